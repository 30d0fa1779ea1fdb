"""The best balance for a wish: sequential quadratic programming (SciPy's SLSQP) on exact gradients.

A peak, the greatest of many values, has no gradient; its bound has: the search makes a number as small as it can that
no value of the turn exceeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from scenarios.balancing.machine import NAMES, Balancing, Machine, Turn

HEAVIEST, REACH = 2.0, 0.08  # kg, m: a counterweight that can be built, and its way round O without touching
STIFFEST = 3000.0  # N/m
SHORTEST, LONGEST = 0.06, 0.25  # m: free length of the spring
STRETCH = 1.8  # of its free length, at most
ANCHOR = 0.35  # m from O, either way, on the machine's frame
UNITS = np.array([1.0, 0.05, 0.05, 1000.0, 0.1, 0.1, 0.1])  # in which the search sees NAMES
LOWER = np.array([0.0, -REACH, -REACH, 0.0, SHORTEST, -ANCHOR, -ANCHOR])
UPPER = np.array([HEAVIEST, REACH, REACH, STIFFEST, LONGEST, ANCHOR, ANCHOR])
COUNTERWEIGHT, SPRING = NAMES[:3], NAMES[3:]
LIGHT = 1e-3  # of the goal a kilogram: of two that balance alike the lighter


@dataclass(frozen=True)
class Wish:
    """What is to become least, and by which of NAMES."""

    key: str
    title: str
    goal: str  # "torque", "loaded" (torque with the soil's) or "force"
    peak: bool
    free: tuple[str, ...]


WISHES = (
    Wish("rms", "counterweight, least rms torque", "torque", False, COUNTERWEIGHT),
    Wish("peak", "counterweight, least peak torque", "torque", True, COUNTERWEIGHT),
    Wish("force", "counterweight, least peak shaking", "force", True, COUNTERWEIGHT),
    Wish("spring", "spring, least peak torque", "torque", True, SPRING),
    Wish("loaded", "both, least peak torque in soil", "loaded", True, NAMES),
)
# Above, below, before and behind O; for the counterweight opposite the crank and across it.
STARTS = tuple(
    Balancing(
        0.5, REACH / 2 * math.cos(at), REACH / 2 * math.sin(at), 500.0, 0.12, -0.2 * math.sin(at), 0.2 * math.cos(at)
    )
    for at in (0.5 * math.pi, math.pi, 1.5 * math.pi, 0.0)
)


def size(turn: Turn, goal: str) -> np.ndarray:
    """|torque|, |torque with the soil's| or |shaking force| at each pose."""
    return abs({"torque": turn.torque, "loaded": turn.torque + turn.soil, "force": turn.force}[goal])


def peak(turn: Turn, goal: str) -> float:
    return float(size(turn, goal).max())


def rms(turn: Turn, goal: str) -> float:
    return float(np.sqrt(np.mean(size(turn, goal) ** 2)))


def sizes_by(turn: Turn, goal: str) -> np.ndarray:
    """The gradient of `size`, a row each pose."""
    by = turn.force_by if goal == "force" else turn.torque_by
    value = {"torque": turn.torque, "loaded": turn.torque + turn.soil, "force": turn.force}[goal]
    return np.real(np.conj(value)[:, None] * by) / np.maximum(abs(value), 1e-12)[:, None]


def rms_by(turn: Turn, goal: str) -> np.ndarray:
    """The gradient of `rms`."""
    return np.mean(size(turn, goal)[:, None] * sizes_by(turn, goal), axis=0) / max(rms(turn, goal), 1e-12)


def search(machine: Machine, speed: float, wish: Wish, done: Callable[[], object] = lambda: None) -> Balancing:
    """The best of the searches from STARTS at ``speed`` in rad/s; never worse than nothing at all."""
    measure = peak if wish.peak else rms
    nothing = machine.turn(Balancing(), speed, gradients=False)
    best, least = Balancing(), measure(nothing, wish.goal)
    for start in STARTS:
        found = _from(machine, speed, wish, start)
        reached = measure(machine.turn(found, speed, gradients=False), wish.goal)
        if is_buildable(found, machine) and reached < least:
            best, least = found, reached
        done()
    return best


