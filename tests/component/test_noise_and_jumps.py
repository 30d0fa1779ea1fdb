"""What a component makes of samples that are not smooth: jumps of a speed, and noise with crank.smoothing."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from fmu_src.twin.linkage import Geometry, solve
from tests.harness.drive import (
    Rotation,
    angle_and_speed,
    angle_modulo_turn,
    angle_only,
    angle_speed_acceleration,
    distances,
    drive,
    exact_tip,
    uneven,
)
from tests.harness.host import PLANTING_SPEED, bits

STEP = 1e-3
COUNT = 2**20  # of the encoder, a turn
GIVING = {"angle": angle_only, "speed": angle_and_speed}


def clutch(at: float) -> Rotation:
    """Planting speed, and half of it from an instant on."""
    return Rotation(
        phi=lambda t: PLANTING_SPEED * (min(t, at) + max(t - at, 0.0) / 2),
        w=lambda t: PLANTING_SPEED * (1.0 if t < at else 0.5),
        a=lambda t: 0.0,
    )


def counted(r: Rotation, t: float):
    """The angle to the nearest count of an encoder."""
    return {"crank.phi": round(r.phi(t) * COUNT / (2 * math.pi)) * (2 * math.pi / COUNT)}, {}


# ---- jumps of the speed --------------------------------------------------------------------------


def missed(new, giving, rotation: Rotation, times: list[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """After each step, by how much angle, speed and acceleration are off, in jumps of the speed over such a step."""
    off = drive(new().initialize(), rotation, times, giving) - exact_tip(rotation, times[1:])
    angles = np.array([rotation.phi(t) for t in times[1:]])
    jump = np.abs(solve(Geometry(), angles, 1).tip[1]) * PLANTING_SPEED / 2
    return tuple(np.hypot(off[:, n], off[:, n + 1]) / jump * STEP ** (n // 2 - 1) for n in (0, 2, 4))


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.75, 0.999])
@pytest.mark.parametrize("given", GIVING)
def test_a_jump_of_the_speed_is_not_carried_on(new, given, share):
    """Nothing is left after the samples have passed it, and until then no step misses by more than the jump.

    `share`: of the step, before the jump. What comes between two samples cannot be foreseen: where the angle alone is
    given, such a jump is seen as two smaller ones, and one step may miss a quarter more, its speed twice as much.
    """
    rotation, times = clutch((20 + share) * STEP), [i * STEP for i in range(40)]
    angle, speed, _ = missed(new, GIVING[given], rotation, times)
    assert angle[5:20].max() < 1e-6
    is_seen_at_once = given == "speed" or share in (0.0, 0.999)
    assert angle[20:25].max() <= (1.05 if is_seen_at_once else 1.25)
    assert angle[21 if given == "speed" else 24 :].max() < 1e-6
    assert speed[20:].max() <= (1.05 if is_seen_at_once else 2.05)


@pytest.mark.parametrize("short", [1e-3, 0.04, 0.06, 0.5])
@pytest.mark.parametrize("given", GIVING)
def test_a_jump_that_the_host_has_located(new, given, short):
    """A short step to the instant of the jump, as of a host that looks for events: it makes nothing worse."""
    at = (20 + short) * STEP
    times = [*(i * STEP for i in range(21)), *(at + i * STEP for i in range(20))]
    rotation = clutch(at)
    angle, speed, _ = missed(new, GIVING[given], rotation, times)
    first = 1.05 if given == "angle" else 1e-6  # where the speed is given it is known at once
    assert angle[21] <= first and speed[21] <= first
    assert angle[22:].max() < 1e-6 and speed[22:].max() < 1e-6


def test_a_jump_of_the_speed_leaves_no_acceleration(new):
    """With the speed given, the acceleration is never that of a parabola across the jump."""
    rotation, times = clutch(20 * STEP), [i * STEP for i in range(40)]
    assert missed(new, angle_and_speed, rotation, times)[2][20:].max() < 0.05


@pytest.mark.parametrize("given", GIVING)
def test_a_smooth_signal_is_no_jump(new, given):
    """Sampled nine times a ripple, the polynomial still goes on unlimited: the error is that of its order."""
    step = 1 / 27
    times = [i * step for i in range(80)]
    off = distances(drive(new().initialize(), uneven(), times, GIVING[given]), exact_tip(uneven(), times[1:]))
    assert off[5:].max() < {"angle": 2.2e-3, "speed": 0.8e-3}[given]


# ---- smoothing -----------------------------------------------------------------------------------


def worst(new, giving, smoothing: float, step: float = STEP) -> np.ndarray:
    """Of position, velocity and acceleration, in SI units, once the window is full."""
    times = [i * step for i in range(round(1.2 / step))]
    found = drive(new().initialize({"crank.smoothing": smoothing}), uneven(), times, giving)
    off = (found - exact_tip(uneven(), times[1:]))[round(0.2 / step) :]
    return np.hypot(off[:, 0::2], off[:, 1::2]).max(axis=0)


def test_smoothing_makes_a_noisy_angle_useful(new):
    """A 20-bit encoder sampled each millisecond: acceleration 30 times better, nothing worse."""
    plain, smooth = worst(new, counted, 0.0), worst(new, counted, 12e-3)
    assert plain[2] > 5.0 and smooth[2] < 0.25
    assert (smooth < plain * (0.4, 0.2, 1 / 30)).all()


def test_smoothing_of_exact_angles_costs_its_window(new):
    """Where there is no noise the fit lags by the fourth power of its window."""
    lags = [worst(new, angle_only, window)[0] for window in (0.02, 0.04)]
    assert 8 < lags[1] / lags[0] < 20
    assert lags[0] < 5e-6


@pytest.mark.parametrize("smoothing", [1e-300, 1e-3, 0.05, 3.0, 1000.0])
@pytest.mark.parametrize("given", [angle_only, angle_and_speed, angle_speed_acceleration, angle_modulo_turn])
def test_polynomials_pass_unchanged(new, given, smoothing):
    """Of the degree that the fit has, over steps that vary by a million, wrapped or not: to rounding."""
    jerk = 3.0
    rotation = Rotation(
        phi=lambda t: 6 * t + t**2 + jerk * t**3 / 6, w=lambda t: 6 + 2 * t + jerk * t**2 / 2, a=lambda t: 2 + jerk * t
    )
    lengths = itertools.islice(itertools.cycle((1e-3, 1e-2, 1e-2, 2e-2, 1e-7, 1e-8, 5e-3)), 100)
    times = list(itertools.accumulate(lengths, initial=0.0))
    found = drive(new().initialize({"crank.smoothing": smoothing}), rotation, times, given)
    off = (found - exact_tip(rotation, times[1:]))[6:]
    assert np.isfinite(found).all()
    # rates of the shortest steps are what rounding leaves of them; those of the longer ones are exact again
    after_long_steps = np.diff(times)[6:] >= 1e-3
    assert np.hypot(off[:, 0], off[:, 1])[after_long_steps].max() < 1e-8


@pytest.mark.parametrize("smoothing", [1e-3, 0.05])
@pytest.mark.parametrize("shortest", [1e-9, 1e-7, 1e-5])
def test_noise_over_very_different_steps(new, shortest, smoothing):
    """Samples that all but coincide, seen over a long step, say nothing of a slope."""
    lengths = itertools.islice(itertools.cycle((*[shortest] * 5, 5e-3, 5e-3)), 300)
    times = list(itertools.accumulate(lengths, initial=0.0))

    def noisy(r: Rotation, t: float):
        return {"crank.phi": r.phi(t) + 1e-6 * math.sin(1e4 * t / shortest)}, {}

    found = drive(new().initialize({"crank.smoothing": smoothing}), uneven(), times, noisy)
    off = distances(found, exact_tip(uneven(), times[1:]))
    assert off[40:].max() < 2e-4, "once there have been as many long steps as the fit has coefficients"


def test_smoothing_sees_no_wraps(new):
    """An angle modulo one turn is smoothed as the unbounded one."""
    times = [i * 5e-3 for i in range(400)]
    wrapped, plain = (
        drive(new().initialize({"crank.smoothing": 0.05}), uneven(), times, giving)
        for giving in (angle_modulo_turn, angle_only)
    )
    assert distances(wrapped, plain).max() < 1e-13


def test_a_jump_of_the_angle_restarts_the_fit(new):
    """From there on outputs are those of an instance that starts there."""
    start, jumped, fresh = 30 * STEP, new().initialize({"crank.smoothing": 0.02}), new()
    fresh.initialize({"crank.smoothing": 0.02}, start=start)
    drive(jumped, uneven(), [i * STEP for i in range(31)], angle_only)
    for i in range(30, 50):
        values = {"crank.phi": uneven().phi(i * STEP) + 2.5}
        found = [instance.step(i * STEP, STEP, values).get("tip.x", "tip.ay") for instance in (jumped, fresh)]
        assert bits(found[0]) == bits(found[1])


@pytest.mark.parametrize("at_step_end", [False, True])
@pytest.mark.parametrize("of", ["crank.phi", "crank.w"])
def test_derivatives_of_the_host_are_not_smoothed(new, of, at_step_end):
    """They say what the angle, or the speed, does: the fit counts for nothing."""
    instance, plain = (
        new().initialize({"crank.smoothing": window, "crank.at_step_end": at_step_end}) for window in (0.02, 0.0)
    )
    for i in range(20):
        for one in (instance, plain):
            one.set({"crank.phi": 7 * i * STEP + 1e-3 * math.sin(i)})
            if of == "crank.w":
                one.set({"crank.w": 7 + math.sin(i)})
            one.set_derivatives({(of, 1): 7.0, (of, 2): 1.0})
            one.step(i * STEP, STEP)
        assert bits(instance.outputs()) == bits(plain.outputs())


def test_the_fit_is_part_of_the_state(new):
    instance = new().initialize({"crank.smoothing": 0.02})
    times = [i * STEP for i in range(60)]
    drive(instance, uneven(), times[:30], counted)
    state = instance.serialize()
    first = drive(instance, uneven(), times[29:], counted)
    again = drive(new().deserialize(state), uneven(), times[29:], counted)
    assert bits(first.ravel()) == bits(again.ravel())
