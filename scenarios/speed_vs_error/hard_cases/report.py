"""Table, CSV and figure of the hard cases."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from rich.console import Console

from scenarios.common.figures import BLACK, BLUE, GREEN, GREY, NOTE, ORANGE, PINK, SKY, STYLE, VERMILLION
from scenarios.common.instance import UnpackedFmu
from scenarios.common.reports import markdown_table, show_table, write_csv
from scenarios.speed_vs_error.hard_cases import dead_points, poles
from scenarios.speed_vs_error.hard_cases.measured import Measured

HEADINGS = ("case", "what is measured", "in", "worst", "bound", "met", "printed form")
SHOWN = tuple(heading for heading in HEADINGS if heading != "in")  # in the terminal
WORDS = ("case", "what is measured", "met")
NO_ANSWER = 16.0  # digits, or powers of ten in the figure, for what the printed equations have no answer to
POLE_LOOKS = {  # colour and marker; the two that cost all digits in the same way are told apart by their marks
    "phi3 at 180°": (VERMILLION, "o"),
    "phi3 at 0°": (ORANGE, "s"),
    "a = c, 0 over 0": (PINK, "^"),
    "phi3 at 90°": (GREEN, "v"),
    "phi3 at -90°": (SKY, "<"),
    "phi2 at 90°": (GREY, "D"),
}

Sections = Mapping[str, Sequence[Measured]]


def number(value: float | None) -> str:
    """For people: three digits; counts as they are."""
    if value is None:
        return ""
    if math.isinf(value):
        return "no answer"
    if value == round(value) and abs(value) < 1e5:
        return f"{value:.0f}"
    return f"{value:.3g}".replace("e-0", "e-")


def cells(line: Measured) -> tuple[str, ...]:
    """A line's texts under HEADINGS."""
    return (
        line.case,
        line.quantity,
        line.unit,
        number(line.worst),
        number(line.bound),
        "yes" if line.is_met else "NO",
        number(line.printed),
    )


def write(output: Path, sections: Sections, fmu: UnpackedFmu) -> list[Path]:
    """Write the page, its figures' numbers and the figure; returns their paths."""
    output.mkdir(parents=True, exist_ok=True)
    paths = [output / f"hard_cases.{suffix}" for suffix in ("md", "csv", "png")]
    paths[0].write_text(page(sections), encoding="utf-8")
    write_csv(
        paths[1],
        ("section", "case", "measured", "unit", "worst", "bound", "met", "printed_form", "where"),
        (
            (
                section,
                line.case,
                line.quantity,
                line.unit,
                f"{line.worst:.6g}",
                f"{line.bound:.6g}",
                line.is_met,
                "" if line.printed is None else f"{line.printed:.6g}",
                line.where,
            )
            for section, lines in sections.items()
            for line in lines
        ),
    )
    with plt.rc_context(STYLE):
        figure = draw(fmu)
        figure.savefig(paths[2])
        plt.close(figure)
    return paths


def reading(sections: Sections) -> Iterator[str]:
    """What the table says, in sentences."""
    lines = [line for part in sections.values() for line in part]
    missed = [line.case for line in lines if not line.is_met]
    yield f"{len(lines) - len(missed)} of {len(lines)} lines are met" + (
        f"; not met: {', '.join(missed)}." if missed else "."
    )
    near = [line for line in sections["Dead points"] if line.printed is not None]
    ours, printed = (number(max(values)) for values in zip(*((line.worst, line.printed) for line in near), strict=True))
    yield (
        f"Beside a dead point the FMU errs by at most {ours} conditionings, the printed equations, once mended, by "
        f"{printed}: both give nearly all that the inputs determine."
    )
    lost = [line for line in sections["Poles of the printed formulas"] if line.printed > 2]
    yield (
        f"At {', '.join(line.case for line in lost)} the printed equations lose a digit for each decade nearer, until "
        "none is left; phi3 passes 180° twice in each turn of the published linkage. The FMU loses none."
    )


def page(sections: Sections) -> str:
    """The Markdown page."""
    parts = [
        "# The hard cases",
        "",
        (
            "Part of [speed against error](speed_vs_error.md); written by `python -m scenarios.speed_vs_error`, from "
            "the functions on which the tests assert."
        ),
        "",
        *(f"- {sentence}" for sentence in reading(sections)),
        "",
        "![Error beside dead points, and digits lost at the printed poles](hard_cases.png)",
        "",
        (
            "1 conditioning is what one unit in the last place of the crank's angle and of each parameter does, "
            "summed, to the exact answer, in 50-digit arithmetic. *Printed form*: the same of the paper's equations, "
            "mended where the print is wrong, in double arithmetic. `hard_cases.csv` also tells where each worst value "
            "was."
        ),
        "",
    ]
    for section, lines in sections.items():
        has_printed = any(line.printed is not None for line in lines)
        width = len(HEADINGS) if has_printed else len(HEADINGS) - 1
        parts += [f"## {section}", "", markdown_table(HEADINGS[:width], (cells(line)[:width] for line in lines))]
        parts += ["Not measured on this system.", ""] if not lines else []
    return "\n".join(parts)


