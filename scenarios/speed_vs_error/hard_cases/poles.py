"""The poles of the printed formulas: angles at which they divide by zero though the linkage is at ease there.

Equation (4) divides by a - c, (10) and (18) multiply and divide by tan phi3, (11) divides by sin phi3, (19) multiplies
and divides by tan phi2. The nominal linkage passes some of these angles in each turn; turned as a whole about O,
which changes nothing but the frame, it passes them all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from mpmath import mp, mpc, mpf

from scenarios.common.instance import UnpackedFmu
from scenarios.speed_vs_error.hard_cases.measured import Measured, Probe, Worst, ask, printed_tip
from scenarios.speed_vs_error.yardstick import NOMINAL, Oracle, Pose

DISTANCES = tuple(10.0**-n for n in range(1, 16))  # rad of the crank
BOUND = math.log10(2)  # digits: an error of twice the conditioning
PLACE = 1.0  # rad: far from all dead points


def other_phi3(pose: Pose) -> mpf:
    """phi3 of the other branch of (4), which is not taken: B mirrored on AD."""
    return 2 * mp.arg(pose.A - pose.D) - pose.phi3


# What is brought to which direction, in degrees.
POLES: dict[str, tuple[Callable[[Pose], mpf], int]] = {
    "phi3 at 180°": (lambda pose: pose.phi3, 180),
    "phi3 at 0°": (lambda pose: pose.phi3, 0),
    "phi3 at 90°": (lambda pose: pose.phi3, 90),
    "phi3 at -90°": (lambda pose: pose.phi3, -90),
    "phi2 at 90°": (lambda pose: pose.phi2, 90),
    "a = c, 0 over 0": (other_phi3, 180),
}


@dataclass(frozen=True)
class Lost:
    """Decimal digits lost beside a pole, over what rounding the inputs costs; by the FMU, by the printed equations."""

    pole: str
    distance: float  # rad
    ours: float
    printed: float


def turned(geometry: dict[str, float], angle: mpf) -> dict[str, float]:
    """The whole linkage turned about O, counter-clockwise."""
    C, G = (mpc(geometry["X" + name], geometry["Y" + name]) * mp.expj(angle) for name in "CG")
    moved = {"XC": C.real, "YC": C.imag, "XG": G.real, "YG": G.imag}
    moved |= {name: mp.fmod(geometry[name] + angle, 2 * mp.pi) for name in ("phi1", "phi4")}
    return geometry | {name: float(value) for name, value in moved.items()}


def at_pole(pole: str) -> tuple[dict[str, float], float]:
    """The nominal linkage turned so that it is at this pole at PLACE, to the last bit of the angle returned."""
    angle_of, degrees = POLES[pole]
    with mp.workdps(30):
        target = mpf(degrees) / 180 * mp.pi
        geometry = turned(NOMINAL, target - angle_of(Oracle(NOMINAL, 30).pose(PLACE)))
        oracle = Oracle(geometry, 30)

        def side(phi: float) -> bool:
            return mp.sin(angle_of(oracle.pose(phi)) - target) > 0

        low, high = PLACE - 1e-9, PLACE + 1e-9
        assert side(low) != side(high)
        while low < (middle := (low + high) / 2) < high:
            low, high = (middle, high) if side(middle) == side(low) else (low, middle)
    return geometry, low


@cache
def losses(fmu: UnpackedFmu) -> tuple[Lost, ...]:
    """Beside every pole, the worse side at each distance."""
    asked = [
        (pole, distance, (geometry, phi + side * distance))
        for pole in POLES
        for geometry, phi in [at_pole(pole)]
        for distance in DISTANCES
        for side in (-1, 1)
    ]
    worst: dict[tuple[str, float], list[float]] = {}
    with Probe(fmu) as probe:
        for (pole, distance, pose), question in zip(asked, ask(pose for _, _, pose in asked), strict=True):
            digits = worst.setdefault((pole, distance), [0.0, 0.0])
            for k, answer in enumerate((probe.tip(*pose), printed_tip(*pose))):
                digits[k] = max(digits[k], math.log10(max(1.0, *question.ratios(answer))))
    return tuple(Lost(*key, *digits) for key, digits in worst.items())


def measure(fmu: UnpackedFmu) -> list[Measured]:
    """Digits lost in the tip's position, velocity or acceleration, from 0.1 to 1e-15 rad beside each pole."""
    by_pole: dict[str, Worst] = {}
    for lost in losses(fmu):
        worst = by_pole.setdefault(lost.pole, Worst())
        worst.see(lost.ours, f"{lost.distance:g} rad beside it")
        worst.see_printed(lost.printed)
    return [
        Measured(
            pole,
            "digits lost in position, velocity and acceleration, 0.1 to 1e-15 rad beside it",
            "digits",
            worst.value,
            BOUND,
            worst.where,
            worst.printed,
        )
        for pole, worst in by_pole.items()
    ]
