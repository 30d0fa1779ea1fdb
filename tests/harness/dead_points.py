"""Geometries beside every kind of dead point."""

from __future__ import annotations

import random

from fmu_src.oracle.oracle import Oracle
from fmu_src.oracle.tables import rows

# The length that brings a dyad to its dead point, the dyad's other link, and 1 where the links fold there, -1 where
# they stretch: length = base + side * (other link) at the dead point itself.
DEAD_POINTS = {
    "ABD stretched": ("L2", "L3", -1),
    "ABD folded, AB longer": ("L2", "L3", 1),
    "ABD folded, DB longer": ("L3", "L2", 1),
    "EFG stretched": ("L7", "L6", -1),
    "EFG folded, GF longer": ("L7", "L6", 1),
    "EFG folded, EF longer": ("L6", "L7", 1),
}


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
