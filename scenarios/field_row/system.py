"""A co-simulation as data: components, connections and parameters, read from a TOML file.

row.toml says what stands in such a file.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

from scenarios.field_row.component import BUILD, Component, Port, SystemFault, Unit, Value, fault_of, kind

ROW = Path(__file__).with_name("row.toml")
KEYS = {"fmu", "names", "units", "at_step_end", "slopes"}  # of a component in the file


@dataclass(frozen=True)
class System:
    """``connections`` leads from each connected input to its output. ``parameters`` are in SI base units."""

    components: tuple[Component, ...]
    connections: dict[Port, Port]
    parameters: dict[Port, Value]
    step_control: dict[str, float]

    def port(self, text: str) -> Port:
        """component.variable as a port; raises SystemFault where there is no such component."""
        component, _, variable = text.partition(".")
        if not variable or component not in [c.name for c in self.components]:
            raise SystemFault(
                f"{text!r} is not component.variable; components are {', '.join(c.name for c in self.components)}."
            )
        return Port(component, variable)

    def component(self, name: str) -> Component | None:
        """None where the system has no such part."""
        return next((c for c in self.components if c.name == name), None)

    def unit(self, port: Port) -> Unit:
        """Raises SystemFault where it cannot be told."""
        return self.component(port.component).unit(port.variable)

    def with_parameters(self, values: Mapping[str, Value]) -> System:
        """Of the same, with other parameters on top."""
        return replace(self, parameters={**self.parameters, **{self.port(name): v for name, v in values.items()}})

    def without(self, *inputs: str) -> System:
        """Of the same, with these inputs left unconnected."""
        left = {self.port(name) for name in inputs}
        return replace(self, connections={i: o for i, o in self.connections.items() if i not in left})

    def offers(self, name: str) -> bool:
        """Whether there is a component.variable of this name."""
        component, _, variable = name.partition(".")
        found = self.component(component)
        return found is not None and found.names.get(variable, variable) in found.variables

    def names(self, signals: Iterable[str]) -> str:
        """Signals in a sentence; those of a part that the system does not have stand together."""
        said = dict.fromkeys(
            signal if self.component(part := signal.partition(".")[0]) else f"all of {part}" for signal in signals
        )
        return ", ".join(said)

    # ---- what is wrong with it -------------------------------------------------------------------

    def check(self, watched: Iterable[str] = ()) -> None:
        """Raises one SystemFault with a line for each thing that keeps the system from running.

        ``watched`` are outputs to be recorded, of those that are offered; as a mapping, with their units.
        """
        found = self.faults(watched)
        if found:
            raise SystemFault("\n".join(found))

    def faults(self, watched: Iterable[str] = ()) -> list[str]:
        """A line each, none twice."""
        found = [fault for component in self.components for fault in component.faults()]
        readable = {c.name for c in self.components if not fault_of(getattr, c, "description")}
        for target, source in self.connections.items():
            if {target.component, source.component} <= readable:
                found += self._connection_faults(target, source)
        for port, value in self.parameters.items():
            if port in self.connections:
                found.append(f"{port} cannot be set: it is connected to {self.connections[port]}.")
            elif port.component in readable:
                found += fault_of(self.component(port.component).settable, port.variable, value)
        if len(readable) == len(self.components):
            for unit in self.step_control:
                found += fault_of(self.named_unit, unit)
        for name in watched:
            if name.partition(".")[0] in readable and self.offers(name):
                label = watched[name] if isinstance(watched, Mapping) else ""
                found += self._record_faults(self.port(name), label)
        return list(dict.fromkeys(found))

    def _connection_faults(self, target: Port, source: Port) -> list[str]:
        ends = [(self.component(port.component), port.variable) for port in (target, source)]
        missing = [fault for part, name in ends for fault in fault_of(part.variable, name)]
        if missing:
            return missing
        taker, giver = (part.variable(name) for part, name in ends)
        if taker.causality != "input" or giver.causality != "output":
            return [
                (
                    f"{target} = {source}: {taker.name} must be an input and {giver.name} an output; "
                    f"they are {taker.causality} and {giver.causality}."
                )
            ]
        if kind(taker) != "Real" and kind(taker) != kind(giver):
            return [f"{target} = {source}: a {kind(giver)} cannot be given to a {kind(taker)}."]
        untold = [fault for port in (source, target) for fault in fault_of(self.unit, port)]
        return (fault_of(self.conversion, target, source) and untold) or fault_of(self.conversion, target, source)

    def _record_faults(self, port: Port, label: str) -> list[str]:
        untold = fault_of(self.unit, port)
        meant = next((c.declared_units[label] for c in self.components if label in c.declared_units), None)
        part = self.component(port.component)
        if untold or not meant or kind(part.variable(port.variable)) != "Real":
            return untold
        if self.unit(port).exponents != meant.exponents:
            return [f"{port} is recorded in {label}, to which {part.unit_name(port.variable)} cannot be converted."]
        return []

    # ---- units -----------------------------------------------------------------------------------

    def conversion(self, target: Port, source: Port) -> tuple[float, float]:
        """Factor and offset from an output's value to an input's; raises SystemFault where there are none."""
        ends = [self.component(port.component) for port in (source, target)]
        variables = [end.variable(port.variable) for end, port in zip(ends, (source, target), strict=True)]
        names = [end.unit_name(port.variable) for end, port in zip(ends, (source, target), strict=True)]
        said = any(port.variable in end.units for end, port in zip(ends, (source, target), strict=True))
        if any(kind(v) != "Real" for v in variables) or (names == [None, None] and not said):
            return 1.0, 0.0  # a count, or a number that neither FMU gives a unit
        theirs, ours = self.unit(source), self.unit(target)
        if theirs.exponents != ours.exponents:
            raise SystemFault(f"{target} = {source}: {names[0]} cannot be converted to {names[1]}.")
        return theirs.factor / ours.factor, (theirs.offset - ours.offset) / ours.factor

    def named_unit(self, name: str) -> Unit:
        """What a unit is, as an FMU of the system declares it; raises SystemFault where none does."""
        for component in self.components:
            if name in component.declared_units:
                return component.declared_units[name]
        raise SystemFault(f"step_control: no FMU of the system declares a unit {name!r}.")

    def tolerance(self, port: Port) -> float | None:
        """The error of an output that step_control allows to a step, in the output's own unit; None if any."""
        if kind(self.component(port.component).variable(port.variable)) != "Real" or fault_of(self.unit, port):
            return None
        unit = self.unit(port)
        for name, allowed in self.step_control.items():
            named = self.named_unit(name)
            if named.exponents == unit.exponents:
                return allowed * named.factor / unit.factor
        return None


