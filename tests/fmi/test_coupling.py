"""The crank is carried from the inputs' instant to the end of the step: how well, and of which order.

FMI 2.0.4, section 4.2.1: inputs set before fmi2DoStep(t, h) belong to t, outputs after it to t + h.
"""

from __future__ import annotations

import math

import fmpy
import numpy as np
import pytest

from fmu_src.twin.linkage import Geometry, solve
from tests.harness.drive import (
    TIP,
    Rotation,
    angle_and_speed,
    angle_only,
    angle_speed_acceleration,
    distances,
    drive,
    even,
    exact_tip,
    growing,
    one_derivative,
    order_of_convergence,
    swinging,
    two_derivatives,
    uneven,
)
from tests.harness.host import PLANTING_SPEED

STEPS = (8e-3, 4e-3, 2e-3, 1e-3)  # s
START_UP = 5  # steps until every history is full


def speed_with_derivatives(r: Rotation, t: float):
    """crank.w with its two derivatives; the second by a difference good to 1e-9."""
    jerk = (r.a(t + 1e-5) - r.a(t - 1e-5)) / 2e-5
    return angle_and_speed(r, t)[0], {("crank.w", 1): r.a(t), ("crank.w", 2): jerk}


def acceleration_with_derivative(r: Rotation, t: float):
    jerk = (r.a(t + 1e-5) - r.a(t - 1e-5)) / 2e-5
    return angle_speed_acceleration(r, t)[0], {("crank.a", 1): jerk}


def evenly(step: float, duration: float = 1.0) -> list[float]:
    return [i * step for i in range(round(duration / step) + 1)]


def unevenly(step: float, duration: float = 1.0) -> list[float]:
    """Steps of a fixed pattern, on average `step`."""
    times = [0.0]
    while times[-1] < duration:
        times.append(times[-1] + step * (1.0, 0.6, 1.5, 0.9, 1.3, 0.7)[len(times) % 6])
    return times


def errors(instance, rotation, times, giving, **options) -> np.ndarray:
    """Position in m, velocity in m/s, acceleration in m/s2, each after every step."""
    at_end = options.get("given_at_end", False)
    instance.initialize({"crank.at_step_end": at_end, **giving(rotation, times[0])[0]}, start=times[0])
    off = drive(instance, rotation, times, giving, **options) - exact_tip(rotation, times[1:])
    return np.hypot(off[:, 0::2], off[:, 1::2])


# ---- how well ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("giving", "at_1_ms", "at_10_ms"),
    [
        # mm
        (angle_only, 1.2e-6, 1.18e-2),
        (angle_and_speed, 4.5e-7, 4.4e-3),
        (angle_speed_acceleration, 1.5e-7, 1.5e-3),
        (one_derivative, 1.7e-3, 1.67e-1),
        (two_derivatives, 1.05e-5, 1.05e-2),
    ],
)
def test_worst_distance_of_the_tip(new, giving, at_1_ms, at_10_ms):
    """Over 12 s, when turn and ripple have met in every way; without the start-up, which is tested below."""
    for step, allowed in ((1e-3, at_1_ms), (10e-3, at_10_ms)):
        worst = errors(new(), uneven(), evenly(step, 12.0), giving)[START_UP:, 0].max() * 1e3
        assert 0.9 * allowed <= worst <= 1.01 * allowed


@pytest.mark.parametrize(("step", "expected"), [(1e-3, 1.95), (10e-3, 19.4)])
def test_held_inputs_are_one_step_late(new, step, expected):
    """What the prediction is for: crank.at_step_end with a host that gives inputs of the step's start."""
    instance, times = new().initialize({"crank.at_step_end": True}), evenly(step, 12.0)
    found = drive(instance, uneven(), times, angle_only)
    worst = distances(found, exact_tip(uneven(), times[1:])).max() * 1e3
    assert worst == pytest.approx(expected, rel=3e-3)


def samples(rotation: Rotation, step: float, names: tuple[str, ...]) -> np.ndarray:
    """An input table for fmpy with one row a step."""
    law = {"crank.phi": rotation.phi, "crank.w": rotation.w, "crank.a": rotation.a}
    table = [(t, *(law[name](t) for name in names)) for t in evenly(step)]
    return np.array(table, dtype=[(name, float) for name in ("time", *names)])


