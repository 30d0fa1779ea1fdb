"""What is right and what is wrong in the paper's print, and where its formulas lose digits.

The judge is the oracle, whose derivatives are differences of positions. Each equation is given exact values of
all that it refers to, so that it answers for itself alone, and at 50 digits, so that no rounding excuses it.
"""

from __future__ import annotations

import math
from functools import cache
from operator import attrgetter
from types import SimpleNamespace

import numpy as np
import pytest
from mpmath import mp, mpf

from fmu_src.interface import load_interface
from fmu_src.oracle import printed_equations as printed
from fmu_src.oracle.oracle import Oracle
from fmu_src.oracle.tables import rows
from fmu_src.twin.linkage import Geometry, UnreachablePose, solve

NOMINAL = load_interface().geometry
CRANK_SPEED = mpf(2 * math.pi / load_interface().model.turn_time)  # rad/s, 65 turns a minute
DIGITS, DOUBLE = 50, 53  # decimal digits of the oracle; bits of a double

# The equations that hold as printed, with the names of what they give.
RIGHT = {
    "1": "X_A Y_A",
    "2": "X_D Y_D",
    "3": "X_B Y_B X_B Y_B",
    "4": "phi3",
    "5": "X_E Y_E",
    "6": "phi7",
    "7": "X_F Y_F X_F Y_F",
    "8": "X_J Y_J",
    "9": "dX_B dY_B dX_B dY_B",
    "11": "dphi3",
    "13": "dX_F dY_F dX_F dY_F",
    "14": "dphi6",
    "15": "dphi7",
    "16": "dX_J dY_J",
    "18": "ddphi2",
    "19": "ddphi3",
    "21": "ddX_F ddY_F ddX_F ddY_F",
    "22": "ddphi6",
    "24": "ddX_F ddY_F",
    "25": "ddX_J ddY_J",
}

# Those that do not, and how wrong they are at least, over the greatest true value of the poses.
WRONG = {
    "10": ("dphi2", 0.5),
    "12": ("dX_E dY_E", 0.5),
    "17": ("ddX_B ddY_B ddX_B ddY_B", 0.2),
    "20": ("ddX_E ddY_E", 0.05),
    "20_half_mended": ("ddX_E ddY_E", 0.1),
    "23": ("ddphi7", 0.02),
}

ANGLES = [0.25 + k for k in range(7)]


def true_state(phi: float, geometry: dict[str, float] = NOMINAL) -> SimpleNamespace:
    """All that the equations refer to, in the paper's names, at the even crank speed of 65 turns a minute."""
    oracle = Oracle(geometry, DIGITS)
    with mp.workdps(DIGITS):
        state = {"phi": -mpf(phi), "dphi1": -CRANK_SPEED, "dphi4": -CRANK_SPEED, "ddphi4": mpf(0)}
        for name in ("phi2", "phi3", "phi5", "phi6", "phi7", "phi8", "phi9"):
            for n, value in enumerate(oracle.angle(attrgetter(name), phi, 2)):
                state["d" * n + name] = value * CRANK_SPEED**n
        for name in "ABDEFHJ":
            for n, value in enumerate(oracle.derivatives(attrgetter(name), phi, 2)):
                state["d" * n + "X_" + name] = value.real * CRANK_SPEED**n
                state["d" * n + "Y_" + name] = value.imag * CRANK_SPEED**n
    return SimpleNamespace(**state)


@cache
def poses() -> list[tuple[SimpleNamespace, SimpleNamespace]]:
    """Geometry and exact state all round the nominal cycle, and for three other geometries."""
    wanted = [(NOMINAL, phi) for phi in ANGLES] + [(row.geometry, row.phi) for row in rows("geometries")[:3]]
    return [
        (SimpleNamespace(**{name: mpf(value) for name, value in geometry.items()}), true_state(phi, geometry))
        for geometry, phi in wanted
    ]


def deviations(equation: str, names: str) -> list[mpf]:
    """|left side - truth| of an equation over the poses, each over the greatest truth of its row."""
    with mp.workdps(DIGITS):
        found, true = [], []
        for g, s in poses():
            values = getattr(printed, f"equation_{equation}")(g, s)
            found.append(values if isinstance(values, tuple) else (values,))
            true.append([getattr(s, name) for name in names.split()])
        off = [
            [direction_aware(names, f - t) for f, t in zip(*both, strict=True)]
            for both in zip(found, true, strict=True)
        ]
        greatest = [max(abs(t) for t in column) for column in zip(*true, strict=True)]
        return [max(column) / great for column, great in zip(zip(*off, strict=True), greatest, strict=True)]


