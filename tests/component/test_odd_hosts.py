"""What hosts do that a smooth test drive does not: remnants of steps, jumps, rates given in part."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.harness.host import MACHINE_SPEED, PLANTING_SPEED

STEP = 1e-3


def angle(t: float) -> float:
    """65 turns a minute with a ripple of 10 % at 3 Hz."""
    return PLANTING_SPEED * (t + 0.1 * (1 - math.cos(6 * math.pi * t)) / (6 * math.pi))


def speed(t: float) -> float:
    return PLANTING_SPEED * (1 + 0.1 * math.sin(6 * math.pi * t))


def exact(new, phi: float) -> np.ndarray:
    """The tip at an angle, read where outputs follow inputs."""
    return np.array(new().setup().enter().set({"crank.phi": phi}).get("tip.x", "tip.y"))


def run(new, gaps: list[float], inputs, *names: str) -> list[list[float]]:
    """Outputs after each of some steps, `inputs(t)` set before it."""
    instance, time, found = new().initialize(), 0.0, []
    for gap in gaps:
        found.append(instance.step(time, gap, inputs(time)).get(*names))
        time += gap
    return found


@pytest.mark.parametrize("remnant", [1e-5, 1e-6, 1e-9, 6e-17, 1e-300])
def test_a_jump_of_the_speed_over_a_remnant_of_a_step_is_not_carried_on(new, remnant):
    """The remnant before an event, as hosts make them: the speed jumps over it, then goes on."""
    gaps = [STEP] * 6 + [remnant] + [STEP] * 6
    event = 6 * STEP + remnant / 2

    def inputs(t: float) -> dict[str, float]:
        return {"machine.v": MACHINE_SPEED if t <= event else MACHINE_SPEED - 0.1}

    for ground_speed, travel in run(new, gaps, inputs, "ground.vx", "machine.s"):
        assert MACHINE_SPEED - 0.1 - 1e-12 <= ground_speed <= MACHINE_SPEED + 1e-12
        assert 0 < travel <= MACHINE_SPEED * 13 * STEP


@pytest.mark.parametrize("remnant", [1e-5, 1e-6, 1e-9, 6e-17, 1e-300])
@pytest.mark.parametrize("names", [("phi",), ("phi", "w")], ids=" ".join)
def test_a_remnant_of_a_step_does_not_spoil_the_prediction(new, names, remnant):
    signals = {"phi": angle, "w": speed}
    gaps = [STEP] * 8 + [remnant] + [STEP] * 8
    found = run(new, gaps, lambda t: {f"crank.{n}": signals[n](t) for n in names}, "tip.x", "tip.y")
    times = np.cumsum(gaps)
    worst = max(np.hypot(*(np.array(xy) - exact(new, angle(t)))) for xy, t in zip(found[5:], times[5:], strict=True))
    assert worst <= 4e-9, "a few times the error of even steps, 1e-9 m"


def test_a_speed_that_jumps_is_taken_as_it_is(new):
    """Not carried on as if it went on jumping."""
    speeds = [0.4] * 4 + [0.1] * 4
    found = run(new, [STEP] * 8, lambda t: {"machine.v": speeds[round(t / STEP)]}, "ground.vx", "ground.ax")
    assert found == [[v, 0.0] for v in speeds]


def test_acceleration_without_speed_helps_and_does_not_stop_the_crank(new):
    """crank.w was never given: it is taken from the angles."""
    acceleration = 3.0

    def inputs(t: float) -> dict[str, float]:
        return {"crank.phi": PLANTING_SPEED * t + acceleration * t * t / 2, "crank.a": acceleration}

    gaps = [0.01] * 12
    found = run(new, gaps, inputs, "tip.x", "tip.y")
    for xy, t in list(zip(found, np.cumsum(gaps), strict=True))[4:]:
        assert np.hypot(*(np.array(xy) - exact(new, inputs(t)["crank.phi"]))) <= 1e-14


def test_acceleration_without_speed_sharpens_the_acceleration(new):
    """Over the angles alone, which know it by their second differences."""

    def acceleration(t: float) -> float:
        return PLANTING_SPEED * 0.6 * math.pi * math.cos(6 * math.pi * t)

    def worst(names: tuple[str, ...]) -> float:
        signals = {"phi": angle, "a": acceleration}
        gaps = [0.01] * 60
        found = run(new, gaps, lambda t: {f"crank.{n}": signals[n](t) for n in names}, "tip.ax")
        reference = new("exact").setup().enter()
        errors = []
        for (ax,), t in zip(found, np.cumsum(gaps), strict=True):
            reference.set({"crank.phi": angle(t), "crank.w": speed(t), "crank.a": acceleration(t)})
            errors.append(abs(ax - reference.get("tip.ax")[0]))
        return max(errors[5:])

    assert worst(("phi", "a")) < 0.7 * worst(("phi",))


def test_the_second_derivative_alone_says_nothing(new):
    """A polynomial needs the first one."""
    plain, instance = new("plain").initialize(), new("derived").initialize()
    for i in range(6):
        values = {"crank.phi": angle(i * STEP), "machine.v": 0.4, "tip.fx": 1.0}
        plain.step(i * STEP, STEP, values)
        instance.set(values).set_derivatives({(name, 2): 5.0 for name in values})
        instance.step(i * STEP, STEP)
    assert instance.outputs() == plain.outputs()


def test_before_the_first_step_derivatives_of_inputs_show_in_those_of_outputs(new):
    instance = new().initialize({"crank.phi": 1.0, "crank.w": 2.0, "machine.v": 0.4})
    still = instance.get_derivatives(("tip.vx", 1), ("machine.s", 2))
    instance.set_derivatives({("crank.w", 1): 5.0, ("machine.v", 1): 0.25})
    turned = instance.get_derivatives(("tip.vx", 1), ("machine.s", 2))
    (rate,) = instance.get("tip.vx")
    assert turned[0] - still[0] == pytest.approx(5.0 * rate / 2.0, rel=1e-12)
    assert turned[1] == 0.25


def test_crank_that_jumps_in_speed_settles_within_three_steps(new):
    """A clutch: from rest to full speed at once, the speed given."""

    def inputs(t: float) -> dict[str, float]:
        run_time = max(0.0, t - 4.5 * STEP)
        return {"crank.phi": PLANTING_SPEED * run_time, "crank.w": PLANTING_SPEED * (t > 4.5 * STEP)}

    gaps = [STEP] * 14
    found = run(new, gaps, inputs, "tip.x", "tip.y")
    errors = [
        np.hypot(*(np.array(xy) - exact(new, inputs(t)["crank.phi"])))
        for xy, t in zip(found, np.cumsum(gaps), strict=True)
    ]
    assert max(errors) <= 1.5 * STEP * PLANTING_SPEED * 0.26, "less than what one and a half steps would move the tip"
    assert max(errors[8:]) <= 1e-15
