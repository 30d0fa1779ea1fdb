"""What hosts do to the crank's angle: wrap it at whole turns, turn it back, make it jump."""

from __future__ import annotations

import math
from itertools import count, pairwise

import pytest

from tests.harness.drive import (
    TIP,
    angle_and_speed,
    angle_around_zero,
    angle_modulo_turn,
    angle_only,
    drive,
    even,
    exact_tip,
    uneven,
)
from tests.harness.host import OK, PLANTING_SPEED, Instance, bits

STEP = 10e-3
TURN = 2 * math.pi


def angle_modulo_turn_and_speed(rotation, t):
    return angle_and_speed(rotation, t)[0] | angle_modulo_turn(rotation, t)[0], {}


# ---- angles modulo one turn ----------------------------------------------------------------------


@pytest.mark.parametrize("at_end", [False, True])
@pytest.mark.parametrize("speed", [PLANTING_SPEED, -PLANTING_SPEED])
@pytest.mark.parametrize("giving", [angle_modulo_turn, angle_around_zero, angle_modulo_turn_and_speed])
def test_wraps_leave_no_trace(new, giving, speed, at_end):
    """Cut at 0 or at half a turn, in both directions: as if the angle went on."""
    rotation, times = even(speed), [i * STEP for i in range(300)]
    instance = new(logging=True)
    instance.initialize({"crank.at_step_end": at_end, **giving(rotation, 0.0)[0]})
    off = abs(drive(instance, rotation, times, giving, given_at_end=at_end) - exact_tip(rotation, times[1:]))[5:]
    # what the rounding of the angle, 4e-16 rad, comes to in an extrapolation and in differences over 10 ms
    assert off[:, :2].max() <= 5e-15 and off[:, 2:4].max() <= 1e-12 and off[:, 4:].max() <= 1e-10

    given = [giving(rotation, t)[0]["crank.phi"] for t in (times if at_end else times[:-1])]
    wraps = sum(abs(b - a) > math.pi for a, b in pairwise(given))
    assert wraps >= 3
    assert [message.category for message in instance.messages] == ["logEvents"] * wraps
    assert all("whole turns" in message.text and message.status == OK for message in instance.messages)


def test_wraps_in_an_uneven_rotation(new):
    """The prediction beside a wrap is the one that the unbounded angle gives."""
    times = [i * STEP for i in range(200)]
    wrapped = drive(new().initialize(), uneven(), times, angle_modulo_turn)
    unbounded = drive(new().initialize(), uneven(), times, angle_only)
    assert abs(wrapped - unbounded)[:, :2].max() <= 1e-14


def test_several_turns_at_once(new):
    """A host that counts turns elsewhere: any whole number of turns is no movement."""
    instance, plain = new().initialize(), new().initialize()
    for i in range(12):
        angle = PLANTING_SPEED * i * STEP
        instance.step(i * STEP, STEP, {"crank.phi": angle + TURN * (0, 3, -7, 100)[i % 4]})
        plain.step(i * STEP, STEP, {"crank.phi": angle})
        assert instance.get(*TIP) == pytest.approx(plain.get(*TIP), abs=1e-8)


# ---- jumps ---------------------------------------------------------------------------------------


def instance_at_speed(new, steps: int = 8, **options) -> Instance:
    instance = new(**options).initialize()
    for i in range(steps):
        instance.step(i * STEP, STEP, {"crank.phi": PLANTING_SPEED * i * STEP})
    return instance


@pytest.mark.parametrize("giving", [angle_only, angle_and_speed])
@pytest.mark.parametrize("jump", [math.pi / 2 + 0.01, -2.5, math.pi, TURN + 2, -3 * TURN - 2])
def test_a_jump_restarts_the_history(new, jump, giving):
    """From the jump on, outputs are those of an instance that starts there."""
    start, at = 8 * STEP, even(PLANTING_SPEED)
    jumped, fresh = new().initialize(), new().initialize(start=start)
    drive(jumped, at, [i * STEP for i in range(9)], giving)
    for i in range(8, 14):
        values = giving(at, i * STEP)[0]
        values["crank.phi"] += jump
        for instance in (jumped, fresh):
            instance.step(i * STEP, STEP, values)
        assert bits(jumped.get(*TIP)) == bits(fresh.get(*TIP)), f"step {i}"


@pytest.mark.parametrize("off", [1.5, -1.5, TURN + 1.5, 5 * TURN - 1.5])
def test_up_to_a_quarter_turn_is_a_movement(new, off):
    """Less than a quarter turn off what was expected, whole turns aside: the history goes on."""
    instance = instance_at_speed(new, logging=True)
    at_jump = PLANTING_SPEED * 8 * STEP + off
    instance.step(8 * STEP, STEP, {"crank.phi": at_jump})
    assert not any("restarts" in message.text for message in instance.messages)
    held = new().initialize({"crank.phi": at_jump}).get("tip.x", "tip.y")
    assert instance.get("tip.x", "tip.y") != pytest.approx(held, abs=1e-6)


def test_the_expected_angle_is_where_the_last_step_ended(new):
    """A fast crank moves far in a step: that is no jump, standing still is."""
    speed, step = 30.0, 0.1  # 3 rad a step
    instance = new(logging=True).initialize()
    for i in range(6):
        instance.step(i * step, step, {"crank.phi": speed * i * step, "crank.w": speed})
    assert instance.messages == []
    instance.step(6 * step, step, {"crank.phi": speed * 5 * step, "crank.w": speed})
    assert "restarts" in instance.last_message.text


def test_a_jump_is_logged(new):
    """As an event with angles and time; it is the host that knows whether it was meant."""
    instance = instance_at_speed(new, logging=True)
    before = PLANTING_SPEED * 7 * STEP
    instance.step(8 * STEP, STEP, {"crank.phi": 4.25})
    (message,) = instance.messages
    assert (message.status, message.category) == (OK, "logEvents")
    for part in ("crank.phi", repr(before)[:8], "4.25 rad", "0.08 s"):
        assert part in message.text
    instance.step(9 * STEP, STEP)
    assert len(instance.messages) == 1


def test_nothing_is_logged_where_logging_is_off(new):
    instance = instance_at_speed(new)
    instance.step(8 * STEP, STEP, {"crank.phi": 4.25})
    instance.step(9 * STEP, STEP, {"crank.phi": 4.25 + TURN})
    assert instance.messages == []


# ---- standing still, turning back ----------------------------------------------------------------


def test_a_crank_that_stands_still(new):
    instance = new().initialize({"crank.phi": 2.0})
    expected = instance.get(*TIP)
    for i in range(6):
        instance.step(i * STEP, STEP)
        assert bits(instance.get(*TIP)) == bits(expected)


def test_a_crank_that_turns_back_within_a_step(new):
    """From full speed forward to full speed backward: the history forgets the turning within four samples."""
    instance, angle = new().initialize(), 1.0
    for i, speed in zip(count(), [PLANTING_SPEED] * 8 + [-PLANTING_SPEED] * 8):
        instance.step(i * STEP, STEP, {"crank.phi": angle})
        angle += speed * STEP
    expected = new().initialize({"crank.phi": angle, "crank.w": -PLANTING_SPEED}).get(*TIP)
    found = instance.get(*TIP)
    assert found[:2] == pytest.approx(expected[:2], abs=1e-14)
    assert found[2:] == pytest.approx(expected[2:], abs=1e-10)
