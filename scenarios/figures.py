"""Figures 3 to 8 of the paper, redrawn from the FMU's outputs.

Axes of trajectories are in mm, x forward and y up, and equal. Families carry a sequential
palette (viridis), components the colour-blind-safe palette of Okabe and Ito.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display needed

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.ticker import MultipleLocator  # noqa: E402

from scenarios import measures  # noqa: E402
from scenarios.cycle import Turns  # noqa: E402
from scenarios.families import FamilyRun  # noqa: E402
from scenarios.measures import CommonPoint, Shape  # noqa: E402
from scenarios.published import BORDERS  # noqa: E402

DPI = 160
BLUE, VERMILLION, GREEN, BLACK, GREY = "#0072B2", "#D55E00", "#009E73", "#000000", "#7F7F7F"
SYMBOLS = {"L1": "$L_1$", "L4": "$L_4$", "L7": "$L_7$", "theta41": r"$\theta_{41}$"}
# Where the static panel has room beside the nozzle's root I for a border's name: mm, x + iy.
ROOT_LABELS_MM = {"I": 8 + 12j, "II": -11 + 7j, "III": 13 + 0j, "IV": 14 + 2j, "V": -9 + 11j, "VI": 6 + 12j}
UNITS = {"mm": " mm", "deg": "°"}
STYLE = {"font.size": 9, "axes.titlesize": 10, "axes.grid": True, "grid.color": "#E4E4E4", "grid.linewidth": 0.6,
         "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False,
         "legend.frameon": False, "savefig.dpi": DPI}


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


def draw_all(output: Path, families: Sequence[FamilyRun], nominal: Turns, plants: Turns, nozzle_mm: float,
             surface_mm: float, common: tuple[CommonPoint, CommonPoint], shapes: dict[float, Shape],
             done: Callable[[], object]) -> list[Path]:
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


def _panels(curves: Sequence[Sequence[np.ndarray]], margin_mm: float, width: float,
            legend: float = 0.0, gap: float = 0.85, top: float = 0.62) -> tuple[Figure, list[Axes]]:
    """Panels side by side that show their curves to one scale, without unused space.

    In inches: the figure's ``width``, the height kept free for a ``legend`` below and for
    titles on ``top``, the ``gap`` between panels.
    """
    points = [np.concatenate(c) for c in curves]
    bottom_mm = min(p.imag.min() for p in points) - margin_mm
    top_mm = max(p.imag.max() for p in points) + margin_mm
    spans = [(p.real.min() - margin_mm, p.real.max() + margin_mm) for p in points]
    left, right, bottom = 0.75, 0.2, 0.55 + legend
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
    axes.axhline(surface_mm, color="#8C6D46", linewidth=1.0, linestyle=(0, (6, 3)), zorder=1, label="ridge surface")


def draw_family(run: FamilyRun, surface_mm: float, common: tuple[CommonPoint, CommonPoint] | None,
                shapes: dict[float, Shape]) -> Figure:
    """Static and dynamic trajectories of one family, a curve a value."""
    family, symbol, unit = run.family, SYMBOLS[run.family.symbol], UNITS[run.family.unit]
    static = [turns.static_mm for _, turns in run.reached]
    dynamic = [turns.dynamic_mm for _, turns in run.reached]
    figure, (left, right) = _panels((static, dynamic), margin_mm=20, width=10.0, legend=0.75)
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.85, len(static)))
    for (value, _), s, d, colour in zip(run.reached, static, dynamic, colours):
        nominal = value == run.nominal_value
        label = f"{symbol} = {value:g}{unit}"
        if value in shapes:
            label += f"  {shapes[value].name or '(between shapes)'}"
        if nominal:
            label += "  (published set)"
        width = 2.4 if nominal else 1.4
        left.plot(s.real, s.imag, color=colour, linewidth=width, label=label)
        right.plot(d.real, d.imag, color=colour, linewidth=width)
    _surface(right, surface_mm)
    if common:
        left.plot([p.point.real for p in common], [p.point.imag for p in common], "o", markersize=11,
                  markerfacecolor="none", markeredgecolor=VERMILLION, markeredgewidth=1.4, label="common points")
    handles, labels = left.get_legend_handles_labels()
    line, text = right.get_legend_handles_labels()
    for member in (m for m in run.members if m.turns is None):
        handles.append(plt.Line2D([], [], linestyle="none"))
        labels.append(f"{symbol} = {member.value:g}{unit}: cannot make a whole turn")
    figure.legend(handles + line, labels + text, loc="lower center", ncols=4)
    _label(left, "(a) static trajectory", "tip")
    _label(right, "(b) dynamic trajectory, one plant", "ground")
    _title(figure, f"Figure {family.figure}: {family.title} {symbol}")
    return figure


def draw_shapes(run: FamilyRun, shapes: dict[float, Shape]) -> Figure:
    """The static trajectories of the phase difference side by side, to compare their shapes."""
    figure, panels = _panels([[turns.static_mm] for _, turns in run.reached],
                             margin_mm=12, width=10.0, gap=0.2, top=0.85)
    for axes, (value, turns) in zip(panels, run.reached):
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
    colours = plt.get_cmap("plasma")(np.linspace(0.0, 0.8, len(at)))
    for axes, curve, tip in ((left, static, tips[0]), (right, dynamic, tips[1])):
        axes.plot(curve.real, curve.imag, color=GREY, linewidth=1.8)
        for name, j, r, colour in zip(BORDERS, tip, root, colours):
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
        right.annotate(f"hole {dug.size:.1f} mm", (middle + 0.5 * dug.size, surface_mm), (middle + 75, surface_mm - 55),
                       arrowprops={"arrowstyle": "-", "color": BLACK, "linewidth": 0.8}, va="center", fontsize=9)
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
    panels = (("velocity / (m/s)", "v", "tip.vx", "tip.vy", nominal.speed),
              ("acceleration / (m/s²)", "a", "tip.ax", "tip.ay", nominal.acceleration))
    edges = [*BORDERS.values(), 360.0]
    for panel, (title, letter, x, y, magnitude) in zip(axes, panels):
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
        axes[0].annotate(f"{name}\n{border:.0f}°", (border, 1.0), (0, 3), xycoords=axes[0].get_xaxis_transform(),
                         textcoords="offset points", ha="center", va="bottom", fontsize=9)
    bottom = measures.lowest(phi, nominal["tip.y"]).phi_deg
    for panel in axes:
        panel.axvline(bottom, color=GREEN, linewidth=1.2, linestyle=":", zorder=1)
    axes[0].annotate(f"lowest point {bottom:.1f}°", (bottom, -1.55), (205, -1.55), color=GREEN, va="center",
                     arrowprops={"arrowstyle": "-", "color": GREEN, "linewidth": 0.8})
    axes[-1].set_xticks(np.arange(0, 361, 30))
    axes[-1].set_xlabel("crank angle φ / degrees")
    figure.suptitle("Figure 8: velocity and acceleration of the tip J relative to the machine",
                    x=0.01, ha="left", fontsize=11)
    return figure
