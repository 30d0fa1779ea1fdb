"""The figures of the field row: the row from the side, a turn of the crank, the energy, the errors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from scenarios.common.figures import (
    BLACK,
    BLUE,
    EARTH,
    EARTH_EDGE,
    GREEN,
    GREY,
    ORANGE,
    PINK,
    SKY,
    VERMILLION,
    name_ends,
    save_all,
)
from scenarios.common.operating_point import SPACING
from scenarios.field_row import mass_study
from scenarios.field_row.mass_study import HANDS, MassStudy
from scenarios.field_row.run import EMPTY, MISSED, NO_SEEDLING, PLANTED, Hole, Record
from scenarios.field_row.study import MASTERS, STEPS_MS, Errors, Study

PLANTS_A_STRIP, STRIPS = 10, 6
IN_MM = FuncFormatter(lambda metres, _: f"{round(1e3 * metres):d}".replace("-", "\N{MINUS SIGN}"))
FATES = {
    PLANTED: (GREEN, "planted"),
    EMPTY: (GREY, "hole without a plant: cup left empty"),
    MISSED: (VERMILLION, "hole without a plant: seedling missed the nozzle"),
    NO_SEEDLING: (BLACK, "hole without a plant: no seedling"),
}
LOOKS = {
    "jacobi": (BLUE, "s"),
    "gauss_seidel": (ORANGE, "v"),
    "extrapolated": (VERMILLION, "o"),
    "held": (BLACK, "s"),
    "angle": (GREEN, "o"),
    "angle_speed": (BLUE, "D"),
    "rates": (VERMILLION, "o"),
}


def draw_record(output: Path, record: Record, spacing: float | None) -> list[Path]:
    """Write row.png, turn.png and, where all energies are offered, energy.png; their paths."""
    figures = {"row": lambda: draw_row(record, spacing or SPACING), "turn": lambda: draw_turn(record)}
    if record.offers(*(name for name, *_ in ENERGIES), "drivetrain.energy.tractor"):
        figures["energy"] = lambda: draw_energy(record)
    return save_all(output, figures)


def draw_studies(output: Path, study: Study | None, masses: MassStudy | None) -> list[Path]:
    """Write errors.png, masses.png and drive.png of the studies that were made; their paths."""
    figures = {"errors": lambda: draw_errors(study)} if study else {}
    if masses:
        figures |= {"masses": lambda: draw_masses(masses), "drive": lambda: draw_coupling(masses)}
    return save_all(output, figures)


def draw_row(record: Record, spacing: float) -> Figure:
    """The ridge cut along the row, up to ten plants a strip: the tip's path, holes, plants, and what is missing."""
    holes = record.holes
    wide = min(max(len(holes), 1), PLANTS_A_STRIP) * spacing
    count = min(max(1, int(np.ceil(len(holes) / PLANTS_A_STRIP))), STRIPS)
    first = (holes[0].plant_x if holes else 0.0) - spacing / 2
    x, y = record["linkage.ground.x"], record["linkage.ground.y"]
    if not holes:  # the path alone
        first, wide = float(x.min()), min(max(float(np.ptp(x)), 1.0), PLANTS_A_STRIP * spacing)
    ridge = y + record["soil.tip.depth"]
    known = record.offers("soil.tip.depth")  # else no ridge is drawn
    ridge = ridge if known else np.full_like(y, y.min())
    mean = float(ridge.mean()) + (0.0 if known else 0.103)
    bottom, top = mean - 0.16, mean + 0.29
    scale = 15.0 / max(wide, PLANTS_A_STRIP // 2 * spacing)  # inches a metre
    page = max(9.5, wide * scale + 1.2)  # inches wide: the legend wants some
    tall = (top - bottom) * scale
    gap, head, foot = 0.28, 0.62, 0.95
    height = head + count * (tall + gap) + foot
    figure = plt.figure(figsize=(page, height))
    by_x = np.argsort(x)
    end = max([float(x.max()), *(hole.plant_x + spacing / 2 for hole in holes[-1:])])
    soil_x, soil_y = np.append(x[by_x], end), np.append(ridge[by_x], ridge[by_x][-1])  # level beyond the last sample
    for strip in range(count):
        left = first + strip * wide
        below = height - head - strip * (tall + gap) - tall
        shown = min(wide, max(end - left, spacing))  # a last strip ends where the row does
        axes = figure.add_axes((0.75 / page, below / height, shown * scale / page, tall / height))
        axes.set(xlim=(left, left + shown), ylim=(bottom, top), aspect="equal")
        if known:
            axes.fill_between(soil_x, bottom, soil_y, color=EARTH, linewidth=0, zorder=0)
            axes.plot(soil_x, soil_y, color=EARTH_EDGE, linewidth=0.9, zorder=1)
        axes.plot(x, y, color=BLUE, linewidth=0.7, zorder=2)
        for number, hole in enumerate(holes, start=1):
            if left <= hole.plant_x < left + wide:
                _hole(axes, hole, number, np.interp([hole.entry, hole.exit, hole.plant_x], x[by_x], ridge[by_x]))
        axes.set_ylabel("ground.y / mm")
        axes.yaxis.set_major_locator(FixedLocator([-0.4, -0.2]))
        axes.xaxis.set_major_formatter(IN_MM)
        axes.yaxis.set_major_formatter(IN_MM)
        axes.grid(visible=False)
    axes.set_xlabel("ground.x / mm, direction of travel")
    fates = {hole.seedling for hole in holes}
    handles = [Line2D([], [], color=BLUE, linewidth=1.2, label="path of the nozzle's tip over ground")]
    if holes:
        handles.append(Line2D([], [], color=BLACK, linewidth=2.4, label="hole at the surface"))
    handles += [
        Line2D(
            [],
            [],
            color=colour,
            linestyle="-" if fate == PLANTED else "none",
            linewidth=2,
            marker="^" if fate == PLANTED else "x",
            markersize=7,
            markeredgewidth=2,
            label=label,
        )
        for fate, (colour, label) in FATES.items()
        if fate in fates
    ]
    figure.legend(handles=handles, loc="lower center", ncols=2 if page < 12 else min(len(handles), 3))
    more = f"; the first {STRIPS * PLANTS_A_STRIP} of {len(holes)}" if len(holes) > STRIPS * PLANTS_A_STRIP else ""
    what = "The planted row" if known else "The tip's path"
    figure.text(0.012, 1 - 0.12 / height, f"{what} from the side, to scale{more}", va="top", fontsize=12)
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
    axes.text(
        hole.plant_x, at_plant - hole.depth - 0.036, str(number), ha="center", va="center", fontsize=8, color=EARTH_EDGE
    )


def draw_turn(record: Record) -> Figure:
    """Signals over one turn of the crank from the middle of the row."""
    turns = record["drivetrain.crank.phi"] / (2 * np.pi)
    middle = np.floor(turns.max() / 2)
    part = (turns >= middle) & (turns <= middle + 1)
    phi = 360 * (turns[part] - middle)

    def of(name: str) -> np.ndarray:
        return record[name][part]

    def line(panel: Axes, name: str, colour: str, label: str, dashes: object = "-", scale: float = 1.0) -> None:
        if record.offers(name):
            panel.plot(phi, scale * of(name), color=colour, linewidth=1.5, linestyle=dashes, label=label)

    shown = [
        (axis, names)
        for axis, names in (
            ("height above O / mm", ("linkage.ground.y",)),
            ("force of the soil / N", ("soil.tip.fx", "soil.tip.fy")),
            ("torque / N·m", ("linkage.crank.tau", "drivetrain.shaft.tau")),
            ("crank / turns a minute", ("drivetrain.crank.w",)),
        )
        if any(record.offers(name) for name in names)
    ]
    figure, panels = plt.subplots(
        len(shown), 1, figsize=(9.5, 0.5 + 2.5 * len(shown)), layout="constrained", sharex=True, squeeze=False
    )
    of_axis = {axis: panel for (axis, _), panel in zip(shown, panels[:, 0], strict=True)}
    heights = of_axis["height above O / mm"]
    line(heights, "linkage.ground.y", BLUE, "nozzle's tip, ground.y", scale=1e3)
    if record.offers("soil.tip.depth"):
        ridge = 1e3 * (of("linkage.ground.y") + of("soil.tip.depth"))
        heights.plot(phi, ridge, color=EARTH_EDGE, linewidth=1.4, linestyle=(0, (6, 3)), label="ridge below the tip")
    if record.offers("conveyor.seedling.y", "conveyor.seedling.in_nozzle"):
        _draw_seedling(heights, phi, 1e3 * of("conveyor.seedling.y"), of("conveyor.seedling.in_nozzle") > 0)
    heights.margins(y=0.1)
    for axis, *lines in (
        (
            "force of the soil / N",
            ("soil.tip.fx", BLUE, "tip.fx, forward", "--"),
            ("soil.tip.fy", VERMILLION, "tip.fy, up", "-."),
        ),
        (
            "torque / N·m",
            ("linkage.crank.tau", VERMILLION, "crank.tau: taken by the linkage"),
            ("drivetrain.shaft.tau", BLACK, "shaft.tau: in the shaft"),
        ),
        ("crank / turns a minute", ("drivetrain.crank.w", BLUE, "", "-", 30 / np.pi)),
    ):
        for arguments in lines if axis in of_axis else ():
            line(of_axis[axis], *arguments)
    for axis, panel in of_axis.items():
        panel.set_ylabel(axis)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(loc="best" if panel is heights else "upper right")
        if record.offers("soil.tip.depth"):
            panel.fill_between(
                phi,
                0,
                1,
                where=of("soil.tip.depth") > 0,
                transform=panel.get_xaxis_transform(),
                color=EARTH,
                linewidth=0,
                zorder=0,
            )
    panels[-1, 0].set_xlabel("crank angle φ / degrees (0: nozzle at its top)")
    panels[-1, 0].set(xlim=(0, 360), xticks=np.arange(0, 361, 30))
    soil = " (shaded: the tip is in the soil)" if record.offers("soil.tip.depth") else ""
    figure.suptitle(f"One turn of the crank in the middle of the row{soil}", x=0.01, ha="left", fontsize=11)
    return figure


def _draw_seedling(panel: Axes, phi: np.ndarray, height: np.ndarray, loaded: np.ndarray) -> None:
    """Its fall, with what became of it, and when it is in the nozzle. height: mm."""
    in_air = height < np.max(height, initial=-np.inf)
    panel.plot(phi, np.where(in_air, height, np.nan), color=GREEN, linewidth=2.0, label="falling seedling")
    if in_air.any():  # at the end of its fall it is in the nozzle's mouth, well above the tip, or beside it
        last = int(np.flatnonzero(in_air)[-1])
        caught = bool(np.any(loaded[last : last + 3]))
        panel.plot(phi[last], height[last], "o" if caught else "x", color=GREEN, markersize=6)
        panel.annotate(
            "caught by the nozzle's mouth, above its tip" if caught else "missed the nozzle's mouth",
            (phi[last], height[last]),
            xytext=(8, 0),
            textcoords="offset points",
            va="center",
            color=GREEN,
        )
    # A bar on the panel's edge: a tint over the soil's would be a third colour.
    panel.fill_between(
        phi,
        0,
        0.035,
        where=loaded,
        transform=panel.get_xaxis_transform(),
        color=GREEN,
        linewidth=0,
        label="seedling in the nozzle (bar below)",
    )


ENERGIES = (
    ("drivetrain.energy.stored", "stored in shaft and crank", BLUE),
    ("drivetrain.energy.shaft", "heat in the shaft", ORANGE),
    ("soil.energy.soil", "taken by the soil", EARTH_EDGE),
)


def draw_energy(record: Record) -> Figure:
    """What the tractor gave, where it went, and what the balance lacks."""
    time = record.time
    at_start = -float(record.links.min())  # a stack has no room for less than nothing
    parts = [(record[name], label, colour) for name, label, colour in ENERGIES]
    if record.has_masses:
        parts.insert(1, (record.links + at_start, "stored in the links, above their least", SKY))
    figure, (above, below) = plt.subplots(
        2, 1, figsize=(9.5, 6.6), layout="constrained", sharex=True, height_ratios=(2.2, 1)
    )
    above.stackplot(
        time,
        [values for values, _, _ in parts],
        labels=[label for _, label, _ in parts],
        colors=[colour for *_, colour in parts],
        alpha=0.55,
        linewidth=0,
    )
    label = "given by the tractor" + (", and stored in the links at the start" if at_start else "")
    above.plot(time, record["drivetrain.energy.tractor"] + at_start, color=BLACK, linewidth=1.4, label=label)
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
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(14.6, 4.9))
    figure.subplots_adjust(left=0.05, right=0.885, top=0.86, bottom=0.17, wspace=0.8)
    linkage = [way for way in study.ways if way not in MASTERS]
    ends: dict[Axes, list[tuple[float, float, str, str]]] = {left: [], middle: [], right: []}

    def line(axes: Axes, errors: Sequence[Errors], values: list[float], name: str, key: str) -> None:
        colour, marker = LOOKS[key]
        dashes = "--" if key == "gauss_seidel" else "-"
        axes.loglog([1e3 * e.step for e in errors], values, dashes, color=colour, marker=marker, linewidth=1.4)
        ends[axes].append((1e3 * errors[-1].step, values[-1], name, colour))

    for axes, what, scale in ((left, "worst", 1e3), (right, "imbalance", 100 / study.work)):
        for way in [way for way in study.ways if way in MASTERS]:
            errors, order = study.of(way.key), study.order(way.key, what)
            name = way.title.replace(" with ", " with\n") + ("" if np.isnan(order) else f", order {order:.1f}")
            line(axes, errors, [scale * getattr(e, what) for e in errors], name, way.key)
        if study.controlled:
            steps = [1e3 * e.step for e in study.controlled]
            values = [scale * getattr(e, what) for e in study.controlled]
            axes.loglog(steps, values, "*", color=PINK, markersize=11, markeredgecolor="white", zorder=4)
    for way in linkage:
        errors = study.of(way.key)
        name = way.title.replace(": ", ":\n").replace(", crank.a", ",\ncrank.a")
        line(middle, errors, [1e3 * e.own_worst for e in errors], name, way.key)
    rest = study.of(linkage[-1].key)
    middle.loglog([1e3 * e.step for e in rest], [1e3 * e.rest_worst for e in rest], color=GREY, linewidth=2.4, zorder=1)
    ends[middle].append((1e3 * rest[-1].step, 1e3 * rest[-1].rest_worst, "the rest of\nthe system", "#606060"))
    if study.controlled:
        star = Line2D([], [], linestyle="", marker="*", markersize=11, color=PINK)
        name = "in (a) and (c): steps controlled by the master, at their mean, the repeated ones counted"
        figure.legend([star], [name], loc="lower left", bbox_to_anchor=(0.04, 0.0))
    left.set_title("(a) masters: error of the tip", loc="left")
    middle.set_title("(b) the linkage's own share,\nby what is connected", loc="left")
    right.set_title("(c) masters: error of the energy", loc="left")
    for axes in (left, middle, right):
        axes.set_xlabel("communication step / ms")
        axes.xaxis.set_major_locator(FixedLocator(STEPS_MS))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda step, _: f"{step:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
    left.set_ylabel("worst error / mm")
    middle.set_ylabel("worst error / mm")
    right.set_ylabel("worst imbalance / % of the tractor's work")
    for axes, named in ends.items():
        name_ends(axes, named, apart=23.0, gap=9.0, linespacing=1.1)
    figure.suptitle("Error against communication step, in a row of three plants", x=0.012, ha="left", fontsize=11)
    return figure


