"""The section *Solving* of the report on speed and error: CSV, Markdown, figure and terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from scenarios.common import reports
from scenarios.common.figures import BLACK, BLUE, GREEN, NOTE, STYLE, VERMILLION
from scenarios.common.timing import noise_here, ratio_text
from scenarios.speed_vs_error.solving.measure import ALIKE, Cell, core_of, times_the_error, wins
from scenarios.speed_vs_error.solving.way import (
    CORE,
    HAND,
    MOTION,
    ORDERS,
    OURS,
    PAPER,
    PEER,
    QUANTITIES,
    UNITS,
    Question,
)

UP_TO = MOTION.levels
LOOKS = {OURS: VERMILLION, PAPER: BLACK, HAND: GREEN, PEER: BLUE}
MARKS = (("o", 4.5), ("s", 4.5), ("D", 4.5))  # of what is computed


def headings(question: Question = MOTION) -> tuple[str, ...]:
    """Of the table: times at each order, then errors."""
    return ("way", *question.levels, f"error / {question.units[0]}", *question.units[1:])


HEADINGS = headings()


def error_text(value: float) -> str:
    """Two digits; as a power of ten below 0.01."""
    return f"{float(f'{value:.2g}'):g}" if value >= 0.01 else f"{value:.1e}".replace("e-0", "e-")


def by_way(cells: Sequence[Cell]) -> list[list[Cell]]:
    """The cells of each way by order; the fastest at the highest order first, those without times last."""
    keys = dict.fromkeys(cell.way.key for cell in cells)
    rows = [sorted((cell for cell in cells if cell.way.key == key), key=lambda cell: cell.order) for key in keys]
    return sorted(rows, key=lambda row: (np.isnan(row[-1].ratio), row[-1].ratio))


def table_rows(cells: Sequence[Cell]) -> list[tuple[str, ...]]:
    """Rows under HEADINGS: each quantity's error at the first order that gives it."""
    rows = []
    for row in by_way(cells):
        times = tuple(cell.why.partition(":")[0] if cell.why else ratio_text(cell.ratio) for cell in row)
        first = tuple(map(error_text, row[0].errors)) or ("",) * (row[0].order + 1)
        errors = tuple(error_text(cell.errors[-1]) if cell.errors else "" for cell in row[1:])
        rows.append((row[0].way.title, *times, *first, *errors))
    return rows


def _named(cell: Cell, core: Cell, question: Question) -> str:
    """'numba (1.03 of the core's time; position error 0.8 times the core's)'."""
    factors = ", ".join(
        f"{quantity} error {float(f'{factor:.2g}'):g}"
        for quantity, factor in zip(question.quantities, times_the_error(cell, core), strict=False)  # up to the order
    )
    return f"{cell.way.title} ({cell.of_core} of the core's time; {factors} times the core's)"


def findings(cells: Sequence[Cell], missing: Sequence[tuple[str, str]], question: Question = MOTION) -> list[str]:
    """Who beats the core in what, from the cells alone; who is missing."""
    found, sentences = wins(cells), []
    for order in question.orders:
        core = core_of(cells, order)
        lost, level, faster, unsure = (
            "; ".join(_named(cell, core, question) for cell in kind if cell.order == order)
            for kind in (found.defeats, found.draws, found.faster, found.unsure)
        )
        alike = f"within the scatter of the rounds neither faster nor slower, at the core's accuracy, is {level}"
        if lost:
            sentence = f"**the core is beaten, at its own accuracy, by {lost}**" + (f"; {alike}" if level else "")
        elif level:
            sentence = alike
        else:
            sentence = f"the core is faster than every way of its accuracy (within {ALIKE:g} times its error)"
            rivals = [
                cell
                for cell in cells
                if cell.order == order
                and cell.way.key != CORE
                and not cell.why
                and max(times_the_error(cell, core)) <= ALIKE
            ]
            if rivals:
                sentence += f"; the next is {_named(min(rivals, key=lambda cell: cell.ratio), core, question)}"
        if faster:
            sentence += f". Faster, but less accurate: {faster}"
        if unsure:
            sentence += f". Less accurate, and within the scatter neither faster nor slower: {unsure}"
        sentence += "." if faster or unsure else ". Nothing less accurate is faster."
        sentences.append(f"{_and(question.quantities[: order + 1])}: {sentence}")
    names = sorted({cell.way.title for cell in found.sharper})
    sentences.append(
        f"Slower, but of half the core's error or less: {', '.join(names)}."
        if names
        else "No way has half the core's error or less."
    )
    core_times = ", ".join(str(core_of(cells, order).of_sincos) for order in question.orders)
    sentences.append(f"The core takes the time of {core_times} calls of libm's sincos ({', '.join(question.levels)}).")
    wrong = dict.fromkeys((cell.way.title, cell.why) for cell in cells if cell.why)
    sentences += [f"Not timed: {title} ({why})." for title, why in wrong]
    sentences += [f"Missing: {name} ({why})." for name, why in missing]
    return sentences