def load_system(path: Path = ROW) -> System:
    """The system of a file; raises SystemFault, with the file's name and all faults, where it describes none."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SystemFault(f"{path} cannot be read: {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SystemFault(f"{path}: {error}") from error
    faults: list[str] = []
    tables: dict[str, dict] = {}
    for name, needed in (("components", True), ("connections", True), ("parameters", False), ("step_control", False)):
        if name not in content and needed:
            faults.append(f"{name!r} is missing.")
        tables[name] = content.pop(name, {})
        if not isinstance(tables[name], dict):
            faults.append(f"{name!r} is no table.")
            tables[name] = {}
    faults += _nothing_else("the file", content, set())
    components = []
    for name, table in tables["components"].items():
        problems = _component_faults(name, table)
        faults += problems
        if isinstance(table, dict) and isinstance(table.get("fmu"), str):
            components.append(_component(path, name, table if not problems else {"fmu": table["fmu"]}))
    system = System(tuple(components), {}, {}, {})
    known = {c.name for c in components} | set(tables["components"])
    connections, parameters = {}, {}

    def port(text: object) -> Port | None:
        component, _, variable = str(text).partition(".")
        if variable and component in known:
            return Port(component, variable)
        faults.append(f"{text!r} is not component.variable; components are {', '.join(sorted(known)) or 'missing'}.")
        return None

    for target, source in tables["connections"].items():
        ends = port(target), port(source)
        if None not in ends:
            connections[ends[0]] = ends[1]
    for name, value in tables["parameters"].items():
        if (found := port(name)) is not None:
            parameters[found] = value
    for unit, allowed in tables["step_control"].items():
        if isinstance(allowed, bool) or not isinstance(allowed, (int, float)) or not allowed > 0:
            faults.append(f"step_control: {unit!r} must be a positive number, not {allowed!r}.")
    step_control = {} if faults else dict(tables["step_control"])
    system = replace(system, connections=connections, parameters=parameters, step_control=step_control)
    if faults:  # with what the FMUs would say, so that all is known at once
        raise SystemFault("\n".join(f"{path}: {fault}" for fault in dict.fromkeys([*faults, *system.faults()])))
    return system


def _component(path: Path, name: str, table: dict) -> Component:
    """A path is relative to the file or, where nothing is there, to the project's folder."""
    fmu = (path.resolve().parent / table["fmu"]).resolve()
    if not fmu.is_file():
        ours = (BUILD.parent / table["fmu"]).resolve()
        fmu = ours if ours.is_file() or ours.is_relative_to(BUILD) else fmu
    return Component(
        name,
        fmu,
        dict(table.get("names", {})),
        table.get("at_step_end"),
        tuple(table.get("slopes", ())),
        dict(table.get("units", {})),
    )


def _component_faults(name: str, table: object) -> list[str]:
    if not isinstance(table, dict):
        return [f"{name} is no table."]
    wanted = (
        ("fmu", str, "a path"),
        ("names", dict, "a table"),
        ("units", dict, "a table"),
        ("slopes", list, "a list"),
    )
    found = _nothing_else(name, table, KEYS)
    found += [
        f"{name}: {key!r} must be {what}."
        for key, type_, what in wanted
        if not isinstance(table.get(key, type_()), type_)
    ]
    return found + ([] if "fmu" in table else [f"{name}: 'fmu' is missing."])


def _nothing_else(where: str, table: dict, known: set[str]) -> list[str]:
    unknown = sorted(set(table) - known)
    return [f"{where} has {', '.join(unknown)}, which mean nothing here."] if unknown else []