def draw_masses(found: MassStudy) -> Figure:
    """Over one turn of the crank: torque in its shares, force on the machine, speed; with masses and without."""
    figure, panels = plt.subplots(
        3, 1, figsize=(9.5, 8.6), layout="constrained", sharex=True, height_ratios=(1.5, 1, 1)
    )
    torque, force, speed = panels
    phi, shares = np.degrees(found.phi), found.shares
    looks = {
        "inertia": (BLUE, "inertia"),
        "weight": (GREEN, "weight"),
        "soil": (EARTH_EDGE, "soil"),
        "machine": (PINK, "machine's acceleration:\nnone at even speed"),
    }
    for name, (colour, label) in looks.items():
        torque.plot(phi, shares[name], color=colour, linewidth=1.3, label=label)
    torque.plot(phi, sum(shares.values()), color=BLACK, linewidth=2.0, label="all: crank.tau")
    torque.set_ylabel("torque that the drive gives / N·m")
    for record, dashes, told in ((found.heavy, "-", "with masses"), (found.without, "--", "without")):
        angle, w, part = mass_study.middle_turn(record)
        for name, colour in (("fx, forward", BLUE), ("fy, up", VERMILLION)):
            values = record[f"linkage.machine.{name[:2]}"][part]
            force.plot(np.degrees(angle), values, dashes, color=colour, linewidth=1.4, label=f"machine.{name}, {told}")
        speed.plot(np.degrees(angle), 30 / np.pi * w, dashes, color=BLACK, linewidth=1.4, label=told)
    force.set_ylabel("force on the machine / N")
    speed.set_ylabel("crank / turns a minute")
    speed.set_xlabel("crank angle φ / degrees (0: nozzle at its top)")
    speed.set(xlim=(0, 360), xticks=np.arange(0, 361, 30))
    angle, _, part = mass_study.middle_turn(found.heavy)
    for panel in panels:
        panel.axhline(0, color=GREY, linewidth=0.8) if panel is not speed else None
        panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        panel.fill_between(
            np.degrees(angle),
            0,
            1,
            where=found.heavy["soil.tip.depth"][part] > 0,
            transform=panel.get_xaxis_transform(),
            color=EARTH,
            linewidth=0,
            zorder=0,
        )
    title = f"What {found.mass:.1f} kg of links do in one turn (shaded: the tip is in the soil)"
    figure.suptitle(title, x=0.01, ha="left", fontsize=11)
    return figure


