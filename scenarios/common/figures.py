"""How the figures of all scenarios look: the colour-blind-safe palette of Okabe and Ito, one style, one way to save.

Units in pictures are those of people: mm, degrees, turns a minute, km/h. Curves are named where they end, with
`name_ends`, rather than in a legend, wherever there is room.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

plt.switch_backend("Agg")  # no display needed, for all who draw

DPI = 160
BLUE, VERMILLION, GREEN, BLACK, GREY = "#0072B2", "#D55E00", "#009E73", "#000000", "#7F7F7F"
ORANGE, SKY, PINK = "#E69F00", "#56B4E9", "#CC79A7"
EARTH, EARTH_EDGE = "#E8DCCB", "#8C6D46"  # the soil, and its surface
NOTE = "#555555"  # of text that explains
STYLE = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "savefig.dpi": DPI,
}


def save_all(output: Path, figures: Mapping[str, Callable[[], Figure]]) -> list[Path]:
    """Draw each figure in the house's style and write it to its name's PNG in ``output``; returns the paths."""
    paths = []
    with plt.rc_context(STYLE):
        for name, draw in figures.items():
            paths.append(output / f"{name}.png")
            figure = draw()
            figure.savefig(paths[-1])
            plt.close(figure)
    return paths


def name_ends(
    axes: Axes, ends: Sequence[tuple[float, float, str, str]], apart: float = 10.5, gap: float = 6.0, **text: object
) -> None:
    """Write names on the right of the points where curves end: each is (x, y, name, colour), in the data's units.

    Names lie at least ``apart`` points from each other, a thin line leads to those that had to move. The axes
    must have their place and limits.
    """
    figure = axes.figure
    figure.draw_without_rendering()
    at = axes.transData.transform([(x, y) for x, y, *_ in ends]) * 72 / figure.dpi
    order = np.argsort(at[:, 1])
    right = at[:, 0].max() + gap
    for k, height in zip(order, spread(at[order, 1].tolist(), apart), strict=True):
        x, y, name, colour = ends[k]
        shift = right - at[k, 0], height - at[k, 1]
        line = {"arrowstyle": "-", "color": colour, "linewidth": 0.6, "alpha": 0.7, "shrinkA": 0, "shrinkB": 2}
        axes.annotate(
            name,
            (x, y),
            xytext=shift,
            textcoords="offset points",
            ha="left",
            va="center",
            color=colour,
            annotation_clip=False,
            arrowprops={**line, "relpos": (0, 0.5)} if abs(shift[1]) > 2 or shift[0] > 2 * gap else None,
            **{"fontsize": 8.5} | text,
        )


def spread(places: Sequence[float], distance: float) -> list[float]:
    """Rising places, moved as little as needed to be so far apart: groups that touch share their middle."""
    groups: list[list[float]] = []  # of what the places would be without their neighbours
    for n, place in enumerate(places):
        groups.append([place - n * distance])
        while len(groups) > 1 and np.mean(groups[-2]) > np.mean(groups[-1]):
            groups[-2:] = [groups[-2] + groups[-1]]
    moved = [float(np.mean(group)) for group in groups for _ in group]
    return [place + n * distance for n, place in enumerate(moved)]
