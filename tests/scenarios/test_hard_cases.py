"""Every hard case is met, as it is measured for the report; and the report says what was measured."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from scenarios.common.instance import UnpackedFmu
from scenarios.speed_vs_error.hard_cases import geometries, report
from scenarios.speed_vs_error.hard_cases.measured import Measured
from scenarios.speed_vs_error.hard_cases.sections import SECTIONS


@pytest.fixture(scope="module")
def fmu(fmu_file: Path) -> Iterator[UnpackedFmu]:
    with UnpackedFmu(fmu_file) as unpacked:
        yield unpacked


@pytest.fixture(scope="module")
def measured() -> dict[str, list[Measured]]:
    """What the tests of this module have found so far."""
    return {}


@pytest.mark.parametrize("section", SECTIONS)
def test_every_case_is_met(fmu, measured, section):
    """Random geometries strictly: hypothesis shrinks the first one that is not."""
    measure = partial(geometries.measure, strict=True) if section == "Random geometries" else SECTIONS[section]
    lines = measured[section] = measure(fmu)
    if not lines:
        pytest.skip("not measured on this system")
    missed = [
        f"{line.case}: {line.quantity}: {line.worst:.3g} {line.unit}, bound {line.bound:g}, at {line.where}"
        for line in lines
        if not line.is_met
    ]
    assert not missed, "\n".join(missed)


def test_where_the_printed_equations_lose_digits_and_where_not(measured):
    """Each of 16 at three poles, next to none at the others; and as many as the inputs determine beside dead points."""
    if "Poles of the printed formulas" not in measured:
        pytest.skip("the poles were not measured")
    lost = {line.case: line.printed for line in measured["Poles of the printed formulas"]}
    assert min(lost.pop(pole) for pole in ("phi3 at 180°", "phi3 at 0°", "a = c, 0 over 0")) > 12
    assert max(lost.values()) < 1.5
    assert all(line.printed < 4 for line in measured["Dead points"] if line.printed is not None)


def test_the_report_shows_every_line(fmu, measured, tmp_path):
    if set(measured) != set(SECTIONS):
        pytest.skip("not all sections were measured")
    failing = Measured("an example", "what is not met", "m", 2.0, 1.0, "somewhere")
    sections = measured | {"Crank and clock": [*measured["Crank and clock"], failing]}
    paths = report.write(tmp_path / "new", sections, fmu)
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == sorted(path.name for path in paths)
    page = paths[0].read_text(encoding="utf-8")
    with paths[1].open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    lines = [line for part in sections.values() for line in part]
    assert [(row["case"], row["measured"]) for row in rows] == [(line.case, line.quantity) for line in lines]
    assert all(f"| {line.case} | {line.quantity} |" in page.replace(r"\|", "|") for line in lines)
    assert "not met: an example" in page and "| 2 | 1 | NO |" in page
    assert rows[-1]["section"] == "The host's process" or not measured["The host's process"]
    assert paths[2].stat().st_size > 20_000


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        (0, "0"),
        (2.0, "2"),
        (0.3599, "0.36"),
        (1.05, "1.05"),
        (1e-9, "1e-9"),
        (float("inf"), "no answer"),
        (13.42, "13.4"),
        (3.31e-15, "3.31e-15"),
    ],
)
def test_numbers_for_people(value, text):
    assert report.number(value) == text
