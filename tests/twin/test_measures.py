"""The measures of a planting cycle and their gradients, against 50 digits, and the package's names."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import transplanter_linkage
from mpmath import mp, mpc, mpf
from transplanter_linkage import Geometry, Kinematics, UnreachablePose, solve
from transplanter_linkage.measures import (
    GEOMETRY,
    KNOWNS,
    MEASURES,
    OPERATION,
    SIGNALS,
    TORQUE,
    NoMeasure,
    Operation,
    Turn,
)

from fmu_src.oracle.oracle import Oracle

DESIGNS = {
    "published": (Geometry(), Operation()),
    "another": (
        Geometry(L1=0.047, L4=0.0195, L7=0.253, YG=-0.113, theta3=0.5),
        Operation(spacing=0.36, w=5.0, depth=0.09, body=0.03, seedling=0.06),
    ),
}
STEP = mpf(10) ** -18  # of differences at so many digits:
DIGITS = 90


class Exact:
    """A design to 50 digits: events and extremes solved for anew, from where the code found them."""

    def __init__(self, geometry, operation):
        self.oracle = Oracle(geometry, DIGITS)
        self.S, self.w, self.depth, self.body, self.seedling = operation

    def tip(self, phi) -> mpc:
        return self.oracle._pose(phi).J

    def angle(self, phi) -> mpf:
        angle = self.oracle._pose(phi).phi9
        return angle - 2 * mp.pi * mp.nint((angle + mp.pi / 2) / (2 * mp.pi))

    def margin(self, phi) -> mpf:
        pose = self.oracle._pose(phi)
        return min(mp.sin(pose.angle_ABD), mp.sin(pose.angle_EFG))

    def level(self, near) -> mpf:
        """Where y is least or greatest."""
        return root(slope(lambda phi: self.tip(phi).imag), near)

    def ground_x(self, phi) -> mpf:
        return self.tip(phi).real + self.S * phi / (2 * mp.pi)

    def at_surface(self, side, surface):
        def place(phi):
            angle = self.angle(phi)
            below = surface - self.tip(phi).imag
            return self.ground_x(phi) + below * mp.cot(angle) + side * self.body / 2 / abs(mp.sin(angle))

        return place

    def __call__(self, name: str, turn: Turn) -> mpf:
        found = turn[name].phi
        low = self.level(turn.lowest.phi)
        high = self.level(turn.highest.phi)
        surface = self.tip(low).imag + self.depth

        def crossing(event, height):
            return root(lambda phi: self.tip(phi).imag - height, event.phi)

        entry, exit_ = crossing(turn.entry, surface), crossing(turn.exit, surface)

        def extreme(f, near):
            """At an end of the stay in the ridge where the code found it there, else where f is level."""
            ends = {turn.entry.phi: entry, turn.exit.phi: exit_}
            return f(ends[near] if near in ends else root(slope(f), near))

        def size(order):
            f = derivative(self.tip, order)
            return lambda phi: abs(f(phi)) * self.w**order

        def rms(order):
            return mp.sqrt(sum(size(order)(2 * mp.pi * k / 120) ** 2 for k in range(120)) / 120)

        def spread(greatest, least):
            return extreme(greatest, found[0]) - extreme(least, found[1])

        return {
            "swept": lambda: spread(self.at_surface(1, surface), self.at_surface(-1, surface)),
            "reach": lambda: spread(self.ground_x, self.ground_x),
            "hole": lambda: self.ground_x(exit_) - self.ground_x(entry),
            "lean": lambda: self.angle(low) + mp.pi / 2,
            "lean_change": lambda: spread(self.angle, self.angle),
            "ground_speed": lambda: slope(self.ground_x)(low) * self.w,
            "mean_ground_speed": lambda: (self.ground_x(exit_) - self.ground_x(entry)) / (exit_ - entry) * self.w,
            "height": lambda: self.tip(high).imag - self.tip(low).imag,
            "pickup_x": lambda: self.tip(high).real,
            "pickup_y": lambda: self.tip(high).imag,
            "pickup_angle": lambda: self.angle(high) + mp.pi / 2,
            "peak_speed": lambda: extreme(size(1), found[0]),
            "rms_speed": lambda: rms(1),
            "peak_acceleration": lambda: extreme(size(2), found[0]),
            "rms_acceleration": lambda: rms(2),
            "peak_jerk": lambda: extreme(size(3), found[0]),
            "rms_jerk": lambda: rms(3),
            "margin": lambda: extreme(self.margin, found[0]),
            "clearance": lambda: self.clearance(turn, low, surface),
        }[name]()

    def clearance(self, turn, low, surface):
        side = 1 if turn["clearance"].parts[0][0] > 0 else -1
        near = turn["clearance"].parts[0][1]
        ends = {turn.exit.phi: surface, turn.above_seedling.phi: surface + self.seedling}
        at = float(near.phi[near.at])
        if at in ends:
            phi = root(lambda phi: self.tip(phi).imag - ends[at], at)
        else:
            phi = root(slope(self.ground_x), at)
        return side * (self.ground_x(phi) - self.ground_x(low))


def derivative(f, order):
    weights = {1: (-1, 0, 1), 2: (1, -2, 1), 3: (-1, 2, 0, -2, 1)}[order]
    half = len(weights) // 2
    per = (2 if order % 2 else 1) * STEP**order
    return lambda phi: sum(c * f(phi + (k - half) * STEP) for k, c in enumerate(weights) if c) / per


def slope(f):
    return derivative(f, 1)


def root(f, near):
    near = mpf(near)
    return mp.findroot(f, (near, near + mpf(10) ** -9), solver="secant", tol=mpf(10) ** -50, verify=False)


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("name", [name for name in MEASURES if name not in TORQUE])
def test_values_and_gradients_against_50_digits(name, design):
    """Along random directions in all 23 parameters at once; 1e-9 is asked for, 1e-11 is held."""
    geometry, operation = DESIGNS[design]
    turn = Turn(Kinematics(geometry), operation)
    at = [getattr(geometry, key) for key in GEOMETRY] + [getattr(operation, key) for key in OPERATION]
    angles = [key.startswith(("phi", "theta")) for key in (*GEOMETRY, *OPERATION)]
    scale = np.where(angles, 1.0, np.maximum(np.abs(at), 0.01))
    gradient = turn[name].gradient[: len(at)]
    chance = np.random.default_rng(5)
    with mp.workdps(DIGITS):
        exact = at_point(at, name, turn)
        assert turn[name].value == pytest.approx(float(exact), rel=1e-11, abs=1e-14)
        for direction in chance.normal(size=(1 if "rms" in name else 3, len(at))) * scale:
            small = mpf(10) ** -14
            ahead, behind = (
                at_point([mpf(a) + side * small * mpf(d) for a, d in zip(at, direction, strict=True)], name, turn)
                for side in (1, -1)
            )
            whole = np.abs(gradient * direction).sum()
            error = float((ahead - behind) / (2 * small)) - float(gradient @ direction)
            assert abs(error) < 1e-11 * whole


def at_point(values, name, turn):
    return Exact(dict(zip(GEOMETRY, values, strict=False)), values[len(GEOMETRY) :])(name, turn)


def test_signals_are_the_solver_s():
    phi, geometry = np.linspace(-9, 9, 50), Geometry(L4=0.02)
    values, rates = Kinematics(geometry).sample(phi)
    found = solve(geometry, phi, 3)
    assert len(SIGNALS) == values.shape[1]
    np.testing.assert_array_equal(values[:, 4] + 1j * values[:, 5], found.tip[2])
    np.testing.assert_array_equal(rates[:, 6], found.angle[1])
    step = 1e-6
    margins = [solve(geometry, phi + side * step, 0).margin for side in (1, -1)]
    np.testing.assert_allclose(rates[:, 7], (margins[0] - margins[1]) / (2 * step), atol=1e-8)


def test_extremes_are_those_of_a_dense_grid():
    """Nothing is missed between the samples, and nothing is flattered."""
    kinematics = Kinematics()
    turn, dense = Turn(kinematics), Turn(kinematics, nodes=7200)
    speed = np.hypot(dense.values[:, 2], dense.values[:, 3]).max() * turn.operation.w
    assert 0 <= turn["peak_speed"].value - speed < 1e-6
    assert 0 <= dense.values[:, 7].min() - turn["margin"].value < 1e-6
    for name in set(MEASURES) - set(TORQUE):
        assert turn[name].value == pytest.approx(dense[name].value, rel=1e-9)


def test_windows_carry_the_whole_extreme():
    """An optimiser that keeps every value of a part below a limit keeps the measure below it."""
    turn = Turn(Kinematics())
    (_, greatest), (_, least) = turn["swept"].parts
    assert len(greatest.values) == len(least.values) == 12 and greatest.gradients.shape == (12, len(KNOWNS))
    assert turn["swept"].value == greatest.values.max() - least.values.min()


def test_what_a_turn_lacks():
    too_deep = Turn(Kinematics(), Operation(depth=0.4))
    with pytest.raises(NoMeasure, match="never reaches the ridge's surface"):
        too_deep["swept"]
    values = too_deep.measure()
    assert math.isnan(values["hole"]) and values["height"] == pytest.approx(0.33465, abs=1e-5)
    with pytest.raises(NoMeasure, match="do not resolve the jerk"):
        Turn(Kinematics(), nodes=36)["peak_jerk"]
    with pytest.raises(NoMeasure, match="of which this source knows nothing"):
        Turn(Kinematics())["peak_torque"]
    with pytest.raises(UnreachablePose, match="dyad ABD"):
        Turn(Kinematics(replace(Geometry(), L1=0.065)))


def test_the_package_s_names_need_no_numpy_until_they_are_used():
    script = (
        "import sys, transplanter_linkage as t; assert 'numpy' not in sys.modules; "
        "t.solve(t.Geometry(), 0.0); assert 'numpy' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
    assert all(hasattr(transplanter_linkage, name) for name in transplanter_linkage.__all__)
    with pytest.raises(AttributeError, match="no attribute 'solver'"):
        transplanter_linkage.solver  # noqa: B018 - the attribute is what is asked for
