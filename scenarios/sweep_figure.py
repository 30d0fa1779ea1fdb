"""The picture of a parameter study: hole length, posture and acceleration against each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display needed

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.colors import LogNorm  # noqa: E402
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator  # noqa: E402

from scenarios.figures import BLACK, STYLE, VERMILLION  # noqa: E402

TITLES = ("hole length / mm", "posture: mean lean out of the vertical / deg",
          "greatest acceleration of the tip / (m/s²)")
SCALES = (1e3, 180 / np.pi, 1.0)


def draw(path: Path, values: np.ndarray, usable: np.ndarray, best: np.ndarray, start: Sequence[float],
         runs: str) -> None:
    """Write the picture. ``values`` has the columns hole (m), posture (rad), acceleration (m/s2), a row a run,
    ``start`` those of the FMU's start values or nothing; ``best`` are the rows that no other beats in all three."""
    shown = values * SCALES
    with plt.rc_context(STYLE):
        figure, panels = plt.subplots(1, 3, figsize=(13.0, 4.9), layout="constrained")
        for axes, (x, y, z) in zip(panels, ((0, 1, 2), (0, 2, 1), (1, 2, 0))):
            dots = axes.scatter(shown[usable, x], shown[usable, y], c=shown[usable, z], cmap="viridis", s=16,
                                norm=LogNorm() if z == 2 else None)
            axes.plot(shown[best, x], shown[best, y], "o", markersize=8, markerfacecolor="none",
                      markeredgecolor=VERMILLION, label="beaten by no other run in all three")
            if start:
                at = [value * scale for value, scale in zip(start, SCALES)]
                axes.plot(at[x], at[y], "*", color=BLACK, markersize=13, label="the FMU's start values")
            axes.set(xlabel=TITLES[x], ylabel=TITLES[y])
            bar = figure.colorbar(dots, ax=axes, label=TITLES[z], location="top", aspect=40)
            for axis in [axes.yaxis] * (y == 2) + [bar.ax.xaxis] * (z == 2):
                axis.axes.set(**{f"{axis.axis_name}scale": "log"})
                axis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))
                axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
                axis.set_minor_locator(NullLocator())
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        figure.suptitle(f"Trade-off of {runs} (smaller is better in all three)", x=0.01, ha="left", fontsize=11)
        figure.savefig(path)
        plt.close(figure)
