"""interface.toml, read and checked: the one declaration of every variable.

Everything in Python that needs a name, a unit, a start value, a value reference or a
dependency takes it from here; the C side gets it from the header that the exporter writes.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib

INTERFACE_FILE = Path(__file__).with_name("interface.toml")
KINDS = ("independent", "input", "output", "parameter", "derivative")
COMPUTED_KINDS = ("output", "derivative")
DEPENDENCY_KINDS = ("dependent", "constant")


class InterfaceError(ValueError):
    """interface.toml contradicts itself; the message names the variable and the mistake."""


@dataclass(frozen=True)
class Unit:
    """A unit with the exponents of its SI base units and the unit that hosts display."""

    name: str
    exponents: dict[str, int]
    display_name: str | None
    display_factor: float | None


@dataclass(frozen=True)
class Variable:
    """One line of interface.toml.

    `depends` maps the names of inputs and states to the dependency kind ("dependent" or "constant");
    `initially` are the parameters that the initial value depends on besides; `of` is the state of a derivative.
    """

    value_reference: int
    name: str
    kind: str
    type: str
    unit: Unit | None
    start: float | bool | None
    range: tuple[float, float] | None
    computed_by: str | None
    depends: dict[str, str]
    initially: tuple[str, ...]
    of: str | None
    text: str

    @property
    def is_state(self) -> bool:
        """An output whose start the user may set: machine.s."""
        return self.kind == "output" and self.start is not None

    @property
    def identifier(self) -> str:
        """The name as a C and Python identifier: `tip.ax` is `tip_ax`."""
        return re.sub(r"\W+", "_", self.name).strip("_")


@dataclass(frozen=True)
class Model:
    """The facts about the component as a whole."""

    name: str
    description: str
    turns_per_minute: float
    plant_spacing: float
    step_size: float

    @property
    def turn_time(self) -> float:
        """Seconds that one crank turn, one plant, takes."""
        return 60 / self.turns_per_minute

    @property
    def machine_speed(self) -> float:
        """Forward speed in m/s that gives the published spacing."""
        return self.plant_spacing / self.turn_time


@dataclass(frozen=True)
class Interface:
    """All variables in value reference order, their units, and the model's facts."""

    model: Model
    units: dict[str, Unit]
    variables: tuple[Variable, ...]
    log_categories: dict[str, str]

    def __getitem__(self, name: str) -> Variable:
        return self._by_name[name]

    def of_kind(self, kind: str) -> list[Variable]:
        return [variable for variable in self.variables if variable.kind == kind]

    @property
    def computed(self) -> list[Variable]:
        """Outputs, then derivatives."""
        return [variable for kind in COMPUTED_KINDS for variable in self.of_kind(kind)]

    @cached_property
    def _by_name(self) -> dict[str, Variable]:
        return {variable.name: variable for variable in self.variables}

    @cached_property
    def geometry(self) -> dict[str, float]:
        """Start values of the geometry by symbol: `{"L1": 0.05, ...}`, the nominal set."""
        prefix = "geometry."
        return {v.name[len(prefix):]: v.start for v in self.variables if v.name.startswith(prefix)}

    @property
    def token(self) -> str:
        """Hash of all that a host can see of the interface; `guid` in FMI 2, the same in C."""
        return self.edition_token("")

    def edition_token(self, edition: str) -> str:
        """The token of another FMU with this interface: hosts tell FMUs apart by it."""
        digest = hashlib.sha256(repr((self, edition)).encode()).hexdigest()
        return "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"


def load_interface(path: Path = INTERFACE_FILE) -> Interface:
    """Read and check interface.toml; raises InterfaceError naming the variable at fault."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as problem:
        raise InterfaceError(f"{path.name}: {problem}") from None
    units = {name: _unit(name, dict(entry)) for name, entry in table["units"].items()}
    sets = table["parameter_sets"]
    variables = tuple(
        _variable(reference, dict(entry), units, sets) for reference, entry in enumerate(table["variables"], 1)
    )
    _check(variables)
    return Interface(Model(**table["model"]), units, variables, table["log_categories"])


def _unit(name: str, entry: dict) -> Unit:
    display_name, display_factor = entry.pop("display", (None, None))
    return Unit(name, entry, display_name, display_factor)


def _variable(reference: int, entry: dict, units: dict[str, Unit], sets: dict[str, list[str]]) -> Variable:
    name = entry.pop("name", None)
    if name is None:
        raise InterfaceError(f"{INTERFACE_FILE.name}: number {reference}: 'name' is missing")
    try:
        variable = Variable(
            value_reference=reference,
            name=name,
            kind=entry.pop("kind"),
            type=entry.pop("type", "real"),
            unit=units[entry.pop("unit")] if "unit" in entry else None,
            start=entry.pop("start", None),
            range=_range(entry.pop("range", None)),
            computed_by=entry.pop("computed_by", None),
            depends={
                known: kind or "dependent"
                for known, _, kind in (depend.partition(":") for depend in entry.pop("depends", []))
            },
            initially=_expand(entry.pop("initially", []), sets),
            of=entry.pop("of", None),
            text=entry.pop("text"),
        )
    except KeyError as missing:
        raise InterfaceError(f"{INTERFACE_FILE.name}: {name}: {missing} is missing or unknown") from None
    if entry:
        raise InterfaceError(f"{INTERFACE_FILE.name}: {name}: unknown keys {sorted(entry)}")
    return variable


def _range(limits: list[float] | None) -> tuple[float, float] | None:
    return None if limits is None else (limits[0], limits[1])


def _expand(names: list[str], sets: dict[str, list[str]]) -> tuple[str, ...]:
    members: list[str] = []
    for name in names:
        members += _expand(sets[name], sets) if name in sets else [name]
    return tuple(members)


def _check(variables: tuple[Variable, ...]) -> None:
    by_name = {variable.name: variable for variable in variables}
    for v in variables:
        problems = []
        if v.kind not in KINDS:
            problems.append(f"kind {v.kind!r} is none of {KINDS}")
        if by_name[v.name] is not v:
            problems.append("the name stands twice")
        if v.kind in ("input", "parameter") and v.start is None:
            problems.append(f"a start value is missing: every {v.kind} has one")
        if (v.kind in COMPUTED_KINDS) != (v.computed_by is not None):
            problems.append("computed_by belongs to outputs and derivatives, and to each of them")
        if (v.kind == "derivative") != (v.of is not None and by_name.get(v.of, v).is_state):
            problems.append("'of' names the state of a derivative")
        if v.range and not (v.kind == "parameter" and v.range[0] <= v.start <= v.range[1]):
            problems.append(f"range {list(v.range)} belongs to parameters, and their start lies in it")
        for known, kind in v.depends.items():
            if known not in by_name or not (by_name[known].kind == "input" or by_name[known].is_state):
                problems.append(f"depends on {known!r}, which is neither an input nor a state")
            if kind not in DEPENDENCY_KINDS:
                problems.append(f"dependency kind {kind!r} is none of {DEPENDENCY_KINDS}")
        for known in v.initially:
            if known not in by_name or by_name[known].kind != "parameter":
                problems.append(f"depends initially on {known!r}, which is no parameter")
        if problems:
            raise InterfaceError(f"{INTERFACE_FILE.name}: {v.name}: " + "; ".join(problems))
