"""The reference tables in reference/: the tip and three derivatives by the crank angle, to 25 digits.

    nominal.csv         200 crank angles of the nominal geometry
    geometries.csv      60 other geometries, one angle each
    near_singular.csv   42 poses of geometries that come within a gap of a dead point, at that angle and beside it

SI units. Each parameter and angle is exactly the double printed.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from mpmath import mp, mpf

from fmu_src.interface import load_interface

REFERENCE = Path(__file__).with_name("reference")
DIGITS = 25
_DERIVATIVES = (("x", "y"), ("dx", "dy"), ("ddx", "ddy"), ("dddx", "dddy"))


@dataclass(frozen=True)
class Row:
    """One pose with its exact answer; `str(row)` says where it stands."""

    table: str
    line: int
    case: str  # which dead point, "" where none is near
    gap: float | None  # metres that the dyad has left where it comes nearest to it
    geometry: dict[str, float]
    phi: float
    printed: tuple[tuple[str, str], ...]  # [n] is the n-th derivative of the tip by phi: (x, y)

    @cached_property
    def exact(self) -> list[tuple[mpf, mpf]]:
        """The tip's derivatives as numbers of all printed digits."""
        with mp.workdps(DIGITS + 5):
            return [(mpf(x), mpf(y)) for x, y in self.printed]

    @cached_property
    def tip(self) -> list[complex]:
        """The tip's derivatives as the nearest doubles."""
        return [complex(float(x), float(y)) for x, y in self.printed]

    def __str__(self) -> str:
        note = f" ({self.case}, {self.gap:g} m)" if self.case else ""
        return f"{self.table}:{self.line}{note} phi={self.phi!r}"


@cache
def rows(table: str) -> tuple[Row, ...]:
    """All rows of `nominal`, `geometries` or `near_singular`."""
    nominal = load_interface().geometry
    with (REFERENCE / f"{table}.csv").open(newline="", encoding="ascii") as file:
        return tuple(
            Row(
                table=f"{table}.csv",
                line=line,
                case=entry.get("case", ""),
                gap=float(entry["gap_m"]) if "gap_m" in entry else None,
                geometry={name: float(entry[name]) if name in entry else nominal[name] for name in nominal},
                phi=float(entry["phi"]),
                printed=tuple((entry[x], entry[y]) for x, y in _DERIVATIVES),
            )
            for line, entry in enumerate(csv.DictReader(file), 2)
        )
