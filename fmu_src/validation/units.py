"""What a unit's name says, where it is written with SI symbols: "N.m/rad", "km/h", "m.s-2".

FMI lets names be anything, and many tools read them as Modelica does (Modelica 3.6, chapter 19: symbols with prefixes,
joined by ".", at most one "/", exponents right behind the symbol). Symbols and factors are those of the SI Brochure,
9th edition, tables 2, 4, 7 and 8.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

from fmpy.model_description import BaseUnit, Unit

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
PREFIXES = {"Y": 24, "Z": 21, "E": 18, "P": 15, "T": 12, "G": 9, "M": 6, "k": 3, "h": 2, "da": 1, "d": -1, "c": -2,
            "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9, "p": -12, "f": -15, "a": -18, "z": -21, "y": -24}  # fmt: skip
SIMPLE = {
    "m": "m", "g": "kg", "s": "s", "A": "A", "K": "K", "mol": "mol", "cd": "cd", "rad": "rad", "N": "kg m s-2",
    "Pa": "kg m-1 s-2", "J": "kg m2 s-2", "W": "kg m2 s-3", "C": "A s", "V": "kg m2 s-3 A-1", "F": "kg-1 m-2 s4 A2",
    "Ohm": "kg m2 s-3 A-2", "Ω": "kg m2 s-3 A-2", "S": "kg-1 m-2 s3 A2", "Wb": "kg m2 s-2 A-1", "T": "kg s-2 A-1",
    "H": "kg m2 s-2 A-2", "Hz": "s-1", "l": "m3", "L": "m3", "bar": "kg m-1 s-2", "kat": "mol s-1",
}  # fmt: skip
FACTORS = {"g": 1e-3, "l": 1e-3, "L": 1e-3, "bar": 1e5}
OTHERS = {  # without prefixes: dimensions, factor
    "min": ("s", 60.0), "h": ("s", 3600.0), "d": ("s", 86400.0), "deg": ("rad", math.pi / 180), "t": ("kg", 1000.0),
    "°": ("rad", math.pi / 180), "rev": ("rad", 2 * math.pi), "rpm": ("rad s-1", math.pi / 30), "ha": ("m2", 1e4),
    "%": ("", 0.01), "sr": ("rad2", 1.0),
}  # fmt: skip
TOLERANCE = 1e-4  # of a factor: some tools write few digits


class Meaning(NamedTuple):
    """factor of the SI unit, and its exponents in the order of BASE."""

    factor: float
    exponents: tuple[int, ...]


def meaning(name: str) -> Meaning | None:
    """What the name says; None where it says nothing certain."""
    text = name.replace("·", ".").replace("*", ".").replace("^", "").replace(" ", "")
    parts = text.split("/")
    if len(parts) > 2 or not text:
        return None
    above, below = parts[0], parts[1] if len(parts) == 2 else ""
    if below.startswith("(") and below.endswith(")"):
        below = below[1:-1]
    elif "." in below:
        return None  # N/m.s: tools differ
    factor, exponents = 1.0, [0] * len(BASE)
    for part, sign in ((above, 1), (below, -1)):
        for word in part.split(".") if part else []:
            if word == "1":
                continue
            match = re.fullmatch(r"([A-Za-zΩµμ°%]+)(-?\d)?", word)
            if match is None or (simple := symbol(match[1])) is None:
                return None
            power = sign * int(match[2] or 1)
            factor *= simple.factor**power
            exponents = [old + power * new for old, new in zip(exponents, simple.exponents, strict=True)]
    return Meaning(factor, tuple(exponents))


def symbol(text: str) -> Meaning | None:
    if text in OTHERS:
        return Meaning(OTHERS[text][1], dimensions(OTHERS[text][0]))
    for prefix in ("", "da", *PREFIXES):
        rest = text.removeprefix(prefix)
        if text.startswith(prefix) and rest in SIMPLE:
            return Meaning(10.0 ** PREFIXES.get(prefix, 0) * FACTORS.get(rest, 1.0), dimensions(SIMPLE[rest]))
    return None


def dimensions(text: str) -> tuple[int, ...]:
    """Exponents of "kg m-1"."""
    powers = dict(re.findall(r"([a-zA-Z]+)(-?\d+)?", text))
    return tuple(int(powers[name] or 1) if name in powers else 0 for name in BASE)


def disagreements(unit: Unit) -> Iterator[str]:
    """Where the name of a unit, or of a display unit, says something else than its definition. Angles have no dimension
    in the SI, so "rad" may be there or not; a name with an offset ("degC") is not judged.
    """
    said, base = meaning(unit.name), unit.baseUnit
    if said is not None and base is not None:
        declared = tuple(getattr(base, name) for name in BASE)
        if declared[:-1] != said.exponents[:-1]:
            yield f"the unit {unit.name} is declared as {shown(base)}"
        elif declared[-1] == said.exponents[-1] and not base.offset and not alike(base.factor, said.factor):
            yield f"the unit {unit.name} is declared with the factor {base.factor:g}, not {said.factor:g}"
    if base is not None:
        said = Meaning(base.factor, tuple(getattr(base, name) for name in BASE))
    for display in unit.displayUnits:
        other = meaning(display.name)
        if said is None or other is None or (base is not None and base.offset) or display.offset:
            continue
        if other.exponents[:-1] != said.exponents[:-1]:
            yield f"the display unit {display.name} is no multiple of {unit.name}"
        elif other.exponents[-1] == said.exponents[-1] and not alike(display.factor, said.factor / other.factor):
            yield (
                f"the display unit {display.name} of {unit.name} is declared with the factor {display.factor:g}, "
                f"not {said.factor / other.factor:g}"
            )


def shown(base: BaseUnit) -> str:
    return ".".join(f"{name}{power if power != 1 else ''}" for name in BASE if (power := getattr(base, name))) or "1"


def alike(one: float, other: float) -> bool:
    return abs(one - other) <= TOLERANCE * abs(other)
