"""Change the plant spacing while driving, from 300 to 500 mm: what the agronomist sees.

    python -m scenarios.spacing_change
    python -m scenarios.spacing_change --ssv design.ssv

The machine keeps its speed; the ratio between ground wheel and crank changes a little with every
metre, so that the spacing S grows evenly with the way s: dS/ds = k. The crank then turns by
dphi = 2 pi ds / S, that is phi = (2 pi / k) ln(S / S0), and its speed is w = 2 pi v / S.

Each plant is held beside what a machine does that has always driven with its spacing.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

from scenarios.common import command, figures, measures, reports, variants
from scenarios.common.instance import FmuError
from scenarios.common.linkage import LinkageFmu, Turns
from scenarios.common.operating_point import HOLE_MM, SPACING, hole_depth

SPACINGS = (0.3, 0.5)  # m: the first and the last plant spacing
PLANTS = (3, 40, 3)  # crank turns at the first spacing, while it changes, at the last
STEP = 2e-3  # s: communication step
STEADY_MM = tuple(range(300, 501, 25))
STEADY_STEP_DEG = 0.25
HEADINGS = (
    "S / mm",
    "apart / mm",
    "hole / mm",
    "steady / mm",
    "nozzle in / deg",
    "lowest / deg",
    "out / deg",
    "tip lowest / m/s",
    "out / m/s",
)


@dataclass(frozen=True)
class Plant:
    """What one crank turn leaves in the ridge. Lengths in mm, angles in degrees from straight down, m/s.

    ``spacing`` is the machine's S at the lowest point, ``apart`` the distance from the hole before (NaN
    for the first). ``nozzle`` is the nozzle's angle, positive with its tip forward, and ``speed`` the tip's
    forward speed over ground, both where the tip enters the ridge, is lowest, and leaves it.
    """

    spacing: float
    apart: float
    hole: measures.Hole
    nozzle: tuple[float, float, float]
    speed: tuple[float, float, float]


def drive(v: float, turns: tuple[int, int, int] = PLANTS) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The inputs by name, sampled every STEP, and the spacing in m at each sample, at speed ``v`` in m/s."""
    first, last = SPACINGS
    k = (last - first) / (turns[1] * (last - first) / math.log(last / first))
    ways = np.cumsum([turns[0] * first, turns[1] * (last - first) / math.log(last / first), turns[2] * last])
    time = np.arange(math.ceil(ways[-1] / v / STEP) + 1) * STEP
    s = v * time
    spacing = first + k * np.clip(s - ways[0], 0, ways[1] - ways[0])
    phi = (
        2 * math.pi * np.minimum(s, ways[0]) / first
        + 2 * math.pi / k * np.log(spacing / first)
        + 2 * math.pi * np.maximum(s - ways[1], 0) / last
    )
    changing = (s >= ways[0]) & (s < ways[1])
    w = 2 * math.pi * v / spacing
    return {
        "time": time,
        "crank.phi": phi,
        "crank.w": w,
        "crank.a": np.where(changing, -w * k * v / spacing, 0.0),
        "machine.v": np.full_like(time, v),
    }, spacing


def plants(path: Turns, spacing_mm: np.ndarray, surface_mm: float) -> list[Plant]:
    """Every plant of a run whose hole lies within it."""
    found: list[Plant] = []
    tip, y = path.dynamic_mm, path.dynamic_mm.imag
    index = np.arange(len(tip))
    for bottom in np.flatnonzero((y[1:-1] < y[:-2]) & (y[1:-1] <= y[2:]) & (y[1:-1] < surface_mm)) + 1:
        hole = measures.hole_around(tip, int(bottom), surface_mm)
        if hole is None:
            continue
        # The moments in samples, between which the tip crosses the surface and, on a parabola, is lowest.
        outside = index[y >= surface_mm]
        before, after = outside[outside < bottom][-1], outside[outside > bottom][0]
        lower, upper = y[bottom - 1] - y[bottom], y[bottom + 1] - y[bottom]
        moments = (
            before + (y[before] - surface_mm) / (y[before] - y[before + 1]),
            bottom + 0.5 * (lower - upper) / (lower + upper),
            after - (y[after] - surface_mm) / (y[after] - y[after - 1]),
        )
        at = {name: np.interp(moments, index, path[name]) for name in ("tip.angle", "ground.vx")}
        middle = 0.5 * (hole.entry + hole.exit).real
        apart = middle - 0.5 * (found[-1].hole.entry + found[-1].hole.exit).real if found else math.nan
        found.append(
            Plant(
                float(spacing_mm[bottom]), apart, hole, tuple(np.degrees(at["tip.angle"]) + 90), tuple(at["ground.vx"])
            )
        )
    return found


