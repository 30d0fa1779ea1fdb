"""What the partners have in common: variables declared in a table, with units and dependencies, and whole states.

PythonFMU alone knows neither units nor dependencies, and of a state only what its variables show. A partner keeps all
that it remembers in two dictionaries of plain values, so that a state is a copy of both.

Outputs are computed in steps alone: at a communication point none depends on an input. Where this is not declared, a
host must take every output to depend on every input, and the row for algebraic loops (FMI 2.0.4, section 2.2.8).
"""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from pythonfmu import Boolean, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Integer, Real

BASE_UNITS = {  # unit: exponents of the SI base units (FMI 2.0.4, section 2.2.2)
    "m": {"m": 1},
    "s": {"s": 1},
    "rad": {"rad": 1},
    "1": {},
    "Hz": {"s": -1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "m2": {"m": 2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "N/m3": {"kg": 1, "m": -2, "s": -2},
    "kg.m2": {"kg": 1, "m": 2},
    "N.m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "N.m.s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
    "N/m(n+1)": None,
    "N/m(n+2)": None,  # Bekker's moduli: the dimension depends on the exponent n
}


class Variable(NamedTuple):
    """A line of a partner's table. ``kind``: input, output, parameter, or tunable (a parameter
    that may change while the row is planted). The type is that of ``start``.
    """

    name: str
    kind: str
    start: float | int | bool
    unit: str
    text: str


class _Real(Real):
    def __init__(self, name: str, unit: str, **options) -> None:
        super().__init__(name, **options)
        self.unit = unit

    def to_xml(self) -> Element:
        element = super().to_xml()
        element[0].set("unit", self.unit)
        return element


class Partner(Fmi2Slave):
    """``value`` holds the variables by name, ``memory`` whatever else is remembered."""

    variables: Sequence[Variable] = ()
    positive: Sequence[str] = ()  # parameters that must be
    initially: Mapping[str, Sequence[str]] = {}  # {output: inputs and parameters that its initial value depends on}

    def __init__(self, **options) -> None:
        super().__init__(**options)
        self.value = {v.name: v.start for v in self.variables}
        self.memory: dict = {}
        self.guid = hashlib.sha256(repr((self.modelName, self.variables)).encode()).hexdigest()[:32]
        self._readable: dict[tuple[int, type], str] = {}  # names by value reference and type
        self._settable: dict[tuple[int, type], str] = {}
        for reference, variable in enumerate(self.variables):
            self._register(variable)
            self._readable[reference, type(variable.start)] = variable.name
            if variable.kind != "output":
                self._settable[reference, type(variable.start)] = variable.name

    def _register(self, variable: Variable) -> None:
        name, kind, start, unit, text = variable
        kinds = {bool: Boolean, int: Integer}
        more = {} if type(start) in kinds else {"unit": unit}
        is_parameter = kind in ("parameter", "tunable")
        variability = {"parameter": "fixed", "tunable": "tunable"}.get(kind, "discrete" if not more else "continuous")
        self.register_variable(
            kinds.get(type(start), _Real)(
                name,
                causality=Fmi2Causality["parameter" if is_parameter else kind],
                variability=Fmi2Variability[variability],
                initial=Fmi2Initial.exact if is_parameter else None,
                description=text,
                getter=lambda: self.value[name],
                setter=None if kind == "output" else lambda value: self.value.__setitem__(name, value),
                **more,
            ),
            nested=False,
        )

    # In each of these calls PythonFMU asks every variable anew for its type. Here that is known from the start; what is
    # not goes to PythonFMU, which says what is wrong with it.

    def get_real(self, references: Sequence[int]) -> list[float]:
        try:
            return [self.value[self._readable[reference, float]] for reference in references]
        except KeyError:
            return super().get_real(references)

    def get_integer(self, references: Sequence[int]) -> list[int]:
        try:
            return [self.value[self._readable[reference, int]] for reference in references]
        except KeyError:
            return super().get_integer(references)

    def get_boolean(self, references: Sequence[int]) -> list[bool]:
        try:
            return [bool(self.value[self._readable[reference, bool]]) for reference in references]
        except KeyError:
            return super().get_boolean(references)

    def set_real(self, references: Sequence[int], values: Sequence[float]) -> None:
        try:
            names = [self._settable[reference, float] for reference in references]
        except KeyError:
            super().set_real(references, values)
        else:
            self.value.update(zip(names, values, strict=True))

    def set_boolean(self, references: Sequence[int], values: Sequence[bool]) -> None:
        try:
            names = [self._settable[reference, bool] for reference in references]
        except KeyError:
            super().set_boolean(references, values)
        else:
            self.value.update(zip(names, values, strict=True))

    def setup_experiment(
        self,
        start_time: float,
        stop_time: float | None = None,  # noqa: ARG002 - PythonFMU calls it with these names
        tolerance: float | None = None,  # noqa: ARG002 - and this
    ) -> None:
        self.memory["time"] = start_time

    def exit_initialization_mode(self) -> None:
        for name in self.positive:
            if not self.value[name] > 0:
                raise ValueError(f"{name} is {self.value[name]:g}: it must be positive")

    def to_xml(self, model_options: dict | None = None) -> Element:
        root = super().to_xml(model_options or {})
        units = Element("UnitDefinitions")
        for unit in sorted({v.unit for v in self.variables if type(v.start) is float}):
            element = SubElement(units, "Unit", name=unit)
            if BASE_UNITS[unit] is not None:
                SubElement(element, "BaseUnit", {base: str(power) for base, power in BASE_UNITS[unit].items()})
        root.insert(1, units)
        self._declare_dependencies(root.find("ModelStructure"))
        return root

    def _declare_dependencies(self, structure: Element) -> None:
        """No output on any input; initial values as ``initially`` says. Indices count from 1."""
        names = [variable.name for variable in self.variables]
        initial_unknowns = SubElement(structure, "InitialUnknowns")
        for unknown in structure.find("Outputs"):
            index = unknown.get("index")
            known = sorted(names.index(name) + 1 for name in self.initially.get(names[int(index) - 1], ()))
            unknown.set("dependencies", "")
            SubElement(initial_unknowns, "Unknown", index=index, dependencies=" ".join(map(str, known)))

    def _get_fmu_state(self) -> dict:
        return {"value": dict(self.value), "memory": copy.deepcopy(self.memory)}

    def _set_fmu_state(self, state: dict) -> None:
        self.value, self.memory = dict(state["value"]), copy.deepcopy(state["memory"])
