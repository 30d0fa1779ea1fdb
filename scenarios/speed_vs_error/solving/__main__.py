"""`python -m scenarios.speed_vs_error.solving`: measure, print, write."""

from __future__ import annotations

import argparse
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

from tqdm import tqdm

from scenarios.common.command import FMU, ROOT, TWIN, Help
from scenarios.common.reports import machine, shown
from scenarios.speed_vs_error.solving import in_python, peers, report, way
from scenarios.speed_vs_error.solving.in_c import Library
from scenarios.speed_vs_error.solving.measure import Cell, measure

ROUNDS = 101


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m scenarios.speed_vs_error.solving",
        description="Time and error of one evaluation of the linkage, beside its peers.",
        formatter_class=Help,
    )
    parser.add_argument("--fmu", type=Path, default=FMU, help="the linkage FMU, FMI 2.0 (default: %(default)s)")
    parser.add_argument("--twin", type=Path, default=TWIN, help="the twin in Python (default: %(default)s)")
    parser.add_argument(
        "--output",
        type=Path,
        default=ROOT / "build" / "reports" / "speed_vs_error",
        help="folder for table and figure (default: %(default)s)",
    )
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of the time measurements (default: %(default)s)")
    parser.add_argument("--angles", type=int, default=way.ANGLES, help="round one turn (default: %(default)s)")
    parser.add_argument("--without-peers", action="store_true", help="leave out CasADi, numba and the like")
    options = parser.parse_args(arguments)
    if options.rounds < 3 or options.angles < 20:
        print("scenarios.speed_vs_error.solving: at least 3 rounds and 20 angles are needed", file=sys.stderr)
        return 1
    for fmu in (options.fmu, options.twin):
        if not fmu.exists():
            print(f"scenarios.speed_vs_error.solving: {fmu} is missing: `make build` makes it", file=sys.stderr)
            return 1
    _, written = perform(
        options.output, options.fmu, options.twin, options.rounds, options.angles, not options.without_peers
    )
    print(f"Written to {shown(options.output)}: {', '.join(path.name for path in written)}")
    return 0


def perform(
    output: Path, fmu: Path, twin: Path, rounds: int = ROUNDS, angles: int = way.ANGLES, with_peers: bool = True
) -> tuple[str, list[Path]]:
    """Measure, print and write into `output`; returns the section of the report and the files written."""
    cells, missing = run(fmu, twin, rounds, angles, with_peers)
    report.show(cells, missing, machine())
    return report.markdown(cells, missing, angles, machine()), report.write(output, cells, missing, angles, machine())


def run(fmu: Path, twin: Path, rounds: int, angles: int, with_peers: bool) -> tuple[list[Cell], list[tuple[str, str]]]:
    """Build every way, verify and time it; returns the cells, and the peers that are missing with the reason."""
    phi = way.angles(angles)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        library = Library(folder)
        ways = [*library.ways(fmu), *in_python.ways()]
        ways += [
            stack.enter_context(in_python.in_fmpy(file, folder / key, key, title))
            for file, key, title in ((fmu, "fmu_in_fmpy", "FMU in fmpy"), (twin, "twin_in_fmpy", "twin FMU in fmpy"))
        ]
        found, missing = peers.build_all(library, folder) if with_peers else ([], [("peers", "left out")])
        ways += found
        exact = way.on_all_processors(way.truth, phi, alone=200)
        with tqdm(total=len(ways) + rounds, desc="solving", leave=False, disable=None, delay=1.0) as bar:
            return measure(ways, library.way("sincos", "sincos", ""), phi, exact, rounds, bar.update), missing


if __name__ == "__main__":
    sys.exit(main())
