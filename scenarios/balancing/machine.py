"""The linkage at a steady speed: torque and shaking force over a turn, and their gradients by what balances it.

What balances: a counterweight on crank OA, a mass at a point of the crank, and a tension spring from joint A to a point
of the machine. The FMU answers for the masses: in Initialization Mode, with its directional derivatives by body.OA.*.
The spring is here: its pull does work on the crank alone, and between crank and machine it shakes nothing. What the
soil adds to the torque is that of the field row's soil, an FMU too, on level ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np

from scenarios.common.command import ROOT
from scenarios.common.instance import FmuError, Instance, UnpackedFmu
from scenarios.common.linkage import Linkage
from scenarios.common.masses import KEYS, plausible, with_counterweight
from scenarios.common.operating_point import MACHINE_SPEED, PLANTING_SPEED

POSES = 120  # of a turn, evenly spaced
GRAVITY = 9.80665  # m/s2
OUTPUTS = ("crank.tau", "machine.fx", "machine.fy")
GEOMETRY = "geometry."
FOLLOWED = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.angle")
SOIL = ROOT / "build" / "partners" / "Soil.fmu"


@dataclass(frozen=True)
class Balancing:
    """``mass`` in kg at (``x``, ``y``) in m, along crank OA from O and to the left of it; ``stiffness`` in N/m,
    ``free`` length in m and anchor (``anchor_x``, ``anchor_y``) in m from O of the spring. What is 0 is not there.
    """

    mass: float = 0.0
    x: float = 0.0
    y: float = 0.0
    stiffness: float = 0.0
    free: float = 0.1
    anchor_x: float = 0.0
    anchor_y: float = 0.2

    @property
    def reach(self) -> float:
        """How far from O the counterweight is, m."""
        return math.hypot(self.x, self.y)


NAMES = tuple(Balancing.__dataclass_fields__)


@dataclass(frozen=True)
class Turn:
    """Torque in N m and shaking force, x + iy in N, at each of POSES angles; gradients have a column for each of NAMES.

    The shaking force is the linkage's on the machine without its dead weight and without the soil; ``soil`` is what the
    soil adds to the torque, N m, whatever balances.
    """

    phi: np.ndarray
    torque: np.ndarray
    force: np.ndarray
    torque_by: np.ndarray
    force_by: np.ndarray
    soil: np.ndarray


class Machine:
    """The linkage FMU with the masses of scenarios/common/masses.py; a context manager.

    Raises FmuError where the FMU has no masses.
    """

    def __init__(self, path: Path, soil: Path = SOIL) -> None:
        self._fmu = UnpackedFmu(path)
        try:
            lacking = [name for name in ("body.OA.m", *OUTPUTS, "joint.A.x") if name not in self._fmu.reference]
            if lacking:
                raise FmuError(f"{path} has no masses: it lacks {', '.join(lacking)}.")
            starts = {v.name: v.start for v in self._fmu.description.modelVariables if v.name.startswith(GEOMETRY)}
            self.masses = plausible({name.removeprefix(GEOMETRY): float(start) for name, start in starts.items()})
            self._linkage = Linkage(self._fmu, "balanced")
        except BaseException:
            self._fmu.close()
            raise
        self._linkage.setup().enter().set(self.masses)
        self.phi = np.arange(POSES) * math.tau / POSES
        at = [self._linkage.set({"crank.phi": phi}).get("joint.A.x", "joint.A.y") for phi in self.phi]
        self.joint = np.array(at) @ [1, 1j]
        try:
            self._soil = self._resistance(soil)
        except BaseException:
            self.__exit__(None, None, None)
            raise

    def __enter__(self) -> Machine:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._linkage.free()
        self._fmu.close()

    def _resistance(self, path: Path) -> np.ndarray:
        """What the soil adds to the torque at each pose, N m: its force hardly depends on how fast the tip moves."""
        added = []
        linkage = self._linkage.set({"crank.w": PLANTING_SPEED})
        with UnpackedFmu(path) as fmu, Instance(fmu, "soil") as soil:
            soil.initialize({"inputs.at_step_end": True, "ridge.wave": 0.0})
            for k, phi in enumerate(self.phi.tolist()):
                x, y, vx, vy, angle, free = linkage.set({"crank.phi": phi}).get(*FOLLOWED, "crank.tau")
                tip = {"ground.x": x, "ground.y": y, "ground.vx": vx + MACHINE_SPEED, "ground.vy": vy}
                fx, fy = soil.step(float(k), 1.0, tip | {"tip.angle": angle}).get("tip.fx", "tip.fy")
                added.append(linkage.set({"tip.fx": fx, "tip.fy": fy}).get("crank.tau")[0] - free)
                linkage.set({"tip.fx": 0.0, "tip.fy": 0.0})
        return np.array(added)

    def turn(self, b: Balancing, speed: float, *, gradients: bool = True) -> Turn:
        """Over a turn at ``speed`` in rad/s."""
        crank, by = with_counterweight(self.masses, b.mass, b.x, b.y)
        self._linkage.set(crank | {"crank.w": speed})
        dead = GRAVITY * sum(value for name, value in (self.masses | crank).items() if name.endswith(".m"))
        values, rates = np.empty((POSES, 3)), np.zeros((POSES, 3, 4))
        for k, phi in enumerate(self.phi.tolist()):
            values[k] = self._linkage.set({"crank.phi": phi}).get(*OUTPUTS)
            for j, key in enumerate(KEYS if gradients else ()):
                status, rates[k, :, j] = self._linkage.try_sensitivity(OUTPUTS, {f"body.OA.{key}": 1.0})
                self._linkage.demand(status, f"derivatives by body.OA.{key}")
        chained = rates @ by
        torque, torque_by_spring = self.spring(b)
        nothing = np.zeros((POSES, 4))
        shaken_by = chained[:, 1] + 1j * chained[:, 2]
        shaken_by[:, 0] += 1j * GRAVITY  # a heavier counterweight is heavier at rest too
        return Turn(
            self.phi,
            values[:, 0] + torque,
            values[:, 1] + 1j * (values[:, 2] + dead),
            np.hstack((chained[:, 0], torque_by_spring)),
            np.hstack((shaken_by, nothing)),
            self._soil,
        )

    def spring(self, b: Balancing) -> tuple[np.ndarray, np.ndarray]:
        """The torque that the spring takes from the drive, N m, and its gradient by stiffness, free length and anchor.

        Its energy is stiffness (l - free)^2/2 with l its length; the torque is that energy's derivative by the angle.
        """
        arm = self.joint - complex(b.anchor_x, b.anchor_y)
        turning = -1j * self.joint  # of joint A by the angle: clockwise
        length, q = abs(arm), np.real(np.conj(arm) * turning)
        stretched = 1 - b.free / length
        squeeze = b.stiffness * b.free / length**3 * q
        return b.stiffness * stretched * q, np.column_stack(
            (
                stretched * q,
                -b.stiffness * q / length,
                -squeeze * arm.real - b.stiffness * stretched * turning.real,
                -squeeze * arm.imag - b.stiffness * stretched * turning.imag,
            )
        )
