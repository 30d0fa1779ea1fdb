"""Tables of the scenarios: Markdown, CSV and the terminal."""

from __future__ import annotations

import csv
import os
import platform
from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

PLAIN_WIDTH = 118
TEXT_WIDTH = 16  # that a column of words has at least, where it has so many letters


def console() -> Console:
    """The terminal, or a plain page where the output is not one: of PLAIN_WIDTH, or as wide as COLUMNS says."""
    terminal = Console(highlight=False)
    is_fixed = not terminal.is_terminal and "COLUMNS" not in os.environ
    return Console(highlight=False, width=PLAIN_WIDTH) if is_fixed else terminal


def show_table(
    console: Console,
    title: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    words: Collection[str] = (),
    styles: Sequence[str] = (),
    lines: bool = False,
) -> None:
    """Print a table as wide as the console at most; in ASCII without a terminal.

    The first column and those headed by one of ``words`` are to the left and wrap between words; all others are
    numbers, to the right, and never wrap. Where the columns have no room side by side, those that are left over follow
    below, again beside the first. ``styles`` are Rich's, one a row; ``lines`` draws a line below each row.
    """
    rows = [tuple(row) for row in rows]
    is_text = [k == 0 or heading in words for k, heading in enumerate(headings)]
    widest = [
        max(len(line) for cell in (*cells, "") for line in cell.split("\n")) for cells in _columns(headings, rows)
    ]
    natural = [max(width, len(heading)) for width, heading in zip(widest, headings, strict=True)]
    least = []
    for k, (heading, cells) in enumerate(zip(headings, _columns(headings, rows), strict=True)):
        longest = max(len(word) for text in (heading, *cells, "-") for word in text.split() or [""])
        least.append(max(longest, min(natural[k], TEXT_WIDTH) if is_text[k] else widest[k]))
    if title:
        console.print(title, style="italic", markup=False)
    for group in _groups(least, console.width):
        widths = _widths([least[k] for k in group], [natural[k] for k in group], console.width)
        table = Table(box=box.ROUNDED if console.is_terminal else box.ASCII, show_lines=lines)
        for k, width in zip(group, widths, strict=True):
            table.add_column(Text(headings[k]), justify="left" if is_text[k] else "right", width=width)
        for number, row in enumerate(rows):
            table.add_row(*(Text(row[k]) for k in group), style=styles[number] if styles else None)
        console.print(table)


def _columns(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> list[list[str]]:
    return [[row[k] for row in rows] for k in range(len(headings))]


def _taken(widths: Iterable[int]) -> int:
    """Columns of the terminal that a table takes: a blank on both sides of each cell, and the lines between."""
    return 1 + sum(width + 3 for width in widths)


def _groups(least: Sequence[int], width: int) -> list[list[int]]:
    """Which columns stand side by side: the first with as many of the others as have room, again and again."""
    groups = [[0]]
    for k in range(1, len(least)):
        if len(groups[-1]) > 1 and _taken(least[j] for j in (*groups[-1], k)) > width:
            groups.append([0])
        groups[-1].append(k)
    return groups


def _widths(least: Sequence[int], natural: Sequence[int], width: int) -> list[int]:
    """Of the columns of a table: the widest give way first, none below its least."""
    widths = list(natural)
    while _taken(widths) > width:
        widest = max((w, k) for k, w in enumerate(widths) if w > least[k])[1] if widths != list(least) else None
        if widest is None:
            break  # a word is longer than the terminal is wide
        widths[widest] -= 1
    return widths


def show_files(console: Console, folder: Path, written: Iterable[Path]) -> None:
    """Print where the reports lie."""
    console.print(f"Tables and figures: {shown(folder)}", soft_wrap=True, markup=False)
    for path in written:
        console.print(f"  {path.name}")


def shown(path: Path) -> Path:
    """A path as seen from where the user stands, if it lies below."""
    here, whole = Path.cwd(), path.resolve()
    return whole.relative_to(here) if whole.is_relative_to(here) else path


def markdown_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A pipe table."""

    def line(texts: Sequence[str]) -> str:
        return "| " + " | ".join(text.replace("|", r"\|") for text in texts) + " |"

    return "\n".join([line(headings), "|" + " --- |" * len(headings), *(line(row) for row in rows)]) + "\n"


def write_csv(path: Path, headings: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """A CSV file; floats with all their digits unless they come as text."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(headings)
        writer.writerows(rows)


def machine() -> str:
    """Processor, with the family and model that tell apart those of one name, and system, as the system names them."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        lines = (line.partition(":") for line in reversed(text.splitlines()))  # the first processor's come last
        known = {name.strip(): value.strip() for name, _, value in lines}
        name = f"{known['model name']} (family {known['cpu family']}, model {known['model']})"
    except (OSError, KeyError):
        name = platform.processor() or platform.machine()
    return f"{name}, {platform.system()}, Python {platform.python_version()}"
