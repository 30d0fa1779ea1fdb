"""Masses in the page: given by a parameter set, by the example, by a control; what is then drawn is the FMU's."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.explorer.conftest import settled, until
from tests.explorer.test_use import SELECTORS, saved, shown, type_into
from tests.harness.host import Instance
from tests.harness.masses import MASSES

EXAMPLE = "extra/org.fmi-standard.fmi-ls-ref/with_masses.ssv"  # in every FMU


@pytest.fixture
def version() -> int:
    """The FMI version of what `new` gives: that of the page's kernel."""
    return 3


@pytest.fixture
def parameter_set(fmu_files: dict[int, Path], tmp_path: Path) -> Path:
    """The masses that the FMU carries as an example, as a parameter set."""
    place = tmp_path / "with_masses.ssv"
    with zipfile.ZipFile(fmu_files[3]) as archive:
        place.write_bytes(archive.read(EXAMPLE))
    return place


def give_masses(page: Any, parameter_set: Path) -> None:
    page.locator("#open").set_input_files(parameter_set)
    until(page, "document.getElementById('message').textContent.includes('is open')")
    settled(page)


def open_masses(page: Any) -> None:
    page.get_by_text("Mass of the links").click()
    until(page, "document.querySelector(\"[data-field='body.EF.m']\") !== null")


def table_of(page: Any, folder: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(saved(page, SELECTORS["csv"], folder).read_text())))


def is_drawn(page: Any) -> list[bool]:
    return [page.locator(f"#{name}").is_visible() for name in ("torque", "inertia")]


def test_without_masses_there_is_no_torque(page):
    assert is_drawn(page) == [False, False]
    assert "peak_torque" not in page.evaluate("window.explorer.figures()")
    assert page.locator("#figures tr[data-figure=peak_torque]").count() == 0


def test_every_output_of_the_turn_has_the_native_bits(page, parameter_set, new: Callable[..., Instance], tmp_path):
    """721 poses with masses: outputs and points of the linkage."""
    give_masses(page, parameter_set)
    assert {name: page.evaluate("(name) => window.explorer.get(name)", name) for name in MASSES} == MASSES
    rows = table_of(page, tmp_path)
    names = list(page.evaluate("window.explorer.pose(0)"))
    assert len(rows) == 721 and {"crank.tau", "crank.inertia", "machine.fy", "joint.B.x"} <= set(names) <= set(rows[0])
    native = new().setup().enter()
    native.set(MASSES)
    for row in rows:
        native.set({name: float(row[name]) for name in ("crank.phi", "crank.w", "machine.v", "machine.s")})
        assert [float(row[name]) for name in names] == list(native.get(*names)), row["crank.phi"]


@pytest.mark.parametrize(("diagram", "output"), [("torque", "crank.tau"), ("inertia", "crank.inertia")])
def test_curves_are_drawn_where_the_numbers_are(page, parameter_set, tmp_path, diagram, output):
    """Each point of the curve, by the scale that stands beside it."""
    give_masses(page, parameter_set)
    assert is_drawn(page) == [True, True]
    values = [float(row[output]) for row in table_of(page, tmp_path)]
    marks = page.evaluate(
        """(id) => [...document.querySelectorAll(`#${id} .grid text[text-anchor=end]`)]
            .map((text) => [text.textContent, text.getAttribute("y")])
            .filter(([text]) => !text.endsWith("°"))""",
        diagram,
    )
    (low, at_low), (high, at_high) = ((float(text.replace("−", "-")), float(y)) for text, y in (marks[0], marks[-1]))
    data = page.locator(f"#{diagram} .curve.c0").first.get_attribute("d")
    points = [tuple(map(float, each.split())) for each in re.split("[ML]", data)[1:]]
    assert len(points) == 241 and max(values) <= high * (1 + 1e-9) and min(values) >= low * (1 + 1e-9)
    for k, (_, y) in enumerate(points):
        shown_value = low + (y - at_low) / (at_high - at_low) * (high - low)
        assert shown_value == pytest.approx(values[3 * k], abs=2e-3 * (high - low))  # letters stand to 0.1 pixel


def test_peak_torque_is_the_greatest(page, parameter_set, new: Callable[..., Instance]):
    """By a search in the native FMU, from fine samples on."""
    give_masses(page, parameter_set)
    w, v = (page.evaluate("(name) => window.explorer.get(name)", name) for name in ("crank.w", "machine.v"))
    native = new().setup().enter()
    native.set(MASSES | {"crank.w": w, "machine.v": v})

    def torque(phi: float) -> float:
        native.set({"crank.phi": phi})
        return abs(native.get("crank.tau")[0])

    best, step = max((2e-3 * k for k in range(3142)), key=torque), 1e-3
    while step > 1e-9:
        best = max((best - step, best, best + step), key=torque)
        step /= 2
    peak = page.evaluate("window.explorer.figures().peak_torque")
    assert shown(page, "peak_torque") == peak == pytest.approx(torque(best), rel=1e-12) and peak > 5


def test_the_example_is_the_fmus(page, visit, parameter_set):
    """One step of the history; with it torque and inertia come, and go."""
    open_masses(page)
    page.locator("#masses").click()
    settled(page)
    other = visit()
    give_masses(other, parameter_set)
    assert is_drawn(page) == [True, True]
    assert page.evaluate("window.explorer.figures()") == other.evaluate("window.explorer.figures()")
    assert page.locator("[data-field='body.EF.m']").input_value() == "1.2"
    page.locator("#undo").click()
    settled(page)
    assert is_drawn(page) == [False, False] and page.locator("#undo").is_disabled()


def test_each_mass_by_its_control(page, new: Callable[..., Instance]):
    """One after the other: the pose has the native FMU's bits."""
    open_masses(page)
    native = new().setup().enter()
    w, v = (page.evaluate("(name) => window.explorer.get(name)", name) for name in ("crank.w", "machine.v"))
    native.set({"crank.w": w, "machine.v": v, "crank.phi": 2.5, "machine.s": v * 2.5 / w})
    before = page.evaluate("window.explorer.pose(2.5)")
    for name, value in MASSES.items():
        type_into(page, name, repr(value * (1e3 if name.endswith((".x", ".y")) else 1)))
        given = page.evaluate("(name) => window.explorer.get(name)", name)
        assert given == pytest.approx(value, rel=1e-12)
        native.set({name: given})
        pose = page.evaluate("window.explorer.pose(2.5)")
        assert list(pose.values()) == list(native.get(*pose)), name
        assert (pose != before) == (value != 0), name
        before = pose


def test_variants_with_and_without_mass(page, parameter_set):
    """The curves stay as long as anything that is drawn has them."""
    give_masses(page, parameter_set)
    page.locator("#variant-name").fill("heavy")
    page.locator("#keep").click()
    page.locator("#undo").click()
    settled(page)
    assert is_drawn(page) == [True, True]
    assert page.locator("#variants tbody tr td[data-figure=peak_torque]").count() == 1
    page.get_by_label("drop heavy").click()
    settled(page)
    assert is_drawn(page) == [False, False]
