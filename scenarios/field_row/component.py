"""An FMU in its place in a system: its name there, and what it declares of its variables and their units.

What passes between the system and an FMU's variable is in SI base units on the system's side, and in the unit that the
FMU declares on its own (FMI 2.0.4, section 2.2.2: value in SI = factor · value + offset).
"""

from __future__ import annotations

import difflib
import math
import numbers
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path

from fmpy.model_description import BaseUnit, ModelDescription, ModelVariable

from scenarios.common.instance import FmuError, describe

Value = float | int | bool
BUILD = Path(__file__).resolve().parents[2] / "build"
EXPONENTS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


class SystemFault(Exception):
    """The system cannot be run as described, or fails in its run: a line for the user, one for each fault."""


@dataclass(frozen=True, order=True)
class Port:
    """A variable of a component, by the name that the system's file uses."""

    component: str
    variable: str

    def __str__(self) -> str:
        return f"{self.component}.{self.variable}"


@dataclass(frozen=True)
class Unit:
    """``exponents`` of the SI base units; a value in SI is ``factor`` times the value, plus ``offset``."""

    exponents: tuple[int, ...] = (0,) * len(EXPONENTS)
    factor: float = 1.0
    offset: float = 0.0

    @classmethod
    def of(cls, base: BaseUnit) -> Unit:
        return cls(tuple(getattr(base, e) for e in EXPONENTS), base.factor, base.offset)

    def to_si(self, value: float) -> float:
        return value if self.factor == 1.0 and not self.offset else self.factor * value + self.offset

    def from_si(self, value: float) -> float:
        return value if self.factor == 1.0 and not self.offset else (value - self.offset) / self.factor


@dataclass(frozen=True)
class Component:
    """An FMU in its place. ``names``: the FMU's own names of variables that are called otherwise here.

    ``units``: of variables, by the names used here, whose unit the FMU does not declare, in the terms of FMI's
    BaseUnit. ``at_step_end`` is its Boolean parameter for masters that hand over the inputs of a step's end,
    ``slopes`` are the inputs of which it may be given the first time derivative.
    """

    name: str
    fmu: Path
    names: dict[str, str] = field(default_factory=dict)
    at_step_end: str | None = None
    slopes: tuple[str, ...] = ()
    units: dict[str, dict[str, float]] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, object]:
        """What was read of the FMU stays behind: another process reads it anew."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def description(self) -> ModelDescription:
        """Raises SystemFault where there is no FMI 2.0 FMU for co-simulation."""
        if not self.fmu.is_file():
            raise SystemFault(f"{self.name}: there is no FMU at {self.fmu}{self._advice()}")
        try:
            description = describe(self.fmu)
        except FmuError as error:
            raise SystemFault(f"{self.name}: {error}") from error
        if description.fmiVersion != "2.0" or description.coSimulation is None:
            raise SystemFault(f"{self.name}: {self.fmu} is not an FMI 2.0 FMU for co-simulation.")
        return description

    def _advice(self) -> str:
        if self.fmu.is_relative_to(BUILD):
            return ": run `make build`, or name another in the system's file."
        return ". Paths are relative to the system's file, or else to the project's folder."

    @cached_property
    def variables(self) -> dict[str, ModelVariable]:
        """By the FMU's own names."""
        return {variable.name: variable for variable in self.description.modelVariables}

    @cached_property
    def declared_units(self) -> dict[str, Unit]:
        """Those of the FMU's units of which it says what they are made of."""
        return {unit.name: Unit.of(unit.baseUnit) for unit in self.description.unitDefinitions if unit.baseUnit}

    def variable(self, name: str) -> ModelVariable:
        """The FMU's variable for a name of the system; raises SystemFault, with likely names, where there is none."""
        own = self.names.get(name, name)
        if own not in self.variables:
            near = difflib.get_close_matches(own, self.variables, n=3, cutoff=0.5)
            raise SystemFault(
                f"{self.name}: {self.fmu.name} has no variable {own!r}"
                + (f"; did you mean {' or '.join(near)}?" if near else ".")
            )
        return self.variables[own]

    def unit_name(self, name: str) -> str | None:
        """As the variable or its type declares it."""
        variable = self.variable(name)
        return variable.unit or (variable.declaredType and variable.declaredType.unit) or None

    def unit(self, name: str) -> Unit:
        """A variable's unit; counts and truth values have none. Raises SystemFault where it cannot be told."""
        variable = self.variable(name)
        if kind(variable) != "Real":
            return Unit()
        if name in self.units:
            return Unit.of(BaseUnit(**self.units[name]))
        declared = self.unit_name(name)
        if declared in self.declared_units:
            unit = self.declared_units[declared]
            relative = variable.relativeQuantity
            if relative is None and variable.declaredType:
                relative = variable.declaredType.relativeQuantity
            return Unit(unit.exponents, unit.factor) if relative else unit
        raise SystemFault(
            f"{self.name}.{name}: its unit cannot be told: {self.fmu.name} "
            + (f"does not say what {declared!r} is made of" if declared else "declares none")
            + f'. Say it in the system\'s file: [components.{self.name}.units] "{name}" = '
            "{rad = 1, s = -1, factor = 0.10471975511965977} is rpm, {} a pure number."
        )

    def settable(self, name: str, value: Value) -> Value:
        """A value in SI as the FMU takes it for a parameter, or for the start of an input; SystemFault if it cannot."""
        variable = self.variable(name)
        if variable.causality not in ("parameter", "input") and variable.start is None:
            raise SystemFault(f"{self.name}.{name} cannot be set: it is of causality {variable.causality}.")
        fitting = {"Real": numbers.Real, "Integer": numbers.Integral, "Boolean": bool}.get(kind(variable), ())
        if not isinstance(value, fitting) or (isinstance(value, bool) and fitting is not bool):
            raise SystemFault(f"{self.name}.{name} cannot be set to {value!r}: it is of type {variable.type}.")
        return self.unit(name).from_si(float(value)) if kind(variable) == "Real" else value

    def start(self, name: str) -> float | None:
        """With what a variable starts, in SI; None where the FMU has no such variable, or does not say."""
        own = self.variables.get(self.names.get(name, name))
        return None if own is None or own.start is None else self.unit(name).to_si(float(own.start))

    def faults(self) -> list[str]:
        """What is wrong with the component alone: FMU, names, units."""
        try:
            interpolates = self.description.coSimulation.canInterpolateInputs
        except SystemFault as fault:
            return [str(fault)]
        named = (*self.names, *([self.at_step_end] if self.at_step_end else ()), *self.slopes, *self.units)
        found = [fault for name in named for fault in fault_of(self.variable, name)]
        for name, unit in self.units.items():
            wrong = set(unit) - {*EXPONENTS, "factor", "offset"} if isinstance(unit, dict) else {unit}
            if wrong or not all(_finite(v) for v in unit.values()) or not unit.get("factor", 1.0):
                found.append(
                    f"{self.name}: units: {name!r} must be given by {', '.join(EXPONENTS)}, factor and offset, as "
                    "numbers."
                )
        if self.slopes and not interpolates:
            found.append(f"{self.name} takes no slopes of inputs: {self.fmu.name} says canInterpolateInputs = false.")
        return found


def kind(variable: ModelVariable) -> str:
    """Real, Integer, Boolean or String: which functions read and write it."""
    return "Integer" if variable.type == "Enumeration" else variable.type


def fault_of(call: Callable, *arguments: object) -> list[str]:
    """The SystemFault that a call raises, if it does."""
    try:
        call(*arguments)
    except SystemFault as fault:
        return [str(fault)]
    return []


def _finite(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
