"""The FMUs, unchanged, through hosts and checkers that others wrote: `python -m tests.hosts.table`, the greater part
of `make hosts`.

First it says what will be fetched and built; each tool is prepared once, before all runs. Each host runs each FMU and
interface that it plays along the drives of drives.py; the values it returns are held against the exact answer
(judge.py). A host that cannot be had is skipped with a line. Tables go to the terminal and, as Markdown and CSV, to
build/reports/hosts.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path
from types import ModuleType

import psutil
from rich.console import Console

from scenarios.common import reports
from scenarios.common.command import Help
from scenarios.common.reports import markdown_table, write_csv
from tests.hosts.drives import DRIVES, ROUNDING, STEP, STEPS
from tests.hosts.foreign import CHECKERS, HOSTS, interfaces, load
from tests.hosts.judge import Errors, Judgement, judge

FMUS = tuple(Path("build") / edition / "TransplanterLinkage.fmu" for edition in ("fmi2", "fmi3"))
TIME_LIMIT = 300  # s: one host with one interface, or one checker
PREPARATION_LIMIT = 3600  # s: cargo or mvn, the first time
HEARTBEAT = 20  # s: between two lines on what is being prepared
AGREES, CLEAN, DIFFERS, DEFECT = "agrees", "nothing reported", "DIFFERS", "host defect"
HEADINGS = ("host", "version", "FMI", "inputs by", *(f"{key}, mm" for key in DRIVES), "s", "verdict")
CHECK_HEADINGS = ("checker", "version", "FMI", "s", "verdict")
WORDS = ("version", "FMI", "inputs by", "verdict")  # headings of texts


class Failed(RuntimeError):
    """The process of a host or checker failed; the message is its last words."""


@dataclass(frozen=True)
class Run:
    """One host with one interface of one FMU, along each of DRIVES."""

    host: ModuleType
    edition: str
    interface: str
    version: str
    seconds: dict[str, float]
    judgements: dict[str, Judgement]
    wrong: dict[str, str]  # of the drives that did not end as they should

    @property
    def defect(self) -> str:
        """What is known to be wrong with the host itself here."""
        return self.host.DEFECTS.get((self.edition, self.interface), "")

    @property
    def verdict(self) -> str:
        return AGREES if not self.wrong else DEFECT if self.defect else DIFFERS

    @property
    def remarks(self) -> list[str]:
        """What was seen, once where several drives show the same, and what is known of the host."""
        seen: dict[str, list[str]] = {}
        for drive, text in self.wrong.items():
            seen.setdefault(text, []).append(drive)
        known = f" ({DEFECT}: {self.defect})" if self.defect else ""
        who = f"{self.host.NAME}, FMI {self.edition} {self.interface}"
        return [f"{who}, {' and '.join(drives)}: {text}{known}" for text, drives in seen.items()]

    def error(self, drive: str) -> Errors | None:
        return self.judgements[drive].errors if drive in self.judgements else None

    def cells(self) -> tuple[str, ...]:
        """The texts under HEADINGS."""
        errors = ("-" if (error := self.error(drive)) is None else f"{error.position:.1e}" for drive in DRIVES)
        return (self.host.NAME, self.version, f"{self.edition} {self.interface}", self.host.FEEDING, *errors,
                f"{sum(self.seconds.values()):.1f}", self.verdict)  # fmt: skip


@dataclass(frozen=True)
class Check:
    """One FMU through one checker."""

    checker: ModuleType
    edition: str
    version: str
    seconds: float
    verdict: str
    remark: str

    def cells(self) -> tuple[str, ...]:
        """The texts under CHECK_HEADINGS."""
        return self.checker.NAME, self.version, self.edition, f"{self.seconds:.1f}", self.verdict

    @property
    def remarks(self) -> list[str]:
        return [f"{self.checker.NAME}, FMI {self.edition}: {self.remark}"] * bool(self.remark)


def names_of(shown: str) -> list[str]:
    """The modules of a host or checker by the name that the tables show, whatever the case."""
    return [name for name in (*HOSTS, *CHECKERS) if load(name).NAME.lower() == shown.lower()]


def main(arguments: list[str] | None = None, first: Callable[[], object] = lambda: None) -> int:
    """0 where all that ran agrees, or differs by a defect known of the host; else 1.

    ``first`` is called once it is said what will be run, and before anything is.
    """
    shown = list(dict.fromkeys(load(name).NAME for name in (*HOSTS, *CHECKERS)))
    parser = argparse.ArgumentParser(prog="hosts", description=__doc__.splitlines()[0], formatter_class=Help)
    parser.add_argument("--fmu", type=Path, action="append", help="default: those in build/")
    parser.add_argument(
        "--host", action="append", metavar="NAME", help=f"repeatable; default: all of {', '.join(shown)}"
    )
    parser.add_argument("--output", type=Path, default=Path("build/reports/hosts"))
    chosen = parser.parse_args(arguments)
    unknown = [name for name in chosen.host or () if not names_of(name)]
    if unknown:
        parser.error(f"no host or checker is called {' or '.join(unknown)}; there are {', '.join(shown)}")
    asked = list(dict.fromkeys(name for host in chosen.host or shown for name in names_of(host)))
    skipped = plan(asked)
    first()
    fmus = chosen.fmu or [fmu for fmu in FMUS if fmu.exists()]
    absent = [fmu for fmu in fmus if not fmu.exists()]
    if absent or not fmus:
        print(f"hosts: {[*absent, *FMUS][0]} is missing: `make build` makes it", file=sys.stderr)
        return 1
    skipped |= prepare([name for name in asked if name not in skipped])
    todo = [(name, fmu) for name in asked if name not in skipped for fmu in fmus]
    runs, checks = [], []
    for number, (name, fmu) in enumerate(todo, start=1):
        rows = (play if name in HOSTS else check)(name, fmu)
        (runs if name in HOSTS else checks).extend(rows)
        for row in rows:
            what = f"{row.interface} " if isinstance(row, Run) else ""
            tell(f"[{number}/{len(todo)}] {load(name).NAME}, FMI {row.edition} {what}- {row.verdict}")
    write(runs, checks, skipped, chosen.output)
    show(reports.console(), runs, checks)
    print(f"written to {chosen.output}/")
    return any(row.verdict == DIFFERS for row in (*runs, *checks))


def tell(line: str) -> None:
    """At once, where the output is a file or a pipe too."""
    print(line, flush=True)


def plan(names: list[str]) -> dict[str, str]:
    """Says what will be run, fetched and built; returns what this machine lacks, by module."""
    lacks = {name: lack for name in names if (lack := load(name).missing())}
    running = list(dict.fromkeys(load(name).NAME for name in names if name not in lacks))
    tell(f"hosts and checkers: {', '.join(running) or 'none'}")
    for name in unprepared([name for name in names if name not in lacks]):
        tell(f"first, into build/hosts: {load(name).PREPARED}")
    for shown, lack in {load(name).NAME: lack for name, lack in lacks.items()}.items():
        tell(f"skipped: {shown}: this machine lacks {lack}")
    return {name: f"this machine lacks {lack}" for name, lack in lacks.items()}


def unprepared(names: list[str]) -> list[str]:
    """Those for which something has to be fetched or built, one module a tool."""
    tools = {module.PREPARED: name for name in reversed(names) if hasattr(module := load(name), "PREPARED")}
    return [name for name in reversed(tools.values()) if not load(name).is_prepared()]


def prepare(names: list[str]) -> dict[str, str]:
    """Fetches and builds each tool once, saying how far it is; returns why one cannot be had, by module."""
    failed = {}
    for name in unprepared(names):
        begin, module = time.monotonic(), load(name)
        tell(f"{module.NAME}: {module.PREPARED}")
        try:
            in_process(
                "prepare",
                name,
                limit=PREPARATION_LIMIT,
                beat=lambda module=module, begin=begin: tell(beat_line(module, begin)),
            )
        except Failed as failure:
            tell(f"skipped: {module.NAME}: {failure}")
            failed |= {
                other: str(failure) for other in names if getattr(load(other), "PREPARED", "") == module.PREPARED
            }
        else:
            tell(f"{module.NAME}: there after {time.monotonic() - begin:.0f} s")
    return failed


def beat_line(module: ModuleType, begin: float) -> str:
    """How long a tool has been prepared, and what its log ends with."""
    log = getattr(module, "LOG", None)
    lines = log.read_text(errors="replace").splitlines() if log is not None and log.exists() else []
    return f"  {module.NAME}: {time.monotonic() - begin:.0f} s" + (f", {lines[-1].strip()}" if lines else "")


def in_process(
    verb: str, name: str, *which: object, limit: float = TIME_LIMIT, beat: Callable[[], None] = lambda: None
) -> dict:
    """What tests.hosts.foreign.run found; ``beat`` is called every HEARTBEAT. Raises Failed."""
    with tempfile.TemporaryDirectory() as folder:
        result, said = Path(folder) / "result.json", Path(folder) / "said.txt"
        command = [sys.executable, "-m", "tests.hosts.foreign.run", verb, str(result), name, *map(str, which)]
        with said.open("w") as file, subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT) as process:
            try:
                end = time.monotonic() + limit
                while process.poll() is None:
                    try:
                        process.wait(max(0.0, min(HEARTBEAT, end - time.monotonic())))
                    except subprocess.TimeoutExpired as expired:
                        if time.monotonic() >= end:
                            raise Failed(f"not done after {limit:g} s") from expired
                        beat()
            finally:
                end_all(process)
        if process.returncode != 0 or not result.exists():
            words = said.read_text(errors="replace").strip().splitlines() or ["nothing was said"]
            raise Failed(f"ended with {process.returncode}: {words[-1]}")
        answer = json.loads(result.read_text())
        if verb == "prepare" and "failed" in answer:
            raise Failed(answer["failed"])
        return answer


def end_all(process: subprocess.Popen[bytes]) -> None:
    """With what it has started, cargo and its compilers say; nothing where it has ended."""
    if process.poll() is None:
        started = psutil.Process(process.pid).children(recursive=True)
        for each in (*started, process):
            with contextlib.suppress(psutil.NoSuchProcess):
                each.kill()
        process.wait()


def play(name: str, fmu: Path) -> list[Run]:
    """A host through all that it plays of what the FMU offers."""
    host, runs = load(name), []
    for edition, interface in interfaces(fmu):
        if (edition, interface) not in host.INTERFACES:
            continue
        judgements, wrong = {}, {}
        try:
            answers = in_process("play", name, fmu, edition, interface)
        except Failed as failure:
            answers = {key: {"seconds": 0.0, "failed": str(failure)} for key in DRIVES}
        for key, answer in answers.items():
            if "found" in answer:
                judgements[key] = judge(DRIVES[key], interface, answer["found"])
            if words := judgements[key].wrong if key in judgements else answer["failed"]:
                wrong[key] = words
        seconds = {key: answer["seconds"] for key, answer in answers.items()}
        runs.append(Run(host, edition, interface, host.version(), seconds, judgements, wrong))
    return runs


def check(name: str, fmu: Path) -> list[Check]:
    """A checker's verdict on an FMU whose edition it knows."""
    checker = load(name)
    edition = interfaces(fmu)[0][0]
    if edition not in checker.EDITIONS:
        return []
    try:
        answer = in_process("check", name, fmu)
    except Failed as failure:
        answer = {"seconds": 0.0, "failed": str(failure)}
    wrong = answer.get("failed") or "; ".join(answer["found"])
    verdict = DIFFERS if wrong else CLEAN
    return [Check(checker, edition, checker.version(), answer["seconds"], verdict, wrong)]