def steady(fmu: LinkageFmu, spacing_mm: float, surface_mm: float) -> Plant:
    """A plant of a machine that has always driven with one spacing: the second of three turns."""
    turn = spacing_mm / 1e3 / (SPACING / fmu.turn_time)
    given = {
        "time": np.array([0.0, 3 * turn]),
        "crank.phi": np.array([0.0, 6 * math.pi]),
        "crank.w": np.full(2, 2 * math.pi / turn),
        "machine.v": np.full(2, spacing_mm / 1e3 / turn),
    }
    path = fmu.follow(given, 3 * round(360 / STEADY_STEP_DEG))
    return plants(path, np.full(len(path.time), float(spacing_mm)), surface_mm)[1]


def cells(plant: Plant, steady_hole: float) -> tuple[str, ...]:
    """A plant's texts under HEADINGS."""
    apart = "" if math.isnan(plant.apart) else f"{plant.apart:.1f}"
    return (
        f"{plant.spacing:.1f}",
        apart,
        f"{plant.hole.size:.1f}",
        f"{steady_hole:.1f}",
        *(f"{angle:.1f}" for angle in plant.nozzle),
        *(f"{v:+.3f}" for v in plant.speed[1:]),
    )


def findings(driven: Sequence[Plant], still: Sequence[Plant], off: np.ndarray) -> list[str]:
    """What the figures say."""
    first, last = still[0], still[-1]
    turned = max(abs(np.ptp([plant.nozzle[k] for plant in (*driven, *still)])) for k in range(3))
    zero = (
        np.interp(0, [-plant.speed[1] for plant in still][::-1], [plant.spacing for plant in still][::-1])
        if first.speed[1] * last.speed[1] < 0
        else math.nan
    )
    best = (
        f"it stands still over ground at S = {zero:.0f} mm"
        if not math.isnan(zero)
        else f"it stands still over ground at no S from {first.spacing:.0f} to {last.spacing:.0f} mm"
    )
    return [
        (
            f"The hole grows from {first.hole.size:.1f} mm at S = {first.spacing:.0f} mm to {last.hole.size:.1f} mm at "
            f"{last.spacing:.0f} mm, {(last.hole.size - first.hole.size) / (last.spacing - first.spacing) * 10:.1f} mm "
            "for each 10 mm of spacing."
        ),
        (
            f"The nozzle's angle does not depend on S: in the ridge it swings from {first.nozzle[0]:.1f} to "
            f"{first.nozzle[2]:.1f} deg, for every plant the same to {max(turned, 0.01):.2f} deg, since the machine "
            "carries the nozzle without turning it. What changes is how the tip moves over ground when it sets the "
            f"seedling: at its lowest {first.speed[1]:+.3f} m/s at {first.spacing:.0f} mm and {last.speed[1]:+.3f} m/s "
            f"at {last.spacing:.0f} mm; {best}."
        ),
        (
            f"Changing the spacing while driving spoils no plant: each of the {len(driven)} holes is as long as at a "
            f"steady spacing within {off.max():.2f} mm (S changes by "
            f"{np.ptp([p.spacing for p in driven]) / PLANTS[1]:.1f} mm from plant to plant)."
        ),
    ]


