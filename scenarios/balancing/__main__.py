"""Balance: what counterweight on crank OA, or spring, evens the crank's torque or the shaking of the machine best.

    python -m scenarios.balancing --rpm 65

searches for each wish with the exact gradients of the FMU, at a steady speed, and shows what gets better and what gets
worse: peak and rms of torque and shaking force, at this speed and at others, and the torque's peak in soil.
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
from tqdm import tqdm

from scenarios.balancing.machine import Balancing, Machine, Turn
from scenarios.balancing.search import ANCHOR, HEAVIEST, REACH, STARTS, STIFFEST, WISHES, peak, rms, search
from scenarios.common import command, figures, reports
from scenarios.common.operating_point import PLANTS_PER_MINUTE

LEAST_RPM, MOST_RPM = 10.0, 300.0
SPEEDS = (30.0, 40.0, 50.0, 60.0, 65.0, 70.0, 80.0, 90.0)  # turns a minute
HEADINGS = (
    "balanced by",
    "torque, peak / N·m",
    "rms / N·m",
    "peak in soil / N·m",
    "shaking force, peak / N",
    "rms / N",
)
QUANTITIES = ("peak torque", "rms torque", "peak torque in soil", "peak shaking", "rms shaking")
UNITS = ("N.m", "N.m", "N.m", "N", "N")
PARTS = ("balanced by", "weight", "at, along OA, to its left", "spring", "free length", "anchored at, from O")
LOOKS = (figures.GREY, figures.BLUE, figures.SKY, figures.GREEN, figures.VERMILLION, figures.BLACK)


@dataclass(frozen=True)
class Found:
    """A balance, its turn at the speed that was asked for, and its turns at SPEEDS."""

    title: str
    balancing: Balancing
    turn: Turn
    turns: tuple[Turn, ...]


def figures_of(turn: Turn) -> tuple[float, ...]:
    """Peak and rms of torque, its peak in soil, N m; peak and rms of the shaking force, N."""
    return peak(turn, "torque"), rms(turn, "torque"), peak(turn, "loaded"), peak(turn, "force"), rms(turn, "force")


def solve(path: Path, rpm: float) -> list[Found]:
    """Nothing, and then the best for each wish."""
    speed = math.tau * rpm / 60
    with Machine(path) as machine, tqdm(total=len(STARTS) * len(WISHES), leave=False, disable=None, delay=1.0) as bar:

        def found(title: str, b: Balancing) -> Found:
            turns = (machine.turn(b, math.tau * each / 60, gradients=False) for each in SPEEDS)
            return Found(title, b, machine.turn(b, speed, gradients=False), tuple(turns))

        return [
            found("nothing", Balancing()),
            *(found(wish.title, search(machine, speed, wish, bar.update)) for wish in WISHES),
        ]


def table(all_found: Sequence[Found]) -> list[tuple[str, ...]]:
    """Lines under HEADINGS, with the change from nothing."""
    before = figures_of(all_found[0].turn)
    lines = []
    for each in all_found:
        cells = []
        for value, was in zip(figures_of(each.turn), before, strict=True):
            change = "" if each is all_found[0] else f" ({100 * (value / was - 1):+.0f} %)".replace("+0 %", "0 %")
            cells.append(f"{value:.3g}{change}")
        lines.append((each.title, *cells))
    return lines


def parts(all_found: Sequence[Found]) -> list[tuple[str, ...]]:
    """Lines under PARTS: what would be built."""
    lines = []
    for each in all_found[1:]:
        b = each.balancing
        weight = (f"{b.mass:.2f} kg", f"{1e3 * b.x + 0.0:.0f}, {1e3 * b.y + 0.0:.0f} mm") if b.mass else ("none", "")
        anchor = f"{1e3 * b.anchor_x + 0.0:.0f}, {1e3 * b.anchor_y + 0.0:.0f} mm"
        spring = (f"{b.stiffness:.0f} N/m", f"{1e3 * b.free:.0f} mm", anchor) if b.stiffness else ("none", "", "")
        lines.append((each.title, *weight, *spring))
    return lines


def sentences(all_found: Sequence[Found], rpm: float) -> list[str]:
    """What came out, and what gets worse."""
    nothing, *balanced = all_found
    before = figures_of(nothing.turn)
    best = min(balanced, key=lambda each: figures_of(each.turn)[0])
    calm = min(balanced, key=lambda each: figures_of(each.turn)[3])
    loaded = min(balanced, key=lambda each: figures_of(each.turn)[2])
    weights = [each.balancing for each in balanced if each.balancing.mass]
    at_bounds = sum(b.mass > 0.99 * HEAVIEST and b.reach > 0.99 * REACH for b in weights)
    said = [
        (
            f"The least peak of torque at {rpm:g} turns a minute, without soil: {best.title}, "
            f"{figures_of(best.turn)[0]:.3g} N·m in place of {before[0]:.3g}; in soil: {loaded.title}, "
            f"{figures_of(loaded.turn)[2]:.3g} in place of {before[2]:.3g}. The least peak of the shaking force: "
            f"{calm.title}, {figures_of(calm.turn)[3]:.3g} N in place of {before[3]:.3g}."
        ),
        (
            "A counterweight turns with the crank: it can even out only what swings once a turn, and its weight is "
            "the same at every speed, where inertia grows with the square. Bounds, and not the gradients, end the "
            f"search for {at_bounds} of {len(weights)} counterweights: {HEAVIEST:g} kg at {1e3 * REACH:g} mm."
        ),
    ]
    for each in balanced:
        after = figures_of(each.turn)
        worse = [
            f"{name} by {100 * (now / was - 1):.0f} %"
            for name, now, was in zip(QUANTITIES, after, before, strict=True)
            if now > 1.005 * was
        ]
        slow = [
            f"{speed:g}"
            for speed, now, was in zip(SPEEDS, each.turns, nothing.turns, strict=True)
            if peak(now, "torque") > 1.005 * peak(was, "torque")
        ]
        if worse or slow:
            at_others = f"the peak of torque without soil at {', '.join(slow)} turns a minute" if slow else ""
            said.append(f"Worse with {each.title}: {'; '.join([*worse, *([at_others] if at_others else [])])}.")
    said.append(
        "What drives the nozzle into the soil is the links' energy: where inertia takes least torque the soil takes "
        "most, so that what evens the one alone may uneven both. The masses are assumptions "
        "(`scenarios/common/masses.py`), and so is the soil (`scenarios/field_row/partners/soil.py`)."
    )
    return said


def draw(all_found: Sequence[Found], rpm: float) -> Figure:
    """Torque over the angle, its peak over the speed, and the shaking force round the turn."""
    figure, ((torque, loaded), (speeds, force)) = plt.subplots(2, 2, figsize=(11.5, 9.2))
    figure.subplots_adjust(left=0.07, right=0.98, top=0.91, bottom=0.14, wspace=0.2, hspace=0.32)
    for each, colour in zip(all_found, LOOKS, strict=True):
        line = {"color": colour, "linewidth": 2.2 if each is all_found[0] else 1.4}
        torque.plot(np.degrees(each.turn.phi), each.turn.torque, label=each.title, **line)
        loaded.plot(np.degrees(each.turn.phi), each.turn.torque + each.turn.soil, **line)
        speeds.plot(SPEEDS, [peak(turn, "torque") for turn in each.turns], marker=".", **line)
        around = np.append(each.turn.force, each.turn.force[0])
        force.plot(around.real, around.imag, **line)
    for axes in (torque, loaded):
        axes.set(xlim=(0, 360), xticks=range(0, 361, 60), ylabel="torque that the drive gives / N·m")
        axes.set_xlabel("crank angle φ / degrees (0: nozzle at its top)")
    torque.set_title(f"(a) torque at {rpm:g} turns a minute, without soil", loc="left")
    loaded.set_title("(b) the same in soil", loc="left")
    speeds.axvline(rpm, color=figures.GREY, linewidth=0.8, linestyle=(0, (4, 3)))
    speeds.set(xlabel="crank / turns a minute", ylabel="peak of torque / N·m", ylim=(0, None))
    speeds.set_title("(c) its peak without soil at other speeds", loc="left")
    force.set(xlabel="forward / N", ylabel="up / N", aspect="equal")
    force.set_title(f"(d) shaking force at {rpm:g} turns a minute", loc="left")
    figure.legend(loc="lower center", ncols=3)
    figure.suptitle("Balanced at a steady speed", x=0.012, ha="left", fontsize=11)
    return figure


def scene(options: argparse.Namespace, console: Console) -> list[Path]:
    """Search, print and write everything; returns the files."""
    all_found = solve(options.fmu, options.rpm)
    options.output.mkdir(parents=True, exist_ok=True)
    said = sentences(all_found, options.rpm)
    reports.show_table(console, f"At a steady {options.rpm:g} turns a minute", HEADINGS, table(all_found))
    reports.show_table(console, "What would be built", PARTS, parts(all_found))
    for sentence in said:
        console.print(f"- {sentence}", markup=False)
    files = [options.output / name for name in ("balancing.md", "balancing.csv", "balancing.png")]
    text = [
        "# Balance",
        "",
        (
            f"Written by `python -m scenarios.balancing --rpm {options.rpm:g}`. Bounds: a counterweight of at most "
            f"{HEAVIEST:g} kg within {1e3 * REACH:g} mm of O on crank OA; a tension spring of at most {STIFFEST:g} N/m "
            f"from joint A to a point of the frame within {1e3 * ANCHOR:g} mm of O either way, never slack nor "
            "overstretched. The shaking force is that of the linkage on the machine without its dead weight."
        ),
        "",
        *(f"- {sentence}" for sentence in said),
        "",
        reports.markdown_table(HEADINGS, table(all_found)),
        reports.markdown_table(PARTS, parts(all_found)),
        "![Torque, its peak over the speed, shaking force](balancing.png)",
        "",
        "`balancing.csv`: the same at other speeds, in SI units.",
        "",
    ]
    files[0].write_text("\n".join(text), encoding="utf-8")
    reports.write_csv(
        files[1],
        ("balanced by", "speed / rad/s", *(f"{name} / {unit}" for name, unit in zip(QUANTITIES, UNITS, strict=True))),
        (
            (each.title, math.tau * speed / 60, *figures_of(turn))
            for each in all_found
            for speed, turn in zip(SPEEDS, each.turns, strict=True)
        ),
    )
    figures.save_all(options.output, {"balancing": lambda: draw(all_found, options.rpm)})
    return files


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = command.parser("balancing", __doc__)
    parser.add_argument(
        "--rpm",
        type=command.between(LEAST_RPM, MOST_RPM, "turns a minute"),
        default=PLANTS_PER_MINUTE,
        help="the crank's speed for which is searched (default: %(default)s)",
    )
    return command.run(scene, parser.parse_args(arguments))


if __name__ == "__main__":
    sys.exit(main())
