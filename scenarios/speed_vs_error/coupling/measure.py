"""What a way of driving the crank costs in accuracy: the linkage FMU stepped through fmpy.

In FMI an input set before a step belongs to the step's start, an output read after it to the
step's end. A rung is what a host gives of the crank; the error is how far the tip then is from
where the crank's true motion puts it.

The truth is read from a second instance of the same FMU. In initialization mode its outputs
follow its inputs, so that with the true angle, speed and acceleration of an instant it answers
exactly for that instant: nothing is predicted there. Its own solving error, about 1e-15 m, is
not seen here; it is tested elsewhere against 50 digits.

Errors are distances: position in m, velocity in m/s, acceleration in m/s2, relative to the
machine.
"""

from __future__ import annotations

import ctypes
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.common.instance import UnpackedFmu
from scenarios.common.linkage import AT_STEP_END, CRANK, SMOOTHING, TIP, Linkage, Motion
from scenarios.speed_vs_error.coupling.crank_profiles import Profile

STEPS_MS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
QUANTITIES = ("position", "velocity", "acceleration")
START_UP = 5  # steps, until every history is full; a window of smoothing, until it is
ORDER_RANGE_MS = (1.0, 10.0)  # the steps over which orders are fitted
# What solving alone may leave, and where rounding of the angles is felt: m, m/s, m/s2.
SOLVING = (5e-15, 5e-14, 1e-12)
ROUNDING = (1e-13, 1e-11, 1e-8)


@dataclass(frozen=True)
class Rung:
    """One way to drive the crank: how many of crank.phi, .w, .a are set, and for which instant.

    ``derivatives`` of crank.phi (order 1, or 1 and 2) are set with fmi2SetRealInputDerivatives.
    ``nothing_predicted`` sets crank.at_step_end, ``smoothing`` in s crank.smoothing. The inputs are those of the step's
    end with ``of_step_end``, else those of its start.
    """

    key: str
    title: str
    inputs: int
    derivatives: int = 0
    nothing_predicted: bool = False
    of_step_end: bool = False
    smoothing: float = 0.0


HELD = Rung("held", "held: the inputs used as they are", 3, nothing_predicted=True)
FULL = Rung("angle_speed_acceleration", "angle + speed + acceleration", 3)
ANGLE = Rung("angle", "angle alone", 1)
AT_END = Rung("at_step_end", "angle of the step's end", 1, nothing_predicted=True, of_step_end=True)
RUNGS = (
    HELD,
    Rung("derivative_1", "angle with its first derivative", 1, derivatives=1),
    Rung("derivatives_2", "angle with two derivatives", 1, derivatives=2),
    ANGLE,
    Rung("angle_speed", "angle + speed", 2),
    FULL,
    AT_END,
)


def drive(linkage: Linkage, rung: Rung, times: np.ndarray, given: Motion) -> np.ndarray:
    """Steps from each time to the next; the tip after each, a row a step, as TIP.

    ``given`` is what the host knows of the crank at these times.
    """
    slave, crank = linkage.slave, [linkage.fmu.reference[name] for name in CRANK]
    inputs, tip = crank[: rung.inputs], [linkage.fmu.reference[name] for name in TIP]
    values = np.column_stack((given.phi, given.w, given.a)[: rung.inputs]).tolist()
    slave.reset()
    slave.setupExperiment(startTime=0.0)
    if rung.nothing_predicted:
        slave.setBoolean([linkage.fmu.reference[AT_STEP_END]], [True])
    slave.setReal([linkage.fmu.reference[SMOOTHING]], [rung.smoothing])
    slave.enterInitializationMode()
    slave.setReal(inputs, values[0])
    slave.exitInitializationMode()

    order = rung.derivatives
    references = (ctypes.c_uint32 * order)(*[crank[0]] * order)
    orders = (ctypes.c_int32 * order)(*range(1, order + 1))
    derivatives = np.ascontiguousarray(np.column_stack((given.w, given.a))[:, :order])
    shift = 1 if rung.of_step_end else 0
    moments = times.tolist()
    rows = np.empty((len(times) - 1, len(TIP)))
    for i, (begin, end) in enumerate(itertools.pairwise(moments)):
        slave.setReal(inputs, values[i + shift])
        if order:
            slave.fmi2SetRealInputDerivatives(
                slave.component, references, order, orders, (ctypes.c_double * order)(*derivatives[i])
            )
        slave.doStep(begin, end - begin)
        rows[i] = slave.getReal(tip)
    return rows