@pytest.mark.parametrize(
    ("names", "at_1_ms", "at_10_ms"),
    [
        # mm, at the worst instant of the first second
        (("crank.phi",), 1.1e-6, 1.2e-2),
        (("crank.phi", "crank.w"), 4.2e-7, 4.3e-3),
        (("crank.phi", "crank.w", "crank.a"), 1.4e-7, 1.4e-3),
    ],
)
def test_distance_of_the_tip_in_simulate_fmu(fmu_file, names, at_1_ms, at_10_ms):
    """fmpy's own loop over an input table keeps the promise as calls by hand do."""
    for step, allowed in ((1e-3, at_1_ms), (10e-3, at_10_ms)):
        result = fmpy.simulate_fmu(
            str(fmu_file), input=samples(uneven(), step, names), output_interval=step, stop_time=1, output=TIP
        )
        found = np.column_stack([result[name] for name in TIP])
        assert len(found) == round(1 / step) + 1
        assert distances(found, exact_tip(uneven(), result["time"]))[1 + START_UP :].max() * 1e3 <= 1.04 * allowed


# ---- of which order ------------------------------------------------------------------------------


@pytest.mark.parametrize("times", [evenly, unevenly])
@pytest.mark.parametrize("rotation", [uneven, swinging])
@pytest.mark.parametrize(
    ("giving", "order"),
    [
        (angle_only, 4),
        (angle_and_speed, 4),
        (angle_speed_acceleration, 4),
        (one_derivative, 2),
        (two_derivatives, 3),
        (speed_with_derivatives, 4),
        (acceleration_with_derivative, 4),
    ],
)
def test_order_of_convergence(new, giving, order, rotation, times):
    """Position of this order in the step, velocity of one less, acceleration of two less."""
    worst = [errors(new(), rotation(), times(step), giving)[START_UP:].max(axis=0) for step in STEPS]
    for n in range(min(3, order)):
        found = order_of_convergence(STEPS, [row[n] for row in worst])
        assert order - n - 0.2 < found < order - n + 0.2, f"derivative {n}: order {found:.2f}"


@pytest.mark.parametrize(
    ("giving", "orders"),
    [
        (angle_only, [1, 2, 3, 4, 4]),  # held, linear, quadratic, cubic
        (angle_and_speed, [2, 3, 4, 4, 4]),
        (angle_speed_acceleration, [3, 4, 4, 4, 4]),
        (one_derivative, [2, 2, 2, 2, 2]),
        (two_derivatives, [3, 3, 3, 3, 3]),
        (speed_with_derivatives, [4, 4, 4, 4, 4]),
    ],
)
def test_start_up(new, giving, orders):
    """Each of the first steps is as good as the samples that there are by then."""
    found = [errors(new(), growing(), evenly(step, len(orders) * step), giving)[:, 0] for step in STEPS]
    for k, order in enumerate(orders):
        slope = order_of_convergence(STEPS, [row[k] for row in found])
        assert slope == pytest.approx(order, abs=0.2), f"step {k + 1}"


@pytest.mark.parametrize("with_second", [False, True])
def test_input_derivatives_are_taken_exactly(new, with_second):
    """The angle at the end is the polynomial that the host gave, whatever the history says."""
    instance, rotation, step = new().initialize(), uneven(), 10e-3
    for i in range(8):
        t = i * step
        values, derivatives = two_derivatives(rotation, t)
        w, a = 3.0 + i, (-20.0 if with_second else 0.0)
        derivatives = {("crank.phi", 1): w} | ({("crank.phi", 2): a} if with_second else {})
        instance.set(values).set_derivatives(derivatives).step(t, step)
        exact = solve(Geometry(), values["crank.phi"] + step * w + step**2 / 2 * a, 2)
        velocity, acceleration = exact.velocity(w + step * a), exact.acceleration(w + step * a, a)
        expected = [part for z in (exact.tip[0], velocity, acceleration) for part in (z.real, z.imag)]
        found = instance.get(*TIP)
        assert found[:2] == pytest.approx(expected[:2], abs=1e-15)
        assert found[2:4] == pytest.approx(expected[2:4], abs=1e-14)
        assert found[4:] == pytest.approx(expected[4:], abs=5e-13)


def test_derivatives_of_the_angle_go_before_the_speed(new):
    """The angle at the end is theirs also where crank.w and crank.a say something else."""
    instance, step = new().initialize(), 10e-3
    for i in range(5):
        instance.set({"crank.phi": 0.05 * i, "crank.w": 3.0, "crank.a": 70.0})
        instance.set_derivatives({("crank.phi", 1): 5.0, ("crank.phi", 2): -40.0}).step(i * step, step)
        reached = solve(Geometry(), 0.05 * i + 5.0 * step - 20.0 * step**2, 0).tip[0]
        assert instance.get("tip.x", "tip.y") == pytest.approx([reached.real, reached.imag], abs=1e-15)


