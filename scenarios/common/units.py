"""Quantities as people write them: 55mm, 180 deg, 65 rpm, 1.5 km/h; a number without a unit is in SI units."""

from __future__ import annotations

import math
import re

# By name: the SI unit of what is measured with it, and how many of those it is.
UNITS = {
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "°": ("rad", math.pi / 180),
    "rad/s": ("rad/s", 1.0),
    "rpm": ("rad/s", 2 * math.pi / 60),
    "/min": ("rad/s", 2 * math.pi / 60),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "km/h": ("m/s", 1 / 3.6),
    "m/s2": ("m/s2", 1.0),
    "mm/s2": ("m/s2", 1e-3),
    "m/s3": ("m/s3", 1.0),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "min": ("s", 60.0),
    "N.m": ("N.m", 1.0),
    "kg.m2": ("kg.m2", 1.0),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "kg": ("kg", 1.0),
    "g": ("kg", 1e-3),
    "1": ("1", 1.0),
    "%": ("1", 1e-2),
}
# What each SI unit is shown in.
SHOWN = {"m": "mm", "rad": "deg", "rad/s": "rpm"}
_WRITTEN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


class UnitError(ValueError):
    """A quantity that cannot be read; the message says what would do."""


def si(written: str | float, unit: str | None) -> float:
    """A quantity in its SI unit, from text with or without a unit, or from a bare number.

    ``unit``: the SI unit that it must have; None where any will do. Raises UnitError.
    """
    if isinstance(written, bool) or not isinstance(written, (str, int, float)):
        raise UnitError(f"{written!r} is no quantity")
    found = _WRITTEN.fullmatch(written) if isinstance(written, str) else None
    if isinstance(written, str) and found is None:
        raise UnitError(f"{written!r} is not a number with a unit, {_examples(unit)}")
    value, name = (float(found[1]), found[2]) if found else (float(written), "")
    if not math.isfinite(value):
        raise UnitError(f"{written!r} is not finite")
    if not name:
        return value
    if name not in UNITS:
        raise UnitError(f"{written!r}: the unit {name!r} is not known; {_examples(unit)}")
    of, factor = UNITS[name]
    if unit is not None and of != unit:
        raise UnitError(f"{written!r} is not {_what(unit)}; {_examples(unit)}")
    return value * factor


def shown(value: float, unit: str, digits: int = 6) -> str:
    """An SI value as people read it, with its unit."""
    name = SHOWN.get(unit, unit)
    number = f"{value / UNITS[name][1] if name in UNITS else value:.{digits}g}"
    return number if name in ("1", "") else f"{number} {name}"


def _what(unit: str) -> str:
    names = {"m": "a length", "rad": "an angle", "rad/s": "an angular speed", "m/s": "a speed", "1": "a pure number"}
    return names.get(unit, f"in {unit}")


def _examples(unit: str | None) -> str:
    fitting = [name for name, (of, _) in UNITS.items() if unit in (None, of)]
    return f"units are {', '.join(fitting)}" if fitting else f"it has the unit {unit}"