@dataclass(frozen=True)
class Errors:
    """What one profile, rung and step gave.

    ``worst`` and ``median`` hold position, velocity and acceleration after the start-up;
    ``start_up`` has a row for each of the first steps, ``first_second`` is the worst position
    within 1 s after the start-up.
    """

    profile: str
    rung: str
    step_ms: float
    worst: np.ndarray
    median: np.ndarray
    start_up: np.ndarray
    first_second: float


@dataclass(frozen=True)
class Coupling:
    """All errors of a run, by profile, rung and step."""

    all: tuple[Errors, ...]
    steps_ms: tuple[float, ...]

    def at(self, profile: str, rung: str, step_ms: float) -> Errors:
        return next(e for e in self.all if (e.profile, e.rung, e.step_ms) == (profile, rung, step_ms))

    def worst(self, profile: str, rung: str, quantity: int = 0) -> np.ndarray:
        """The worst errors, one for each of ``steps_ms``."""
        return np.array([self.at(profile, rung, step).worst[quantity] for step in self.steps_ms])

    def order(self, profile: str, rung: str, quantity: int = 0) -> float:
        """Fitted slope of log(error) over log(step), over ORDER_RANGE_MS.

        NaN where less than three errors stand clear of rounding.
        """
        steps, errors = np.array(self.steps_ms), self.worst(profile, rung, quantity)
        low, high = ORDER_RANGE_MS
        used = (steps >= low) & (steps <= high) & (errors > 10 * ROUNDING[quantity])
        if np.count_nonzero(used) < 3:
            return float("nan")
        return float(np.polyfit(np.log(steps[used]), np.log(errors[used]), 1)[0])

    def largest_step(self, profile: str, rung: str, tolerance: float, quantity: int = 0) -> float:
        """The largest step in ms up to which every step keeps the tolerance; 0 where none does."""
        kept = 0.0
        for step, error in zip(self.steps_ms, self.worst(profile, rung, quantity), strict=True):
            if error > tolerance:
                break
            kept = step
        return kept

    def times_more_steps(self, profile: str, rung: str, error: float, step_ms: float) -> float:
        """How many times the steps of ``step_ms`` a rung needs for a position error in m.

        Extrapolated from its error at that step by its fitted order.
        """
        here = self.at(profile, rung, step_ms).worst[0]
        return float((here / error) ** (1 / self.order(profile, rung)))


def step_count(profiles: Iterable[Profile], rungs: Sequence[Rung], steps_ms: Sequence[float]) -> int:
    """How many steps and truths `measure` takes, for a progress bar."""
    return sum(
        round(p.duration * 1e3 / _common_ms(steps_ms))
        + len(rungs) * sum(round(p.duration * 1e3 / step) for step in steps_ms)
        for p in profiles
    )


def _common_ms(steps_ms: Sequence[float]) -> float:
    """The greatest step of which all are multiples, to a microsecond."""
    return math.gcd(*(round(step * 1e3) for step in steps_ms)) / 1e3


def measure(
    fmu: UnpackedFmu,
    profiles: Sequence[Profile],
    rungs: Sequence[Rung],
    steps_ms: Sequence[float],
    done: Callable[[int], object],
) -> Coupling:
    """Drive every profile on every rung with every step; ``done`` is called with the steps taken."""
    found: list[Errors] = []
    known: dict[tuple[object, float], np.ndarray] = {}
    finest = _common_ms(steps_ms)
    with Linkage(fmu, "driven") as driven, Linkage(fmu, "truth") as truth:
        for profile in profiles:
            count = round(profile.duration * 1e3 / finest)
            times = np.arange(count + 1) * (finest * 1e-3)
            motion = profile.motion(times)
            given = Motion(profile.reading(motion.phi), motion.w, motion.a)
            key = (profile.motion, profile.duration)
            if key not in known:
                known[key] = truth.exact(motion)
            done(count)
            for rung in rungs:
                for step in steps_ms:
                    every = slice(None, None, round(step / finest))
                    rows = drive(driven, rung, times[every], given[every])
                    off = rows - known[key][every][1:]
                    found.append(_errors(profile, rung, step, np.hypot(off[:, 0::2], off[:, 1::2])))
                    done(len(rows))
    return Coupling(tuple(found), tuple(steps_ms))


def _errors(profile: Profile, rung: Rung, step_ms: float, distances: np.ndarray) -> Errors:
    start_up = START_UP + round(rung.smoothing * 1e3 / step_ms)
    steady = distances[start_up:]
    first = distances[start_up : max(round(1e3 / step_ms), start_up + 1), 0]
    return Errors(
        profile.key,
        rung.key,
        step_ms,
        steady.max(axis=0),
        np.median(steady, axis=0),
        distances[:START_UP],
        float(first.max()),
    )
