"""The hard cases as a table and a figure: `python -m tests.hard_cases`, which `make bench` runs.

Exits with 1 where a case is not met.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import fmpy
from rich.console import Console
from tqdm import tqdm

from fmu_src.exporter.compiler import compile_library, host_platform
from tests.fmi.host import Fmu
from tests.hard_cases import report
from tests.hard_cases.sections import SECTIONS

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "build" / "fmi2" / "TransplanterLinkage.fmu"
OUTPUT = ROOT / "build" / "reports" / "speed_vs_error"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hard_cases", description=__doc__.splitlines()[0])
    parser.add_argument("--fmu", type=Path, default=FMU, help="the linkage FMU, FMI 2.0 (default: %(default)s)")
    parser.add_argument(
        "--output", type=Path, default=OUTPUT, help="folder for table and figure (default: %(default)s)"
    )
    chosen = parser.parse_args(arguments)
    if not chosen.fmu.is_file():
        print(f"{chosen.fmu} is missing: `make build` makes it", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as name:
        fmu = unpack(chosen.fmu, Path(name))
        bar = tqdm(SECTIONS.items(), unit="section", leave=False, disable=None)
        measured = {section: measure(fmu) for section, measure in bar}
        written = report.write(chosen.output, measured, fmu)
    report.show(Console(), measured)
    print(f"Table and figure: {chosen.output}")
    for path in written:
        print(f"  {path.name}")
    return 0 if all(line.is_met for lines in measured.values() for line in lines) else 1


def unpack(file: Path, folder: Path) -> Fmu:
    """The FMU, with the callbacks that tests/fmi/host.py gives to it."""
    fmpy.extract(str(file), str(folder / "fmu"))
    callbacks = folder / f"callbacks{host_platform().suffix}"
    compile_library((ROOT / "tests" / "hosts" / "callbacks.c",), callbacks, host_platform())
    return Fmu(file, folder / "fmu", callbacks)


if __name__ == "__main__":
    sys.exit(main())
