"""How the workshop's errors pass through to what a design is judged by: by gradient, and checked by samples.

At an optimum several extremes over the turn are equal, for that is what stops the optimiser; one gradient would tell of
one of them alone. So each window's extreme moves by its own gradient, and the measure is the greatest or least of them:
a model without turns, in which a hundred thousand machines cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from transplanter_linkage.measures import GEOMETRY, Found, Operation, Turn

from scenarios.common.instance import Refused
from scenarios.common.turn import FmuSource

DRAWN = 100_000  # of the model by gradients
MEASURED = ("swept", "hole", "lean", "ground_speed", "height", "pickup_x", "pickup_y", "peak_acceleration", "margin")


@dataclass(frozen=True)
class Spread:
    """Of one measure, SI units: standard deviation by gradient and of the samples, and the part of each parameter."""

    measure: str
    by_gradient: float
    by_samples: float
    share: dict[str, float]  # of the variance by gradient

    @property
    def off(self) -> float:
        """By how much the gradient's is off the samples'."""
        return self.by_gradient / self.by_samples - 1 if self.by_samples else 0.0


def spreads(
    source: FmuSource,
    geometry: dict[str, float],
    operation: Operation,
    deviations: dict[str, float],
    samples: int,
    done: Callable[[], object],
    *,
    seed: int = 1,
) -> tuple[list[Spread], int]:
    """Spreads of MEASURED, errors normal and independent; and how many samples the FMU refused."""
    sigma = np.array([deviations[name] for name in GEOMETRY])
    turn = Turn(source.set(geometry), operation)
    chance, found, refused = np.random.default_rng(seed), [], 0
    drawn = chance.normal(size=(DRAWN, len(GEOMETRY)))
    modelled = {name: _by_gradients(turn[name], drawn * sigma) for name in MEASURED}
    for errors in chance.normal(size=(samples, len(GEOMETRY))) * sigma:
        done()
        try:
            made = Turn(source.set({k: geometry[k] + e for k, e in zip(GEOMETRY, errors, strict=True)}), operation)
            found.append([made[name].value for name in MEASURED])
        except Refused:
            refused += 1
    source.set(geometry)
    sampled = np.std(np.array(found), axis=0, ddof=1)
    return [
        Spread(name, float(np.std(values, ddof=1)), float(deviation), _shares(values, drawn))
        for (name, values), deviation in zip(modelled.items(), sampled, strict=True)
    ], refused


def _by_gradients(found: Found, errors: np.ndarray) -> np.ndarray:
    """The measure of machines with these errors, each window's extreme by its gradient."""
    total = np.zeros(len(errors))
    for factor, part in found.parts:
        moved = part.values + errors @ part.gradients[:, : len(GEOMETRY)].T
        total += factor * (moved.max(axis=1) if part.sign >= 0 else moved.min(axis=1))
    return total


def _shares(values: np.ndarray, drawn: np.ndarray) -> dict[str, float]:
    """Of the variance that each parameter explains, the others free."""
    covariance = (values - values.mean()) @ drawn / len(values)
    total = float((covariance**2).sum())
    return {name: float(c**2 / total) for name, c in zip(GEOMETRY, covariance, strict=True)} if total else {}
