"""Processes with a PythonFMU slave in them, run to their end many times: `python -m tests.soak.heap_at_exit`.

What a corrupt heap does at exit depends on where everything happens to lie. So each process runs 300 times, each time
from a folder with a path of another length and with freed memory filled with other bytes (MALLOC_PERTURB_ of glibc).
All must end with status 0. The pool, which ends two workers a run, runs half as often. This is part of `make soak`; how
far it is stands on the screen, or in a line every 20th part where there is none.
`--unmended` takes the library as PythonFMU built it: the twin in fmpy may then fail; the scenes let go of such slaves.

tests/twin/test_heap_at_exit.py holds the same processes against valgrind and `freed.c`, which find the fault in one
run.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from importlib import metadata
from pathlib import Path

from tqdm import tqdm

ROOT = Path(__file__).resolve().parents[2]
TWIN = ROOT / "build" / "twin" / "TransplanterLinkageTwin.fmu"
PARTNERS = tuple(ROOT / "build" / "partners" / f"{name}.fmu" for name in ("Drivetrain", "Conveyor", "Soil"))
SYSTEM = ROOT / "scenarios" / "field_row" / "row.toml"
RUNS = 300
PARTS = 20  # of all runs, after each of which a line is printed where there is no screen
POOL = "rows in a pool"
FILLINGS = ("", "1", "85", "165", "255")  # MALLOC_PERTURB_; "": left as it is
LENGTHS = tuple(range(1, 200, 11))  # characters of the folder's name
IN_FMPY = "import fmpy, sys; fmpy.simulate_fmu(sys.argv[1], stop_time=0.02, output_interval=0.01)"
# the scene without its figures, which take longer than all else and load no FMU
ROW = """import sys
from pathlib import Path
from scenarios.field_row import run
from scenarios.field_row.system import load_system
row = run.row_of(load_system(Path(sys.argv[1])), 1)
assert run.run(row.system, "extrapolated", 0.02, 0.1).time[-1] == 0.1"""  # s: loading and ending take longer
# as the study runs them: workers end by themselves, their status is asked for
IN_A_POOL = """import multiprocessing, sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from scenarios.field_row import run
from scenarios.field_row.system import load_system
row = run.row_of(load_system(Path(sys.argv[1])), 1)
with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
    rows = [pool.submit(run.run, row.system, "extrapolated", 0.02, 0.1) for _ in range(2)]
    workers = list(pool._processes.values())
    assert all(row.result().time[-1] == 0.1 for row in rows)
status = {worker.exitcode for worker in workers}
sys.exit(f"the workers ended with {status}" if status != {0} else 0)"""
SECONDS = 900.0  # for one process, also under valgrind on a busy machine


def processes(twin: Path = TWIN, system: Path = SYSTEM) -> dict[str, list[str]]:
    """The command of each process by its title, to be run in a folder of its own."""
    python = [sys.executable, "-B"]
    archive = ["--system", str(system), "--plants", "1", "--output", "row.ssp"]
    return {
        "the twin in fmpy": [*python, "-c", IN_FMPY, str(twin)],
        "the SSP archive": [*python, "-m", "scenarios.field_row.ssp", *archive],
        "a short row": [*python, "-c", ROW, str(system)],
        POOL: [*python, "-c", IN_A_POOL, str(system)],
    }


def run(command: Sequence[str], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """A process in `folder`, which holds its temporary files as well."""
    settings = {"PYTHONPATH": str(ROOT), "TMPDIR": str(folder), **environment}
    return subprocess.run(
        command, cwd=folder, env=os.environ | settings, capture_output=True, text=True, errors="replace",
        timeout=SECONDS,
    )  # fmt: skip


def unmended(fmu: Path, folder: Path) -> Path:
    """A copy with PythonFMU's own libraries in it."""
    copy = folder / fmu.name
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(copy, "w") as new:
        for name in old.namelist():
            is_library = name.startswith("binaries/") and not name.endswith("/")
            new.writestr(name, own_library(Path(name).suffix) if is_library else old.read(name))
    return copy


def own_library(suffix: str) -> bytes:
    """As PythonFMU brings it, for Linux (".so") or Windows (".dll")."""
    (library,) = (file for file in metadata.files("pythonfmu") or [] if file.name.endswith(f"pythonfmu-export{suffix}"))
    return library.read_binary()


def unmended_system(folder: Path) -> Path:
    """The row's system with such partners, the linkage at its place."""
    text = SYSTEM.read_text(encoding="utf-8")
    for partner in PARTNERS:
        name = partner.relative_to(ROOT).as_posix()
        assert f'"{name}"' in text, f"{SYSTEM.name} names {partner.name} in another way"
        text = text.replace(name, unmended(partner, folder).name)
    system = folder / SYSTEM.name
    system.write_text(text, encoding="utf-8")
    return system


def one(title: str, command: Sequence[str], scratch: Path, number: int) -> str:
    """Nothing where run `number` of a process ended well, else how it ended."""
    filling, length = FILLINGS[number % len(FILLINGS)], LENGTHS[number % len(LENGTHS)]
    with tempfile.TemporaryDirectory(dir=scratch) as place:
        folder = Path(place) / ("x" * length)
        folder.mkdir()
        done = run(command, folder, **({"MALLOC_PERTURB_": filling} if filling else {}))
    if done.returncode == 0:
        return ""
    said = (done.stderr.strip().splitlines() or [""])[-1]
    return f"{title}, run {number}, MALLOC_PERTURB_={filling or 'unset'}, {length} characters: {done.returncode} {said}"


def soak(runs: int, chosen: dict[str, list[str]], workers: int) -> tuple[dict[str, int], list[str]]:
    """Runs of each process, and how each that did not end with 0 ended, which is printed as it comes."""
    counts, failed = dict.fromkeys(chosen, 0), []
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(workers) as pool:
        jobs = {
            pool.submit(one, title, command, Path(scratch), number): title
            for number in range(runs)
            for title, command in chosen.items()
            if title != POOL or number % 2 == 0
        }
        part = math.ceil(len(jobs) / PARTS)
        for done, job in enumerate(tqdm(as_completed(jobs), total=len(jobs), unit="run", leave=False, disable=None), 1):
            counts[jobs[job]] += 1
            if ended := job.result():
                tqdm.write(ended)
                failed.append(ended)
            if done % part == 0 and not sys.stderr.isatty():
                print(f"{done} of {len(jobs)} runs, {len(failed)} did not end with status 0", flush=True)
    return counts, failed


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status: 1 where a process ended otherwise than with 0."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak.heap_at_exit", description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N", help="of each process (default: %(default)s)")
    parser.add_argument("--workers", type=int, default=2, metavar="N", help="at a time (default: %(default)s)")
    parser.add_argument("--unmended", action="store_true", help="with the library as PythonFMU built it")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        chosen = processes(unmended(TWIN, folder), unmended_system(folder)) if options.unmended else processes()
        counts, failed = soak(options.runs, chosen, options.workers)
    ran = ", ".join(f"{count} of {title}" for title, count in counts.items())
    print(f"runs: {ran}; {len(failed)} did not end with status 0")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
