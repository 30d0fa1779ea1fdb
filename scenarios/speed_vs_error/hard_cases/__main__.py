"""The hard cases alone, as a table and a figure: `python -m scenarios.speed_vs_error.hard_cases`.

Exits with 1 where a case is not met.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tqdm import tqdm

from scenarios.common.command import FMU, ROOT, Help
from scenarios.common.instance import FmuError, Refused, UnpackedFmu
from scenarios.common.reports import console, shown
from scenarios.speed_vs_error.hard_cases import report
from scenarios.speed_vs_error.hard_cases.sections import SECTIONS


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m scenarios.speed_vs_error.hard_cases",
        description=__doc__.splitlines()[0],
        formatter_class=Help,
    )
    parser.add_argument("--fmu", type=Path, default=FMU, help="the linkage FMU, FMI 2.0 (default: %(default)s)")
    parser.add_argument(
        "--output",
        type=Path,
        default=ROOT / "build" / "reports" / "speed_vs_error",
        help="folder for table and figure (default: %(default)s)",
    )
    chosen = parser.parse_args(arguments)
    try:
        _, written, all_met = perform(chosen.output, chosen.fmu)
    except (FmuError, Refused) as error:
        print(error, file=sys.stderr)
        return 1
    print(f"Table and figure: {shown(chosen.output)}")
    for path in written:
        print(f"  {path.name}")
    return 0 if all_met else 1


def perform(output: Path, fmu: Path) -> tuple[str, list[Path], bool]:
    """Measure, print and write into `output`; returns the section of the report, the files, and whether all are met."""
    with UnpackedFmu(fmu) as unpacked:
        bar = tqdm(SECTIONS.items(), desc="hard cases", unit="section", leave=False, disable=None)
        measured = {section: measure(unpacked) for section, measure in bar}
        written = report.write(output, measured, unpacked)
    report.show(console(), measured)
    return report.summary(measured), written, all(line.is_met for lines in measured.values() for line in lines)


if __name__ == "__main__":
    sys.exit(main())
