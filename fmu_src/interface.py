"""interface.toml, read and checked: the one declaration of every variable.

Everything in Python that needs a name, a unit, a start value, a value reference or a
dependency takes it from here; the C side gets it from the header that the exporter writes.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal, overload

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

INTERFACE_FILE = Path(__file__).with_name("interface.toml")
DEPENDENCY_KINDS = ("dependent", "constant")

# What equations are made of; in C: PoseFactor and MotionFactor (component/factors.h).
MASS_FACTORS = ("linkage.mass", "linkage.inertia", "linkage.moment.x", "linkage.moment.y")
POSE_FACTORS = ("tip.x", "tip.y", "tip.angle", "assembly.margin", *MASS_FACTORS)
MOTION_FACTORS = (
    "crank.w", "crank.w^2", "crank.a", "machine.s", "machine.v", "machine.a", "tip.fx", "tip.fy",
    "gravity",
)  # fmt: skip
HIGHEST_ORDER = 2  # of a derivative by phi in an equation: derivatives by time need two more


class InterfaceError(ValueError):
    """interface.toml contradicts itself; the message names the variable and the mistake."""


@dataclass(frozen=True)
class Unit:
    """A unit with the exponents of its SI base units and, where hosts display another, that one: (name, factor)."""

    name: str
    exponents: dict[str, int]
    display: tuple[str, float] | None

    @property
    def display_name(self) -> str | None:
        """Name of the unit that hosts display, where it is another."""
        return None if self.display is None else self.display[0]


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One line of interface.toml: what all kinds have in common.

    `start` is there where the variable may be set; `unit` is missing for a Boolean alone.
    """

    kind: ClassVar[str]
    value_reference: int
    name: str
    text: str
    unit: Unit | None = None
    start: float | bool | None = None

    @property
    def type(self) -> str:
        """The type of its values: "real" or "boolean"."""
        return "boolean" if isinstance(self.start, bool) else "real"

    @property
    def is_state(self) -> bool:
        """An output whose start the user may set: machine.s."""
        return self.kind == "output" and self.start is not None

    @property
    def identifier(self) -> str:
        """The name as a C and Python identifier: `tip.ax` is `tip_ax`."""
        return re.sub(r"\W+", "_", self.name).strip("_")


@dataclass(frozen=True, kw_only=True)
class Time(Variable):
    """What all else depends on."""

    kind = "independent"


@dataclass(frozen=True, kw_only=True)
class Input(Variable):
    """What a host gives at every step."""

    kind = "input"
    unit: Unit = field()
    start: float = field()


@dataclass(frozen=True, kw_only=True)
class Parameter(Variable):
    """What is fixed from the end of initialization on.

    `range`: its least and greatest value, where not any will do; `smallest`: the least magnitude of a value but 0.
    """

    kind = "parameter"
    start: float | bool = field()
    range: tuple[float, float] | None = None
    smallest: float = 0.0

    def accepts(self, value: float) -> bool:
        """Whether the range has this value."""
        least, greatest = self.range or (value, value)
        return least <= value <= greatest and (value == 0 or abs(value) >= self.smallest)

    @property
    def demand(self) -> str:
        """What a value must be, in words: for messages."""
        if self.range is None:
            return "any number"
        least, greatest = self.range
        return f"0 or from {self.smallest:g} to {greatest:g}" if self.smallest else f"from {least:g} to {greatest:g}"


@dataclass(frozen=True)
class Product:
    """One term of an equation: coefficient · pose factor, differentiated `order` times by phi · motion factor.

    A factor is 1 where it is "".
    """

    coefficient: float
    pose: str
    order: int
    motion: str

    @property
    def has_masses(self) -> bool:
        """Whether it is 0 where no masses are given."""
        return self.pose in MASS_FACTORS


@dataclass(frozen=True, kw_only=True)
class Computed(Variable):
    """What the component computes, with the others of its group."""

    unit: Unit = field()
    group: str


@dataclass(frozen=True, kw_only=True)
class Local(Computed):
    """What one looks at: a value, without derivatives, that no host records unasked."""

    kind = "local"


@dataclass(frozen=True, kw_only=True)
class Unknown(Computed):
    """What has derivatives: the sum of the products of its equation.

    `depends` maps the names of inputs and states to the dependency kind ("dependent" or "constant").
    """

    equation: tuple[Product, ...]
    depends: dict[str, str]


@dataclass(frozen=True, kw_only=True)
class Output(Unknown):
    """What a host reads; `initially` are the parameters that its initial value depends on besides."""

    kind = "output"
    initially: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Derivative(Unknown):
    """The derivative by time of the state `of`."""

    kind = "derivative"
    of: str


