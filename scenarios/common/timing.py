"""What measured times allow to be said: ratios within rounds, their scatter, and verdicts that the scatter carries.

Two things are timed beside each other, round after round, so that a busy machine slows both. What is left is scatter
within a round, and drift over the run, as when another program wakes on the sibling thread. A verdict has to
hold in each third of the run; a figure is stated alone where the scatter is small beside it, else as a range.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

THIRDS = 3
STEADY = 0.1  # of the median: up to this much may lie between it and either quartile where it is stated alone


@dataclass(frozen=True, eq=False)
class Ratios:
    """Times of one thing in times of another's, a number a round, in the order in which they were measured."""

    rounds: np.ndarray

    @cached_property
    def median(self) -> float:
        return float(np.median(self.rounds)) if len(self.rounds) else float("nan")

    @cached_property
    def quartiles(self) -> tuple[float, float]:
        """Between which ratios the middle half of the rounds lies."""
        if not len(self.rounds):
            return float("nan"), float("nan")
        low, high = np.percentile(self.rounds, (25, 75))
        return float(low), float(high)

    @property
    def is_steady(self) -> bool:
        """Whether the scatter lets the median be stated alone."""
        low, high = self.quartiles
        return max(high - self.median, self.median - low) <= STEADY * self.median

    def side(self, limit: float = 1.0) -> int:
        """-1 below the limit, 1 above, 0 where the scatter does not tell: the middle half of each third decides."""
        thirds = [third for third in np.array_split(self.rounds, THIRDS) if len(third)]
        if not thirds:
            return 0
        low, high = np.array([np.percentile(third, (25, 75)) for third in thirds]).T
        return -1 if high.max() < limit else 1 if low.min() > limit else 0

    def __str__(self) -> str:
        """The median where it is steady, else the middle half."""
        low, high = self.quartiles
        return ratio_text(self.median) if self.is_steady else f"{ratio_text(low)} to {ratio_text(high)}"


def ratio_text(value: float) -> str:
    """A ratio of times: two decimals below ten, then three digits."""
    if np.isnan(value):
        return ""
    return f"{value:.2f}" if value < 10 else f"{float(f'{value:.3g}'):,.0f}".replace(",", " ")


def noise(yardstick: Iterable[float], name: str, load: float | None, threads: int, siblings: int) -> str:
    """How quiet the machine was, a sentence: the scatter of something that takes the same time in each round, and who
    else was running. ``load``: of the system's run queue, None where it tells none; ``siblings``: threads a core.
    """
    taken = np.array(list(yardstick))
    low, middle, high = np.percentile(taken, (5, 50, 95))
    said = [f"Noise: {name} took {low / middle:.2f} to {high / middle:.2f} times its median in nine rounds of ten"]
    if load is not None:
        busy = f"{load:.1f} programs wanted the {threads} threads"
        if load > 1.5:  # we are one of them
            busy += ": others ran beside" + (f", {siblings} threads share a core" if siblings > 1 else "")
        said.append(busy)
    return "; ".join(said) + "."


def noise_here(yardstick: Iterable[float], name: str) -> str:
    """`noise` on this machine, now."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    try:
        listed = Path("/sys/devices/system/cpu/cpu0/topology/thread_siblings_list").read_text(encoding="ascii")
        siblings = sum(
            int(last or first) - int(first) + 1
            for first, _, last in (part.partition("-") for part in listed.strip().split(","))
        )
    except (OSError, ValueError):
        siblings = 1
    return noise(yardstick, name, load, os.cpu_count() or 1, siblings)
