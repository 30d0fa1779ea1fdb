"""All hard cases by section: what the tests assert and the report shows."""

from __future__ import annotations

from collections.abc import Callable

from scenarios.common.instance import UnpackedFmu
from scenarios.speed_vs_error.hard_cases import dead_points, environment, geometries, poles, states, steps, unreachable
from scenarios.speed_vs_error.hard_cases.measured import Measured

SECTIONS: dict[str, Callable[[UnpackedFmu], list[Measured]]] = {
    "Dead points": dead_points.measure,
    "Poles of the printed formulas": poles.measure,
    "Random geometries": geometries.measure,
    "Crank and clock": steps.measure,
    "Unreachable poses": unreachable.measure,
    "States from any bytes": states.measure,
    "The host's process": environment.measure,
}
