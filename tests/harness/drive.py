"""Known motions, and a host that drives an instance along them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fmu_src.twin.linkage import Geometry, solve
from tests.harness.host import PLANTING_SPEED, Instance

TIP = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay")


@dataclass(frozen=True)
class Rotation:
    """How a crank turns: angle and derivatives as functions of time."""

    phi: Callable[[float], float]
    w: Callable[[float], float]
    a: Callable[[float], float]


def uneven() -> Rotation:
    """Planting speed that swings by a tenth, three times a second."""
    speed, share, pulse = PLANTING_SPEED, 0.1, 6 * math.pi
    return Rotation(
        phi=lambda t: speed * (t + share * (1 - math.cos(pulse * t)) / pulse),
        w=lambda t: speed * (1 + share * math.sin(pulse * t)),
        a=lambda t: speed * share * pulse * math.cos(pulse * t),
    )


def swinging() -> Rotation:
    """To and fro about 1 rad: the crank reverses, its speed passes 0."""
    reach, pulse = 1.2, 2 * math.pi
    return Rotation(
        phi=lambda t: 1 + reach * math.sin(pulse * t),
        w=lambda t: reach * pulse * math.cos(pulse * t),
        a=lambda t: -reach * pulse**2 * math.sin(pulse * t),
    )


def growing() -> Rotation:
    """All derivatives grow alike: none is 0 at an instant by chance."""
    return Rotation(phi=lambda t: math.exp(2 * t), w=lambda t: 2 * math.exp(2 * t), a=lambda t: 4 * math.exp(2 * t))


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


def one_derivative(r: Rotation, t: float) -> Given:
    return {"crank.phi": r.phi(t)}, {("crank.phi", 1): r.w(t)}


def two_derivatives(r: Rotation, t: float) -> Given:
    return {"crank.phi": r.phi(t)}, {("crank.phi", 1): r.w(t), ("crank.phi", 2): r.a(t)}


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
    solution = solve(Geometry(), phi, 2)
    vectors = (solution.tip[0], solution.velocity(w), solution.acceleration(w, a))
    return np.column_stack([part for vector in vectors for part in (vector.real, vector.imag)])


def distances(found: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """How far apart the tips are, in m, a number a step."""
    return np.hypot(found[:, 0] - exact[:, 0], found[:, 1] - exact[:, 1])


def order_of_convergence(steps: Sequence[float], errors: Sequence[float]) -> float:
    """The slope of log(error) over log(step)."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