def draw_coupling(found: MassStudy) -> Figure:
    """A soft, light drive: the error of its angle over the step, and where its coupling diverges."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.5, 4.6))
    figure.subplots_adjust(left=0.07, right=0.82, top=0.86, bottom=0.13, wspace=0.85)
    looks = {
        "inertia": (BLUE, "o"),
        "inertia_held": (SKY, "s"),
        "torque": (VERMILLION, "o"),
        "torque_held": (ORANGE, "s"),
    }
    steps, coupling, ends = list(mass_study.STEPS_MS), found.coupling, {left: [], right: []}
    worst = {hand: [1e3 * coupling.worst[hand.key, 1e-3 * step] for step in steps] for hand in HANDS}
    beyond = 3 * max(value for values in worst.values() for value in values if np.isfinite(value))
    for hand, values in worst.items():
        colour, marker = looks[hand.key]
        left.loglog(steps, values, color=colour, marker=marker, linewidth=1.4)
        lost = [step for step, value in zip(steps, values, strict=True) if not np.isfinite(value)]
        shift = 1.0 if hand.held else 1.6
        left.loglog(lost, [beyond * shift] * len(lost), "x", color=colour, markersize=8, markeredgewidth=2)
        last = values[-1] if np.isfinite(values[-1]) else beyond * shift
        name = hand.title.replace(", crank", ",\ncrank").replace(", held", ",\nheld")
        ends[left].append((steps[-1], last, name + ("" if np.isfinite(values[-1]) else ": diverges (×)"), colour))
        if hand.torque:
            least = [coupling.border[hand.key, 1e-3 * step] for step in steps]
            right.loglog(steps, least, color=colour, marker=marker, linewidth=1.4)
            ends[right].append((steps[-1], least[-1], f"{name}:\ndiverges below", colour))
    right.axhline(coupling.largest, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)))
    ends[right].append((steps[-1], coupling.largest, "the linkage's greatest\ncrank.inertia", "#606060"))
    left.set_title(f"(a) error of a drive of {mass_study.LIGHT:g} kg·m²", loc="left")
    right.set_title("(b) the drive's inertia below which it diverges", loc="left")
    left.set_ylabel("worst error of the angle / mrad")
    right.set_ylabel("inertia of the drive / kg·m²")
    right.set_ylim(mass_study.LIGHTEST, mass_study.HEAVIEST)
    for axes, marks in ((left, (0.1, 1, 10, 100)), (right, (0.01, 0.02, 0.05, 0.1, 0.2, 0.5))):
        axes.yaxis.set_major_locator(FixedLocator(marks))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_locator(NullLocator())
    for axes in (left, right):
        axes.set_xlabel("communication step / ms")
        axes.xaxis.set_major_locator(FixedLocator(steps))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda step, _: f"{step:g}"))
        axes.xaxis.set_minor_locator(NullLocator())
        name_ends(axes, ends[axes], apart=24.0, gap=9.0, linespacing=1.1)
    figure.suptitle(
        f"A soft drive ({mass_study.SLOPE:g} N·m per rad/s) turns links that have mass", x=0.012, ha="left", fontsize=11
    )
    return figure
