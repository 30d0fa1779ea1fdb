"""The comparison with the paper as a table: in the terminal and as CSV."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console

from scenarios.common import reports
from scenarios.paper_cycle.published import AGREES, DIFFERS, OPEN, Row

HEADINGS = ("paper section", "published", "computed", "verdict", "reason")
HEADINGS_WITH_REASON = tuple(heading for heading in HEADINGS if heading != "verdict")
# What the terminal shows, in this order.
SHOWN = (
    (DIFFERS, "{} differ: what the paper says, what the FMU gives, and why", HEADINGS_WITH_REASON),
    (OPEN, "{} are not determined by the paper", HEADINGS_WITH_REASON),
    (AGREES, "{} agree; table.md has remarks", HEADINGS_WITH_REASON[:3]),
)


def cells(row: Row) -> tuple[str, str, str, str, str]:
    """A row's texts under HEADINGS."""
    return row.source, row.published, row.computed, row.verdict, row.reason


def count(rows: Iterable[Row]) -> str:
    """'20 agree, 5 differ, 4 not determined by the paper'."""
    verdicts = [row.verdict for row in rows]
    return (
        f"{verdicts.count(AGREES)} agree, {verdicts.count(DIFFERS)} differ, "
        f"{verdicts.count(OPEN)} not determined by the paper"
    )


def show(console: Console, rows: Sequence[Row]) -> None:
    """Print the comparison: first what differs, then what is open, each with its reason; then what agrees."""
    for verdict, title, headings in SHOWN:
        found = [dict(zip(HEADINGS, cells(row), strict=True)) for row in rows if row.verdict == verdict]
        if found:
            texts = [[row[heading] for heading in headings] for row in found]
            has_reasons = "reason" in headings
            reports.show_table(console, title.format(len(found)), headings, texts, words=headings, lines=has_reasons)


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """The comparison for machines: with a key, the leading number and its unit."""
    reports.write_csv(
        path,
        ("key", *HEADINGS, "value", "unit"),
        ((row.key, *cells(row), "" if row.value is None else repr(row.value), row.unit) for row in rows),
    )
