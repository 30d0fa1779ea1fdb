"""fmi-sim: a simulator in Rust, built by cargo; Euler around ME. bindgen, which it is built with, needs libclang."""

from __future__ import annotations

import csv
import os
from pathlib import Path

from tests.hosts.drives import OUTPUTS, STEP, STEPS
from tests.hosts.foreign import TOOLS, Rows, Task, missing_programs, run

NAME, PACKAGE = "fmi-sim", "crates.io fmi-sim"
INTERFACES = {("2.0", "CS"), ("3.0", "CS"), ("2.0", "ME"), ("3.0", "ME")}
FEEDING = "table of inputs"
REFUSES_UNITS = "its reader of FMI 3.0 knows no attribute `unit` of Float64 and refuses the description"
DEFECTS = {("3.0", interface): REFUSES_UNITS for interface in ("CS", "ME")}
VERSION = "0.7.0"
PROGRAM = TOOLS / f"fmi-sim-{VERSION}" / "bin" / "fmi-sim"
PREPARED = f"cargo fetches fmi-sim {VERSION} and what it needs from crates.io and compiles it: ten minutes on two cores"
LOG = TOOLS / "fmi-sim.log"
# from the root on; libclang-14.so.1 is one, libclang-cpp.so.14, the C++ interface, is none
LIBCLANG = tuple(
    f"{folder}/libclang{version}.so*"
    for folder in ("usr/lib/llvm-*/lib", "usr/lib/*", "usr/lib*")
    for version in ("", "-[0-9]*")
)


def missing() -> str:
    if PROGRAM.exists():
        return ""
    has_clang = "LIBCLANG_PATH" in os.environ or any(any(Path("/").glob(pattern)) for pattern in LIBCLANG)
    return missing_programs("cargo") or ("" if has_clang else "libclang (Debian libclang-dev)")


def is_prepared() -> bool:
    return PROGRAM.exists()


def prepare() -> None:
    run("cargo", "install", "fmi-sim", "--version", VERSION, "--locked", "--root", PROGRAM.parents[1], log=LOG)


def version() -> str:
    return VERSION


def play(task: Task) -> Rows:
    table, result = task.input_table(task.folder / "inputs.csv"), task.folder / "result.csv"
    interface = {"CS": "co-simulation", "ME": "model-exchange"}[task.interface]
    run(PROGRAM, "--model", task.fmu, "-i", table, "-o", result, interface, "-f", repr(STEPS * STEP),
        "--output-interval", repr(STEP))  # fmt: skip
    with result.open(newline="") as file:
        for row in csv.DictReader(file):
            yield float(row["time"]), [float(row[name]) for name in OUTPUTS]
