"""The page's figures are the measures by which scenarios and studies judge a design: the same numbers, by other code.

Both find events and extremes between samples to rounding, so they agree to rounding, which acceleration has most of:
its derivatives are sums of greater terms. A figure would be off by far more if it were about something else: by 1e-3 of
itself where an extreme were that of the 720 samples.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from transplanter_linkage import Geometry, Kinematics, UnreachablePose
from transplanter_linkage.measures import GEOMETRY, KNOWNS, MEASURES, Operation, Turn

from scenarios.common.variants import explored, read_ssv, write_ssv
from scenarios.design.report import fragment
from tests.explorer.conftest import until

FIGURES = ("height", "hole", "swept", "lean", "ground_speed", "margin", "peak_acceleration")
DESIGNS = 20
# Of a figure's own size in the published design, and of its derivatives'.
SAME, SAME_BY = 1e-10, 1e-7
NOMINAL = {name: getattr(Geometry(), name) for name in GEOMETRY}
PUBLISHED = Turn(Kinematics(Geometry())).measure(*FIGURES)

# What the study `practical` found, to a micrometre.
PRACTICAL = NOMINAL | {
    "L1": 0.045, "L2": 0.0945, "L3": 0.100634, "L4": 0.0198, "L5": 0.247447, "L6": 0.063, "L7": 0.275, "L8": 0.0605,
    "L9": 0.22, "XC": 0.10659, "YC": -0.065, "XG": 0.117, "YG": -0.125, "phi1": 2.183161, "phi4": 5.375828,
    "theta3": 0.390773, "theta9": 1.570796,
}  # fmt: skip


def set_in(page: Any, geometry: dict[str, float], operation: Operation) -> None:
    values = {f"geometry.{name}": value for name, value in geometry.items()} | explored(operation)
    page.evaluate("(values) => window.explorer.set(values)", values)


def near(found: dict[str, float], measured: dict[str, float], within: float = SAME) -> None:
    """Or both have none."""
    for name in FIGURES:
        if found[name] is None:
            assert measured[name] != measured[name], name
        else:
            assert found[name] == pytest.approx(measured[name], abs=within * abs(PUBLISHED[name]), rel=within), name


def figures(page: Any) -> dict[str, float]:
    return page.evaluate(
        "Object.fromEntries(Object.entries(window.explorer.figures()).map(([k, v]) => [k, Number.isNaN(v) ? null : v]))"
    )


def some_designs() -> Iterator[tuple[dict[str, float], Operation]]:
    """Whole turns about the published design, with rate, spacing and depth of their own."""
    draw, made = random.Random(7), 0
    while made < DESIGNS:
        spread = draw.choice((0.02, 0.06))
        geometry = {name: value * (1 + spread * draw.uniform(-1, 1)) for name, value in NOMINAL.items()}
        operation = Operation(
            w=draw.uniform(3, 12), spacing=draw.uniform(0.2, 0.6), depth=draw.choice((0.02, 0.1, 0.13))
        )
        try:
            Turn(Kinematics(Geometry(**geometry))).measure("margin")
        except UnreachablePose:
            continue
        made += 1
        yield geometry, operation


def test_the_published_design(page):
    set_in(page, NOMINAL, Operation())
    near(figures(page), PUBLISHED)


def test_random_designs(page):
    for geometry, operation in some_designs():
        set_in(page, geometry, operation)
        near(figures(page), Turn(Kinematics(Geometry(**geometry)), operation).measure(*FIGURES))


def test_a_surface_above_the_path(page):
    """No hole there, in either."""
    operation = Operation(depth=0.5)
    set_in(page, NOMINAL, operation)
    found = figures(page)
    assert found["hole"] is None and found["swept"] is None
    near(found, Turn(Kinematics(Geometry()), operation).measure(*FIGURES))


def test_gradients_of_random_designs(page):
    """By every parameter, spacing, rate and depth; each as large as the greatest of its kind allows."""
    for geometry, operation in some_designs():
        set_in(page, geometry, operation)
        found = page.evaluate("window.explorer.gradients()")
        turn = Turn(Kinematics(Geometry(**geometry)), operation)
        names = [f"geometry.{name}" for name in GEOMETRY] + ["plant.spacing", "crank.w", "ridge.depth"]
        assert list(KNOWNS[len(GEOMETRY) : len(names)]) == ["spacing", "w", "depth"]
        for figure in FIGURES:
            own = turn[figure].gradient
            size = max(abs(own))
            for name, by in zip(names, own, strict=False):
                assert found[figure][name] == pytest.approx(by, rel=SAME_BY, abs=SAME_BY * size), (figure, name)


def test_words_are_about_the_same(page):
    """Units of the tables, by name."""
    headings = page.evaluate(
        "[...document.querySelectorAll('#figures tbody tr')].map((r) => [r.dataset.figure, r.cells[0].textContent])"
    )
    units = {"deg": "°", "m/s2": "m/s²", "1": ""}
    for key, text in headings:
        unit = MEASURES[key].unit
        assert text.partition(", ")[2] == units.get(unit, unit)
    assert [key for key, _ in headings] == list(FIGURES)


# ---- what a study writes ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "operation", [Operation(depth=0.10321573112567503), Operation(spacing=0.35, w=5.5, depth=0.08)]
)
@pytest.mark.parametrize("way", ["parameter set", "link"])
def test_what_a_study_finds_opens_with_the_same_figures(visit, tmp_path: Path, operation, way):
    """In the study's own operation: rate, spacing and depth come with the geometry."""
    measured = Turn(Kinematics(Geometry(**PRACTICAL)), operation).measure(*FIGURES)
    if way == "link":
        page = visit("#" + fragment(NOMINAL, PRACTICAL, operation))
    else:
        page, place = visit(), tmp_path / "design.ssv"
        write_ssv(place, "practical", PRACTICAL, operation)
        assert read_ssv(place).changes == PRACTICAL
        page.locator("#open").set_input_files(place)
        until(page, "document.getElementById('message').textContent.includes('is open')")
    found = figures(page)
    near(found, measured)
    assert found["swept"] < 0.3 * PUBLISHED["swept"]
    assert {
        name: page.evaluate("(name) => window.explorer.get(name)", name) for name in explored(operation)
    } == explored(operation)
