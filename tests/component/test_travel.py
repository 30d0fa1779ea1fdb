"""machine.s, the integral of machine.v: second order in the step, exact start, no drift over a season."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from tests.harness.drive import order_of_convergence
from tests.harness.host import ERROR, MACHINE_SPEED

STEPS = (16e-3, 8e-3, 4e-3, 2e-3)


def speed(t: float) -> float:
    return 0.4 + 0.1 * math.sin(5 * t + 1)


def slope(t: float) -> float:
    return 0.5 * math.cos(5 * t + 1)


def curvature(t: float) -> float:
    return -2.5 * math.sin(5 * t + 1)


def distance(t: float) -> float:
    return 0.4 * t - 0.02 * (math.cos(5 * t + 1) - math.cos(1))


def travel(new: Callable, step: float, derivatives: int = 0, at_end: bool = False, uneven: bool = False) -> np.ndarray:
    """Errors of machine.s, ground.vx and ground.ax after each step of some two seconds."""
    instance = new().initialize({"machine.v": speed(0.0), "crank.at_step_end": at_end})
    time, errors = 0.0, []
    for i in range(round(2 / step)):
        h = step * (1.4, 0.6)[i % 2] if uneven else step
        given = time + h if at_end else time
        instance.set({"machine.v": speed(given)})
        if derivatives:
            both = {("machine.v", 1): slope(given), ("machine.v", 2): curvature(given)}
            instance.set_derivatives(dict(list(both.items())[:derivatives]))
        instance.step(time, h)
        time += h
        s, vx, tip_vx, ax, tip_ax = instance.get("machine.s", "ground.vx", "tip.vx", "ground.ax", "tip.ax")
        errors.append([s - distance(time), vx - tip_vx - speed(time), ax - tip_ax - slope(time)])
    return np.abs(errors)


@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize(
    ("derivatives", "at_end", "orders"),
    [
        (0, False, (2, 2, 1)),  # the slope of the samples carries the speed on
        (1, False, (2, 2, 1)),
        (2, False, (3, 3, 2)),
        (0, True, (2, None, 1)),  # the speed is given, its slope is that of the samples
        (1, True, (2, None, None)),
    ],
)
def test_order_of_convergence(new, derivatives, at_end, orders, uneven):
    """Distance, speed and acceleration over ground."""
    worst = [travel(new, step, derivatives, at_end, uneven)[3:].max(axis=0) for step in STEPS]
    for n, order in enumerate(orders):
        if order is None:
            assert max(row[n] for row in worst) <= 1e-14
        else:
            found = order_of_convergence(STEPS, [row[n] for row in worst])
            assert found == pytest.approx(order, abs=0.2), ("distance", "speed", "acceleration")[n]


@pytest.mark.parametrize("at_end", [False, True])
def test_even_acceleration_is_exact(new, at_end):
    """The trapezoidal rule is, for a speed that grows evenly: at the step's end from the first step on."""
    instance, step = new().initialize({"machine.v": 1.0, "crank.at_step_end": at_end}), 2.0**-6
    for i in range(30):
        end = (i + 1) * step
        instance.step(i * step, step, {"machine.v": 1 + 2 * (end if at_end else i * step)})
        first_and_predicted = i == 0 and not at_end
        if not first_and_predicted:
            assert instance.get("machine.s") == pytest.approx([end + end * end], abs=4e-16)
            assert instance.get("ground.vx", "ground.ax") == pytest.approx([1 + 2 * end, 2.0], abs=1e-14)


def test_the_first_step_holds_the_speed(new):
    """One sample has no slope."""
    instance = new().initialize().step(0.0, 0.125, {"machine.v": 0.5})
    assert instance.get("machine.s", "ground.vx", "ground.ax") == [0.0625, 0.5, 0.0]


def test_what_was_predicted_too_far_is_taken_back(new):
    """Beyond the newest sample the speed is a guess; the next sample settles the distance."""
    instance, step = new().initialize(), 0.125
    speeds = [1.0, 1.0, 3.0, 0.0, 0.0, 0.0]
    for i, v in enumerate(speeds):
        instance.step(i * step, step, {"machine.v": v})
    trapezoids = sum((a + b) / 2 * step for a, b in itertools.pairwise(speeds))
    assert instance.get("machine.s") == [trapezoids]


