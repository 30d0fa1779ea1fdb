"""The field row in engines that are not ours: Ecos and libcosim run its SSP archive, beside our Jacobi master.

    python -m scenarios.field_row.engines

writes build/TransplanterRow.ssp, runs it unchanged in every engine that is installed, and holds every
signal of every step against our master's. The engines differ from it in nothing but their clocks, that is
in the last digits of the times that they hand to the FMUs; our master, given an engine's clock, must
give its results to the last bit.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from tqdm import tqdm

from scenarios.common import command, figures, reports
from scenarios.field_row import run as row_run
from scenarios.field_row import ssp
from scenarios.field_row.engine_run import ENGINES, Engine
from scenarios.field_row.masters import CoSimulation, jacobi
from scenarios.field_row.partners.build import PartnerError
from scenarios.field_row.partners.build import build as build_partners
from scenarios.field_row.run import WATCHED
from scenarios.field_row.system import ROW, System, SystemFault, load_system

STEP_MS = 2.0
ROUNDING = 1e-9  # of a signal's range: what the last digits of times may grow to
PATIENCE = 600  # s: for an engine
# What is shown beside each other at the end of the row: signal, factor, unit.
SHOWN = (
    ("soil.hole.count", 1, "holes"),
    ("conveyor.seedlings.caught", 1, "seedlings caught"),
    ("conveyor.seedlings.missed", 1, "seedlings missed"),
    ("conveyor.cups.empty", 1, "cups empty"),
    ("soil.plant.x", 1e3, "last plant at / mm"),
    ("soil.hole.length", 1e3, "its hole / mm"),
    ("drivetrain.crank.phi", 1, "crank.phi / rad"),
    ("linkage.ground.x", 1e3, "ground.x / mm"),
    ("drivetrain.energy.tractor", 1, "work of the tractor / J"),
    ("soil.energy.soil", 1, "work on the soil / J"),
)


@dataclass(frozen=True)
class Compared:
    """What an engine gave beside ours. ``off`` is the difference of every signal after every step, of its range.

    ``same`` says whether our master at the engine's clock gives its values to the last bit. Where there are no
    results, ``problem`` says why; ``missing``: because the engine is not installed.
    """

    engine: Engine
    version: str = ""
    values: np.ndarray | None = None
    off: np.ndarray | None = None
    same: bool = False
    problem: str = ""
    missing: bool = False

    @property
    def agrees(self) -> bool:
        return self.off is not None and bool(self.off.max() <= ROUNDING)


def ours(
    system: System, watched: Sequence[str], times: np.ndarray, steps: np.ndarray, done: Callable[[], object]
) -> np.ndarray:
    """The watched outputs in SI after each of our Jacobi master's steps that begin at ``times``."""
    samples = []
    with CoSimulation(system, watched) as simulation:
        for time, step in zip(times.tolist(), steps.tolist(), strict=True):
            jacobi(simulation, time, step)
            samples.append(simulation.values())
    done()
    return np.array(samples)


def theirs(key: str, archive: Path, own_names: Sequence[str], step: float, stop: float) -> tuple[str, np.ndarray]:
    """An engine's version and its values after each step; RuntimeError with its message where it fails."""
    with tempfile.TemporaryDirectory() as scratch:
        result = Path(scratch) / "result.npz"
        run = subprocess.run(
            [
                sys.executable,
                "-m",
                "scenarios.field_row.engine_run",
                key,
                str(archive),
                repr(step),
                repr(stop),
                json.dumps(list(own_names)),
                str(result),
            ],
            cwd=command.ROOT,
            env={**os.environ, "TMPDIR": scratch},  # engines leave unpacked FMUs behind
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            timeout=PATIENCE,
        )
        if run.returncode != 0:
            raise RuntimeError((run.stderr.strip().splitlines() or [f"it ended with status {run.returncode}"])[-1])
        with np.load(result) as content:
            return str(content["version"]), content["values"]


def compare(
    key: str,
    system: System,
    archive: Path,
    watched: Sequence[str],
    base: np.ndarray,
    *,
    step: float,
    stop: float,
    done: Callable[[], object],
) -> Compared:
    """Run an engine, hold it against ``base``, and our master at its clock against it."""
    engine = ENGINES[key]
    try:
        version(engine.package)
    except PackageNotFoundError:
        return Compared(
            engine,
            problem=f"{engine.package} is not installed; it is offered for Linux on x86_64"
            + (" and Python 3.11 or newer" if key == "libcosim" else ""),
            missing=True,
        )
    components = {component.name: component.names for component in system.components}
    own_names = [f"{part}.{components[part].get(name, name)}" for part, name in (w.split(".", 1) for w in watched)]
    try:
        its_version, values = theirs(key, archive, own_names, step, stop)
        for column, unit in zip(values.T, [system.unit(system.port(name)) for name in watched], strict=True):
            column[:] = [unit.to_si(value) for value in column]
    except (RuntimeError, subprocess.TimeoutExpired) as error:
        return Compared(engine, problem=str(error))
    done()
    ranges = np.ptp(base, axis=0)
    off = np.abs(values - base) / np.where(ranges > 0, ranges, 1.0)
    return Compared(
        engine,
        its_version,
        values,
        off,
        np.array_equal(ours(system, watched, *engine.clock(len(base), step), done), values),
    )


