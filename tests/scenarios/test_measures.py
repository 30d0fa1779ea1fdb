"""What is read off trajectories, against curves whose numbers are known."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.common import measures

ANGLE = np.linspace(0, 2 * np.pi, 720, endpoint=False)
CIRCLE = 50 * np.exp(1j * ANGLE)


def test_extremes_between_samples() -> None:
    phi = np.linspace(0, 360, 721)
    found = measures.extremes(phi, 3 * np.cos(np.radians(phi - 40.2)))
    assert [e.is_maximum for e in found] == [True, False]
    assert [e.phi_deg for e in found] == pytest.approx([40.2, 220.2], abs=1e-4)
    assert [e.value for e in found] == pytest.approx([3, -3], abs=1e-8)


def test_extreme_at_the_seam_of_the_turn() -> None:
    phi = np.linspace(0, 360, 361)
    top = measures.highest(phi, np.cos(np.radians(phi + 0.3)))
    assert top.phi_deg == pytest.approx(359.7, abs=1e-3)


def test_extreme_between_two_equal_samples_is_found_once() -> None:
    phi = np.linspace(0, 360, 361)
    found = measures.extremes(phi, np.round(np.cos(np.radians(phi - 0.5)), 12))
    assert [round(e.phi_deg, 3) for e in found] == [0.5, 180.5]


def test_nearest_goes_the_short_way_round() -> None:
    found = [measures.Extreme(350.0, 0.0, True), measures.Extreme(30.0, 0.0, True)]
    assert measures.nearest(found, 5.0).phi_deg == 350.0
    assert measures.angle_between(5.0, 350.0) == 15.0


def dynamic(radius: float, spacing: float) -> np.ndarray:
    """A tip on a circle, clockwise from its top, on a machine that moves on by ``spacing``."""
    turn = np.linspace(0, 1, 3601)
    return radius * 1j * np.exp(-2j * np.pi * turn) + spacing * turn


def test_hole_of_a_cycloid() -> None:
    # At axle height the circle stands a quarter of a turn before and after its lowest point;
    # there x is that of the spacing alone, plus and minus the radius.
    found = measures.hole(dynamic(30.0, 200.0), 0.0)
    assert found is not None
    assert found.entry.real == pytest.approx(0.25 * 200 + 30, abs=1e-3)
    assert found.exit.real == pytest.approx(0.75 * 200 - 30, abs=1e-3)
    assert found.size == pytest.approx(40.0, abs=2e-3)


def test_hole_of_a_path_that_crosses_itself_is_negative() -> None:
    found = measures.hole(dynamic(100.0, 200.0), 0.0)
    assert found is not None and found.size == pytest.approx(-100.0, abs=5e-3)


def test_no_hole_where_the_surface_is_out_of_reach() -> None:
    assert measures.hole(dynamic(30.0, 200.0), -31.0) is None
    assert measures.hole(dynamic(30.0, 200.0), 31.0) is None


def test_surface_for_a_hole() -> None:
    path = dynamic(30.0, 200.0)
    height = measures.surface_of_hole(path, 40.0, (1.0, 50.0))
    assert height == pytest.approx(30.0, abs=1e-2)
    assert measures.surface_of_hole(path, 4000.0, (1.0, 50.0)) is None


def test_area_and_hull() -> None:
    square = np.array([0, 10, 10 + 10j, 10j], complex)
    assert measures.area(square) == pytest.approx(100)
    assert measures.area(square[::-1]) == pytest.approx(-100)
    assert measures.hull_area(np.append(square, 5 + 5j)) == pytest.approx(100)


def test_form_of_a_circle_and_of_a_figure_eight() -> None:
    circle = measures.shape(CIRCLE)
    assert (circle.crossings, circle.hollows) == (0, 0)
    assert circle.solidity == pytest.approx(1, abs=1e-6)
    assert circle.slenderness == pytest.approx(1, abs=1e-3)
    assert circle.name == "loaf"

    start = ANGLE + 0.003  # so that the crossing does not meet a sample
    eight = measures.shape(100 * np.sin(start) + 40j * np.sin(2 * start))
    assert (eight.crossings, eight.name) == (1, "figure 8")
    assert eight.minor_lobe == pytest.approx(0.5, abs=0.01)


def test_form_of_a_curve_with_one_hollow() -> None:
    bent = np.exp(1j * ANGLE)
    bean = 100 * (bent.real * 0.35 + 0.8 * bent.imag**2 + 1j * bent.imag)
    form = measures.shape(bean)
    assert (form.crossings, form.hollows) == (0, 1)
    assert form.name == "kidney"


def test_best_rotation_ignores_the_shift() -> None:
    curve = CIRCLE.real + 3j * CIRCLE.imag
    found = measures.best_rotation(curve, curve * np.exp(1j * np.radians(-12)) + 70 - 20j)
    assert found.angle_deg == pytest.approx(-12)
    assert found.residual == pytest.approx(0, abs=1e-9)
    assert found.before > 5


def test_distance_is_to_the_chord_not_only_to_its_ends() -> None:
    square = np.array([0, 10, 10 + 10j, 10j], complex)
    assert measures.distance(square, np.array([5 - 2j, 12 + 5j, 13 + 14j])) == pytest.approx([2, 2, 5])


def test_common_points_of_circles_through_two_points() -> None:
    # Circles about points of the y axis that pass (-30, 0) and (30, 0).
    circles = [1j * h + np.hypot(30, h) * np.exp(1j * ANGLE) for h in (-20, -5, 5, 25)]
    found = measures.common_points(circles, circles[1][::8], apart_mm=30)
    assert sorted(round(p.point.real) for p in found) == [-30, 30]
    for point in found:
        assert point.point.imag == pytest.approx(0, abs=0.05)
        assert point.distance < 0.02


def test_common_points_are_not_invented() -> None:
    rings = [r * np.exp(1j * ANGLE) for r in (40, 50, 60)]
    assert all(p.distance > 9 for p in measures.common_points(rings, rings[1][::8], apart_mm=30))


def test_wall_of_a_straight_and_of_a_bent_line() -> None:
    y = np.linspace(0, 100, 30)
    straight = measures.wall(0.2 * y + 1j * y)
    assert straight.lean_deg == pytest.approx(np.degrees(np.arctan(0.2)))
    assert straight.bulge == pytest.approx(0, abs=1e-9)
    assert straight.spread == pytest.approx(20)
    bent = measures.wall(0.01 * y**2 + 1j * y)
    assert bent.bulge > 5


def test_width_at_a_level() -> None:
    assert measures.width_at(CIRCLE, 30.0) == pytest.approx(80.0, abs=0.01)
    assert measures.width_at(CIRCLE, 60.0) == 0.0