def test_a_machine_that_stood_by_its_derivatives(new):
    """They say that it stands during one step only: later a sample of another speed tells of a change, as ever."""
    instance, step = new().initialize(), 0.125
    for i in range(2):
        instance.set_derivatives({("machine.v", 1): 0.0}).step(i * step, step, {"machine.v": 0.0})
    for i, v in enumerate([0.0, 1.0, 1.0], start=2):
        instance.step(i * step, step, {"machine.v": v})
    assert instance.get("machine.s") == [2.5 * step]


def test_the_machine_may_go_backward(new):
    instance = new().initialize()
    for i in range(8):
        instance.step(i * 0.5, 0.5, {"machine.v": -0.25})
    assert instance.get("machine.s") == [-1.0]


# ---- the start value -----------------------------------------------------------------------------


def test_the_start_value(new):
    """machine.s is exact initially: what the host sets, it reads, and travels on from."""
    instance = new().setup()
    instance.set({"machine.s": 12.5})
    instance.enter()
    assert instance.get("machine.s") == [12.5]
    instance.set({"machine.s": -3.0})
    assert instance.get("machine.s") == [-3.0]
    tip_x, ground_x = instance.get("tip.x", "ground.x")
    assert ground_x == -3.0 + tip_x
    instance.exit().step(0.0, 0.5, {"machine.v": 1.0})
    assert instance.get("machine.s") == [-2.5]


def test_the_start_value_cannot_be_set_later(new):
    instance = new().initialize({"machine.s": 1.0})
    before = instance.serialize()
    assert instance.try_set({"machine.s": 2.0}) == ERROR
    assert "machine.s" in instance.last_message.text and "initialization" in instance.last_message.text
    assert instance.serialize() == before


# ---- a season ------------------------------------------------------------------------------------


def test_no_drift_over_a_hundred_thousand_steps(new):
    """An even speed: the distance is speed times time, to rounding, however many terms it is made of."""
    instance, step, steps = new().initialize({"machine.v": MACHINE_SPEED, "machine.s": 1000.0}), 1e-3, 100_000
    do_step, component = instance.slave.dll.fmi2DoStep, instance.component
    assert not any(do_step(component, i * step, step, True) for i in range(steps))
    expected = 1000.0 + MACHINE_SPEED * step * steps
    assert abs(instance.get("machine.s")[0] - expected) <= math.ulp(expected)


def test_no_drift_at_uneven_speed(new):
    """Against the same trapezoids summed without rounding."""
    instance, step, steps = new().initialize({"machine.s": 1e6}), 1e-3, 20_000
    speeds = [0.0] + [speed(i * step) for i in range(1, steps)]
    for i, v in enumerate(speeds):
        instance.step(i * step, step, {"machine.v": v})
    trapezoids = math.fsum((a + b) / 2 * step for a, b in itertools.pairwise(speeds))
    ahead = step * (speeds[-1] + (speeds[-1] - speeds[-2]) / 2)
    expected = math.fsum([1e6, trapezoids, ahead])
    assert abs(instance.get("machine.s")[0] - expected) <= 2 * math.ulp(expected)


# ---- what the ground sees ------------------------------------------------------------------------


def test_ground_is_machine_plus_tip(new):
    instance = new().initialize({"machine.v": MACHINE_SPEED})
    for i in range(20):
        instance.step(i * 0.02, 0.02, {"crank.phi": 6.8 * i * 0.02, "crank.w": 6.8, "machine.v": 0.4 + i * i * 1e-3})
        for upward in ("y", "vy", "ay"):
            tip, ground = instance.get(f"tip.{upward}", f"ground.{upward}")
            assert tip == ground
        s, tip_x, ground_x = instance.get("machine.s", "tip.x", "ground.x")
        assert ground_x == s + tip_x