@dataclass(frozen=True)
class Model:
    """The facts about the component as a whole."""

    name: str
    description: str
    turns_per_minute: float
    plant_spacing: float
    step_size: float
    greatest_value: float

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

    @overload
    def of_kind(self, kind: Literal["input"]) -> list[Input]: ...
    @overload
    def of_kind(self, kind: Literal["output"]) -> list[Output]: ...
    @overload
    def of_kind(self, kind: Literal["parameter"]) -> list[Parameter]: ...
    @overload
    def of_kind(self, kind: Literal["derivative"]) -> list[Derivative]: ...
    @overload
    def of_kind(self, kind: Literal["local"]) -> list[Local]: ...
    def of_kind(self, kind: str) -> Any:
        """The variables of one kind, in the order of their value references."""
        return [variable for variable in self.variables if variable.kind == kind]

    @property
    def unknowns(self) -> list[Unknown]:
        """Outputs, then derivatives."""
        return [*self.of_kind("output"), *self.of_kind("derivative")]

    @property
    def computed(self) -> list[Computed]:
        """Outputs, derivatives, then locals."""
        return [*self.unknowns, *self.of_kind("local")]

    def limits(self, variable: Variable) -> tuple[float, float]:
        """The least and the greatest value that a variable may be set to."""
        has_range = isinstance(variable, Parameter) and variable.range
        return has_range or (-self.model.greatest_value, self.model.greatest_value)

    @cached_property
    def _by_name(self) -> dict[str, Variable]:
        return {variable.name: variable for variable in self.variables}

    @cached_property
    def geometry(self) -> dict[str, float]:
        """Start values of the geometry by symbol: `{"L1": 0.05, ...}`, the nominal set."""
        return self._parameters("geometry.")

    @cached_property
    def masses(self) -> dict[str, float]:
        """Start values of the masses: `{"OA.m": 0.0, ...}`."""
        return self._parameters("body.")

    @property
    def gravity(self) -> float:
        """Start value of gravity, m/s2."""
        return next(v.start for v in self.of_kind("parameter") if v.name == "gravity")

    def _parameters(self, prefix: str) -> dict[str, float]:
        return {v.name[len(prefix) :]: v.start for v in self.of_kind("parameter") if v.name.startswith(prefix)}

    @property
    def token(self) -> str:
        """Hash of all that a host can see of the interface; `guid` in FMI 2, the same in C."""
        return self.edition_token("")

    def edition_token(self, edition: str) -> str:
        """The token of another FMU with this interface: hosts tell FMUs apart by it."""
        digest = hashlib.sha256(repr((self, edition)).encode()).hexdigest()
        return "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file, whatever Python this is; raises tomllib.TOMLDecodeError."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def load_interface(path: Path = INTERFACE_FILE) -> Interface:
    """Read and check interface.toml; raises InterfaceError naming the variable at fault."""
    try:
        table = read_toml(path)
    except tomllib.TOMLDecodeError as problem:
        raise InterfaceError(f"{path.name}: {problem}") from None
    units = {name: _unit(name, dict(entry)) for name, entry in table["units"].items()}
    sets = table["parameter_sets"]
    variables = tuple(
        _variable(reference, dict(entry), units, sets) for reference, entry in enumerate(table["variables"], 1)
    )
    _check(variables)
    return Interface(Model(**table["model"]), units, variables, table["log_categories"])


def _unit(name: str, entry: dict[str, Any]) -> Unit:
    display = entry.pop("display", None)
    return Unit(name, entry, None if display is None else (display[0], display[1]))


def _variable(reference: int, entry: dict[str, Any], units: dict[str, Unit], sets: dict[str, list[str]]) -> Variable:
    name = entry.pop("name", None)
    if name is None:
        raise InterfaceError(f"{INTERFACE_FILE.name}: number {reference}: 'name' is missing")

    def mistake(what: str) -> InterfaceError:
        return InterfaceError(f"{INTERFACE_FILE.name}: {name}: {what}")

    def number(key: str) -> float:
        value = entry.pop(key)
        if not isinstance(value, float):
            raise mistake(f"{key} = {value!r} must be a number with a decimal point")
        return value

    def start() -> float | bool:
        return entry.pop("start") if isinstance(entry.get("start"), bool) else number("start")

    def depends() -> dict[str, str]:
        named = (depend.partition(":") for depend in entry.pop("depends", []))
        return {known: kind or "dependent" for known, _, kind in named}

    def equation() -> tuple[Product, ...]:
        try:
            return _equation(entry.pop("equation"))
        except ValueError as problem:
            raise mistake(str(problem)) from None

    readers: dict[str, Callable[..., Variable]] = {
        "independent": Time,
        "input": lambda **common: Input(**common, start=number("start")),
        "parameter": lambda **common: Parameter(
            **common,
            start=start(),
            range=_range(entry.pop("range")) if "range" in entry else None,
            smallest=number("smallest") if "smallest" in entry else 0.0,
        ),
        "output": lambda **common: Output(
            **common,
            start=number("start") if "start" in entry else None,
            group=entry.pop("group"),
            equation=equation(),
            depends=depends(),
            initially=_expand(entry.pop("initially", []), sets),
        ),
        "local": lambda **common: Local(**common, group=entry.pop("group")),
        "derivative": lambda **common: Derivative(
            **common, group=entry.pop("group"), equation=equation(), depends=depends(), of=entry.pop("of")
        ),
    }
    try:
        kind = entry.pop("kind")
        if kind not in readers:
            raise mistake(f"kind {kind!r} is none of {', '.join(readers)}")
        unit = units[entry.pop("unit")] if "unit" in entry else None
        variable = readers[kind](value_reference=reference, name=name, text=entry.pop("text"), unit=unit)
    except KeyError as missing:
        raise mistake(f"{missing} is missing or unknown") from None
    if entry:
        raise mistake(f"unknown keys {sorted(entry)}: no {kind} has them")
    return variable