def noise(cells: Sequence[Cell]) -> str:
    """How quiet the machine was, from libm's sincos, which was timed in every round beside the core."""
    return noise_here(next(cell for cell in cells if cell.way.key == CORE).sincos, "libm's sincos")


def markdown(cells: Sequence[Cell], missing: Sequence[tuple[str, str]], angles: int, machine: str) -> str:
    """The section."""
    rounds = len(core_of(cells, 0).times)
    remarks = [f"- *{row[0].way.title}*: {row[0].way.remark}." for row in by_way(cells) if row[0].way.remark]
    return "\n".join(
        [
            "## Solving",
            "",
            (
                f"One evaluation at each order, at the same {angles} angles for all. First its time in times of the "
                "exact core's: of the position alone, with the velocity, with the acceleration too. Then the worst "
                "distance of the tip from the 50-digit truth at 65 turns a minute, of each quantity where it is the "
                "last computed. Each way's answers are held against the truth before it is timed. Times are the "
                f"processor's; medians of the ratios within {rounds} interleaved rounds, each way beside the core. "
                f"Measured on: {machine}. A sentence on times stands below only where the scatter carries it: in the "
                "middle half of each third of the rounds; a range is that middle half. Written by `python -m "
                "scenarios.speed_vs_error`; `make bench` runs it with the peers installed."
            ),
            "",
            reports.markdown_table(
                HEADINGS, [*table_rows(cells), *((name, "missing", *[""] * 5) for name, _ in missing)]
            ),
            *(f"- {sentence}" for sentence in (*findings(cells, missing), noise(cells))),
            "",
            "![Error against time of one evaluation](solving.png)",
            "",
            "What is what:",
            "",
            *remarks,
            "",
            "`solving.csv` has every error, ratio and quartile.",
            "",
        ]
    )


def write(
    output: Path, cells: Sequence[Cell], missing: Sequence[tuple[str, str]], angles: int, machine: str
) -> list[Path]:
    """solving.csv, solving.md and solving.png in `output`; returns their paths."""
    output.mkdir(parents=True, exist_ok=True)
    paths = [output / f"solving.{suffix}" for suffix in ("csv", "md", "png")]
    rows = [
        (
            cell.way.key,
            cell.way.title,
            cell.way.whose,
            cell.order,
            *(f"{error:.4g}" for error in cell.errors),
            *[""] * (len(ORDERS) - len(cell.errors)),
            *(f"{value:.4f}" for value in (cell.ratio, *cell.of_core.quartiles, cell.of_sincos.median)),
            f"{np.median(cell.times):.2f}" if len(cell.times) else "",
            cell.why,
        )
        for row in by_way(cells)
        for cell in row
    ]
    rows += [("", name, PEER, "", *[""] * 8, f"missing: {why}") for name, why in missing]
    errors = (f"{name}_error_{unit.replace('/', '_')}" for name, unit in zip(QUANTITIES, UNITS, strict=True))
    reports.write_csv(
        paths[0],
        (
            "key",
            "way",
            "whose",
            "order",
            *errors,
            "of_core",
            "of_core_lower_quartile",
            "of_core_upper_quartile",
            "of_sincos",
            "nanoseconds_here",
            "remark",
        ),
        rows,
    )
    paths[1].write_text(markdown(cells, missing, angles, machine), encoding="utf-8")
    draw(paths[2], cells)
    return paths


def show(cells: Sequence[Cell], missing: Sequence[tuple[str, str]], machine: str) -> None:
    """Print the table and the findings; in ASCII where the output is not a terminal."""
    console = reports.console()
    rows = [*table_rows(cells), *((name, "missing", *[""] * 5) for name, _ in missing)]
    core = core_of(cells, 0).way.title
    title = f"One evaluation: time (core = 1), then worst error: {machine}"
    reports.show_table(console, title, HEADINGS, rows, styles=["bold" if row[0] == core else "" for row in rows])
    for sentence in (*findings(cells, missing), noise(cells)):
        console.print(f"- {sentence.replace('**', '')}", markup=False)


