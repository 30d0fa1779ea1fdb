"""A co-simulation as data: components, connections and parameters, read from a TOML file.

row_system.toml says what stands in such a file.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROW = Path(__file__).with_name("row_system.toml")
Value = float | int | bool


class SystemFault(Exception):
    """The system cannot be run as described, or fails in its run; one line for the user."""


@dataclass(frozen=True, order=True)
class Port:
    """A variable of a component, by the name that the system's file uses."""

    component: str
    variable: str

    def __str__(self) -> str:
        return f"{self.component}.{self.variable}"


@dataclass(frozen=True)
class Component:
    """An FMU in its place. ``names``: the FMU's own names of variables that are called otherwise here.

    ``at_step_end`` is its Boolean parameter for masters that hand over the inputs of a step's end,
    ``slopes`` are the inputs of which it may be given the first time derivative.
    """

    name: str
    fmu: Path
    names: dict[str, str] = field(default_factory=dict)
    at_step_end: str | None = None
    slopes: tuple[str, ...] = ()


@dataclass(frozen=True)
class System:
    """``connections`` leads from each connected input to its output."""

    components: tuple[Component, ...]
    connections: dict[Port, Port]
    parameters: dict[Port, Value]
    step_control: dict[str, float]

    def port(self, text: str) -> Port:
        """component.variable as a port; raises SystemFault where there is no such component."""
        component, _, variable = text.partition(".")
        if not variable or component not in [c.name for c in self.components]:
            raise SystemFault(f"{text!r} is not component.variable; components are "
                              f"{', '.join(c.name for c in self.components)}.")
        return Port(component, variable)

    def with_parameters(self, values: dict[str, Value]) -> System:
        """Of the same, with other parameters on top."""
        return replace(self, parameters={**self.parameters, **{self.port(name): v for name, v in values.items()}})

    def without(self, *inputs: str) -> System:
        """Of the same, with these inputs left unconnected."""
        left = {self.port(name) for name in inputs}
        return replace(self, connections={i: o for i, o in self.connections.items() if i not in left})


def load_system(path: Path = ROW) -> System:
    """The system of a file; raises SystemFault, with the file's name, where it does not describe one."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        components = tuple(
            Component(name, (path.parent / c["fmu"]).resolve(), dict(c.get("names", {})), c.get("at_step_end"),
                      tuple(c.get("slopes", ())))
            for name, c in content.pop("components").items()
            if _nothing_else(name, c, {"fmu", "names", "at_step_end", "slopes"}))
        system = System(components, {}, {}, dict(content.pop("step_control", {})))
        connections = {system.port(i): system.port(o) for i, o in content.pop("connections").items()}
        parameters = {system.port(name): value for name, value in content.pop("parameters", {}).items()}
        _nothing_else("the file", content, set())
    except OSError as error:
        raise SystemFault(f"{path} cannot be read: {error.strerror}.") from error
    except KeyError as error:
        raise SystemFault(f"{path}: {error} is missing.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, AttributeError, TypeError, SystemFault) as error:
        raise SystemFault(f"{path}: {error}") from error
    return replace(system, connections=connections, parameters=parameters)


def _nothing_else(where: str, table: dict, known: set[str]) -> bool:
    unknown = sorted(set(table) - known)
    if unknown:
        raise SystemFault(f"{where} has {', '.join(unknown)}, which mean nothing here.")
    return True
