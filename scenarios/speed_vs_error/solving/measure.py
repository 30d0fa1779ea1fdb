"""Errors and times of the ways, and what follows from them: which of them beats the core, and by what."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scenarios.common.timing import Ratios
from scenarios.speed_vs_error.solving.way import CORE, MOTION, Question, Way, greatest, worst_errors

WRONG = 0.1  # of the greatest true value: an error beyond that is no inaccuracy any more
ALIKE = 3.0  # up to this many times the core's error counts as the core's accuracy
BUDGET = 4e6  # ns: so long may one measurement of a slow way last; it then takes fewer of the angles
FEWEST = 10


@dataclass(frozen=True)
class Cell:
    """One way at one order.

    errors   worst distance from the truth in the question's units, as many as the order gives
    times    nanoseconds an evaluation, a round each; beside: the core's, measured just before, sincos: libm's
    why      why there are no times: what the way raised, or how wrong it is; "" where all is well
    """

    way: Way
    order: int
    errors: tuple[float, ...]
    times: np.ndarray
    beside: np.ndarray
    sincos: np.ndarray
    why: str = ""

    @cached_property
    def of_core(self) -> Ratios:
        """The way's time in times of the core's."""
        return Ratios(self.times / self.beside)

    @cached_property
    def of_sincos(self) -> Ratios:
        """The same in calls of libm's sincos."""
        return Ratios(self.times / self.sincos)

    @property
    def ratio(self) -> float:
        """Median over the rounds of this way's time in times of the core's."""
        return self.of_core.median


def verify(
    way: Way, order: int, phi: np.ndarray, exact: np.ndarray, question: Question = MOTION
) -> tuple[tuple[float, ...], str]:
    """Worst errors over all angles, and what is wrong with the way, "" where nothing is."""
    try:
        answers = np.asarray(way.evaluate(phi, order), dtype=float)
    except Exception as error:  # noqa: BLE001 - a peer may raise anything; it is named in the table
        return (), f"failed: {str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__}"
    expected = (len(phi), question.width(order))
    if answers.shape != expected:
        return (), f"wrong: {answers.shape} numbers instead of {expected}"
    errors = worst_errors(answers, exact, question)
    # as many as the order has
    for quantity, unit, error, scale in zip(
        question.quantities, question.units, errors, greatest(exact, question), strict=False
    ):
        if not error <= WRONG * scale:
            return errors, f"wrong: {quantity} off by {error:.3g} {unit}, where it is at most {scale:.3g}"
    return errors, ""


def measure(
    ways: Sequence[Way],
    sincos: Way,
    phi: np.ndarray,
    exact: np.ndarray,
    rounds: int,
    done: Callable[[], object] = lambda: None,
    *,
    question: Question = MOTION,
    timed: np.ndarray | None = None,
) -> list[Cell]:
    """Every way at every order: verified first, then timed in interleaved rounds, each time beside the core's.

    `done` is called after each way verified, and after each round; `timed` are other angles than those verified, where
    these are too few to be timed.
    """
    timed = phi if timed is None else timed
    core = next(way for way in ways if way.key == CORE)
    errors: dict[tuple[str, int], tuple[float, ...]] = {}
    why: dict[tuple[str, int], str] = {}
    counts: dict[tuple[str, int], int] = {}
    for way in ways:
        for order in question.orders:
            at = way.key, order
            errors[at], why[at] = verify(way, order, phi, exact, question)
            if not why[at]:
                whole = way.nanoseconds(timed, order) * len(timed)  # warm by now
                counts[at] = len(timed) if whole < BUDGET else max(FEWEST, int(len(timed) * BUDGET / whole))
        done()
    taken: dict[tuple[str, int], list[tuple[float, float, float]]] = {at: [] for at in errors}
    for _ in range(rounds):
        for order in question.orders:
            for way in ways:
                at = way.key, order
                if not why[at]:
                    alone, beside = sincos.nanoseconds(timed, 0), core.nanoseconds(timed, order)
                    mine = beside if way is core else way.nanoseconds(timed[: counts[at]], order)
                    taken[at].append((mine, beside, alone))
        done()
    return [
        Cell(way, order, errors[way.key, order], *np.array(taken[way.key, order]).reshape(-1, 3).T, why[way.key, order])
        for way in ways
        for order in question.orders
    ]


def core_of(cells: Sequence[Cell], order: int) -> Cell:
    """The core's cell at an order."""
    return next(cell for cell in cells if cell.way.key == CORE and cell.order == order)


def times_the_error(cell: Cell, core: Cell) -> tuple[float, ...]:
    """Its error in times of the core's, for each quantity."""
    return tuple(mine / ours for mine, ours in zip(cell.errors, core.errors, strict=True))


@dataclass(frozen=True)
class Wins:
    """What the core loses, and to which cells; faster and slower: beyond the scatter of the rounds.

    defeats   as accurate as the core (ALIKE, in every quantity) and faster
    draws     as accurate, and neither faster nor slower
    faster    faster, at a greater error
    unsure    at a greater error, and neither faster nor slower
    sharper   of half the core's error or less in every quantity, but slower
    """

    defeats: tuple[Cell, ...]
    draws: tuple[Cell, ...]
    faster: tuple[Cell, ...]
    unsure: tuple[Cell, ...]
    sharper: tuple[Cell, ...]


def wins(cells: Sequence[Cell]) -> Wins:
    """Sort out who beats the core in what."""
    defeats, draws, faster, unsure, sharper = [], [], [], [], []
    for cell in cells:
        if cell.why or cell.way.key == CORE:
            continue
        factors, side = times_the_error(cell, core_of(cells, cell.order)), cell.of_core.side()
        if side < 0:
            (faster if max(factors) > ALIKE else defeats).append(cell)
        elif side == 0:
            (unsure if max(factors) > ALIKE else draws).append(cell)
        elif max(factors) <= 0.5:
            sharper.append(cell)
    return Wins(*map(tuple, (defeats, draws, faster, unsure, sharper)))
