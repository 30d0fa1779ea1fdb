"""The pictures of a design: paths and linkages over those published, and the front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from transplanter_linkage import Geometry, solve
from transplanter_linkage.measures import MEASURES, Turn

from scenarios.common.figures import BLUE, EARTH, EARTH_EDGE, GREEN, GREY, NOTE, ORANGE, VERMILLION

COLOURS = (GREY, BLUE, VERMILLION, GREEN, ORANGE)
LINKS = (("O", "A"), ("A", "B"), ("C", "D"), ("D", "B"), ("D", "E"), ("E", "F"), ("G", "F"), ("H", "I"), ("I", "J"))


def designs(turns: Mapping[str, Turn], geometries: Mapping[str, Mapping[str, float]]) -> Figure:
    """Each design's path relative to the machine, with its linkage at the lowest point; over ground, about the plant,
    with the nozzle as it passes the surface; and its speed and acceleration over the turn."""
    figure = plt.figure(figsize=(13.0, 5.2), layout="constrained")
    machine, ground, motion = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.1))
    for (name, turn), colour in zip(turns.items(), COLOURS, strict=False):
        _machine(machine, turn, geometries[name], colour, name)
        _ground(ground, turn, geometries[name], colour, name)
        w = turn.operation.w
        phi = np.degrees(turn.phi)
        motion.plot(phi, w**2 * np.hypot(turn.values[:, 4], turn.values[:, 5]), color=colour, label=name)
    machine.set(xlabel="x / mm, direction of travel", ylabel="y / mm", aspect="equal")
    machine.set_title("Path relative to the machine", loc="left")
    ground.set(xlabel="along the row from the plant / mm", ylabel="above the surface / mm", aspect="equal")
    ground.set_title("Over ground, and the nozzle in the ridge", loc="left")
    low, high, bottom, top = *ground.get_xlim(), *ground.get_ylim()
    ground.axhspan(bottom, 0, color=EARTH, zorder=-2)
    ground.axhline(0, color=EARTH_EDGE, linewidth=1.0)
    ground.set(xlim=(low, high), ylim=(bottom, top))
    motion.set(xlabel="crank angle / degrees", ylabel="acceleration of the tip / (m/s²)", xlim=(0, 360))
    motion.set_xticks(range(0, 361, 60))
    motion.set_title("Acceleration over the turn", loc="left")
    motion.legend(loc="upper right")
    return figure


def _machine(axes: Axes, turn: Turn, geometry: Mapping[str, float], colour: str, name: str) -> None:
    closed = np.append(turn.values[:, 0] + 1j * turn.values[:, 1], turn.values[0, 0] + 1j * turn.values[0, 1]) * 1e3
    axes.plot(closed.real, closed.imag, color=colour, label=name)
    joints = {key: complex(z) * 1e3 for key, z in solve(Geometry(**geometry), turn.lowest.phi, 0).joints.items()}
    for start, end in LINKS:
        axes.plot(
            *zip(*[(joints[k].real, joints[k].imag) for k in (start, end)], strict=True), color=colour, alpha=0.65
        )
    axes.plot([z.real for z in joints.values()], [z.imag for z in joints.values()], "o", color=colour, markersize=3)


def _ground(axes: Axes, turn: Turn, geometry: Mapping[str, float], colour: str, name: str) -> None:
    phi = np.linspace(turn.entry.phi - 0.6, turn.exit.phi + 0.6, 400)
    values, _ = turn.source.sample(phi)
    x = (values[:, 0] + turn.operation.spacing * phi / (2 * np.pi)) * 1e3
    surface = turn.surface[0]
    plant = np.interp(turn.lowest.phi, phi, x)
    y = (values[:, 1] - surface) * 1e3
    axes.plot(x - plant, y, color=colour, label=name)
    inside = np.flatnonzero((phi >= turn.entry.phi) & (phi <= turn.exit.phi))
    for k in inside[:: max(1, len(inside) // 9)]:
        direction = -np.exp(1j * values[k, 6])  # from the tip to I
        length = min(geometry["L9"] * 1e3, (15 - y[k]) / direction.imag)
        axes.plot([x[k] - plant, x[k] - plant + length * direction.real], [y[k], y[k] + length * direction.imag],
                  color=colour, linewidth=0.8, alpha=0.55)  # fmt: skip


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
    axes.set(xlabel=_label(names[0]), ylabel=_label(names[1]))
    axes.set_xlim(low[0], max(low[1], published[0] * scale[0] * 1.05))
    axes.set_ylim(high[0], max(high[1], published[1] * scale[1] * 1.05))
    axes.legend()
    axes.set_title("What one costs in the other: nothing lies to the lower left of the line", loc="left", color=NOTE)
    return figure


def _label(name: str) -> str:
    unit = MEASURES[name].unit.replace("s2", "s²").replace("s3", "s³")
    return name.replace("_", " ") + ("" if unit == "1" else f" / ({unit})")