def _equation(text: str) -> tuple[Product, ...]:
    """The products of "tip.x'' crank.w^2 + tip.x' crank.a"; raises ValueError that says what is wrong."""
    terms = re.findall(r"([+-]|^)([^+-]*)", text)
    return tuple(_product(-1.0 if sign == "-" else 1.0, words.split()) for sign, words in terms)


def _product(coefficient: float, words: list[str]) -> Product:
    pose, order, motion = "", 0, ""
    for word in words:
        name = word.rstrip("'")
        if re.fullmatch(r"[0-9.]+", word):
            coefficient *= float(word)
        elif name in POSE_FACTORS and not pose:
            pose, order = name, len(word) - len(name)
        elif word in MOTION_FACTORS and not motion:
            motion = word
        else:
            known = ", ".join((*POSE_FACTORS, *MOTION_FACTORS))
            raise ValueError(f"equation: {word!r} is a second factor of its kind, or none of {known}")
    if not words or order > HIGHEST_ORDER:
        raise ValueError(f"equation: {' '.join(words)!r}: a product has factors, and at most {HIGHEST_ORDER} primes")
    return Product(coefficient, pose, order, motion)


def _range(limits: list[float]) -> tuple[float, float]:
    return limits[0], limits[1]


def _expand(names: list[str], sets: dict[str, list[str]]) -> tuple[str, ...]:
    members: list[str] = []
    for name in names:
        members += _expand(sets[name], sets) if name in sets else [name]
    return tuple(members)


def _check(variables: tuple[Variable, ...]) -> None:
    by_name = {variable.name: variable for variable in variables}
    for v in variables:
        problems = [] if by_name[v.name] is v else ["the name stands twice"]
        if (v.unit is None) != (v.type == "boolean"):
            problems.append("a unit belongs to every number, and to no Boolean")
        if isinstance(v, Parameter):
            problems += _problems_of_range(v)
        if isinstance(v, Unknown):
            problems += _problems_of_equation(v)
            problems += _problems_of_dependencies(v, by_name)
        if problems:
            raise InterfaceError(f"{INTERFACE_FILE.name}: {v.name}: " + "; ".join(problems))


def _problems_of_range(v: Parameter) -> list[str]:
    if not v.accepts(v.start):
        return [f"its start {v.start:g} is not {v.demand}"]
    if v.smallest and (v.range is None or v.range[0] != 0):
        return ["'smallest' belongs to a range from 0"]
    return []


def _problems_of_equation(v: Unknown) -> list[str]:
    """Without masses, what they are in is left out: something has to be left, and the end to be it."""
    masses = [product.has_masses for product in v.equation]
    return ["equation: products with masses come after others"] if masses != sorted(masses) or masses[0] else []


def _problems_of_dependencies(v: Unknown, by_name: dict[str, Variable]) -> list[str]:
    problems = []
    if isinstance(v, Derivative) and not (v.of in by_name and by_name[v.of].is_state):
        problems.append(f"'of' must name a state, which {v.of!r} is not")
    for known, kind in v.depends.items():
        if known not in by_name or not (by_name[known].kind == "input" or by_name[known].is_state):
            problems.append(f"depends on {known!r}, which is neither an input nor a state")
        if kind not in DEPENDENCY_KINDS:
            problems.append(f"dependency kind {kind!r} is none of {DEPENDENCY_KINDS}")
    if isinstance(v, Output):
        wrong = (known for known in v.initially if known not in by_name or by_name[known].kind != "parameter")
        problems += [f"depends initially on {known!r}, which is no parameter" for known in wrong]
    return problems