def direction_aware(names: str, difference: mpf) -> mpf:
    """The size of a difference; of angles, whole turns aside."""
    if names.startswith("phi"):
        difference -= 2 * mp.pi * mp.nint(difference / (2 * mp.pi))
    return abs(difference)


@pytest.mark.parametrize("equation", RIGHT)
def test_right_as_printed(equation):
    assert max(deviations(equation, RIGHT[equation])) < mpf(10) ** (4 - DIGITS)


@pytest.mark.parametrize("equation", WRONG)
def test_wrong_as_printed(equation):
    names, at_least = WRONG[equation]
    assert max(deviations(equation, names)) > at_least


@pytest.mark.parametrize("equation", [equation for equation in WRONG if equation.isdecimal()])
def test_right_as_mended(equation):
    names, _ = WRONG[equation]
    assert max(deviations(equation + "_mended", names)) < mpf(10) ** (4 - DIGITS)


def test_every_equation_is_judged():
    judged = {int(equation) for equation in [*RIGHT, *WRONG] if equation.isdecimal()}
    assert judged == set(range(1, 26))


# ---- the signs of the pivots -----------------------------------------------------------

WHOLE_TURN = np.radians(np.arange(0, 360, 0.05))


def test_pivots_below_the_crank_give_the_published_height_and_phases():
    """334.9 mm, from highest at 0 to lowest about 180 degrees later; a length rounded by 0.5 mm moves 1.5 mm."""
    height = solve(Geometry(), WHOLE_TURN, 0).tip[0].imag
    assert abs(np.ptp(height) * 1e3 - 334.9) < 0.5
    assert min(height.argmax(), 7200 - height.argmax()) < 60 and abs(height.argmin() - 3600) < 60


def test_pivots_as_printed_give_neither():
    height = solve(Geometry(YC=0.055, YG=0.115), WHOLE_TURN, 0).tip[0].imag
    assert abs(np.ptp(height) * 1e3 - 334.9) > 100
    assert np.degrees(WHOLE_TURN[height.argmax()]) == pytest.approx(122, abs=1), "published: 0"


@pytest.mark.parametrize("pivots", [{"YC": 0.055}, {"YG": 0.115}])
def test_one_pivot_as_printed_does_not_turn_round(pivots):
    with pytest.raises(UnreachablePose, match="EFG"):
        solve(Geometry(**pivots), WHOLE_TURN, 0)


# ---- digits lost -----------------------------------------------------------------------


def in_doubles(equation: str, s: SimpleNamespace):
    """An equation evaluated in double arithmetic at a state that is rounded to doubles first."""
    with mp.workprec(DOUBLE):
        rounded = SimpleNamespace(**{name: +value for name, value in vars(s).items()})
        nominal = SimpleNamespace(**{name: mpf(value) for name, value in NOMINAL.items()})
        return getattr(printed, f"equation_{equation}")(nominal, rounded)


def worst_in_doubles(equation: str, name: str, angles: list[float]) -> float:
    """Worst relative error over some crank angles."""
    errors = []
    for phi in angles:
        s = true_state(phi)
        value, true = in_doubles(equation, s), getattr(s, name)
        with mp.workdps(DIGITS):
            errors.append(direction_aware(name, value - true) / abs(true))
    return float(max(errors))


@cache
def where(angle: str, function: str, low: float, high: float) -> float:
    """The crank angle, to the last bit, at which the sine or cosine of a link's angle changes its sign."""
    oracle = Oracle(NOMINAL, 30)

    def sign(phi: float) -> bool:
        return getattr(mp, function)(getattr(oracle.pose(phi), angle)) > 0

    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if sign(middle) == sign(low) else (low, middle)
    return low


