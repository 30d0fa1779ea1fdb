"""The tables that the FMU carries as its reference results are what the oracle computes."""

from __future__ import annotations

from fmu_src.exporter.reference import SOURCE
from fmu_src.oracle.reference_results import reference_files


def test_nothing_is_stale(interface):
    files = reference_files(interface)
    assert {path.name for path in SOURCE.glob("*.csv")} == {path.name for path in files}
    stale = [path.name for path, content in files.items() if path.read_text(encoding="ascii") != content]
    assert not stale, f"run python -m fmu_src.oracle.reference_results: {stale}"
