"""How a crank may turn, and what a host with an ideal or a plain sensor reads of it.

Angles in rad count in the working direction, clockwise; time in s. All functions take and
return arrays.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenarios.common.linkage import Motion
from scenarios.common.operating_point import PLANTING_SPEED, TURN

ENCODER_COUNTS = 2**20  # a turn


@dataclass(frozen=True)
class Profile:
    """One way to turn.

    ``motion`` is what the crank does at given times. ``reading`` is the angle that the host
    gives instead of the true one; speed and acceleration it gives as they are.
    ``duration`` in s is long enough for the worst case to occur. ``remark`` is for the reader
    of its table.
    """

    key: str
    title: str
    duration: float
    motion: Callable[[np.ndarray], Motion]
    reading: Callable[[np.ndarray], np.ndarray] = lambda phi: phi
    remark: str = ""


def constant(time: np.ndarray) -> Motion:
    """Planting speed."""
    return Motion(PLANTING_SPEED * time, np.full_like(time, PLANTING_SPEED), np.zeros_like(time))


def ripple(time: np.ndarray) -> Motion:
    """Planting speed that swings by 10 %, three times a second."""
    share, pulse = 0.1, 6 * math.pi
    return Motion(
        PLANTING_SPEED * (time + share * (1 - np.cos(pulse * time)) / pulse),
        PLANTING_SPEED * (1 + share * np.sin(pulse * time)),
        PLANTING_SPEED * share * pulse * np.cos(pulse * time),
    )


def start(time: np.ndarray) -> Motion:
    """From rest to planting speed within 1 s; acceleration and jerk begin and end at 0."""
    x = np.minimum(time, 1.0)
    return Motion(
        PLANTING_SPEED * (x**4 * (2.5 - 3 * x + x**2) + np.maximum(time - 1.0, 0.0)),
        PLANTING_SPEED * x**3 * (10 - 15 * x + 6 * x**2),
        PLANTING_SPEED * 30 * x**2 * (1 - x) ** 2,
    )


def clutch(time: np.ndarray) -> Motion:
    """Planting speed and half of it by turns: a clutch changes over at once, 26 times in 12 s.

    The change-overs meet the crank at many angles and the communication step at many
    fractions, so that the worst of them is nearly the worst there can be.
    """
    first, apart = 0.3141592653, 0.4567890123  # s; in no simple ratio to a step or a turn
    slow_and_fast = 2 * apart
    since = time - first
    share = np.mod(since, slow_and_fast)
    slow = np.where(since < 0, 0.0, np.floor(since / slow_and_fast) * apart + np.minimum(share, apart))
    is_slow = (since >= 0) & (share < apart)
    return Motion(PLANTING_SPEED * (time - slow / 2), PLANTING_SPEED * np.where(is_slow, 0.5, 1.0), np.zeros_like(time))


def counted(phi: np.ndarray) -> np.ndarray:
    """The angle as an encoder of 20 bits reads it, to the nearest count."""
    return np.round(phi * (ENCODER_COUNTS / TURN)) * (TURN / ENCODER_COUNTS)


def within_a_turn(phi: np.ndarray) -> np.ndarray:
    """The angle from 0 up to one turn."""
    return np.mod(phi, TURN)


# In 12 s turn and ripple have met in every way: 13 turns, 36 ripples.
PROFILES = (
    Profile("constant", "constant speed", 3.0, constant),
    Profile("ripple", "10 % ripple at 3 Hz", 12.0, ripple),
    Profile("start", "start from rest", 3.0, start),
    Profile(
        "clutch",
        "speed steps of a clutch",
        12.0,
        clutch,
        remark=(
            "Planting speed and half of it by turns, 26 sudden changes. `crank.a` is 0 at every sample here, which the "
            "FMU takes for not connected: the rung with the acceleration is that with the speed."
        ),
    ),
    Profile(
        "encoder",
        "ripple, 20-bit encoder",
        12.0,
        ripple,
        counted,
        ("The angle is rounded to one of 2^20 counts a turn; speed, acceleration and derivatives are given exactly."),
    ),
    Profile("modulo", "ripple, angle modulo one turn", 12.0, ripple, within_a_turn),
)
