"""The crank angle that an instance's outputs belong to, found from where the nozzle is."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from fmu_src.twin.linkage import Geometry, solve

TURN = 2 * math.pi
NOZZLE = ("tip.x", "tip.y", "tip.angle")
_ARM = 0.1  # m: how far from the tip the nozzle's direction is compared


@cache
def _table() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    phi = np.linspace(0.0, TURN, 4097)[:-1]
    solution = solve(Geometry(), phi, 1)
    return phi, solution.tip[0], np.exp(1j * solution.angle[0])


def angles_of(nozzle: np.ndarray) -> np.ndarray:
    """Within one turn, to 1e-6 rad. nozzle: NOZZLE, a row each, of the nominal geometry."""
    phi, tip, direction = _table()
    place = nozzle[:, 0] + 1j * nozzle[:, 1]
    turned = np.exp(1j * nozzle[:, 2])
    off = abs(place[:, None] - tip) + _ARM * abs(turned[:, None] - direction)
    nearest = off.argmin(axis=1)
    found = phi[nearest]
    for _ in range(3):
        solution = solve(Geometry(), found, 1)
        missing = place - solution.tip[0]
        found = found + (missing * solution.tip[1].conj()).real / abs(solution.tip[1]) ** 2
    return found