def agreement(found: Sequence[Compared], watched: Sequence[str]) -> list[tuple[str, ...]]:
    """Lines under AGREEMENT."""
    lines = []
    for each in found:
        title = f"{each.engine.title} {each.version}".strip()
        if each.off is None:
            lines.append((title, "not run", each.problem, ""))
            continue
        worst = watched[int(each.off.max(axis=0).argmax())]
        lines.append((title, f"{each.off.max():.0e}", worst, "the same to the last bit" if each.same else "differs"))
    return lines


AGREEMENT = ("engine", "worst difference", "signal", "our master at its clock")


def beside(
    found: Sequence[Compared],
    watched: Sequence[str],
    base: np.ndarray,
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and lines: the end of the row by our master and by each engine that ran."""
    run = [each for each in found if each.values is not None]
    lines = [
        (unit, *(f"{factor * values[-1, watched.index(name)]:.10g}" for values in (base, *(e.values for e in run))))
        for name, factor, unit in SHOWN
        if name in watched
    ]
    return ("at the end of the row", "our Jacobi", *(each.engine.title for each in run)), lines


def sentences(found: Sequence[Compared], steps: int, signals: int) -> list[str]:
    """What came out."""
    run = [each for each in found if each.off is not None]
    agreeing = [each for each in run if each.agrees]
    said = []
    if agreeing:
        names = " and ".join(each.engine.title for each in agreeing)
        said.append(
            f"{names} agree{'s' * (len(agreeing) == 1)} with our Jacobi master in each of {signals} signals "
            f"after each of {steps} steps, to within "
            f"{max(each.off.max() for each in agreeing):.0e} of the signal's range."
        )
    for each in run:
        if not each.agrees:
            said.append(
                f"{each.engine.title} does not agree with our Jacobi master: it is off by up to "
                f"{each.off.max():.1e} of a signal's range."
            )
        said.append(
            f"{each.engine.title} {each.engine.clock_text}. "
            + (
                "Our master, given these times, gives its results to the last bit: they differ in nothing else."
                if each.same
                else "Our master, given these times, does not give its results to the last bit: "
                "they differ in something else, too."
            )
        )
    return said


def draw(path: Path, found: Sequence[Compared], watched: Sequence[str], base: np.ndarray, step: float) -> None:
    """The crank's torque by all, and the worst difference of any signal over time."""
    time = step * np.arange(1, len(base) + 1)
    run = [each for each in found if each.off is not None]
    looks = ((figures.VERMILLION, "--"), (figures.BLUE, ":"))
    same: list[tuple[str, np.ndarray, str]] = []  # the steps after which no signal differs
    with plt.rc_context(figures.STYLE):
        figure, (signal, off, equal) = plt.subplots(
            3, 1, figsize=(9.5, 6.6), layout="constrained", sharex=True, height_ratios=(5, 5, 1)
        )
        shown = "linkage.crank.tau" if "linkage.crank.tau" in watched else watched[0]
        column = watched.index(shown)
        signal.plot(time, base[:, column], color=figures.GREY, linewidth=2.6, label="our Jacobi master")
        for each, (colour, dashes) in zip(run, looks, strict=False):
            signal.plot(time, each.values[:, column], dashes, color=colour, linewidth=1.4, label=each.engine.title)
            worst = each.off.max(axis=1)
            off.plot(
                time, np.where(worst > 0, worst, np.nan), ".", color=colour, markersize=2.5, label=each.engine.title
            )
            same.append((each.engine.title, np.where(worst == 0)[0], colour))
        off.axhline(np.finfo(float).eps, color=figures.GREY, linewidth=0.8)
        off.annotate(
            "a unit in the last place",
            (time[-1], np.finfo(float).eps),
            xytext=(0, 3),
            textcoords="offset points",
            ha="right",
            fontsize=8,
            color=figures.NOTE,
        )
        off.set(yscale="log", ylabel="difference of a signal / its range")
        off.set_title("Worst difference of any signal from our master, after each step", loc="left")
        for row, (_, steps, colour) in enumerate(same):
            equal.plot(time[steps], np.full(len(steps), row), "|", color=colour, markersize=7)
        equal.set(ylim=(len(same) - 0.4, -0.6), xlabel="time / s")
        equal.set_yticks(range(len(same)), [f"{title}: {len(steps)}" for title, steps, _ in same])
        equal.grid(visible=False)
        equal.set_title(f"Steps, of {len(time)}, after which no bit of any signal differs", loc="left")
        signal.set_ylabel(f"{shown} / {WATCHED[shown].replace('.', '·')}")
        signal.set_title("The same archive in every engine", loc="left")
        signal.legend(loc="upper left", ncols=3)
        off.legend(loc="lower right", ncols=2, markerscale=4)
        signal.margins(y=0.25)
        figure.savefig(path)
        plt.close(figure)


def scenario(options: argparse.Namespace, console: Console) -> tuple[list[Path], bool]:
    """Run, print and write everything; returns the files, and whether all engines that ran agree."""
    build_partners()
    row = row_run.row_of(load_system(options.system), options.plants)
    watched = [name for name in WATCHED if row.system.offers(name)]
    not_offered = [name for name in WATCHED if name not in watched]
    if not watched:
        raise SystemFault(
            f"The engines are compared by signals of which this system offers none: {', '.join(WATCHED)}."
        )
    options.output.mkdir(parents=True, exist_ok=True)
    step = options.step * 1e-3
    count = round(row.stop / step)
    with tqdm(total=1 + 2 * len(ENGINES), unit="run", leave=False, disable=None, delay=1.0) as bar:
        archive = ssp.write(row.system, row.stop, options.archive)
        base = ours(row.system, watched, np.arange(count) * step, np.full(count, step), bar.update)
        found = [
            compare(key, row.system, archive, watched, base, step=step, stop=row.stop, done=bar.update)
            for key in ENGINES
        ]
    said = sentences(found, count, len(watched))
    headings, lines = beside(found, watched, base)
    length = f"{row.plants} plants" if row.plants else f"{row.stop:g} s"
    if not_offered:
        said.append(f"Not offered by the FMUs, and not compared: {row.system.names(not_offered)}.")
    title = f"{length}, steps of {options.step:g} ms, difference of a signal / its range"
    reports.show_table(console, title, AGREEMENT, agreement(found, watched))
    reports.show_table(console, "The end of the row", headings, lines)
    for sentence in said:
        console.print(f"- {sentence}", markup=False)
    files = [options.output / name for name in ("engines.md", "engines.csv", "engines.png")]
    files[0].write_text(
        "\n".join(
            [
                "# The field row in other engines",
                "",
                (
                    f"Written by `python -m scenarios.field_row.engines`. `{archive.name}` holds {length}; every "
                    f"engine runs it unchanged, {count} steps of {options.step:g} ms in which all FMUs step from what "
                    "all gave before (Jacobi)."
                ),
                "",
                *(f"- {sentence}" for sentence in said),
                "",
                (
                    "None of the engines hands over slopes of inputs, nor steps one FMU after the other: our masters "
                    "`extrapolated`, `gauss-seidel` and `controlled` have no counterpart in them."
                ),
                "",
                "Difference of a signal, of its range:",
                "",
                reports.markdown_table(AGREEMENT, agreement(found, watched)),
                reports.markdown_table(headings, lines),
                "![Torque of the crank and differences](engines.png)",
                "",
                (
                    "PythonFMU slaves load into a process of Python alone: the engines run here as Python packages. "
                    "`engines.csv`: the worst difference of each signal."
                ),
                "",
            ]
        ),
        encoding="utf-8",
    )
    run = [each for each in found if each.off is not None]
    reports.write_csv(
        files[1],
        ("signal", "range", *(f"{e.engine.title}, worst difference / range" for e in run)),
        (
            (name, f"{np.ptp(base[:, k]):.6g}", *(f"{each.off[:, k].max():.3g}" for each in run))
            for k, name in enumerate(watched)
        ),
    )
    draw(files[2], found, watched, base, step)
    return files, all(each.missing or each.agrees for each in found)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status, 1 where an engine fails or disagrees."""
    parser = argparse.ArgumentParser(
        prog="python -m scenarios.field_row.engines", description=__doc__.splitlines()[0], formatter_class=command.Help
    )
    parser.add_argument(
        "--system",
        type=Path,
        default=ROW,
        metavar="FILE",
        help="FMUs, connections and parameters (default: %(default)s)",
    )
    parser.add_argument(
        "--plants",
        type=command.plants(1000),
        default=ssp.PLANTS,
        metavar="N",
        help="plants in the row (default: %(default)s)",
    )
    parser.add_argument(
        "--step",
        type=float,
        choices=(0.5, 1.0, 2.0, 5.0, 10.0),
        default=STEP_MS,
        metavar="MS",
        help="communication step: 0.5, 1, 2, 5 or 10 ms (default: %(default)s)",
    )
    parser.add_argument(
        "--archive", type=Path, default=ssp.OUTPUT, help="where the archive goes (default: %(default)s)"
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=command.ROOT / "build" / "reports" / "field_row",
        help="folder for tables and figures (default: %(default)s)",
    )
    options = parser.parse_args(arguments)
    console = reports.console()
    try:
        written, agree = scenario(options, console)
    except (SystemFault, PartnerError) as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(f"The reports cannot be written to {options.output}: {error}", file=sys.stderr)
        return 1
    reports.show_files(console, options.output, written)
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())
