"""What every hard case comes to: a worst value and its bound; and the tip of any geometry at any angle."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from types import SimpleNamespace

from mpmath import mp, mpf

from scenarios.common.instance import OK, Instance, UnpackedFmu
from scenarios.speed_vs_error.yardstick import Oracle, conditioning, error
from scenarios.speed_vs_error.yardstick import printed_equations as printed

TIP = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay")
DOUBLE = 53  # bits
TINY = sys.float_info.min  # below it doubles have fewer digits

# How errors are counted: 1 is what one unit in the last place of the crank's angle and of each parameter does,
# summed, to the exact answer (fmu_src/oracle/oracle.py). Who takes doubles cannot be asked for much less.
CONDITIONING = "conditioning"

Vectors = list[tuple[float, float]]  # a point and its derivatives, (x, y) each
Pose = tuple[Mapping[str, float], float]  # geometry, crank angle in rad


@dataclass(frozen=True)
class Measured:
    """One line of the table."""

    case: str
    quantity: str  # what is measured
    unit: str
    worst: float
    bound: float
    where: str = ""  # the worst of all
    printed: float | None = None  # the same of the paper's equations, mended; infinite where they have no answer

    @property
    def is_met(self) -> bool:
        return self.worst <= self.bound


@dataclass
class Worst:
    """The greatest of some values, and where it was."""

    value: float = 0.0
    where: str = ""
    printed: float | None = None

    def see(self, value: float, where: str = "") -> None:
        if not value <= self.value:  # what is no number stays the worst
            self.value, self.where = value, where

    def see_printed(self, value: float) -> None:
        self.printed = value if self.printed is None else max(self.printed, value)


@dataclass
class Probe:
    """An instance that stays in initialization mode, where outputs follow inputs and parameters."""

    fmu: UnpackedFmu
    instance: Instance = field(init=False)

    def __post_init__(self) -> None:
        self.instance = Instance(self.fmu, "probe").setup().enter()

    def __enter__(self) -> Probe:
        return self

    def __exit__(self, *_) -> None:
        self.instance.free()

    def place(self, geometry: Mapping[str, float], phi: float, **inputs: float) -> Instance:
        """Set the geometry and the crank, which turns at 1 rad/s: derivatives by time are those by angle."""
        values = {f"geometry.{name}": value for name, value in geometry.items()}
        return self.instance.set(values | {"crank.phi": phi, "crank.w": 1.0, "crank.a": 0.0} | inputs)

    def tip(self, geometry: Mapping[str, float], phi: float) -> Vectors | None:
        """The tip and two derivatives by the crank angle; None where the FMU says that it has no pose."""
        status, found = self.place(geometry, phi).try_get(TIP)
        return list(zip(found[::2], found[1::2], strict=True)) if status == OK else None


def printed_tip(geometry: Mapping[str, float], phi: float) -> Vectors | None:
    """The same by the paper's equations, mended, in double arithmetic; None where they have no answer."""
    with mp.workprec(DOUBLE):
        try:
            tip = printed.mended_tip(SimpleNamespace(**{k: mpf(v) for k, v in geometry.items()}), phi, mpf(1))
            return [(float(x), float(y)) for x, y in tip]
        except (ZeroDivisionError, TypeError):  # a division by zero; a root of a negative number
            return None


@dataclass(frozen=True)
class Question:
    """A pose: the exact tip and two derivatives, and how sharp the question is."""

    exact: list
    allowed: list

    def ratios(self, answer: Vectors | None) -> list[float]:
        """Error over conditioning for the point and each derivative, the worse axis."""
        if answer is None:
            return [math.inf] * len(self.exact)
        return [
            max(error(f, e) / max(a, TINY) for f, e, a in zip(found, exact, allowed, strict=True))
            for found, exact, allowed in zip(answer, self.exact, self.allowed, strict=True)
        ]


def ask(poses: Iterable[Pose]) -> list[Question]:
    """The oracle, on all cores: geometries and angles may be many, and each takes it some 50 ms."""
    poses = list(poses)
    if len(poses) < 8:
        return [_ask(pose) for pose in poses]
    with ProcessPoolExecutor() as pool:
        return list(pool.map(_ask, poses, chunksize=8))


def _ask(pose: Pose) -> Question:
    return Question(Oracle(pose[0]).tip(pose[1], 2), conditioning(*pose, 2))
