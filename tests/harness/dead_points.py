"""Geometries beside every kind of dead point."""

from __future__ import annotations

import random

from fmu_src.oracle.oracle import Oracle
from fmu_src.oracle.tables import rows
from scenarios.speed_vs_error.hard_cases.dead_points import DEAD_POINTS


def beside_dead_point(case: str, gap: float) -> tuple[dict[str, float], float]:
    """A geometry, and an angle at which it is `gap` metres from a dead point; beyond it where gap < 0."""
    length, other, side = DEAD_POINTS[case]
    chance = random.Random(case)
    while True:
        geometry, phi = dict(chance.choice(rows("geometries")).geometry), chance.uniform(-10, 10)
        pose = Oracle(geometry).pose(phi)
        base = float(abs(pose.D - pose.A) if case.startswith("ABD") else abs(pose.G - pose.E))
        geometry[length] = base + side * (geometry[other] - 1e-4)
        try:
            Oracle(geometry).pose(phi)
        except ValueError:
            continue  # the other dyad cannot close then
        if geometry[length] > 0.01:
            return geometry | {length: base + side * (geometry[other] - gap)}, phi