def explanation() -> str:
    bounds = ", ".join(f"{d.key} {d.coupled.position:g} mm ({d.coupled.why})" for d in DRIVES.values())
    return (
        f"Worst position of the tip against 50 digits over {STEPS} steps of {STEP * 1e3:g} ms; "
        + ", ".join(f"{d.key}: {d.title}" for d in DRIVES.values())
        + f". Allowed: {bounds}; by Model Exchange "
        f"{ROUNDING.position:g} mm. Velocity, acceleration and travel are judged too (hosts.csv). Seconds: all runs."
    )


def notes(runs: list[Run], checks: list[Check]) -> list[str]:
    """What stands under the tables."""
    return [remark for row in (*runs, *checks) for remark in row.remarks]


def show(console: Console, runs: list[Run], checks: list[Check]) -> None:
    """Both tables, and what stands under them; what was skipped has been said when it was."""
    colours = {AGREES: "green", DIFFERS: "bold red", DEFECT: "yellow"}
    for headings, rows in ((HEADINGS, runs), (CHECK_HEADINGS, checks)):
        if rows:
            styles = [colours.get(row.verdict, "green") for row in rows]
            reports.show_table(console, "", headings, [row.cells() for row in rows], words=WORDS, styles=styles)
    for text in (explanation(), *notes(runs, checks)):
        console.print(text, highlight=False, markup=False)


