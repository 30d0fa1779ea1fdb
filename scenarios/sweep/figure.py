"""The picture of a parameter study: swept width, lean and acceleration against each other."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from scenarios.common.figures import BLACK, STYLE, VERMILLION

TITLES = (
    "swept at the surface / mm",
    "lean from straight down, lowest point / deg",
    "greatest acceleration of the tip / (m/s²)",
)
SCALES = (1e3, 180 / np.pi, 1.0)


def draw(
    path: Path, values: np.ndarray, usable: np.ndarray, best: np.ndarray, start: Sequence[float], left_out: str
) -> None:
    """Write the picture. ``values`` has the columns swept (m), lean (rad), acceleration (m/s2), a row a run,
    ``start`` those of the FMU's start values or nothing; ``best`` are the rows that no other beats in all three.
    ``left_out`` says which runs are not ``usable`` and why, "" where all are.
    """
    shown = values * SCALES
    beaten = usable.copy()
    beaten[best] = False
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, 3, figsize=(13.0, 4.7), layout="constrained")
        for axes, (x, y) in zip(panels, ((0, 1), (0, 2), (1, 2)), strict=True):
            axes.scatter(shown[beaten, x], shown[beaten, y], s=13, color="#C4C4C4", linewidths=0)
            # The same colour is the same width in every panel, so that a run can be followed.
            dots = axes.scatter(
                shown[best, x], shown[best, y], c=shown[best, 0], cmap="viridis", s=34, edgecolors=BLACK, linewidths=0.6
            )
            if start:
                at = [value * scale for value, scale in zip(start, SCALES, strict=True)]
                axes.plot(at[x], at[y], "*", color=VERMILLION, markersize=14, markeredgecolor="white")
            axes.set(xlabel=TITLES[x], ylabel=TITLES[y])
            if y == 2:
                axes.set_yscale("log")
                axes.yaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))
                axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
                axes.yaxis.set_minor_locator(NullLocator())
        figure.colorbar(dots, ax=panels, label=TITLES[0], aspect=30, pad=0.015)
        marks = [
            Line2D([], [], linestyle="", marker="o", markersize=6, markeredgecolor=BLACK, color="#3B9A8C"),
            Line2D([], [], linestyle="", marker="o", markersize=4, color="#C4C4C4"),
            Line2D([], [], linestyle="", marker="*", markersize=12, color=VERMILLION),
        ]
        names = (
            f"{len(best)} runs beaten by no other in all three",
            f"{np.count_nonzero(beaten)} runs that another beats",
            "the FMU's start values",
        )
        shown_marks = 3 if start else 2
        figure.legend(
            marks[:shown_marks], names[:shown_marks], loc="outside lower center", ncols=3, title=left_out or None
        )
        runs = f"{np.count_nonzero(usable)} of {len(values)} runs"
        title = f"Trade-off of {runs} (smaller is better in all three, of the lean its size)"
        figure.suptitle(title, x=0.01, ha="left", fontsize=11)
        figure.savefig(path)
        plt.close(figure)


def left_out(statuses: Sequence[str], swept: np.ndarray, messages: Sequence[str | None]) -> str:
    """Why runs are missing from the picture, a sentence; "" where none is. ``swept``: NaN where a run has none."""
    found: Counter[str] = Counter()
    for status, width, message in zip(statuses, swept, messages, strict=True):
        dyad = re.search(r"dyad (\w+)", message or "")
        if status == "refused":
            found[f"make no whole turn (dyad {dyad[1]} cannot close)" if dyad else "were refused by the FMU"] += 1
        elif status == "failed":
            found["failed"] += 1
        elif not np.isfinite(width):
            found["have a tip that does not rise to the surface"] += 1
    said = ", ".join(f"{count} {why}" for why, count in found.most_common())
    return f"Not drawn: {said}." if said else ""
