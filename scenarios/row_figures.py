"""The figures of the field row: the row from the side, a turn of the crank, the energy, the errors."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display needed

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator  # noqa: E402

from scenarios.figures import BLACK, BLUE, GREEN, GREY, VERMILLION, save_all  # noqa: E402
from scenarios.row_run import EMPTY, MISSED, NO_SEEDLING, PLANTED, Hole, Record  # noqa: E402
from scenarios.row_study import LINKAGE, MASTERS, STEPS_MS, Study  # noqa: E402

EARTH, EARTH_EDGE, ORANGE, PINK = "#E8DCCB", "#8C6D46", "#E69F00", "#CC79A7"
PLANTS_A_STRIP, STRIPS = 10, 6
FATES = {PLANTED: (GREEN, "planted"), EMPTY: (GREY, "hole without a plant: cup left empty"),
         MISSED: (VERMILLION, "hole without a plant: seedling missed the nozzle"),
         NO_SEEDLING: (BLACK, "hole without a plant: no seedling")}
LOOKS = {"jacobi": (BLUE, "s"), "gauss_seidel": (ORANGE, "v"), "extrapolated": (VERMILLION, "o"),
         "held": (BLACK, "s"), "angle": (GREEN, "o"), "angle_speed": (BLUE, "D"), "rates": (VERMILLION, "o")}


def draw_all(output: Path, record: Record, spacing: float, study: Study | None) -> list[Path]:
    """Write row.png, turn.png, energy.png and, with a study, errors.png; returns their paths."""
    figures = {"row": lambda: draw_row(record, spacing), "turn": lambda: draw_turn(record),
               "energy": lambda: draw_energy(record)}
    if study:
        figures["errors"] = lambda: draw_errors(study)
    return save_all(output, figures)


def draw_row(record: Record, spacing: float) -> Figure:
    """The ridge cut along the row, up to ten plants a strip: the tip's path, holes, plants, and what is missing."""
    holes = record.holes
    wide = min(max(len(holes), PLANTS_A_STRIP // 2), PLANTS_A_STRIP) * spacing
    count = min(max(1, int(np.ceil(len(holes) / PLANTS_A_STRIP))), STRIPS)
    first = (holes[0].plant_x if holes else 0.0) - spacing / 2
    x, y = record["linkage.ground.x"], record["linkage.ground.y"]
    ridge = y + record["soil.tip.depth"]
    ridge = np.where(np.isfinite(ridge), ridge, y.min())  # a soil may not offer the depth
    mean = float(ridge.mean())
    bottom, top = mean - 0.16, mean + 0.29
    scale = 15.0 / wide  # inches a metre
    tall = (top - bottom) * scale
    gap, head, foot = 0.28, 0.62, 0.95
    height = head + count * (tall + gap) + foot
    figure = plt.figure(figsize=(16.2, height))
    by_x = np.argsort(x)
    for strip in range(count):
        left = first + strip * wide
        below = height - head - strip * (tall + gap) - tall
        axes = figure.add_axes((0.75 / 16.2, below / height, 15 / 16.2, tall / height))
        axes.set(xlim=(left, left + wide), ylim=(bottom, top), aspect="equal")
        axes.fill_between(x[by_x], bottom, ridge[by_x], color=EARTH, linewidth=0, zorder=0)
        axes.plot(x[by_x], ridge[by_x], color=EARTH_EDGE, linewidth=0.9, zorder=1)
        axes.plot(x, y, color=BLUE, linewidth=0.7, zorder=2)
        for number, hole in enumerate(holes, start=1):
            if left <= hole.plant_x < left + wide:
                _hole(axes, hole, number, np.interp([hole.entry, hole.exit, hole.plant_x], x[by_x], ridge[by_x]))
        axes.set_ylabel("y / m")
        axes.yaxis.set_major_locator(FixedLocator([-0.4, -0.2]))
        axes.grid(visible=False)
    axes.set_xlabel("ground.x / m, direction of travel")
    shown = {hole.seedling for hole in holes}
    handles = [Line2D([], [], color=BLUE, linewidth=1.2, label="path of the nozzle's tip over ground"),
               Line2D([], [], color=BLACK, linewidth=2.4, label="hole at the surface")]
    handles += [Line2D([], [], color=colour, linestyle="-" if fate == PLANTED else "none", linewidth=2,
                       marker="^" if fate == PLANTED else "x", markersize=7, markeredgewidth=2, label=label)
                for fate, (colour, label) in FATES.items() if fate in shown]
    figure.legend(handles=handles, loc="lower center", ncols=3 if len(handles) > 4 else len(handles))
    more = f"; the first {STRIPS * PLANTS_A_STRIP} of {len(holes)}" if len(holes) > STRIPS * PLANTS_A_STRIP else ""
    figure.text(0.012, 1 - 0.12 / height, f"The planted row from the side, to scale{more}", va="top", fontsize=12)
    return figure


def _hole(axes: Axes, hole: Hole, number: int, surface: np.ndarray) -> None:
    at_entry, at_exit, at_plant = surface
    colour, _ = FATES[hole.seedling]
    axes.plot([hole.entry, hole.exit], [at_entry, at_exit], color=BLACK, linewidth=2.4, zorder=4, solid_capstyle="butt")
    if hole.seedling == PLANTED:
        foot = at_plant - hole.depth + 0.01
        lean = hole.lean
        stem = 0.10 + hole.depth
        tip = hole.plant_x + stem * np.sin(lean), foot + stem * np.cos(lean)
        axes.plot([hole.plant_x, tip[0]], [foot, tip[1]], color=colour, linewidth=2.0, zorder=5)
        axes.plot(*tip, "^", color=colour, markersize=8, zorder=5)
    else:
        axes.plot(hole.plant_x, at_plant + 0.035, "x", color=colour, markersize=8, markeredgewidth=2.2, zorder=5)
    axes.text(hole.plant_x, at_plant - hole.depth - 0.036, str(number), ha="center", va="center", fontsize=8,
              color=EARTH_EDGE)


def draw_turn(record: Record) -> Figure:
    """Signals over one turn of the crank from the middle of the row."""
    turns = record["drivetrain.crank.phi"] / (2 * np.pi)
    middle = np.floor(turns.max() / 2)
    part = (turns >= middle) & (turns <= middle + 1)
    phi = 360 * (turns[part] - middle)

    def of(name: str) -> np.ndarray:
        return record[name][part]

    figure, panels = plt.subplots(4, 1, figsize=(9.5, 10.5), layout="constrained", sharex=True)
    heights, forces, torques, speeds = panels
    heights.plot(phi, of("linkage.ground.y"), color=BLUE, linewidth=1.6, label="nozzle's tip, ground.y")
    heights.plot(phi, of("linkage.ground.y") + of("soil.tip.depth"), color=EARTH_EDGE, linewidth=1.4,
                 linestyle=(0, (6, 3)), label="ridge below the tip")
    falling = of("conveyor.seedling.y")
    rest = np.max(falling, initial=-np.inf)
    heights.plot(phi, np.where(falling < rest, falling, np.nan), color=GREEN, linewidth=2.0, label="falling seedling")
    loaded = of("conveyor.seedling.in_nozzle")
    heights.fill_between(phi, 0, 1, where=loaded > 0, transform=heights.get_xaxis_transform(), color=GREEN, alpha=0.10,
                         linewidth=0, label="seedling in the nozzle")
    heights.set_ylabel("height above O / m")
    forces.plot(phi, of("soil.tip.fx"), color=BLUE, linewidth=1.6, linestyle="--", label="tip.fx, forward")
    forces.plot(phi, of("soil.tip.fy"), color=VERMILLION, linewidth=1.6, linestyle="-.", label="tip.fy, up")
    forces.set_ylabel("force of the soil / N")
    torques.plot(phi, of("linkage.crank.tau"), color=VERMILLION, linewidth=1.6, label="crank.tau: taken by the linkage")
    torques.plot(phi, of("drivetrain.shaft.tau"), color=BLACK, linewidth=1.4, label="shaft.tau: in the shaft")
    torques.set_ylabel("torque / N·m")
    speeds.plot(phi, of("drivetrain.crank.w") * 30 / np.pi, color=BLUE, linewidth=1.6, label="crank")
    speeds.set_ylabel("crank speed / rpm")
    speeds.set_xlabel("crank angle φ / degrees (0: nozzle at its top)")
    speeds.set(xlim=(0, 360), xticks=np.arange(0, 361, 30))
    for panel in panels:
        if panel.get_legend_handles_labels()[0] and panel is not speeds:
            panel.legend(loc="upper right")
        in_soil = of("soil.tip.depth") > 0
        panel.fill_between(phi, 0, 1, where=in_soil, transform=panel.get_xaxis_transform(), color=EARTH, linewidth=0,
                           zorder=0)
    figure.suptitle("One turn of the crank in the middle of the row (brown: the tip is in the soil)", x=0.01, ha="left",
                    fontsize=11)
    return figure


def draw_energy(record: Record) -> Figure:
    """What the tractor gave, where it went, and what the balance lacks."""
    time = record.time
    parts = (("drivetrain.energy.stored", "stored in shaft and crank", BLUE),
             ("drivetrain.energy.shaft", "heat in the shaft", ORANGE),
             ("soil.energy.soil", "taken by the soil", EARTH_EDGE))
    figure, (above, below) = plt.subplots(2, 1, figsize=(9.5, 6.6), layout="constrained", sharex=True,
                                          height_ratios=(2.2, 1))
    above.stackplot(time, [record[name] for name, _, _ in parts], labels=[label for _, label, _ in parts],
                    colors=[colour for *_, colour in parts], alpha=0.55, linewidth=0)
    above.plot(time, record["drivetrain.energy.tractor"], color=BLACK, linewidth=1.4, label="given by the tractor")
    above.set_ylabel("energy since the start / J")
    above.legend(loc="upper left", reverse=True)
    below.plot(time, record.imbalance, color=VERMILLION, linewidth=1.1)
    below.axhline(0, color=GREY, linewidth=0.8)
    below.set_ylabel("given − all others / J")
    below.set_xlabel("time / s")
    figure.suptitle("Energy of the coupled system; below, the error of the coupling", x=0.01, ha="left", fontsize=11)
    return figure


def draw_errors(study: Study) -> Figure:
    """Worst error of the tip over the step: of the masters, and split for the linkage's couplings."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(14, 5.2), layout="constrained")
    for way in MASTERS:
        colour, marker = LOOKS[way.key]
        errors = study.of(way.key)
        steps = [1e3 * e.step for e in errors]
        order = study.order(way.key, "worst")
        left.loglog(steps, [1e3 * e.worst for e in errors], color=colour, marker=marker, linewidth=1.4,
                    linestyle="--" if way.key == "gauss_seidel" else "-", label=f"{way.title} (order {order:.1f})")
        order = study.order(way.key, "imbalance")
        right.loglog(steps, [100 * e.imbalance / study.work for e in errors], color=colour, marker=marker,
                     linewidth=1.4, linestyle="--" if way.key == "gauss_seidel" else "-",
                     label=f"{way.title} (order {order:.1f})")
    for k, (axes, what, scale) in enumerate(((left, "worst", 1e3), (right, "imbalance", 100 / study.work))):
        axes.loglog([1e3 * e.step for e in study.controlled], [scale * getattr(e, what) for e in study.controlled],
                    "*", color=PINK, markersize=10,
                    label="steps controlled (mean, repeated ones included)" if not k else None)
    left.set_title("(a) masters: error of the tip", loc="left")
    right.set_title("(c) masters: error of the energy", loc="left")
    for way in LINKAGE:
        colour, marker = LOOKS[way.key]
        errors = study.of(way.key)
        middle.loglog([1e3 * e.step for e in errors], [1e3 * e.own_worst for e in errors], color=colour, marker=marker,
                      linewidth=1.4, label=way.title)
    rest = study.of(LINKAGE[-1].key)
    middle.loglog([1e3 * e.step for e in rest], [1e3 * e.rest_worst for e in rest], color=GREY, linewidth=2.4, zorder=1,
                  label="the rest of the system, for comparison")
    middle.set_title("(b) the linkage's own share, by what is connected", loc="left")
    for axes in (left, middle, right):
        axes.set_xlabel("communication step / ms")
        axes.xaxis.set_major_locator(FixedLocator(STEPS_MS))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda step, _: f"{step:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.legend(loc="upper left" if axes is not middle else "best", fontsize=8)
    left.set_ylabel("worst error / mm")
    middle.set_ylabel("worst error / mm")
    right.set_ylabel("worst imbalance / % of the tractor's work")
    for axes in (left, middle, right):
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (30 if axes is middle else 8))
    figure.suptitle("Error against communication step, in a row of three plants", x=0.005, ha="left", fontsize=11)
    return figure