def test_input_derivatives_are_used_up_by_the_step(new):
    """FMI 2.0.4, section 4.2.1: they are set anew for each step; a step without is predicted from samples."""
    with_one, without = new().initialize(), new().initialize()
    for i in range(6):
        angle = {"crank.phi": PLANTING_SPEED * i * 1e-3}
        with_one.set(angle)
        if i == 3:
            with_one.set_derivatives({("crank.phi", 1): 50.0})
        with_one.step(i * 1e-3, 1e-3)
        without.step(i * 1e-3, 1e-3, angle)
        same = with_one.outputs() == without.outputs()
        assert same == (i != 3), f"step {i}"


def test_a_discarded_step_does_not_use_input_derivatives_up(new):
    """A refused step changes nothing: the same derivatives serve the shorter step that follows."""
    geometry = {"geometry.L2": 0.097, "geometry.L3": 0.097}  # opens near 5.75 rad
    refused, plain = new(), new()
    for instance in (refused, plain):
        instance.initialize(geometry | {"crank.phi": 5.0})
        instance.set_derivatives({("crank.phi", 1): 7.0})
    assert refused.try_step(0.0, 0.1) != 0
    for instance in (refused, plain):
        instance.step(0.0, 1e-3)
    assert refused.outputs() == plain.outputs()
    assert refused.get("tip.x") != new().initialize(geometry | {"crank.phi": 5.0}).step(0.0, 1e-3).get("tip.x")


# ---- which source --------------------------------------------------------------------------------


def test_speed_zero_is_a_speed_once_it_was_given(new):
    """A crank that comes to rest and turns back: at speed 0 the history must not fall back on the angle.

    With a constant deceleration the speed's parabola is exact; the angle's history, one sample old, is not.
    """
    stopping = Rotation(phi=lambda t: t - t * t, w=lambda t: 1 - 2 * t, a=lambda t: -2.0)
    times = evenly(2.0**-4, 1.0)  # binary fractions, so that w is 0 exactly at 0.5 s
    assert 0.0 in [stopping.w(t) for t in times]
    worst = errors(new(), stopping, times, angle_and_speed)[2:].max(axis=0)
    assert worst[0] <= 1e-15 and worst[1] <= 1e-14 and worst[2] <= 1e-12


def test_acceleration_zero_is_an_acceleration_once_it_was_given(new):
    """The same with crank.a passing 0 in a motion of constant jerk."""
    turning = Rotation(phi=lambda t: t - t * t + t**3 / 1.5, w=lambda t: 1 - 2 * t + 2 * t * t, a=lambda t: -2 + 4 * t)
    times = evenly(2.0**-4, 1.0)
    assert 0.0 in [turning.a(t) for t in times]
    worst = errors(new(), turning, times, angle_speed_acceleration)[2:].max(axis=0)
    assert worst[0] <= 1e-15 and worst[1] <= 1e-14 and worst[2] <= 1e-12


@pytest.mark.parametrize("standing", [0, 1, 5])
@pytest.mark.parametrize("at_end", [False, True])
def test_the_acceleration_of_a_crank_that_starts_from_rest_is_a_sample(new, at_end, standing):
    """The speed it starts with is 0, as if it were not connected; the acceleration given with it counts all the same.

    `standing`: steps before the start.
    """
    start = standing * 2.0**-7
    starting = Rotation(
        phi=lambda t: 10 * max(t - start, 0.0) ** 2,
        w=lambda t: 20 * max(t - start, 0.0),
        a=lambda t: 20.0 if t >= start else 0.0,
    )
    times = evenly(2.0**-7, 0.125)
    worst = errors(new(), starting, times, angle_speed_acceleration, given_at_end=at_end)[standing:].max(axis=0)
    assert worst[0] <= 1e-15 and worst[1] <= 1e-14 and worst[2] <= 1e-12


def test_speed_that_comes_later_takes_over(new):
    """crank.w counts from the moment that it is not 0; its first sample brings order 2 at least."""
    found = []
    for step in STEPS:
        instance, rotation, times = new().initialize(), growing(), evenly(step, 20 * step)
        drive(instance, rotation, times[:11], angle_only)
        after = drive(instance, rotation, times[10:], angle_and_speed)
        found.append(distances(after, exact_tip(rotation, times[11:])))
    first = order_of_convergence(STEPS, [row[0] for row in found])
    settled = order_of_convergence(STEPS, [row[3:].max() for row in found])
    assert first > 1.9 and settled > 3.9, (first, settled)


# ---- inputs of the step's end --------------------------------------------------------------------


