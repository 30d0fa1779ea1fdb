"""The section *Solving* of the report on speed and error: CSV, Markdown, figure and terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no display needed

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator  # noqa: E402
from rich import box  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from scenarios import reports  # noqa: E402
from scenarios.figures import STYLE  # noqa: E402
from tests.solving.measure import ALIKE, Cell, core_of, times_the_error, wins  # noqa: E402
from tests.solving.way import CORE, HAND, ORDERS, OURS, PAPER, PEER, QUANTITIES, UNITS  # noqa: E402

UP_TO = ("position", "+ velocity", "+ acceleration")
HEADINGS = ("way", *UP_TO, f"error / {UNITS[0]}", *UNITS[1:])
LABEL_DISTANCE = 11.5  # points, between the names above a panel
# Colour-blind-safe, of Okabe and Ito.
LOOKS = {OURS: ("#D55E00", "D"), PAPER: ("#000000", "s"), HAND: ("#009E73", "^"), PEER: ("#0072B2", "o")}


def ratio_text(value: float) -> str:
    """A ratio of times: two decimals below ten, then three digits."""
    if np.isnan(value):
        return ""
    return f"{value:.2f}" if value < 10 else f"{float(f'{value:.3g}'):,.0f}".replace(",", " ")


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
        errors = tuple(error_text(cell.errors[-1]) if cell.errors else "" for cell in row)
        rows.append((row[0].way.title, *times, *errors))
    return rows


def _named(cell: Cell, core: Cell) -> str:
    """'numba (1.03 times its time; position error 0.8 times the core's)'."""
    factors = ", ".join(f"{quantity} error {float(f'{factor:.2g}'):g}" for quantity, factor in
                        zip(QUANTITIES, times_the_error(cell, core)))
    return f"{cell.way.title} ({ratio_text(cell.ratio)} of the core's time; {factors} times the core's)"


def findings(cells: Sequence[Cell], missing: Sequence[tuple[str, str]]) -> list[str]:
    """Who beats the core in what, from the cells alone; who is missing."""
    found, sentences = wins(cells), []
    for order in ORDERS:
        core = core_of(cells, order)
        lost, level, faster = ("; ".join(_named(cell, core) for cell in kind if cell.order == order)
                               for kind in (found.defeats, found.draws, found.faster))
        if lost:
            sentence = f"**the core is beaten, at its own accuracy, by {lost}**"
        elif level:
            sentence = f"level with the core, within the scatter of the rounds, is {level}"
        else:
            sentence = f"the core is faster than every way of its accuracy (within {ALIKE:g} times its error)"
            rivals = [cell for cell in cells if cell.order == order and cell.way.key != CORE and not cell.why
                      and max(times_the_error(cell, core)) <= ALIKE]
            if rivals:
                sentence += f"; the next is {_named(min(rivals, key=lambda cell: cell.ratio), core)}"
        sentence += f". Faster, but less accurate: {faster}." if faster else ". Nothing less accurate is faster."
        sentences.append(f"{_and(QUANTITIES[:order + 1])}: {sentence}")
    names = sorted({cell.way.title for cell in found.sharper})
    sentences.append(f"Slower, but of half the core's error or less: {', '.join(names)}." if names
                     else "No way has half the core's error or less.")
    core_times = ", ".join(f"{core_of(cells, order).in_sincos:.1f}" for order in ORDERS)
    sentences.append(f"The core takes the time of {core_times} calls of libm's sincos ({', '.join(UP_TO)}).")
    wrong = dict.fromkeys((cell.way.title, cell.why) for cell in cells if cell.why)
    sentences += [f"Not timed: {title} ({why})." for title, why in wrong]
    sentences += [f"Missing: {name} ({why})." for name, why in missing]
    return sentences


def markdown(cells: Sequence[Cell], missing: Sequence[tuple[str, str]], angles: int, machine: str) -> str:
    """The section."""
    rounds = len(core_of(cells, 0).times)
    remarks = [f"- *{row[0].way.title}*: {row[0].way.remark}." for row in by_way(cells) if row[0].way.remark]
    return "\n".join([
        "## Solving", "",
        f"One evaluation at each order, at the same {angles} angles for all. First its time in times of the exact "
        "core's: of the position alone, with the velocity, with the acceleration too. Then the worst distance of the "
        "tip from the 50-digit truth at 65 turns a minute, of each quantity where it is the last computed. Each way's "
        "answers are held against the truth before it is timed. Times are the processor's; medians of the ratios "
        f"within {rounds} interleaved rounds, each way beside the core. Measured on: {machine}. Written by "
        "`python -m tests.solving`, which `make bench` runs with the peers installed.", "",
        reports.markdown_table(
            HEADINGS, [*table_rows(cells), *((name, "missing", *[""] * 5) for name, _ in missing)]),
        *(f"- {sentence}" for sentence in findings(cells, missing)), "",
        "![Error against time of one evaluation](solving.png)", "",
        "What is what:", "", *remarks, "",
        "`solving.csv` has every error, ratio and quartile.", ""])


