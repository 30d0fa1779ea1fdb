"""The tables in the pages of fmu_src/documentation that repeat what is at home elsewhere.

A page has a table between two marks, `<!-- generated: NAME from FILE -->` and `<!-- end of NAME -->`;
`linkage-fmu generate` writes it.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence

from ..interface import Interface
from .documentation import FOLDER
from .reference import definitions
from .terminals import TERMINALS, members

PUBLISHED = FOLDER / "published.csv"  # what the published planting cycle wrote; a test tells when it is stale
MARKED = re.compile(
    r"(?P<begin><!-- generated: (?P<name>\w+) from [^>]* -->\n)(?:.*?)(?P<end><!-- end of (?P=name) -->)", re.DOTALL
)
MARK = re.compile(r"<!-- (?:generated:|end of)[^>]*-->")


def with_tables(page: str, interface: Interface) -> str:
    """A page with its generated tables made anew; raises ValueError where a mark has no partner or no table."""

    def made(found: re.Match[str]) -> str:
        if found["name"] not in TABLES:
            raise ValueError(f"{found['begin'].strip()}: there is no such table, but {', '.join(TABLES)}")
        return f"{found['begin']}{TABLES[found['name']](interface)}\n{found['end']}"

    if MARK.search(outside := MARKED.sub("", page)):
        raise ValueError(f"{MARK.findall(outside)[0]}: this mark has no partner")
    return MARKED.sub(made, page)


def interface_rows(interface: Interface) -> list[tuple[str, ...]]:
    """Number, name, kind, unit, start and meaning of every variable, as people read them."""
    rows: list[tuple[str, ...]] = []
    for v in interface.variables:
        start = "" if v.start is None else f"{v.start}".lower() if v.type == "boolean" else f"{v.start:.10g}"
        rows.append((str(v.value_reference), v.name, v.kind, v.unit.name if v.unit else "", start, v.text))
    return rows


def _interface(interface: Interface) -> str:
    return _table(("#", "name", "kind", "unit", "start", "meaning"), interface_rows(interface), code=1)


def _terminals(interface: Interface) -> str:
    rows = ((name, text, ", ".join(members(interface, name))) for name, (_, _, _, text) in TERMINALS.items())
    return _table(("terminal", "what it is", "members"), rows, code=0)


def _experiments(interface: Interface) -> str:
    found = definitions(interface)
    units = list(found[0].tolerance)
    rows = (
        (of.name, of.description, f"{of.stop:g} s", f"{of.step:g} s", *(_power(of.tolerance[unit]) for unit in units))
        for of in found
    )
    return _table(("experiment", "what it is", "end", "step", *units), rows, code=0)


def _published(_interface: Interface) -> str:
    with PUBLISHED.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    columns = ("paper section", "published", "computed", "verdict", "reason")
    return _table(columns, ([row[name] for name in columns] for row in rows))


TABLES: dict[str, Callable[[Interface], str]] = {
    "interface": _interface,
    "terminals": _terminals,
    "experiments": _experiments,
    "published": _published,
}


def _power(value: float) -> str:
    return f"{value:.0e}".replace("e-0", "e-")


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]], code: int | None = None) -> str:
    """A Markdown table; the column number `code` in typewriter letters."""

    def line(cells: Iterable[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    marked = ([f"`{cell}`" if k == code else cell for k, cell in enumerate(row)] for row in rows)
    return "\n".join([line(headings), "|" + "---|" * len(headings), *map(line, marked)])