@pytest.mark.parametrize("times", [evenly, unevenly])
@pytest.mark.parametrize(
    ("giving", "orders"),
    [(angle_only, (None, 3, 2)), (angle_and_speed, (None, None, 2)), (angle_speed_acceleration, (None, None, None))],
)
def test_at_step_end_nothing_is_predicted(new, giving, orders, times):
    """What is given is taken as it is (None: exact to rounding), what is missing comes from the samples."""
    worst = [errors(new(), uneven(), times(step), giving, given_at_end=True)[START_UP:].max(axis=0) for step in STEPS]
    for n, order in enumerate(orders):
        if order is None:
            assert max(row[n] for row in worst) <= (2e-15, 2e-14, 4e-13)[n], f"derivative {n}"
        else:
            assert order_of_convergence(STEPS, [row[n] for row in worst]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("giving", [angle_only, angle_and_speed, angle_speed_acceleration])
def test_at_step_end_the_initial_inputs_are_the_first_sample(new, giving):
    """An even crank: velocity and acceleration are right from the first step on."""
    worst = errors(new(), even(PLANTING_SPEED), evenly(1e-2, 0.1), giving, given_at_end=True).max(axis=0)
    assert worst[0] <= 1e-15 and worst[1] <= 1e-13 and worst[2] <= 1e-9


def test_at_step_end_the_initial_speed_is_the_first_sample(new):
    """A crank that speeds up evenly: its acceleration follows from the first two speeds."""
    rotation = Rotation(phi=lambda t: t + t * t / 2, w=lambda t: 1 + t, a=lambda t: 1.0)
    worst = errors(new(), rotation, evenly(1e-2, 0.1), angle_and_speed, given_at_end=True).max(axis=0)
    assert worst[0] <= 1e-15 and worst[1] <= 1e-14 and worst[2] <= 1e-12


@pytest.mark.parametrize("phi", [0.0, 1.0])
def test_at_step_end_what_was_not_connected_initially_is_no_sample(new, phi):
    """A host that gives its first speed with its first step: the zero before it was none, the crank ran on."""
    rotation, step = even(PLANTING_SPEED), 1e-2
    instance = new().initialize({"crank.at_step_end": True, "crank.phi": phi})
    for i in range(4):
        angle = phi + rotation.phi((i + 1) * step)
        instance.step(i * step, step, {"crank.phi": angle, "crank.w": PLANTING_SPEED})
        at_rest = new().initialize({"crank.phi": angle, "crank.w": PLANTING_SPEED})
        assert instance.get(*TIP) == pytest.approx(at_rest.get(*TIP), abs=1e-12)


def test_at_step_end_a_crank_that_starts_from_rest(new):
    """There the zero is a sample: acceleration from the first step on."""
    starting = Rotation(phi=lambda t: 50 * t * t, w=lambda t: 100 * t, a=lambda t: 100.0)
    worst = errors(new(), starting, evenly(1e-2, 0.1), angle_and_speed, given_at_end=True).max(axis=0)
    assert worst[0] <= 1e-15 and worst[1] <= 1e-14 and worst[2] <= 1e-10


# ---- what outputs belong to ----------------------------------------------------------------------


def test_before_the_first_step_outputs_follow_the_inputs(new, fmu):
    """Direct feedthrough, in initialization mode and after it."""
    inputs = {"crank.phi": 1.3, "crank.w": 5.0, "crank.a": -3.0, "machine.v": 0.4, "tip.fx": 20.0, "tip.fy": 70.0}
    expected = new().initialize(inputs).outputs()
    instance = new().setup().enter()
    at_start = instance.outputs()
    assert instance.set(inputs).outputs() == expected
    instance.set(dict.fromkeys(inputs, 0.0))
    assert instance.outputs() == at_start
    instance.exit()
    assert instance.outputs() == at_start
    assert instance.set(inputs).outputs() == expected


def test_input_derivatives_count_before_the_first_step(new):
    """The end of initialization changes nothing of what was told."""
    instance = new().setup().enter().set({"machine.v": 0.5})
    instance.set_derivatives({("machine.v", 1): 3.0, ("machine.v", 2): 2.0}).exit()
    assert instance.get("ground.vx", "ground.ax") == [0.5, 3.0]
    assert instance.get_derivatives(("machine.s", 2), ("ground.vx", 2)) == [3.0, 2.0]


def test_after_a_step_outputs_keep_until_the_next(new):
    instance = new().initialize().step(0.0, 1e-3, {"crank.phi": 0.5, "crank.w": 2.0})
    before = instance.outputs()
    instance.set({"crank.phi": 1.5, "crank.w": 5.0, "machine.v": 2.0, "tip.fx": 100.0, "tip.fy": 3.0})
    instance.set_derivatives({("crank.phi", 1): 5.0, ("tip.fx", 1): 5.0})
    assert instance.outputs() == before
    assert instance.step(1e-3, 1e-3).outputs() != before


def test_the_time_variable_is_the_end_of_the_step(new):
    instance = new().initialize(start=3.0)
    assert instance.get("time") == [3.0]
    assert instance.step(3.0, 0.25).get("time") == [3.25]
    assert math.isclose(instance.last_successful_time(), 3.25)
