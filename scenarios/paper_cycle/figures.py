"""Figures 3 to 8 of the paper, redrawn from the FMU's outputs.

Axes of trajectories are in mm, x forward and y up, and equal. The published set is black in every family; each other
curve has its colour of the palette of Okabe and Ito, and its value beside its end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from scenarios.common import measures
from scenarios.common.figures import (
    BLACK,
    BLUE,
    EARTH_EDGE,
    GREEN,
    GREY,
    NOTE,
    ORANGE,
    PINK,
    SKY,
    STYLE,
    VERMILLION,
    name_ends,
)
from scenarios.common.linkage import Turns
from scenarios.common.measures import CommonPoint, Shape
from scenarios.paper_cycle.families import FamilyRun
from scenarios.paper_cycle.published import BORDERS

SYMBOLS = {"L1": "$L_1$", "L4": "$L_4$", "L7": "$L_7$", "theta41": r"$\theta_{41}$"}
# Where the static panel has room beside the nozzle's root I for a border's name: mm, x + iy.
ROOT_LABELS_MM = {"I": 8 + 12j, "II": -11 + 7j, "III": 13 + 0j, "IV": 14 + 2j, "V": -9 + 11j, "VI": 6 + 12j}
UNITS = {"mm": " mm", "deg": "°"}
FAMILY_COLOURS = (BLUE, SKY, GREEN, ORANGE, VERMILLION, PINK)  # of all but the published set, as the values rise


def draw_all(
    output: Path,
    families: Sequence[FamilyRun],
    nominal: Turns,
    plants: Turns,
    *,
    nozzle_mm: float,
    surface_mm: float,
    common: tuple[CommonPoint, CommonPoint],
    shapes: dict[float, Shape],
    done: Callable[[], object],
) -> list[Path]:
    """Write figure_3.png to figure_8.png and figure_4_shapes.png; ``done`` is called after each."""
    paths = []

    def save(number: int | str, figure: Figure) -> None:
        path = output / f"figure_{number}.png"
        figure.savefig(path)
        plt.close(figure)
        paths.append(path)
        done()

    with plt.rc_context(STYLE):
        for run in families:
            number = run.family.figure
            save(number, draw_family(run, surface_mm, common if number == 3 else None, shapes if number == 4 else {}))
            if number == 4:
                save("4_shapes", draw_shapes(run, shapes))
        save(7, draw_trajectories(nominal, plants, nozzle_mm, surface_mm))
        save(8, draw_rates(nominal))
    return paths


def _label(axes: Axes, title: str, frame: str) -> None:
    axes.set_title(title, loc="left")
    axes.set_xlabel(f"{frame}.x / mm (forward)")
    axes.set_ylabel(f"{frame}.y / mm (up)")


def _panels(
    curves: Sequence[Sequence[np.ndarray]],
    margin_mm: float,
    width: float,
    *,
    legend: float = 0.0,
    gap: float = 0.85,
    top: float = 0.62,
    right: float = 0.2,
) -> tuple[Figure, list[Axes]]:
    """Panels side by side that show their curves to one scale, without unused space.

    In inches: the figure's ``width``, the height kept free for a ``legend`` below and for
    titles on ``top``, the ``gap`` between panels, the width kept free on the ``right``.
    """
    points = [np.concatenate(c) for c in curves]
    bottom_mm = min(p.imag.min() for p in points) - margin_mm
    top_mm = max(p.imag.max() for p in points) + margin_mm
    spans = [(p.real.min() - margin_mm, p.real.max() + margin_mm) for p in points]
    left, bottom = 0.75, 0.55 + legend
    inch_per_mm = (width - left - gap * (len(spans) - 1) - right) / sum(b - a for a, b in spans)
    tall = (top_mm - bottom_mm) * inch_per_mm
    height = tall + top + bottom
    figure = plt.figure(figsize=(width, height))
    panels, x = [], left
    for a, b in spans:
        wide = (b - a) * inch_per_mm
        axes = figure.add_axes((x / width, bottom / height, wide / width, tall / height))
        axes.set(xlim=(a, b), ylim=(bottom_mm, top_mm), aspect="equal")
        panels.append(axes)
        x += wide + gap
    return figure, panels


def _title(figure: Figure, text: str) -> None:
    figure.text(0.012, 1 - 0.09 / figure.get_figheight(), text, ha="left", va="top", fontsize=11)


def _surface(axes: Axes, surface_mm: float) -> None:
    axes.axhline(surface_mm, color=EARTH_EDGE, linewidth=1.0, linestyle=(0, (6, 3)), zorder=1)


def draw_family(
    run: FamilyRun, surface_mm: float, common: tuple[CommonPoint, CommonPoint] | None, shapes: dict[float, Shape]
) -> Figure:
    """Static and dynamic trajectories of one family, a curve a value."""
    family, symbol, unit = run.family, SYMBOLS[run.family.symbol], UNITS[run.family.unit]
    static = [turns.static_mm for _, turns in run.reached]
    dynamic = [turns.dynamic_mm for _, turns in run.reached]
    refused = [f"{member.value:g}{unit}" for member in run.members if member.turns is None]
    room = 2.1 if shapes else 1.5  # inches, for the names at the curves' ends
    figure, (left, right) = _panels((static, dynamic), 20, 10.4, legend=0.22 if refused else 0.0, right=room)
    colours = iter(FAMILY_COLOURS)
    ends = []
    for (value, _), s, d in zip(run.reached, static, dynamic, strict=True):
        nominal = value == run.nominal_value
        colour, width = (BLACK, 2.2) if nominal else (next(colours), 1.5)
        name = f"{symbol} = {value:g}{unit}" + (", published" if nominal else "")
        if value in shapes:
            name += f": {shapes[value].name or 'between shapes'}"
        for axes, curve in ((left, s), (right, d)):
            axes.plot(curve.real, curve.imag, color=colour, linewidth=width, zorder=3 if nominal else 2)
        ends.append((float(d[-1].real), float(d[-1].imag), name, colour))
    name_ends(right, ends)
    _surface(right, surface_mm)
    right.text(right.get_xlim()[0] + 4, surface_mm + 4, "ridge surface", color="#6B5233", fontsize=8.5)
    if common:
        points = [p.point for p in common]
        look = {"markersize": 11, "markerfacecolor": "none", "markeredgecolor": PINK, "markeredgewidth": 1.6}
        left.plot([p.real for p in points], [p.imag for p in points], "o", zorder=4, **look)
        middle = sum(points) / len(points)
        left.text(middle.real, middle.imag, "common\npoints", ha="center", va="center", color="#9C4A78", fontsize=8.5)
    if refused:
        many = "make" if len(refused) > 1 else "makes"
        note = f"Not drawn: {symbol} = {', '.join(refused)}, which {many} no whole turn."
        figure.text(0.75 / figure.get_figwidth(), 0.1 / figure.get_figheight(), note, color=NOTE, fontsize=8.5)
    _label(left, "(a) static trajectory", "tip")
    _label(right, "(b) dynamic trajectory, one plant", "ground")
    _title(figure, f"Figure {family.figure}: {family.title} {symbol}")
    return figure


def draw_shapes(run: FamilyRun, shapes: dict[float, Shape]) -> Figure:
    """The static trajectories of the phase difference side by side, to compare their shapes."""
    figure, panels = _panels(
        [[turns.static_mm] for _, turns in run.reached], margin_mm=12, width=10.0, gap=0.2, top=0.85
    )
    for axes, (value, turns) in zip(panels, run.reached, strict=True):
        curve = turns.static_mm
        axes.plot(curve.real, curve.imag, color=BLUE, linewidth=1.8)
        name = shapes[value].name or "(between shapes)"
        axes.set_title(f"{SYMBOLS[run.family.symbol]} = {value:g}°\n{name}", fontsize=9)
        axes.xaxis.set_major_locator(MultipleLocator(50))
        axes.set_xlabel("tip.x / mm")
        axes.tick_params(labelleft=axes is panels[0])
    panels[0].set_ylabel("tip.y / mm (up)")
    _title(figure, "Figure 4a, each curve alone: static trajectories and the paper's names for such shapes")
    return figure


def draw_trajectories(nominal: Turns, plants: Turns, nozzle_mm: float, surface_mm: float) -> Figure:
    """Figure 7: static and dynamic trajectories with the nozzle at the phase borders."""
    static, dynamic = nominal.static_mm, plants.dynamic_mm
    at = [int(np.argmin(np.abs(nominal.phi_deg - border))) for border in BORDERS.values()]
    # I, the nozzle's root, lies behind J against the direction of tip.angle.
    root = -nozzle_mm * np.exp(1j * nominal["tip.angle"][at])
    tips = (static[at], nominal.dynamic_mm[at])
    every = [static, tips[0] + root], [dynamic, tips[1] + root]
    figure, (left, right) = _panels(every, margin_mm=35, width=12.5)
    colours = (BLACK, BLUE, SKY, GREEN, VERMILLION, "#B27A00")
    for axes, curve, tip in ((left, static, tips[0]), (right, dynamic, tips[1])):
        axes.plot(curve.real, curve.imag, color=GREY, linewidth=1.8)
        for name, j, r, colour in zip(BORDERS, tip, root, colours, strict=True):
            i = j + r
            axes.plot([i.real, j.real], [i.imag, j.imag], color=colour, linewidth=1.8, solid_capstyle="round")
            axes.plot(j.real, j.imag, "o", color=colour, markersize=4.2)
            beside = i + (ROOT_LABELS_MM[name] if axes is left else 14 * r / abs(r))
            axes.text(beside.real, beside.imag, name, ha="center", va="center", color=colour, fontweight="bold")
        axes.xaxis.set_major_locator(MultipleLocator(100))
        axes.yaxis.set_major_locator(MultipleLocator(100))
    _surface(right, surface_mm)
    dug = measures.hole(nominal.dynamic_mm, surface_mm)
    if dug:
        # Marked at the last plant, clear of the nozzles at the first.
        shift = float((dynamic[-1] - dynamic[0] - (nominal.dynamic_mm[-1] - nominal.dynamic_mm[0])).real)
        middle = 0.5 * (dug.entry + dug.exit).real + shift
        for x in (dug.entry.real, dug.exit.real):
            right.plot(x + shift, surface_mm, "o", color=BLACK, markersize=4)
        right.plot([dug.entry.real + shift, dug.exit.real + shift], [surface_mm] * 2, color=BLACK, linewidth=2)
        right.annotate(
            f"hole {dug.size:.1f} mm",
            (middle + 0.5 * dug.size, surface_mm),
            (middle + 75, surface_mm - 55),
            arrowprops={"arrowstyle": "-", "color": BLACK, "linewidth": 0.8},
            va="center",
            fontsize=9,
        )
        right.text(dynamic.real.min() - 25, surface_mm + 6, "ridge surface", color="#6B5233", fontsize=9)
    _label(left, "(a) static trajectory", "tip")
    _label(right, "(b) dynamic trajectory, two plants", "ground")
    angles = ", ".join(f"{name} {angle:.0f}°" for name, angle in BORDERS.items())
    _title(figure, f"Figure 7: trajectory of the tip J, and nozzle IJ at the phase borders ({angles})")
    return figure


def draw_rates(nominal: Turns) -> Figure:
    """Figure 8: speed and acceleration over one turn, relative to the machine."""
    phi = nominal.phi_deg
    figure, axes = plt.subplots(2, 1, figsize=(9.5, 7.4), layout="constrained", sharex=True)
    panels = (
        ("velocity / (m/s)", "v", "tip.vx", "tip.vy", nominal.speed),
        ("acceleration / (m/s²)", "a", "tip.ax", "tip.ay", nominal.acceleration),
    )
    edges = [*BORDERS.values(), 360.0]
    for panel, (title, letter, x, y, magnitude) in zip(axes, panels, strict=True):
        for k in range(0, len(edges) - 1, 2):
            panel.axvspan(edges[k], edges[k + 1], color="#F1F1F1", zorder=0, linewidth=0)
        for border in BORDERS.values():
            panel.axvline(border, color=GREY, linewidth=0.8, zorder=1)
        panel.axhline(0, color=GREY, linewidth=0.8, zorder=1)
        panel.plot(phi, nominal[x], color=BLUE, linewidth=1.6, linestyle="--", label=f"{x}, forward")
        panel.plot(phi, nominal[y], color=VERMILLION, linewidth=1.6, linestyle="-.", label=f"{y}, up")
        panel.plot(phi, magnitude, color=BLACK, linewidth=1.8, label=f"|{letter}|")
        panel.set_ylabel(title)
        panel.set_xlim(0, 360)
        panel.legend(loc="upper right")
    for name, border in BORDERS.items():
        axes[0].annotate(
            f"{name}\n{border:.0f}°",
            (border, 1.0),
            (0, 3),
            xycoords=axes[0].get_xaxis_transform(),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=9,
        )
    bottom = measures.lowest(phi, nominal["tip.y"]).phi_deg
    for panel in axes:
        panel.axvline(bottom, color=GREEN, linewidth=1.2, linestyle=":", zorder=1)
    axes[0].annotate(
        f"lowest point {bottom:.1f}°",
        (bottom, -1.55),
        (205, -1.55),
        color=GREEN,
        va="center",
        arrowprops={"arrowstyle": "-", "color": GREEN, "linewidth": 0.8},
    )
    axes[-1].set_xticks(np.arange(0, 361, 30))
    axes[-1].set_xlabel("crank angle φ / degrees")
    figure.suptitle(
        "Figure 8: velocity and acceleration of the tip J relative to the machine", x=0.01, ha="left", fontsize=11
    )
    return figure
