"""Measure and write the section *Inverse dynamics* of the report on speed and error."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from scenarios.common import reports
from scenarios.common.reports import machine
from scenarios.speed_vs_error.dynamics import peers, task
from scenarios.speed_vs_error.dynamics.task import ANGLES, MASSES, ORDER, TORQUES
from scenarios.speed_vs_error.solving import report, way
from scenarios.speed_vs_error.solving.in_c import Library
from scenarios.speed_vs_error.solving.measure import Cell, core_of, measure
from scenarios.speed_vs_error.solving.peers import build_each
from scenarios.speed_vs_error.solving.way import CORE, OURS, Way

ROUNDS = 101
HEADINGS = report.headings(TORQUES)
Missing = Sequence[tuple[str, str]]


def perform(
    output: Path, fmu: Path, rounds: int = ROUNDS, angles: int = ANGLES, with_peers: bool = True
) -> tuple[str, list[Path]]:
    """Measure, print and write into `output`; returns the section of the report and the files written."""
    cells, missing = run(fmu, rounds, angles, with_peers)
    show(cells, missing)
    return markdown(cells, missing, angles), [write(output, cells, missing)]


def ways_in_c(library: Library, fmu: Path) -> list[Way]:
    """Ours: the core and the FMU, with the masses."""
    library.give_masses(list(MASSES.values()), task.LOAD)
    library.load_fmu(fmu)
    return [
        library.way(
            CORE, "exact core, C", OURS, "fmu_src/linkage as the FMU is compiled", "core_dynamics", question=TORQUES
        ),
        library.way(
            "fmu_in_c",
            "FMU in a C host",
            OURS,
            "a whole step: three inputs set, step, crank.tau, crank.inertia and crank.tau_bias read",
            "fmu_dynamics",
            question=TORQUES,
        ),
    ]


def run(fmu: Path, rounds: int, angles: int, with_peers: bool) -> tuple[list[Cell], list[tuple[str, str]]]:
    """Build every way, verify and time it; returns the cells, and the peers that are missing with the reason."""
    phi = way.angles(angles)
    exact = way.on_all_processors(task.truth, phi, alone=60)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        library = Library(folder)
        ways = ways_in_c(library, fmu)
        found, missing = build_each(peers.builders(library, folder)) if with_peers else ([], [("peers", "left out")])
        ways += found
        with tqdm(total=len(ways) + rounds, desc="dynamics", leave=False, disable=None, delay=1.0) as bar:
            sincos = library.way("sincos", "sincos", "")
            timed = way.angles()
            return measure(ways, sincos, phi, exact, rounds, bar.update, question=TORQUES, timed=timed), missing


def rows(cells: Sequence[Cell], missing: Missing) -> list[tuple[str, ...]]:
    return [*report.table_rows(cells), *((name, "missing", "", "", "") for name, _ in missing)]


def remarks(cells: Sequence[Cell], missing: Missing) -> list[str]:
    return [*report.findings(cells, missing, TORQUES), report.noise(cells)]


def show(cells: Sequence[Cell], missing: Missing) -> None:
    """Print table and findings."""
    console = reports.console()
    title = f"Inverse dynamics: time (core = 1), then worst error: {machine()}"
    core = core_of(cells, ORDER).way.title
    shown = rows(cells, missing)
    reports.show_table(console, title, HEADINGS, shown, styles=["bold" if row[0] == core else "" for row in shown])
    for sentence in remarks(cells, missing):
        console.print(f"- {sentence.replace('**', '')}", markup=False)


def markdown(cells: Sequence[Cell], missing: Missing, angles: int) -> str:
    """The section."""
    rounds = len(core_of(cells, ORDER).times)
    what = [f"- *{row[0].way.title}*: {row[0].way.remark}." for row in report.by_way(cells) if row[0].way.remark]
    return "\n".join(
        [
            "## Inverse dynamics",
            "",
            (
                "Torque, reflected inertia and bias of a machine of plausible masses (all six bodies, "
                f"{sum(value for name, value in MASSES.items() if name.endswith('.m')):.2f} kg) at {angles} angles, at "
                f"65 turns a minute and {task.ACCELERATION:g} rad/s2, under {task.FORCE[0]:g} and {task.FORCE[1]:g} N "
                "on the tip. Errors are the worst distances from Lagrange's equation on the vector loops to 50 digits; "
                "each way is held against it before it is timed. Times are the processor's, in times of the exact "
                f"core's over {way.ANGLES} angles: medians of the ratios within {rounds} interleaved rounds. Peers "
                f"have geometry, masses and motion as constants. No multibody program is among them: none was asked "
                f"yet (what MuJoCo makes of the closed loops stands under *Solving*). Measured on: {machine()}."
            ),
            "",
            reports.markdown_table(HEADINGS, rows(cells, missing)),
            *(f"- {sentence}" for sentence in remarks(cells, missing)),
            "",
            "What is what:",
            "",
            *what,
            "",
            "`dynamics.csv` has every error, ratio and quartile.",
            "",
        ]
    )


def write(output: Path, cells: Sequence[Cell], missing: Missing) -> Path:
    """dynamics.csv in `output`."""
    output.mkdir(parents=True, exist_ok=True)
    headings = ("key", "way", "whose", "torque_error_N_m", "inertia_error_kg_m2", "bias_error_N_m", "of_core")
    more = ("of_core_lower_quartile", "of_core_upper_quartile", "of_sincos", "nanoseconds_here", "remark")
    lines = [
        (
            cell.way.key,
            cell.way.title,
            cell.way.whose,
            *(tuple(f"{error:.4g}" for error in cell.errors) or ("",) * 3),
            *(f"{value:.4f}" for value in (cell.ratio, *cell.of_core.quartiles, cell.of_sincos.median)),
            f"{np.median(cell.times):.2f}" if len(cell.times) else "",
            cell.why,
        )
        for (cell,) in report.by_way(cells)
    ]
    lines += [("", name, way.PEER, *[""] * 8, f"missing: {why}") for name, why in missing]
    reports.write_csv(output / "dynamics.csv", (*headings, *more), lines)
    return output / "dynamics.csv"
