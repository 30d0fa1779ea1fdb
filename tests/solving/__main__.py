"""`python -m tests.solving`: measure, print, write."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from tqdm import tqdm

from scenarios.scene_cost import machine
from tests.solving import in_python, peers, report, way
from tests.solving.in_c import Library
from tests.solving.measure import Cell, measure

ROUNDS = 101


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.solving",
                                     description="Time and error of one evaluation of the linkage, beside its peers.")
    parser.add_argument("--fmu", type=Path, default=Path("build/fmi2/TransplanterLinkage.fmu"))
    parser.add_argument("--twin", type=Path, default=Path("build/twin/TransplanterLinkageTwin.fmu"))
    parser.add_argument("--output", type=Path, default=Path("build/reports/speed_vs_error"),
                        help="folder for table and figure (default: %(default)s)")
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of the time measurements (default: %(default)s)")
    parser.add_argument("--angles", type=int, default=way.ANGLES, help="round one turn (default: %(default)s)")
    parser.add_argument("--without-peers", action="store_true", help="leave out CasADi, numba and the like")
    options = parser.parse_args(arguments)
    if options.rounds < 3 or options.angles < 20:
        print("tests.solving: at least 3 rounds and 20 angles are needed", file=sys.stderr)
        return 1
    for fmu in (options.fmu, options.twin):
        if not fmu.exists():
            print(f"tests.solving: {fmu} is missing: `make build` makes it", file=sys.stderr)
            return 1
    cells, missing = run(options.fmu, options.twin, options.rounds, options.angles, not options.without_peers)
    written = report.write(options.output, cells, missing, options.angles, machine())
    report.show(cells, missing, machine())
    print(f"Written to {options.output}: {', '.join(path.name for path in written)}")
    return 0


def run(fmu: Path, twin: Path, rounds: int, angles: int, with_peers: bool) -> tuple[list[Cell], list[tuple[str, str]]]:
    """Build every way, verify and time it; returns the cells, and the peers that are missing with the reason."""
    phi = way.angles(angles)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        library = Library(folder)
        ways = [*library.ways(fmu, folder), *in_python.ways()]
        ways += [stack.enter_context(in_python.in_fmpy(file, folder / key, key, title)) for file, key, title in
                 ((fmu, "fmu_in_fmpy", "FMU in fmpy"), (twin, "twin_in_fmpy", "twin FMU in fmpy"))]
        found, missing = peers.build_all(library, folder) if with_peers else ([], [("peers", "left out")])
        ways += found
        exact = exact_answers(phi)
        with tqdm(total=len(ways) + rounds, desc="solving", leave=False, disable=None, delay=1.0) as bar:
            return measure(ways, library.way("sincos", "sincos", ""), phi, exact, rounds, bar.update), missing


def exact_answers(phi: np.ndarray) -> np.ndarray:
    """way.truth on all processors."""
    workers = min(8, os.cpu_count() or 1)
    if len(phi) < 200 or workers == 1:
        return way.truth(phi)
    with ProcessPoolExecutor(workers) as pool:
        return np.concatenate(list(pool.map(way.truth, np.array_split(phi, workers))))


if __name__ == "__main__":
    sys.exit(main())