def write(output: Path, cells: Sequence[Cell], missing: Sequence[tuple[str, str]], angles: int,
          machine: str) -> list[Path]:
    """solving.csv, solving.md and solving.png in `output`; returns their paths."""
    output.mkdir(parents=True, exist_ok=True)
    paths = [output / f"solving.{suffix}" for suffix in ("csv", "md", "png")]
    rows = [(cell.way.key, cell.way.title, cell.way.whose, cell.order,
             *(f"{error:.4g}" for error in cell.errors), *[""] * (len(ORDERS) - len(cell.errors)),
             *(f"{value:.4f}" for value in (cell.ratio, *cell.spread, cell.in_sincos)),
             f"{np.median(cell.times):.2f}" if len(cell.times) else "", cell.why)
            for row in by_way(cells) for cell in row]
    rows += [("", name, PEER, "", *[""] * 8, f"missing: {why}") for name, why in missing]
    errors = (f"{name}_error_{unit.replace('/', '_')}" for name, unit in zip(QUANTITIES, UNITS))
    reports.write_csv(paths[0], ("key", "way", "whose", "order", *errors, "of_core", "of_core_lower_quartile",
                                 "of_core_upper_quartile", "of_sincos", "nanoseconds_here", "remark"), rows)
    paths[1].write_text(markdown(cells, missing, angles, machine), encoding="utf-8")
    draw(paths[2], cells)
    return paths


def show(cells: Sequence[Cell], missing: Sequence[tuple[str, str]], machine: str) -> None:
    """Print the table and the findings; in ASCII where the output is not a terminal."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=reports.PLAIN_WIDTH)
    table = Table(title=f"One evaluation: time (core = 1), then worst error: {machine}", title_justify="left",
                  box=box.ROUNDED if console.is_terminal else box.ASCII)
    for k, heading in enumerate(HEADINGS):
        table.add_column(heading, justify="right" if k else "left", no_wrap=True)
    for row in table_rows(cells):
        table.add_row(*row, style="bold" if row[0] == core_of(cells, 0).way.title else "")
    for name, _ in missing:
        table.add_row(name, "missing", *[""] * 5)
    console.print(table)
    for sentence in findings(cells, missing):
        console.print(f"- {sentence.replace('**', '')}", markup=False)


# ---- the figure ------------------------------------------------------------------------

def draw(path: Path, cells: Sequence[Cell]) -> None:
    """Error over time, a panel an order, a marker a way, each with its name above the panel."""
    with plt.rc_context({**STYLE, "figure.dpi": 100}):
        figure, panels = plt.subplots(len(ORDERS), 1, figsize=(9.5, 15.0))
        figure.subplots_adjust(left=0.085, right=0.93, top=0.868, bottom=0.06, hspace=0.62)
        shown = [cell for cell in cells if not cell.why]
        limits = 0.6 * min(cell.ratio for cell in shown), 1.6 * max(cell.ratio for cell in shown)
        for order, axes in zip(ORDERS, panels):
            axes.set(xscale="log", yscale="log", xlim=limits)
            _panel(axes, [cell for cell in shown if cell.order == order], order)
        panels[-1].set_xlabel("time of one evaluation (exact core = 1)")
        handles = [plt.Line2D([], [], linestyle="", color=colour, marker=marker, label=whose)
                   for whose, (colour, marker) in LOOKS.items()]
        figure.legend(handles=handles, loc="lower center", ncols=len(handles), bbox_to_anchor=(0.5, 0.005))
        figure.suptitle("One evaluation of the linkage, error against time: best is below and to the left",
                        x=0.012, y=0.994, ha="left", fontsize=11)
        figure.savefig(path)
        plt.close(figure)


def _panel(axes: Axes, cells: Sequence[Cell], order: int) -> None:
    axes.set_ylabel(f"worst error of the {QUANTITIES[order]} / {UNITS[order].replace('s2', 's²')}")
    axes.text(0.012, 0.94, UP_TO[order].capitalize(), transform=axes.transAxes, fontsize=10, va="top",
              bbox={"color": "white", "pad": 1.5}, zorder=4)
    low, high = (pick(cell.errors[order] for cell in cells) for pick in (min, max))
    axes.set_ylim(10 ** (np.floor(np.log10(low)) - 0.5), 10 ** (np.ceil(np.log10(high)) + 0.3))
    axes.yaxis.set_major_locator(LogLocator(base=10, numticks=9))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    cells = sorted(cells, key=lambda cell: cell.ratio)
    points = axes.get_window_extent().width * 72 / axes.figure.dpi
    to_axes = axes.transData + axes.transAxes.inverted()
    names = _spread([points * to_axes.transform((cell.ratio, cell.errors[order]))[0] for cell in cells], LABEL_DISTANCE)
    for cell, name in zip(cells, names):
        colour, marker = LOOKS[cell.way.whose]
        axes.plot(cell.ratio, cell.errors[order], marker, color=colour, markersize=8 if cell.way.key == CORE else 5.5,
                  markeredgecolor="white", markeredgewidth=0.5, zorder=3)
        axes.annotate(cell.way.title, (cell.ratio, cell.errors[order]), xytext=((name + 5) / points, 1.01),
                      textcoords="axes fraction", rotation=48, rotation_mode="anchor", ha="left", va="bottom",
                      fontsize=7.5, color=colour, fontweight="bold" if cell.way.key == CORE else None,
                      arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.5, "alpha": 0.6, "shrinkA": 0,
                                  "shrinkB": 2, "relpos": (0, 0)})


def _and(words: Sequence[str]) -> str:
    text = ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else words[0]
    return text[0].upper() + text[1:]


def _spread(places: Sequence[float], distance: float) -> list[float]:
    """Rising places, moved as little as needed to be so far apart: groups that touch share their middle."""
    groups: list[list[float]] = []  # of what the places would be without their neighbours
    for n, place in enumerate(places):
        groups.append([place - n * distance])
        while len(groups) > 1 and np.mean(groups[-2]) > np.mean(groups[-1]):
            groups[-2:] = [groups[-2] + groups[-1]]
    moved = [float(np.mean(group)) for group in groups for _ in group]
    return [place + n * distance for n, place in enumerate(moved)]
