"""crank.tau: what the drive must give so that the massless linkage holds the soil's force on the tip."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fmu_src.twin.linkage import Geometry, solve
from tests.harness.host import PLANTING_SPEED

ANGLES = np.linspace(0, 6, 13)


def slope(phi: float) -> complex:
    """The tip's derivative by the crank angle."""
    return complex(solve(Geometry(), phi, 1).tip[1])


def torque(force: complex, phi: float) -> float:
    tip = slope(phi)
    return -(force.real * tip.real + force.imag * tip.imag)


@pytest.mark.parametrize("phi", ANGLES)
def test_virtual_work(new, phi):
    """Torque times angle plus force times way is nothing, whatever the speed."""
    instance = new().setup().enter().set({"crank.phi": phi, "tip.fx": -30.0, "tip.fy": 80.0})
    (found,) = instance.get("crank.tau")
    assert found == pytest.approx(torque(-30 + 80j, phi), abs=1e-13)
    for speed in (0.0, PLANTING_SPEED, -3.0):
        vx, vy, tau = instance.set({"crank.w": speed, "crank.a": speed}).get("tip.vx", "tip.vy", "crank.tau")
        assert tau == found
        assert tau * speed + -30 * vx + 80 * vy == pytest.approx(0, abs=1e-12)


def test_lifting_takes_torque(new):
    """The sign: a weight on a tip that rises must be driven."""
    instance = new().setup().enter().set({"crank.phi": 4.0, "crank.w": 1.0, "tip.fy": -100.0})
    vy, tau = instance.get("tip.vy", "crank.tau")
    assert vy > 0.1 and tau > 10


def test_without_force_there_is_no_torque(new):
    instance = new().initialize({"crank.phi": 4.0, "crank.w": PLANTING_SPEED, "crank.a": 100.0})
    (tau,) = instance.get("crank.tau")
    assert (tau, math.copysign(1, tau)) == (0.0, 1.0), "zero, not minus zero"


def drive(instance, at_end: bool, derivatives: bool, step: float = 0.01) -> float:
    """Two steps at even speed under a force that changes; the torque at their end, 2 h."""
    for i in range(2):
        given = (i + 1 if at_end else i) * step
        instance.set({"crank.phi": 2 + given, "crank.w": 1.0, "tip.fx": 5 + 40 * given, "tip.fy": 7 + 300 * given**2})
        if derivatives:
            instance.set_derivatives({("tip.fx", 1): 40.0, ("tip.fy", 1): 600 * given, ("tip.fy", 2): 600.0})
        instance.step(i * step, step)
    return instance.get("crank.tau")[0]


def test_a_force_is_held_over_the_step(new):
    """Soil does not foresee: the force of the step's start, at the crank angle of its end."""
    force = complex(5 + 40 * 0.01, 7 + 300 * 0.01**2)
    found = drive(new().initialize({"crank.phi": 2.0}), at_end=False, derivatives=False)
    assert found == pytest.approx(torque(force, 2.02), abs=1e-12)


@pytest.mark.parametrize(("at_end", "derivatives"), [(False, True), (True, False), (True, True)])
def test_a_force_is_that_of_the_end_where_the_host_says_so(new, at_end, derivatives):
    """By its derivatives, or by crank.at_step_end."""
    force = complex(5 + 40 * 0.02, 7 + 300 * 0.02**2)
    instance = new().initialize({"crank.phi": 2.0, "crank.w": 1.0, "crank.at_step_end": at_end})
    assert drive(instance, at_end, derivatives) == pytest.approx(torque(force, 2.02), abs=1e-12)
