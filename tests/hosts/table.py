"""The FMUs, unchanged, through hosts and checkers that others wrote: `python -m tests.hosts.table`, which is
`make hosts`.

Each host runs each FMU and interface that it plays along the drives of drives.py; the values it returns are held
against the exact answer (judge.py). A host whose tools are missing is skipped by name. Tables go to the terminal and,
as Markdown and CSV, to build/reports/hosts.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from dataclasses import astuple, dataclass
from pathlib import Path
from types import ModuleType

from rich import box
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from scenarios.reports import markdown_table, write_csv
from tests.hosts.drives import DRIVES, ROUNDING, STEP, STEPS
from tests.hosts.foreign import CHECKERS, HOSTS, interfaces, load
from tests.hosts.judge import Errors, Judgement, judge

FMUS = tuple(Path("build") / edition / "TransplanterLinkage.fmu" for edition in ("fmi2", "fmi3"))
TIME_LIMIT = 600  # s, with what cargo and mvn have to build and fetch the first time
AGREES, CLEAN, DIFFERS, DEFECT = "agrees", "nothing reported", "DIFFERS", "host defect"
HEADINGS = ("host", "version", "FMI", "inputs by", *(f"{key}, mm" for key in DRIVES), "s", "verdict")
CHECK_HEADINGS = ("checker", "version", "FMI", "s", "verdict")


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


def main(arguments: list[str] | None = None) -> int:
    """0 where all that ran agrees, or differs by a defect known of the host; else 1."""
    parser = argparse.ArgumentParser(prog="hosts", description=__doc__.splitlines()[0])
    parser.add_argument("--fmu", type=Path, action="append", help="default: those in build/")
    parser.add_argument("--host", action="append", choices=[*HOSTS, *CHECKERS], help="repeatable; default: all")
    parser.add_argument("--output", type=Path, default=Path("build/reports/hosts"))
    chosen = parser.parse_args(arguments)
    fmus = chosen.fmu or [fmu for fmu in FMUS if fmu.exists()]
    absent = [fmu for fmu in fmus if not fmu.exists()]
    if absent or not fmus:
        print(f"hosts: {[*absent, *FMUS][0]} is missing: `make build` makes it", file=sys.stderr)
        return 1
    names = chosen.host or [*HOSTS, *CHECKERS]
    skipped = {name: lack for name in names if (lack := load(name).missing())}
    todo = [(name, fmu) for name in names if name not in skipped for fmu in fmus]
    runs, checks = [], []
    for name, fmu in tqdm(todo, "hosts", unit="host", disable=None, leave=False):
        (runs if name in HOSTS else checks).extend((play if name in HOSTS else check)(name, fmu))
    write(runs, checks, skipped, chosen.output)
    show(Console(), runs, checks, skipped)
    print(f"written to {chosen.output}/")
    return any(row.verdict == DIFFERS for row in (*runs, *checks))


def in_process(verb: str, name: str, fmu: Path, *which: str) -> dict:
    """What tests.hosts.foreign.run found; raises Failed."""
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.json"
        command = [sys.executable, "-m", "tests.hosts.foreign.run", verb, str(result), name, str(fmu), *which]
        try:
            done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired as expired:
            raise Failed(f"not done after {TIME_LIMIT} s") from expired
        if done.returncode != 0 or not result.exists():
            said = (done.stderr.strip() or done.stdout.strip() or "nothing was said").splitlines()
            raise Failed(f"ended with {done.returncode}: {said[-1]}")
        return json.loads(result.read_text())


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


def notes(runs: list[Run], checks: list[Check], skipped: dict[str, str]) -> list[str]:
    """What stands under the tables."""
    lines = [f"skipped: {load(name).NAME}: this machine lacks {lack}" for name, lack in skipped.items()]
    return [remark for row in (*runs, *checks) for remark in row.remarks] + lines


def show(console: Console, runs: list[Run], checks: list[Check], skipped: dict[str, str]) -> None:
    """Both tables; without colour and in ASCII where the output is not a terminal."""
    console.width = max(console.width, 110)
    lines = box.ROUNDED if console.is_terminal else box.ASCII
    colours = {AGREES: "green", DIFFERS: "bold red", DEFECT: "yellow"}
    for headings, rows in ((HEADINGS, runs), (CHECK_HEADINGS, checks)):
        table = Table(box=lines)
        for heading in headings:
            table.add_column(heading, justify="right" if heading == "s" or heading.endswith("mm") else "left")
        for row in rows:
            *texts, verdict = row.cells()
            table.add_row(*texts, f"[{colours.get(verdict, 'green')}]{verdict}[/]")
        if rows:
            console.print(table)
    for text in (explanation(), *notes(runs, checks, skipped)):
        console.print(text, highlight=False, markup=False, soft_wrap=not console.is_terminal)


def write(runs: list[Run], checks: list[Check], skipped: dict[str, str], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    text = [
        "# The FMUs in hosts that others wrote", explanation(), markdown_table(HEADINGS, [r.cells() for r in runs]),
        markdown_table(CHECK_HEADINGS, [c.cells() for c in checks]),
        "\n".join(f"- {note}" for note in notes(runs, checks, skipped)),
    ]  # fmt: skip
    (folder / "hosts.md").write_text("\n\n".join(part.rstrip() for part in text) + "\n", encoding="utf-8")
    headings = ("host", "package", "version", "fmi", "interface", "inputs", "drive", "position_mm", "velocity_mm_s",
                "acceleration_mm_s2", "travel_mm", "bound_mm", "bound_from", "seconds", "verdict", "remark")  # fmt: skip
    write_csv(folder / "hosts.csv", headings, (csv_row(run, drive) for run in runs for drive in DRIVES))
    write_csv(folder / "checkers.csv", ("checker", "package", "version", "fmi", "seconds", "verdict", "remark"), (
        (c.checker.NAME, c.checker.PACKAGE, c.version, c.edition, c.seconds, c.verdict, c.remark) for c in checks))  # fmt: skip


def csv_row(run: Run, drive: str) -> tuple[object, ...]:
    errors, bound = run.error(drive), DRIVES[drive].bound(run.interface)
    return (
        run.host.NAME, run.host.PACKAGE, run.version, run.edition, run.interface, run.host.FEEDING, drive,
        *(("",) * 4 if errors is None else astuple(errors)), bound.position, bound.why, run.seconds.get(drive, ""),
        AGREES if drive not in run.wrong else run.verdict, run.wrong.get(drive, ""),
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
