"""Motions of a crank, what a host gives of them, a host that drives an instance along them, and a story to replay."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.common.instance import Instance
from scenarios.common.linkage import TIP
from scenarios.speed_vs_error.yardstick import twin

# ---- motions, and what a host gives of them ------------------------------------------------------


@dataclass(frozen=True)
class Rotation:
    """How a crank turns: angle and derivatives as functions of time."""

    phi: Callable[[float], float]
    w: Callable[[float], float]
    a: Callable[[float], float]


def swinging() -> Rotation:
    """To and fro about 1 rad: the crank reverses, its speed passes 0."""
    reach, pulse = 1.2, 2 * math.pi
    return Rotation(
        phi=lambda t: 1 + reach * math.sin(pulse * t),
        w=lambda t: reach * pulse * math.cos(pulse * t),
        a=lambda t: -reach * pulse**2 * math.sin(pulse * t),
    )


def even(speed: float) -> Rotation:
    return Rotation(phi=lambda t: speed * t, w=lambda t: speed, a=lambda t: 0.0)


# What a host gives of a rotation at one instant: (values of inputs, derivatives of inputs).
Given = tuple[dict[str, float], dict[tuple[str, int], float]]
Giving = Callable[[Rotation, float], Given]


def angle_only(r: Rotation, t: float) -> Given:
    return {"crank.phi": r.phi(t)}, {}


def angle_modulo_turn(r: Rotation, t: float) -> Given:
    """As an encoder counts: from 0 up to one turn."""
    return {"crank.phi": r.phi(t) % (2 * math.pi)}, {}


def angle_around_zero(r: Rotation, t: float) -> Given:
    """As an arc tangent gives it: from half a turn back to half a turn forth."""
    return {"crank.phi": math.remainder(r.phi(t), 2 * math.pi)}, {}


def angle_and_speed(r: Rotation, t: float) -> Given:
    return {"crank.phi": r.phi(t), "crank.w": r.w(t)}, {}


def angle_speed_acceleration(r: Rotation, t: float) -> Given:
    return {"crank.phi": r.phi(t), "crank.w": r.w(t), "crank.a": r.a(t)}, {}


def drive(
    instance: Instance,
    rotation: Rotation,
    times: Sequence[float],
    giving: Giving,
    outputs: Sequence[str] = TIP,
    given_at_end: bool = False,
) -> np.ndarray:
    """Steps from each time to the next; the outputs after each, a row a step.

    The inputs of a step are those of its start or, with `given_at_end`, of its end.
    """
    rows = []
    for start, end in itertools.pairwise(times):
        values, derivatives = giving(rotation, end if given_at_end else start)
        instance.set(values)
        if derivatives:
            instance.set_derivatives(derivatives)
        instance.step(start, end - start)
        rows.append(instance.get(*outputs))
    return np.array(rows)


def exact_tip(rotation: Rotation, times: Sequence[float]) -> np.ndarray:
    """The outputs TIP as they are at these times."""
    phi, w, a = (np.array([law(t) for t in times]) for law in (rotation.phi, rotation.w, rotation.a))
    solution = twin.solve(twin.Geometry(), phi, 2)
    vectors = (solution.tip[0], solution.velocity(w), solution.acceleration(w, a))
    return np.column_stack([part for vector in vectors for part in (vector.real, vector.imag)])


def distances(found: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """How far apart the tips are, in m, a number a step."""
    return np.hypot(found[:, 0] - exact[:, 0], found[:, 1] - exact[:, 1])


# ---- a story of steps of every kind --------------------------------------------------------------

STEP = 10e-3
OPEN = {"geometry.L2": 0.097, "geometry.L3": 0.097}  # dyad ABD cannot close between 5.60 and 5.89 rad
OPEN_ANGLE = 5.75
END = 40  # steps of the story


def in_initialization(instance: Instance) -> Instance:
    return instance.setup().enter().set(OPEN | {"crank.phi": 1.0})


def between_steps(instance: Instance) -> Instance:
    in_initialization(instance).exit()
    for i in range(3):
        instance.step(i * STEP, STEP, {"crank.phi": 1 + 0.06 * i, "crank.w": 6.0, "machine.v": 0.4})
    return instance


def tell(instance: Instance, first: int, last: int) -> list[str]:
    """Steps number `first` to `last` of a story with all that a component remembers; the bits of all outputs."""
    told = []
    time = story_time(first)
    for i in range(first, last):
        step = STEP * (1 + i % 3)
        instance.set({"crank.phi": 0.05 * i + 1e-3 * i * i, "machine.v": 0.4 + 0.01 * i, "tip.fy": -3.0 * i})
        if i % 7 == 3:
            instance.set_derivatives({("crank.phi", 1): 5.0, ("machine.v", 2): 0.3, ("tip.fx", 1): 9.0})
        if i > 20:
            instance.set({"crank.w": 5 + 0.1 * i})
        if i > 30:
            instance.set({"crank.a": 8.0})
        instance.step(time, step)
        time += step
        told += [value.hex() for value in instance.outputs()]
    return told


def story_time(number: int) -> float:
    """When step `number` begins."""
    time = 0.0
    for i in range(number):
        time += STEP * (1 + i % 3)
    return time


def begin(instance: Instance, at_step_end: bool = False) -> Instance:
    return instance.initialize({"crank.at_step_end": at_step_end, "geometry.L1": 0.0501, "machine.s": 4.0}, stop=9.0)


# ---- a serialized state --------------------------------------------------------------------------

HEADER = 40  # bytes: magic, version, interface, payload size, checksum


def fnv1a(content: bytes) -> int:
    """The checksum of a serialized state, for those who would fit their own content with it."""
    value = 0xCBF29CE484222325
    for byte in content:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value
