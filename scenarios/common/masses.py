"""A plausible machine: the masses of the links, of sections that are drawn here. Assumptions, not a machine's.

Each body is made of bars and a tube with the lengths of the linkage's geometry; mass, centre and moment of inertia of
each piece come from its section, its length and its material, and are put together here and nowhere else. Eyes, pins
and bearings are in the ends of the bars, which reach beyond the joints.

A point of a body is a complex number in m: along the link from its first-named joint, and to the left of it, as the
parameters body.OA.x and body.OA.y have it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

STEEL, ALUMINIUM = 7850.0, 2700.0  # kg/m3
EYE = 0.02  # m: of a bar beyond each of its joints
BODIES = ("OA", "CD", "AB", "DE", "EF", "GF")
KEYS = ("m", "x", "y", "J")


@dataclass(frozen=True)
class Piece:
    """Mass in kg, centre in m and moment of inertia about it in kg m2."""

    m: float
    centre: complex
    inertia: float


def bar(start: complex, end: complex, *, wide: float, thick: float, density: float, beyond: float = EYE) -> Piece:
    """A flat bar from joint to joint, ``wide`` in the plane of motion, ``beyond`` longer at both ends; in m."""
    length = abs(end - start) + 2 * beyond
    m = density * length * wide * thick
    return Piece(m, (start + end) / 2, m * (length**2 + wide**2) / 12)


def tube(start: complex, end: complex, *, outside: float, wall: float, density: float) -> Piece:
    """A round tube, its axis in the plane of motion; diameters in m."""
    length, inside = abs(end - start), outside - 2 * wall
    m = density * length * math.pi / 4 * (outside**2 - inside**2)
    return Piece(m, (start + end) / 2, m * (3 * (outside**2 + inside**2) + 4 * length**2) / 48)


def together(pieces: Sequence[Piece]) -> Piece:
    """One body of several pieces: Steiner's theorem."""
    m = sum(piece.m for piece in pieces)
    centre = sum(piece.m * piece.centre for piece in pieces) / m
    return Piece(m, centre, sum(piece.inertia + piece.m * abs(piece.centre - centre) ** 2 for piece in pieces))


def pieces(geometry: Mapping[str, float]) -> dict[str, list[Piece]]:
    """The drawing: what each body is made of, for a geometry {"L1": 0.05, ...} in SI units."""
    g = geometry
    to_b = g["L3"] * cmath.exp(1j * g["theta3"])  # of the plate: D to B stands left of D to E
    h = g["L6"] / 2 + 0j
    i = h - g["L8"] * cmath.exp(1j * g["theta8"])
    tip = i - g["L9"] * cmath.exp(1j * (g["theta8"] + g["theta9"]))
    return {
        "OA": [bar(0, g["L1"], wide=0.03, thick=0.015, density=STEEL)],
        "CD": [bar(0, g["L4"], wide=0.03, thick=0.012, density=STEEL)],
        "AB": [bar(0, g["L2"], wide=0.025, thick=0.01, density=STEEL)],
        "DE": [
            bar(0, g["L5"], wide=0.05, thick=0.015, density=ALUMINIUM),
            bar(0, to_b, wide=0.05, thick=0.015, density=ALUMINIUM),
        ],
        "EF": [
            bar(0, g["L6"], wide=0.03, thick=0.01, density=STEEL),
            bar(h, i, wide=0.03, thick=0.01, density=STEEL, beyond=0.0),
            tube(i, tip, outside=0.05, wall=0.0035, density=STEEL),  # the planting nozzle
        ],
        "GF": [bar(0, g["L7"], wide=0.025, thick=0.01, density=STEEL)],
    }


def plausible(geometry: Mapping[str, float]) -> dict[str, float]:
    """{"body.OA.m": 0.32, ...} of every body, in SI units."""
    found = {}
    for body, parts in pieces(geometry).items():
        whole = together(parts)
        values = (whole.m, complex(whole.centre).real, complex(whole.centre).imag, whole.inertia)
        found |= {f"body.{body}.{key}": value for key, value in zip(KEYS, values, strict=True)}
    return found


def with_counterweight(
    masses: Mapping[str, float], mass: float, x: float, y: float
) -> tuple[dict[str, float], np.ndarray]:
    """body.OA.* of crank and counterweight together, and how it follows mass, x and y: a column each.

    The counterweight, ``mass`` in kg at (``x``, ``y``) in m along crank OA from O and to the left of it, counts as a
    point: at a steady speed its own moment of inertia is not felt.
    """
    m0, x0, y0, own = (masses[f"body.OA.{key}"] for key in KEYS)
    m = m0 + mass
    at = (m0 * x0 + mass * x) / m, (m0 * y0 + mass * y) / m
    part = m0 * mass / m
    apart = (x - x0) ** 2 + (y - y0) ** 2
    by = np.array(
        [
            [1.0, 0.0, 0.0],
            [(x - at[0]) / m, mass / m, 0.0],
            [(y - at[1]) / m, 0.0, mass / m],
            [(m0 / m) ** 2 * apart, 2 * part * (x - x0), 2 * part * (y - y0)],
        ]
    )
    values = (m, *at, own + part * apart)
    return {f"body.OA.{key}": value for key, value in zip(KEYS, values, strict=True)}, by