def draw(path: Turns, driven: Sequence[Plant], still: Sequence[Plant], surface_mm: float) -> Figure:
    """Three holes on top; hole length, nozzle angle and speed over ground over the spacing below."""
    figure, axes = plt.subplots(2, 3, figsize=(11.5, 7.2), layout="constrained")
    tip = path.dynamic_mm
    for panel, plant in zip(axes[0], (driven[0], driven[len(driven) // 2], driven[-1]), strict=True):
        middle = 0.5 * (plant.hole.entry + plant.hole.exit).real
        near = np.abs(tip.real - middle) < 160
        panel.plot(np.where(near, tip.real - middle, np.nan), np.where(near, tip.imag, np.nan), color=figures.BLUE)
        panel.axhline(surface_mm, color=figures.EARTH_EDGE, linewidth=1.0, linestyle=(0, (6, 3)))
        panel.text(-155, surface_mm + 3, "ridge surface", fontsize=8, color=figures.EARTH_EDGE)
        ends = [plant.hole.entry.real - middle, plant.hole.exit.real - middle]
        panel.plot(ends, [surface_mm] * 2, "o-", color=figures.BLACK, markersize=4)
        panel.set(
            xlim=(-160, 160),
            ylim=(tip.imag.min() - 25, surface_mm + 130),
            aspect="equal",
            xlabel="along the row / mm",
            ylabel="ground.y / mm",
        )
        panel.set_title(f"S = {plant.spacing:.0f} mm: hole {plant.hole.size:.1f} mm", loc="left")
    spacing, steady_spacing = [p.spacing for p in driven], [p.spacing for p in still]
    hole, angle, speed = axes[1]
    hole.plot(steady_spacing, [p.hole.size for p in still], color=figures.GREY, label="steady spacing")
    hole.plot(spacing, [p.hole.size for p in driven], ".", color=figures.BLUE, label="while driving")
    hole.set_title("Hole at the ridge surface", loc="left")
    hole.set_ylabel("length / mm")
    hole.legend()
    looks = zip(("enters", "lowest", "leaves"), (figures.VERMILLION, figures.BLACK, figures.GREEN), strict=True)
    for k, (name, colour) in enumerate(looks):
        for panel, values in ((angle, "nozzle"), (speed, "speed")):
            panel.plot(steady_spacing, [getattr(p, values)[k] for p in still], color=colour, linewidth=1.0)
            panel.plot(spacing, [getattr(p, values)[k] for p in driven], ".", color=colour, label=f"tip {name}")
    angle.set_title("Nozzle from straight down (tip forward: +)", loc="left")
    angle.set_ylabel("angle / deg")
    angle.legend(loc=(0.62, 0.28))
    speed.axhline(0, color=figures.GREY, linewidth=0.8)
    speed.set_title("Tip's forward speed over ground", loc="left")
    speed.set_ylabel("ground.vx / (m/s)")
    for panel in axes[1]:
        panel.set_xlabel("plant spacing S / mm")
    figure.suptitle(
        "Plant spacing changed while driving (dots: each plant; lines: steady spacing)", x=0.01, ha="left", fontsize=11
    )
    return figure


def scene(options: argparse.Namespace, console: Console) -> list[Path]:
    """Run, print and write everything; returns the files."""
    with LinkageFmu(options.fmu, SPACING) as fmu:
        options.output.mkdir(parents=True, exist_ok=True)
        nominal = fmu.run(STEADY_STEP_DEG).dynamic_mm
        depth = hole_depth(nominal)
        if depth is None:
            raise FmuError(f"{options.fmu} does not start with the published set: no ridge surface gives its hole.")
        for variant in variants.chosen(options)[-1:]:
            geometry = {name.removeprefix(variants.PREFIX): value for name, value in fmu.nominal.items()}
            fmu.design = variant.parameters(geometry)
            console.print(
                f"Of the design {variant.name}, with the ridge's surface as deep as the published one's.", markup=False
            )
            nominal = fmu.run(STEADY_STEP_DEG).dynamic_mm
        surface_mm = float(nominal.imag.min()) + depth
        given, spacing = drive(SPACING / fmu.turn_time)
        path = fmu.follow(given, len(given["time"]) - 1)
        driven = plants(path, spacing * 1e3, surface_mm)
        still = [steady(fmu, each, surface_mm) for each in STEADY_MM]
    expected = np.interp([p.spacing for p in driven], STEADY_MM, [p.hole.size for p in still])
    sentences = findings(driven, still, np.abs(np.array([p.hole.size for p in driven]) - expected))
    rows = [cells(plant, each) for plant, each in zip(driven, expected, strict=True)]
    reports.show_table(
        console, "Every fifth plant; nozzle from straight down, tip's forward speed over ground", HEADINGS, rows[::5]
    )
    for sentence in sentences:
        console.print(f"- {sentence}", markup=False)
    files = [options.output / name for name in ("spacing_change.md", "plants.csv", "spacing_change.png")]
    files[0].write_text(
        "\n".join(
            [
                "# Change the plant spacing while driving",
                "",
                (
                    "Written by `python -m scenarios.spacing_change`. The machine drives at "
                    f"{SPACING / fmu.turn_time:.4f} m/s; within {PLANTS[1]} plants the spacing grows evenly with the "
                    f"way from {SPACINGS[0] * 1e3:.0f} to {SPACINGS[1] * 1e3:.0f} mm. The ridge surface is the one at "
                    f"which the published set digs its published hole of {HOLE_MM} mm, {depth:.1f} mm above the tip's "
                    f"lowest point. Communication step {STEP * 1e3:g} ms."
                ),
                "",
                *(f"- {sentence}" for sentence in sentences),
                "",
                "![Hole, nozzle and speed over the spacing](spacing_change.png)",
                "",
                (
                    "Angles are the nozzle's from straight down, positive with its tip forward; speeds the tip's over "
                    "ground, positive forward."
                ),
                "",
                reports.markdown_table(HEADINGS, rows),
            ]
        ),
        encoding="utf-8",
    )
    reports.write_csv(files[1], HEADINGS, rows)
    with plt.rc_context(figures.STYLE):
        figure = draw(path, driven, still, surface_mm)
        figure.savefig(files[2])
        plt.close(figure)
    return files


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = command.parser("spacing_change", __doc__)
    variants.add_options(parser)
    options = parser.parse_args(arguments)
    if len(variants.chosen(options)) > 1:
        parser.error("one design at a time: --set several times, or one --ssv")
    return command.run(scene, options)


if __name__ == "__main__":
    sys.exit(main())
