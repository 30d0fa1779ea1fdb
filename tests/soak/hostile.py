"""Long and hostile runs of small C hosts: `python -m tests.soak.hostile`, which is `make soak`.

The fuzzers (fuzz.c, fuzz3.c) are linked with the component's sources under the sanitizers of the system's C
compiler, where there is one that has them; the season of planting (soak.c) runs the built FMU.
tests/soak/test_hostile.py runs the same for some seconds.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from itertools import product
from pathlib import Path
from typing import NamedTuple

from fmu_src.exporter import compiler
from fmu_src.interface import load_interface

HERE = Path(__file__).parent
FMU = HERE.parents[1] / "build" / "fmi2" / "TransplanterLinkage.fmu"
SEASON = 720_000_000  # steps of 1 ms: 200 hours
FUZZERS = {2: "fuzz.c", 3: "fuzz3.c"}
SANITIZERS = {"memory": "-fsanitize=address,undefined", "threads": "-fsanitize=thread"}


class NoSanitizer(RuntimeError):
    """The system has no C compiler with this sanitizer; the message is what it said."""


class Season(NamedTuple):
    """Worst differences of a long run, each in units in the last place of what it is held against."""

    travel: float
    tip: float
    time: float


def build_fuzzer(folder: Path, sanitizer: str, version: int = 2) -> Path:
    """The fuzzer of an FMI version under a sanitizer of SANITIZERS, by the system's compiler: ziglang brings none."""
    cc = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if cc is None:
        raise NoSanitizer("there is no C compiler on this system")
    program = folder / f"fuzz{version}_{sanitizer}"
    adaptor = compiler.SOURCE_ROOT / "fmi" / f"fmi{version}.c"
    sources = [HERE / FUZZERS[version], *compiler.LINKAGE_SOURCES, *compiler.COMPONENT_SOURCES, adaptor]
    command = [
        cc, "-std=c99", "-g", "-O1", SANITIZERS[sanitizer], "-fno-sanitize-recover=all",
        "-I", compiler.SOURCE_ROOT, "-I", compiler.FMI_HEADERS, "-o", program, *sources, "-lm", "-lpthread",
    ]  # fmt: skip
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode != 0:
        raise NoSanitizer(done.stderr.strip())
    return program


def fuzz(program: Path, seed: int, calls: int, threads: int) -> str:
    """Random calls; what the fuzzer printed, its first line naming a broken promise if there is one."""
    done = subprocess.run([program, str(seed), str(calls), str(threads)], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"seed {seed}, {calls} calls, {threads} threads:\n{done.stdout}{done.stderr}")
    return done.stdout.strip()


def plant(folder: Path, steps: int) -> Season:
    """A season of `steps` milliseconds with the built FMU."""
    target = compiler.host_platform()
    program = folder / "soak"
    compiler.compile_program((HERE / "soak.c",), program, target, "-I", str(HERE.parents[1]), "-ldl")
    name = f"binaries/{target.folder}/{load_interface().model.name}{target.suffix}"
    with zipfile.ZipFile(FMU) as archive:
        library = archive.extract(name, folder)
    command = [program, library, load_interface().token, str(steps)]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return Season(*(float(number) for number in re.findall(r"[\d.]+", output)))


def main() -> int:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for version, (sanitizer, threads) in product(FUZZERS, (("memory", 1), ("threads", 4))):
            name = f"fuzzer of FMI {version}.0, {sanitizer}"
            try:
                program = build_fuzzer(folder, sanitizer, version)
            except NoSanitizer as reason:
                print(f"{name}: left out: {reason}")
                continue
            for seed in range(1, 6):
                print(f"{name}, seed {seed}: {fuzz(program, seed, 1_000_000, threads)}", flush=True)
        begin = time.perf_counter()
        season = plant(folder, SEASON)
        print(
            f"200 hours of planting, {SEASON:,} steps in {time.perf_counter() - begin:.0f} s: in units in the last "
            f"place, travel {season.travel}, tip {season.tip}, time {season.time} off"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
