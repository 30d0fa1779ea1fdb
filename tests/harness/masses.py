"""A plausible set of masses for every body, 3.45 kg in all: so that all that depends on a mass is seen to."""

from __future__ import annotations

PLAUSIBLE = {  # body: kg, m, m, kg m2
    "OA": (0.35, 0.025, 0.0, 1.5e-4),
    "CD": (0.15, 0.009, 0.0, 2e-5),
    "AB": (0.30, 0.0525, 0.0, 4e-4),
    "DE": (0.9, 0.09, 0.015, 6e-3),
    "EF": (1.2, 0.13, -0.04, 6e-3),
    "GF": (0.55, 0.125, 0.0, 3e-3),
}
MASSES = {
    f"body.{body}.{key}": value for body, values in PLAUSIBLE.items() for key, value in zip("mxyJ", values, strict=True)
}
