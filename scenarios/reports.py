"""Tables of the scenarios: Markdown, CSV and the terminal."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from scenarios.published import AGREES, DIFFERS, OPEN, Row

HEADINGS = ("paper section", "published", "computed", "verdict", "reason")
STYLES = {AGREES: "green", DIFFERS: "bold red", OPEN: "yellow"}
PLAIN_WIDTH = 118


def cells(row: Row) -> tuple[str, str, str, str, str]:
    """A row's texts under HEADINGS."""
    return row.source, row.published, row.computed, row.verdict, row.reason


def count(rows: Iterable[Row]) -> str:
    """'20 agree, 5 differ, 4 not determined by the paper'."""
    verdicts = [row.verdict for row in rows]
    return (f"{verdicts.count(AGREES)} agree, {verdicts.count(DIFFERS)} differ, "
            f"{verdicts.count(OPEN)} not determined by the paper")


def show(console: Console, rows: Sequence[Row]) -> None:
    """Print the comparison; without colour and in ASCII where the output is not a terminal."""
    table = Table(box=box.ROUNDED if console.is_terminal else box.ASCII, show_lines=True, width=min(console.width, 120))
    for heading, ratio in zip(HEADINGS, (8, 22, 31, 10, 29)):
        table.add_column(heading, ratio=ratio, min_width=10 if heading == "verdict" else None, overflow="fold")
    for row in rows:
        source, published, computed, verdict, reason = (text.replace("[", r"\[") for text in cells(row))
        colour = STYLES[row.verdict]
        table.add_row(source, published, computed, f"[{colour}]{verdict}[/]", reason)
    console.print(table)


def console() -> Console:
    """The terminal, or a plain page of fixed width where the output is not one."""
    terminal = Console(highlight=False)
    return terminal if terminal.is_terminal else Console(highlight=False, width=PLAIN_WIDTH)


def show_table(console: Console, title: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table, its first column to the left and all others to the right; in ASCII without a terminal."""
    table = Table(title=title, title_justify="left", box=box.ROUNDED if console.is_terminal else box.ASCII)
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="right" if k else "left")
    for row in rows:
        table.add_row(*(text.replace("[", r"\[") for text in row))
    console.print(table)


def show_files(console: Console, folder: Path, written: Iterable[Path]) -> None:
    """Print where the reports lie, as seen from where the user stands."""
    try:
        shown = folder.resolve().relative_to(Path.cwd())
    except ValueError:
        shown = folder
    console.print(f"Tables and figures: {shown}", soft_wrap=True)
    for path in written:
        console.print(f"  {path.name}")


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


def write_comparison_csv(path: Path, rows: Sequence[Row]) -> None:
    """The comparison for machines: with a key, the leading number and its unit."""
    write_csv(path, ("key", *HEADINGS, "value", "unit"),
              ((row.key, *cells(row), "" if row.value is None else repr(row.value), row.unit) for row in rows))