def write(runs: list[Run], checks: list[Check], skipped: dict[str, str], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    left_out = dict.fromkeys(f"skipped: {load(name).NAME}: {why}" for name, why in skipped.items())
    text = [
        "# The FMUs in hosts that others wrote", explanation(), markdown_table(HEADINGS, [r.cells() for r in runs]),
        markdown_table(CHECK_HEADINGS, [c.cells() for c in checks]),
        "\n".join(f"- {note}" for note in (*notes(runs, checks), *left_out)),
    ]  # fmt: skip
    (folder / "hosts.md").write_text("\n\n".join(part.rstrip() for part in text) + "\n", encoding="utf-8")
    headings = (
        "host package version fmi interface inputs drive position_mm velocity_mm_s acceleration_mm_s2 travel_mm "
        "bound_mm bound_from seconds verdict remark"
    )
    write_csv(folder / "hosts.csv", headings.split(), (csv_row(run, drive) for run in runs for drive in DRIVES))
    checked = (
        (c.checker.NAME, c.checker.PACKAGE, c.version, c.edition, c.seconds, c.verdict, c.remark) for c in checks
    )
    headings = "checker package version fmi seconds verdict remark"
    write_csv(folder / "checkers.csv", headings.split(), checked)


def csv_row(run: Run, drive: str) -> tuple[object, ...]:
    errors, bound = run.error(drive), DRIVES[drive].bound(run.interface)
    return (
        run.host.NAME, run.host.PACKAGE, run.version, run.edition, run.interface, run.host.FEEDING, drive,
        *(("",) * 4 if errors is None else astuple(errors)), bound.position, bound.why, run.seconds.get(drive, ""),
        AGREES if drive not in run.wrong else run.verdict, run.wrong.get(drive, ""),
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
