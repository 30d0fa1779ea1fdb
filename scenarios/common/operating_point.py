"""The operating point that the paper publishes, which every story starts from.

Paper: Chen Jianneng et al. 2010, DOI 10.3969/j.issn.1000-1298.2010.12.010.
"""

from __future__ import annotations

import math

import numpy as np

from scenarios.common import measures

PLANTS_PER_MINUTE = 65.0
SPACING = 0.4  # plant spacing S, m
HOLE_MM = 46.7  # length of the hole at the ridge surface
TURN = 2 * math.pi
PLANTING_SPEED = TURN * PLANTS_PER_MINUTE / 60  # rad/s: one plant a turn
MACHINE_SPEED = SPACING * PLANTS_PER_MINUTE / 60  # m/s


def hole_depth(dynamic: np.ndarray) -> float | None:
    """How far in mm the ridge surface lies above the lowest point where one turn digs the published hole."""
    return measures.surface_of_hole(dynamic, HOLE_MM, (1.0, 0.6 * float(np.ptp(dynamic.imag))))
