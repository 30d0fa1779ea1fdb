"""The picture of a front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from transplanter_linkage.measures import MEASURES

from scenarios.common.beside import label
from scenarios.common.figures import BLUE, GREEN, GREY, NOTE, ORANGE, VERMILLION


def front(
    points: np.ndarray, names: Sequence[str], rivals: Mapping[str, np.ndarray], chosen: int, published: Sequence[float]
) -> Figure:
    """Points of the front (two columns, SI units), the rivals' beside them; ``chosen``: the one that is reported."""
    figure, axes = plt.subplots(figsize=(8.0, 5.2), layout="constrained")
    scale = [MEASURES[name].scale for name in names]
    shown = points * scale
    for (name, other), colour, mark in zip(rivals.items(), (ORANGE, GREEN), ("s", "^"), strict=False):
        if len(other):
            axes.plot(*(other * scale).T, mark, color=colour, markersize=4, label=name)
    axes.plot(*shown.T, "o-", color=BLUE, linewidth=1.0, markersize=5, label="by gradients")
    axes.plot(*shown[chosen], "o", color=VERMILLION, markersize=9, label="reported design")
    low, high = axes.get_xlim(), axes.get_ylim()
    axes.plot(published[0] * scale[0], published[1] * scale[1], "*", color=GREY, markersize=13, label="published")
    axes.set(xlabel=label(names[0]), ylabel=label(names[1]))
    axes.set_xlim(low[0], max(low[1], published[0] * scale[0] * 1.05))
    axes.set_ylim(high[0], max(high[1], published[1] * scale[1] * 1.05))
    axes.legend()
    axes.set_title("What one costs in the other: towards the lower left is better", loc="left", color=NOTE)
    return figure
