"""What is asked of every way, and the true answer to 50 digits.

An answer is a row an angle: `crank.tau` (N m), `crank.inertia` (kg m2), `crank.tau_bias` (N m), of a machine of
plausible masses that stands, with a crank at 65 turns a minute that gains speed, and a force on the tip.
"""

from __future__ import annotations

import numpy as np
from mpmath import mp, mpf

from scenarios.common.masses import plausible
from scenarios.speed_vs_error.solving.way import SPEED, Question
from scenarios.speed_vs_error.yardstick import NOMINAL, STANDARD_GRAVITY, Dynamics, Oracle

NAMES = ("crank.tau", "crank.inertia", "crank.tau_bias")
ORDER = 2  # all three at once, and nothing less: as the core needs the second order for each torque
TORQUES = Question(
    ("torque", "inertia", "bias"), ("N m", "kg m2", "N m"), (1.0,) * 3, 1, (ORDER,), ("torque, inertia, bias",)
)
MASSES = plausible(NOMINAL)
ACCELERATION = 40.0  # rad/s2, of the crank
GRAVITY = STANDARD_GRAVITY
FORCE = (-20.0, 55.0)  # N, of the soil on the tip
LOAD = (ACCELERATION, GRAVITY, *FORCE)
ANGLES = 240


def truth(phi: np.ndarray) -> np.ndarray:
    """The answers to 50 digits, each as the unevaluated sum of two doubles: shape (angles, 3, 2)."""
    masses = {name.removeprefix("body."): value for name, value in MASSES.items()}
    at, answers = Dynamics(Oracle(NOMINAL), masses, GRAVITY), np.empty((len(phi), len(NAMES), 2))
    for row, angle in zip(answers, phi, strict=True):
        exact = at.outputs(float(angle), SPEED, ACCELERATION, (0.0, 0.0), FORCE)
        with mp.workdps(50):
            row[:, 0] = [float(exact[name]) for name in NAMES]
            row[:, 1] = [float(exact[name] - mpf(head)) for name, head in zip(NAMES, row[:, 0], strict=True)]
    return answers
