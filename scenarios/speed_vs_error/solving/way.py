"""The question put to every way of solving the linkage, its true answer, and what a way is.

The same angles, the same geometry and the same crank speed for all. An answer is an array with a row an angle:
x, y of the tip's position (m), then of its velocity (m/s), then of its acceleration (m/s2), up to the order asked
for, relative to the machine, with the crank at a constant 65 turns a minute.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from mpmath import mp, mpf

from scenarios.speed_vs_error.yardstick import NOMINAL, TURN_TIME, Oracle

QUANTITIES = ("position", "velocity", "acceleration")
UNITS = ("mm", "mm/s", "mm/s2")
ORDERS = range(len(QUANTITIES))
GEOMETRY = NOMINAL
SPEED = 2 * math.pi / TURN_TIME  # rad/s: 65 turns a minute
ANGLES = 2000

Evaluate = Callable[[np.ndarray, int], np.ndarray]


@dataclass(frozen=True)
class Question:
    """What every way is asked: at order n for the first n + 1 quantities, so many components of each.

    levels   what each of the orders gives beside those before it
    scale    of a unit in SI units
    """

    quantities: tuple[str, ...]
    units: tuple[str, ...]
    scale: tuple[float, ...]
    components: int
    orders: tuple[int, ...]
    levels: tuple[str, ...]

    def width(self, order: int) -> int:
        """How many numbers an answer has."""
        return self.components * (order + 1)


MOTION = Question(
    QUANTITIES, UNITS, (1e-3,) * len(UNITS), 2, tuple(ORDERS), ("position", "+ velocity", "+ acceleration")
)


@dataclass(frozen=True)
class Way:
    """A way of solving the linkage.

    evaluate   the answers at an array of angles, which go round evenly, up to an order
    take_time  the same without keeping the answers, nanoseconds an evaluation; where None, evaluate is timed
    """

    key: str
    title: str
    whose: str  # OURS, PAPER, PEER or HAND
    evaluate: Evaluate
    take_time: Callable[[np.ndarray, int], float] | None = None
    remark: str = ""

    def nanoseconds(self, angles: np.ndarray, order: int) -> float:
        """What one evaluation takes of the processor's time, over all these angles."""
        if self.take_time is not None:
            return self.take_time(angles, order)
        begin = time.thread_time_ns()
        self.evaluate(angles, order)
        return (time.thread_time_ns() - begin) / len(angles)


OURS, PAPER, HAND, PEER = "this project", "the paper", "by hand", "peer"
CORE = "core"


def angles(count: int = ANGLES) -> np.ndarray:
    """Angles evenly round one turn of the crank, rad, from half an interval on."""
    return (np.arange(count) + 0.5) * (2 * math.pi / count)


def truth(phi: np.ndarray) -> np.ndarray:
    """The answers to 50 digits, each as the unevaluated sum of two doubles: shape (angles, 6, 2)."""
    oracle, answers = Oracle(GEOMETRY), np.empty((len(phi), 2 * len(ORDERS), 2))
    for row, angle in zip(answers, phi, strict=True):
        derivatives = oracle.tip(float(angle), ORDERS[-1])
        with mp.workdps(50):
            exact = [component * mpf(SPEED) ** n for n, pair in enumerate(derivatives) for component in pair]
            row[:, 0] = [float(value) for value in exact]
            row[:, 1] = [float(value - mpf(head)) for value, head in zip(exact, row[:, 0], strict=True)]
    return answers


def worst_errors(answers: np.ndarray, exact: np.ndarray, question: Question = MOTION) -> tuple[float, ...]:
    """The greatest distance of an answer from the truth, a number for each quantity answered, in its unit."""
    columns = answers.shape[1]
    off = (answers - exact[:, :columns, 0]) - exact[:, :columns, 1]
    apart = np.linalg.norm(off.reshape(len(off), -1, question.components), axis=2)
    return tuple(float(worst) / scale for worst, scale in zip(apart.max(axis=0), question.scale, strict=False))


def greatest(exact: np.ndarray, question: Question = MOTION) -> tuple[float, ...]:
    """How great the quantities are at most, each in its unit."""
    return worst_errors(np.zeros(exact.shape[:2]), exact, question)


def on_all_processors(truth: Callable[[np.ndarray], np.ndarray], phi: np.ndarray, alone: int) -> np.ndarray:
    """A truth at angles, spread over processes where there are `alone` angles or more: fewer are sooner done here."""
    workers = min(8, os.cpu_count() or 1)
    if len(phi) < alone or workers == 1:
        return truth(phi)
    with ProcessPoolExecutor(workers) as pool:
        return np.concatenate(list(pool.map(truth, np.array_split(phi, workers))))