def summary(sections: Sections) -> str:
    """The section of the report on speed and error, which leads to the page."""
    sentences = "".join(f"- {sentence}\n" for sentence in reading(sections))
    return (
        "## The hard cases\n\nDead points, poles, random geometries, odd clocks and hosts, line by line: "
        f"[hard_cases.md](hard_cases.md).\n\n{sentences}"
    )


def show(console: Console, sections: Sections) -> None:
    """Print a table a section, and what they say; the page has the words that are left out here."""
    for section, lines in sections.items():
        rows = [tuple(cells(line)[HEADINGS.index(heading)] for heading in SHOWN) for line in lines]
        styles = ["" if line.is_met else "bold red" for line in lines]
        show_table(console, section, SHOWN, rows, words=WORDS, styles=styles)
    for sentence in reading(sections):
        console.print(f"- {sentence}", markup=False)


# ---- the figure ----------------------------------------------------------------------------------


def draw(fmu: UnpackedFmu) -> plt.Figure:
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 5.2))
    draw_dead_points(left, fmu)
    draw_poles(right, fmu)
    figure.text(
        0.01,
        0.02,
        "1 conditioning: what one unit in the last place of the crank's angle and of each parameter does, summed, to "
        "the exact answer. An error below 1 is less than what the last\ndigit of the inputs decides. Further right is "
        "nearer to the place where the linkage stops (left panel) or the printed formula divides by zero (right "
        "panel).",
        color=NOTE,
        fontsize=8,
        va="bottom",
    )
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    return figure


def draw_dead_points(axes: Axes, fmu: UnpackedFmu) -> None:
    """Every pose a mark, the worst of each gap a line."""
    answered = [a for a in dead_points.answer(fmu) if a.approach.gap in dead_points.GAPS]
    for values, label, colour, marker in (
        ([max(a.printed) for a in answered], "printed equations, mended", VERMILLION, "x"),
        ([max(a.ours) for a in answered], "FMU", BLUE, "o"),
    ):
        gaps = np.array([a.approach.gap for a in answered])
        axes.plot(1e3 * gaps, values, marker, color=colour, markersize=3.5, alpha=0.35, linestyle="none")
        worst = [max(v for v, gap in zip(values, gaps, strict=True) if gap == at) for at in dead_points.GAPS]
        axes.plot(1e3 * np.array(dead_points.GAPS), worst, marker + "-", color=colour, markersize=5, label=label)
    axes.axhline(dead_points.BOUND, color=BLACK, linewidth=1, linestyle="--")
    axes.annotate(
        "bound of the tests",
        (1e3 * dead_points.GAPS[-1], dead_points.BOUND),
        xytext=(-4, 4),
        textcoords="offset points",
        ha="right",
        fontsize=8,
    )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="what is left until the links are stretched out / mm",
        ylabel="error / conditionings",
        ylim=(1e-3, 10),
    )
    axes.invert_xaxis()
    axes.set_title("Beside dead points: marks are poses, lines the worst", loc="left")
    axes.legend(loc="lower left")


def draw_poles(axes: Axes, fmu: UnpackedFmu) -> None:
    losses = poles.losses(fmu)
    for pole in poles.POLES:
        colour, marker = POLE_LOOKS[pole]
        beside = [lost for lost in losses if lost.pole == pole]
        axes.plot(
            [lost.distance for lost in beside],
            [min(lost.printed, NO_ANSWER) for lost in beside],
            marker + "-",
            color=colour,
            markersize=4,
            linewidth=1.2,
            label=f"printed: {pole}",
        )
    ours = [max(lost.ours for lost in losses if lost.distance == at) for at in poles.DISTANCES]
    axes.plot(poles.DISTANCES, ours, "o-", color=BLUE, markersize=5, linewidth=2, label="FMU: the worst of all")
    axes.set(
        xscale="log",
        xlabel="distance from the pole / rad of the crank",
        ylabel="decimal digits lost, of the 16 that a double has",
        ylim=(-0.5, 16.5),
    )
    axes.invert_xaxis()
    axes.set_title("Beside the poles of the printed formulas", loc="left")
    axes.axhline(NO_ANSWER, color=GREY, linewidth=0.8, linestyle="--")
    axes.annotate(
        "no answer at all",
        (poles.DISTANCES[0], NO_ANSWER),
        xytext=(0, 3),
        textcoords="offset points",
        fontsize=8,
        color=NOTE,
    )
    axes.legend(loc="upper left", bbox_to_anchor=(0, 0.95))
