"""Designs beside one another: their figures, by the measures that all scenarios share, and a picture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from transplanter_linkage import Geometry, solve
from transplanter_linkage.measures import MEASURES, TORQUE, Operation, Turn

from scenarios.common import reports
from scenarios.common.figures import BLUE, EARTH, EARTH_EDGE, GREEN, GREY, ORANGE, VERMILLION, save_all
from scenarios.common.turn import FmuSource
from scenarios.common.variants import PUBLISHED, Variant

COLOURS = (GREY, BLUE, VERMILLION, GREEN, ORANGE)
LINKS = (("O", "A"), ("A", "B"), ("C", "D"), ("D", "B"), ("D", "E"), ("E", "F"), ("G", "F"), ("H", "I"), ("I", "J"))


def designs(turns: Mapping[str, Turn], geometries: Mapping[str, Mapping[str, float]]) -> Figure:
    """Each design's path relative to the machine, with its linkage at the lowest point; over ground, about the plant,
    with the nozzle as it passes the surface; and its speed and acceleration over the turn.
    """
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


class Held:
    """A source with one geometry, though others use the same FMU in between; it tells of motion, not of torque."""

    def __init__(self, source: FmuSource, geometry: Mapping[str, float]) -> None:
        self._source, self._geometry = source, geometry

    def sample(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self._source.set(self._geometry).sample(phi)

    def gradient(self, phi: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return self._source.set(self._geometry).gradient(phi, weights)


def number(name: str, value: float) -> str:
    """A measure's value in its unit, without it."""
    return "none" if math.isnan(value) else f"{MEASURES[name].shown(value):.{3 if MEASURES[name].unit == '1' else 2}f}"


def label(name: str) -> str:
    """A measure's name with the unit that `number` gives it in."""
    unit = MEASURES[name].unit
    return name.replace("_", " ") + ("" if unit == "1" else f" / {unit}" if "/" not in unit else f" / ({unit})")


def turns(source: FmuSource, variants: Sequence[Variant], operation: Operation) -> dict[str, Turn]:
    """Of the published design and of each variant, by name. Raises Refused where one makes no whole turn."""
    geometries = geometries_of(source, variants)
    return {name: Turn(Held(source, geometry), operation) for name, geometry in geometries.items()}


def geometries_of(source: FmuSource, variants: Sequence[Variant]) -> dict[str, dict[str, float]]:
    """Of the published design and of each variant, by name."""
    return {PUBLISHED: source.nominal} | {each.name: each.geometry(source.nominal) for each in variants}


def table(found: Mapping[str, Turn]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: a measure each, a column each design."""
    values = {name: turn.measure() for name, turn in found.items()}
    told = [
        name for name in MEASURES if name not in TORQUE or not all(math.isnan(each[name]) for each in values.values())
    ]
    rows = [(label(name), *(number(name, each[name]) for each in values.values())) for name in told]
    return ("figure", *values), rows


def write(output: Path, source: FmuSource, variants: Sequence[Variant], found: Mapping[str, Turn]) -> list[Path]:
    """designs.md, designs.csv and designs.png; returns the paths."""
    text, values = output / "designs.md", output / "designs.csv"
    parts = [
        "# Designs beside one another",
        "",
        reports.markdown_table(*table(found)),
        "![Paths and linkages](designs.png)",
    ]
    text.write_text("\n".join([*parts, ""]), encoding="utf-8")
    measured = {name: turn.measure() for name, turn in found.items()}
    rows = ((name, *(each[name] for each in measured.values())) for name in MEASURES)
    reports.write_csv(values, ("measure, SI units", *measured), rows)
    geometries = geometries_of(source, variants)
    return [text, values, *save_all(output, {"designs": lambda: designs(found, geometries)})]
