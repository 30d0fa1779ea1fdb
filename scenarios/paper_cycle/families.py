"""The parameter studies of the paper's section 4: one parameter moves, all others stay nominal.

The paper names the parameters but prints no values for the curves of its figures 3 to 6;
those here are this project's choice. The last lengths lie where the linkage cannot make a
whole turn, to show how far the parameter may go.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenarios.common.instance import Refused
from scenarios.common.linkage import LinkageFmu, Turns


@dataclass(frozen=True)
class Family:
    """One figure of section 4. Values are in mm, or in degrees for the phase difference."""

    figure: int
    section: str
    symbol: str
    title: str
    unit: str
    values: tuple[float, ...]

    def parameters(self, value: float, nominal: dict[str, float]) -> dict[str, float]:
        """The FMU's parameters for one value of this family, in SI units."""
        if self.symbol == "theta41":  # phi4 moves, phi1 stays (section 4.2)
            return {"geometry.phi4": nominal["geometry.phi1"] + math.radians(value)}
        return {f"geometry.{self.symbol}": value / 1e3}

    def nominal_value(self, nominal: dict[str, float]) -> float:
        """The published value of this family's parameter."""
        if self.symbol == "theta41":
            return round(math.degrees(nominal["geometry.phi4"] - nominal["geometry.phi1"]), 9)
        return round(nominal[f"geometry.{self.symbol}"] * 1e3, 9)


FAMILIES = (
    Family(3, "4.1", "L1", "length of crank OA", "mm", (35, 40, 45, 50, 55, 60, 65)),
    Family(4, "4.2", "theta41", "phase difference of the cranks", "deg", (40, 65, 95, 130, 160, 190)),
    Family(5, "4.3", "L4", "length of crank CD", "mm", (6, 10, 14, 18, 22, 26, 36)),
    Family(6, "4.4", "L7", "length of rocker FG", "mm", (235, 240, 245, 250, 255, 260, 270)),
)


@dataclass(frozen=True)
class Member:
    """One curve of a family, or why there is none."""

    value: float
    turns: Turns | None
    refusal: str = ""


@dataclass(frozen=True)
class FamilyRun:
    """A family and what came of each of its values."""

    family: Family
    nominal_value: float
    members: tuple[Member, ...]

    @property
    def reached(self) -> list[tuple[float, Turns]]:
        """The values with which the linkage makes a whole turn."""
        return [(m.value, m.turns) for m in self.members if m.turns is not None]

    @property
    def values(self) -> list[float]:
        return [value for value, _ in self.reached]

    @property
    def nominal(self) -> Turns:
        """The curve of the published value, which is one of each family's."""
        return next(turns for value, turns in self.reached if value == self.nominal_value)

    def each(self, measure: Callable[[Turns], float]) -> list[float]:
        """One number a curve, in the order of ``values``."""
        return [measure(turns) for _, turns in self.reached]


def run_family(fmu: LinkageFmu, family: Family, step_deg: float, done: Callable[[], object]) -> FamilyRun:
    """Run one turn for every value; ``done`` is called after each."""
    members = []
    for value in family.values:
        try:
            members.append(Member(value, fmu.run(step_deg, family.parameters(value, fmu.nominal))))
        except Refused as refusal:
            members.append(Member(value, None, str(refusal)))
        done()
    return FamilyRun(family, family.nominal_value(fmu.nominal), tuple(members))


def height(turns: Turns) -> float:
    """Height of the static trajectory, mm."""
    return float(np.ptp(turns.static_mm.imag))


def width(turns: Turns) -> float:
    """Width of the static trajectory, mm."""
    return float(np.ptp(turns.static_mm.real))