PHI3_PASSES_180 = {"near 87.5 deg": ("phi3", "sin", 1.5, 1.55), "near 319.2 deg": ("phi3", "sin", 5.5, 5.6)}
PHI2_PASSES_MINUS_90 = {"near 43.3 deg": ("phi2", "cos", 0.7, 0.8), "near 157.0 deg": ("phi2", "cos", 2.7, 2.8)}
POLES = PHI3_PASSES_180 | PHI2_PASSES_MINUS_90


def beside(place: tuple, distance: float) -> list[float]:
    return [where(*place) + k * distance for k in (-1, -0.7, 0.7, 1)]


@pytest.mark.parametrize("place", PHI3_PASSES_180.values(), ids=PHI3_PASSES_180)
@pytest.mark.parametrize("distance", [1e-12, 1e-9, 1e-6, 1e-3])
def test_11_loses_its_digits_where_phi3_passes_180_degrees(place, distance):
    """It divides 0 by 0 there: each decimal nearer costs one. A double has 16."""
    assert worst_in_doubles("11", "dphi3", beside(place, distance)) > 3e-17 / distance


@pytest.mark.parametrize("place", POLES.values(), ids=POLES)
@pytest.mark.parametrize(
    ("equation", "name"), [("4", "phi3"), ("10_mended", "dphi2"), ("18", "ddphi2"), ("19", "ddphi3")]
)
def test_the_other_poles_cost_no_digits(equation, name, place):
    """Though a - c of (4) is 0 where phi3 is 180 degrees, and tan phi2 of (19) infinite where phi2 is -90.

    The arc tangent takes the first, and tan phi2 stands above and below the line. tan phi3 of (10) and (18) does
    so too, and phi3 stays between 169 and 250 degrees. Their divisors are 0 at dead points alone.
    """
    for distance in (1e-12, 1e-9, 1e-6, 1e-3):
        assert worst_in_doubles(equation, name, beside(place, distance)) < 5e-14


def test_4_divides_by_zero_at_some_double():
    """Where a - c rounds to 0, beside an angle at which phi3 passes 180 degrees."""

    def divides_by_zero(phi: float) -> bool:
        try:
            in_doubles("4", SimpleNamespace(phi=-mpf(phi)))
        except ZeroDivisionError:
            return True
        return False

    angles = [where(*place) + k * 2**-53 for place in PHI3_PASSES_180.values() for k in range(-32, 33)]
    stopped = [phi for phi in angles if divides_by_zero(phi)]
    assert stopped
    assert np.all(np.isfinite(solve(Geometry(), np.array(stopped), 3).tip)), "ours goes on"


def printed_cycle(phi: float) -> tuple[complex, complex]:
    """Velocity and acceleration of J by the mended equations, one after the other, in double arithmetic."""
    with mp.workprec(DOUBLE):
        _, *rates = printed.mended_tip(SimpleNamespace(**{k: mpf(v) for k, v in NOMINAL.items()}), phi, +CRANK_SPEED)
        return tuple(complex(*rate) for rate in rates)


def test_the_printed_route_agrees_elsewhere():
    """Mended, and far from the poles: the two editions are the same mechanism."""
    for phi in ANGLES:
        ours = solve(Geometry(), phi)
        velocity, acceleration = printed_cycle(phi)
        assert abs(velocity - ours.velocity(float(CRANK_SPEED))) < 1e-12
        assert abs(acceleration - ours.acceleration(float(CRANK_SPEED))) < 1e-11


@pytest.mark.parametrize("place", PHI3_PASSES_180.values(), ids=PHI3_PASSES_180)
def test_the_tip_loses_the_digits_that_11_lost_and_ours_does_not(place):
    """1e-9 rad beside the angle, in m/s and m/s2."""
    speed, printed_errors, our_errors = float(CRANK_SPEED), [], []
    for phi in beside(place, 1e-9):
        s, ours = true_state(phi), solve(Geometry(), phi)
        true = [complex(s.dX_J, s.dY_J), complex(s.ddX_J, s.ddY_J)]
        printed_errors.append(np.abs(np.subtract(printed_cycle(phi), true)))
        our_errors.append(np.abs(np.subtract([ours.velocity(speed), ours.acceleration(speed)], true)))
    assert np.all(np.max(printed_errors, axis=0) > [1e-9, 1e-8]), printed_errors
    assert np.all(np.max(our_errors, axis=0) < [1e-14, 2e-13]), our_errors