# ---- the figure ------------------------------------------------------------------------


def draw(path: Path, cells: Sequence[Cell]) -> None:
    """A line a way, the fastest on top: its time at each order with the middle half of the rounds, and its errors."""
    rows = [[cell for cell in row if not cell.why] for row in by_way(cells)]
    rows = [row for row in rows if row]
    places = np.arange(len(rows))
    with plt.rc_context(STYLE):
        head, foot, tall = 0.72, 1.05, 0.27 * len(rows) + 0.1  # inches
        high = head + tall + foot
        figure, panels = plt.subplots(1, 4, figsize=(12.4, high), sharey=True, width_ratios=(2.6, 1, 1, 1))
        figure.subplots_adjust(left=0.205, right=0.985, top=1 - head / high, bottom=foot / high, wspace=0.09)
        _times(panels[0], rows)
        for order, axes in zip(ORDERS, panels[1:], strict=True):
            _errors(axes, rows, order)
        for axes in panels:
            axes.set_ylim(len(rows) - 0.4, -0.6)
            core = next((place for place, row in zip(places, rows, strict=True) if row[0].way.key == CORE), None)
            if core is not None:
                axes.axhspan(core - 0.5, core + 0.5, color="#FBEFE6", zorder=0, linewidth=0)
            axes.tick_params(axis="y", length=0)
        panels[0].set_yticks(places, [row[0].way.title for row in rows])
        for label, row in zip(panels[0].get_yticklabels(), rows, strict=True):
            label.set(color=LOOKS[row[0].way.whose], fontweight="bold" if row[0].way.key == CORE else "normal")
        marks = [
            Line2D([], [], linestyle="", color=NOTE, marker=marker, markersize=size, label=name)
            for name, (marker, size) in zip(UP_TO, MARKS, strict=True)
        ]
        figure.legend(handles=marks, loc="lower left", ncols=3, bbox_to_anchor=(0.2, 0.0), title="computed")
        present = {row[0].way.whose for row in rows}
        whose = [
            Line2D([], [], linestyle="", color=c, marker="s", markersize=7, label=w)
            for w, c in LOOKS.items()
            if w in present
        ]
        figure.legend(handles=whose, loc="lower right", ncols=len(whose), bbox_to_anchor=(0.985, 0.0), title="whose")
        title = "One evaluation of the linkage: time and worst error of each way (further left is better)"
        figure.text(0.012, 1 - 0.12 / high, title, va="top", fontsize=11)
        figure.savefig(path)
        plt.close(figure)


def _times(axes: Axes, rows: Sequence[Sequence[Cell]]) -> None:
    axes.set(xscale="log", xlabel="exact core = 1; whiskers: middle half of the rounds")
    axes.set_title("Time of one evaluation", loc="left")
    axes.axvline(1, color=BLACK, linewidth=0.8, zorder=1)
    for place, row in enumerate(rows):
        for cell, (marker, size) in zip(row, (MARKS[cell.order] for cell in row), strict=True):
            at = place + 0.22 * (cell.order - 1)
            colour = LOOKS[cell.way.whose]
            axes.plot(cell.of_core.quartiles, [at, at], color=colour, linewidth=1.1, zorder=2)
            axes.plot(
                cell.ratio,
                at,
                marker,
                color=colour,
                markersize=size,
                zorder=3,
                markeredgecolor="white",
                markeredgewidth=0.4,
            )
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _errors(axes: Axes, rows: Sequence[Sequence[Cell]], order: int) -> None:
    marker, size = MARKS[order]
    axes.set(xscale="log", xlabel=UNITS[order].replace("s2", "s²"))
    axes.set_title(f"Error of the {QUANTITIES[order]}", loc="left")
    for place, row in enumerate(rows):
        for cell in row:
            if cell.order == order:
                axes.plot(cell.errors[order], place, marker, color=LOOKS[cell.way.whose], markersize=size + 1)
    axes.xaxis.set_major_locator(LogLocator(base=10, numticks=4))
    axes.xaxis.set_minor_locator(NullLocator())


def _and(words: Sequence[str]) -> str:
    text = ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else words[0]
    return text[0].upper() + text[1:]
