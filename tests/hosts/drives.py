"""What foreign hosts drive the linkage through, and the exact answer to it.

Two motions of the crank, each STEPS communication steps of STEP: `even`, where the component's prediction is exact,
and `ripple`, where it is within the coupling table of connecting.md. The machine's speed keeps to the crank's (one
plant every 400 mm), so that the travel has a closed form too. All hosts give angle, speed and acceleration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

from mpmath import mpf

from fmu_src.interface import load_interface
from fmu_src.oracle.oracle import Oracle
from scenarios.common.operating_point import PLANTING_SPEED
from tests.harness.drive import Rotation, even, uneven

STEP, STEPS = 1e-3, 1000
SPEED = PLANTING_SPEED
SHARE, PULSE = 0.1, 6 * math.pi  # of RIPPLE: as tests.harness.drive.uneven()
TRAVEL = 0.4 / (2 * math.pi)  # m a radian
INPUTS = ("crank.phi", "crank.w", "crank.a", "machine.v")
OUTPUTS = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay", "machine.s")
AT_STEP_END = "crank.at_step_end"
COMPARED = (1, 2, 3, 4, 5, *range(10, STEPS + 1, 10))  # communication points


@dataclass(frozen=True)
class Bound:
    """Greatest error allowed: position in mm, velocity in mm/s, acceleration in mm/s2, travel in mm."""

    position: float
    velocity: float
    acceleration: float
    travel: float
    why: str


def predicted(position: float, order: int, travel: float, why: str) -> Bound:
    """What a prediction whose position error grows with h to the power `order` leaves: rates lose h each."""
    return Bound(position, order / STEP * position, order * (order - 1) / STEP**2 * position, travel, why)


# Of the angle and of the time, which some hosts add up step by step.
ROUNDING = Bound(1e-9, 1e-8, 1e-6, 1e-9, "rounding")


@dataclass(frozen=True)
class Drive:
    """A motion of the crank: the inputs of an instant, the exact outputs, and how near a host must come to them."""

    key: str
    title: str
    rotation: Rotation
    share: float  # of the speed that swings
    coupled: Bound

    def inputs(self, time: float) -> tuple[float, float, float, float]:
        """The values of INPUTS."""
        r = self.rotation
        return r.phi(time), r.w(time), r.a(time), TRAVEL * r.w(time)

    def exact(self, point: int) -> tuple[float, ...]:
        """The values of OUTPUTS at a communication point."""
        phi, w, a, _ = self.inputs(point * STEP)
        return *exact_tip(float(phi), float(w), float(a)), TRAVEL * (phi - self.rotation.phi(0.0))

    def bound(self, interface: str) -> Bound:
        """Model Exchange has no step to predict over; how exact its travel is, the host's solver decides."""
        if interface == "ME":
            return replace(ROUNDING, travel=ROUNDING.travel if self.share == 0.0 else EULER)
        return self.coupled


@cache
def exact_tip(phi: float, w: float, a: float) -> tuple[float, ...]:
    """Position, velocity and acceleration of the tip, from 50 digits."""
    position, rate, curvature = Oracle(load_interface().geometry).tip(phi, 2)
    velocity = [w * d for d in rate]
    acceleration = [mpf(w) ** 2 * dd + a * d for d, dd in zip(rate, curvature, strict=True)]
    return tuple(map(float, (*position, *velocity, *acceleration)))


EULER = 0.03  # mm: the first-order solver of the hosts leaves half a step of changing speed, 0.022 mm here
EVEN = Drive("even", "constant speed", even(SPEED), 0.0, ROUNDING)
COUPLED = predicted(1.5e-7, 4, 5e-4, "the coupling table of connecting.md")  # also at the start: the jerk is 0 there
RIPPLE = Drive("ripple", "10 % ripple in speed at 3 Hz", uneven(), SHARE, COUPLED)
DRIVES = {drive.key: drive for drive in (EVEN, RIPPLE)}