def is_buildable(b: Balancing, machine: Machine, slack: float = 1e-6) -> bool:
    """Whether it keeps to the bounds, to within rounding of them."""
    values = np.array([getattr(b, name) for name in NAMES])
    used = [not name.startswith(("free", "anchor")) or b.stiffness > 0 for name in NAMES]
    inside = (values >= LOWER - slack * UNITS) & (values <= UPPER + slack * UNITS)
    lengths = abs(machine.joint - complex(b.anchor_x, b.anchor_y))
    fits = not b.stiffness or bool(lengths.min() >= b.free - slack and lengths.max() <= STRETCH * b.free + slack)
    return bool(inside[used].all()) and b.reach <= REACH + slack and fits


def _from(machine: Machine, speed: float, wish: Wish, start: Balancing) -> Balancing:
    """SLSQP in scaled variables; for a peak the last one is the bound."""
    columns = [NAMES.index(name) for name in wish.free]
    units = UNITS[columns]
    base = replace(start, **{name: 0.0 for name in ("mass", "stiffness") if name not in wish.free})
    known: dict[bytes, tuple[Balancing, Turn]] = {}

    def at(z: np.ndarray) -> tuple[Balancing, Turn]:
        given = z[: len(columns)]
        if (key := given.tobytes()) not in known:
            b = replace(base, **{NAMES[c]: float(v) for c, v in zip(columns, given * units, strict=True)})
            known.clear()
            known[key] = b, machine.turn(b, speed)
        return known[key]

    def by(rows: np.ndarray) -> np.ndarray:
        return rows[..., columns] * units

    scale = rms(machine.turn(Balancing(), speed, gradients=False), wish.goal)
    light = np.zeros(len(columns) + wish.peak)
    if "mass" in wish.free:
        light[0] = LIGHT

    def goal(z: np.ndarray) -> float:
        return float((z[-1] if wish.peak else rms(at(z)[1], wish.goal) / scale) + light @ z)

    def goal_by(z: np.ndarray) -> np.ndarray:
        if wish.peak:
            return np.append(np.zeros(len(columns)), 1.0) + light
        return by(rms_by(at(z)[1], wish.goal)) / scale + light

    rows = slice("mass" not in wish.free, 3 if "stiffness" in wish.free else 1)
    constraints = [
        {
            "type": "ineq",
            "fun": lambda z: room(at(z)[0], machine)[rows],
            "jac": lambda z: padded(room_by(at(z)[0])[rows]),
        }
    ]

    def padded(rows: np.ndarray) -> np.ndarray:
        mine = by(rows)
        return np.hstack((mine, np.zeros((len(mine), 1)))) if wish.peak else mine

    def room_below_peak(z: np.ndarray) -> np.ndarray:
        return z[-1] - size(at(z)[1], wish.goal) / scale

    def room_below_peak_by(z: np.ndarray) -> np.ndarray:
        rows = -by(sizes_by(at(z)[1], wish.goal)) / scale
        return np.hstack((rows, np.ones((len(rows), 1))))

    begin = np.array([getattr(base, name) for name in wish.free]) / units
    bounds = list(zip(LOWER[columns] / units, UPPER[columns] / units, strict=True))
    if wish.peak:
        constraints.append({"type": "ineq", "fun": room_below_peak, "jac": room_below_peak_by})
        begin = np.append(begin, peak(at(begin)[1], wish.goal) / scale)
        bounds.append((0.0, None))
    found = minimize(
        goal, begin, jac=goal_by, method="SLSQP", bounds=bounds, constraints=constraints,
        options={"maxiter": 60, "ftol": 1e-7},
    )  # fmt: skip
    return at(np.clip(found.x, [low for low, _ in bounds], [np.inf if high is None else high for _, high in bounds]))[0]


def room(b: Balancing, machine: Machine) -> np.ndarray:
    """What must not be negative: the counterweight within reach, the spring neither slack nor overstretched."""
    radius = abs(machine.joint[0])
    away = math.hypot(b.anchor_x, b.anchor_y)
    return np.array(
        [
            (REACH**2 - b.reach**2) / REACH**2,
            (away - radius - b.free) / SHORTEST,
            (STRETCH * b.free - away - radius) / SHORTEST,
        ]
    )


def room_by(b: Balancing) -> np.ndarray:
    """The gradient of `room`, a column each of NAMES."""
    away = max(math.hypot(b.anchor_x, b.anchor_y), 1e-9)
    toward = b.anchor_x / away / SHORTEST, b.anchor_y / away / SHORTEST
    return np.array(
        [
            [0.0, -2 * b.x / REACH**2, -2 * b.y / REACH**2, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, -1 / SHORTEST, *toward],
            [0.0, 0.0, 0.0, 0.0, STRETCH / SHORTEST, -toward[0], -toward[1]],
        ]
    )
