"""Thousands of random step histories for everything that a host may give: `python -m tests.soak.histories [COUNT]`.

histories.c makes them, with motions and steps of its own (tests/harness/histories.py has others), and says how many
times what holding the angle misses by the worst position is off. Prints a table; ends with 1 where PROMISED is beyond
MOST. tests/soak/test_histories.py runs some of each.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from fmu_src.exporter import compiler

HERE = Path(__file__).parent
MOST = 2.5  # times what holding misses by
# What a host gives, as in histories.c; the others are measured, and not promised: they say what is not so.
GIVEN = (
    "angle", "speed", "acceleration", "one derivative", "two derivatives", "changing sources",
    "noisy angle", "coarse angle", "noisy speed", "speed that falls to 0", "speed in rpm",
)  # fmt: skip
PROMISED = (*GIVEN[:6], "speed that falls to 0")
WINDOWS = (0.0, 0.005, 0.02, 0.1, 0.5)  # s, crank.smoothing


class Worst(NamedTuple):
    """Of many histories."""

    times_holding: float
    history: int  # its number
    beyond: int  # how many are worse than MOST


def build(folder: Path) -> Path:
    """The program, linked with the component."""
    target = compiler.host_platform()
    program = folder / f"histories{'.exe' if sys.platform == 'win32' else ''}"
    sources = (HERE / "histories.c", *compiler.COMPONENT_SOURCES, *compiler.LINKAGE_SOURCES)
    compiler.compile_program(sources, program, target)
    return program


def worst(program: Path, given: str, smoothing: float, at_step_end: bool, first: int, count: int) -> Worst:
    arguments = [str(GIVEN.index(given)), str(smoothing), str(int(at_step_end)), str(first), str(count)]
    output = subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout.split()
    return Worst(float(output[0]), int(output[1]), int(output[2]))


def main(count: int = 10_000) -> int:
    print(f"{count:,} histories each: times what holding misses by, the worst; how many are beyond {MOST}")
    columns = [f"smoothing {window:g} s" if window else "as it is" for window in WINDOWS]
    print(f"{'':22}" + "".join(f"{column:>18}" for column in (*columns, "at_step_end")))
    kept = True
    with tempfile.TemporaryDirectory() as temporary:
        program = build(Path(temporary))
        for given in GIVEN:
            runs = [worst(program, given, window, False, 0, count) for window in WINDOWS]
            runs.append(worst(program, given, 0.0, True, 0, count))
            print(f"{given:22}" + "".join(f"{run.times_holding:11.2f} {run.beyond:6}" for run in runs), flush=True)
            kept &= given not in PROMISED or not any(run.beyond for run in runs)
    print("promised: " + ", ".join(PROMISED) + (": kept" if kept else ": BROKEN"))
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
