"""A study as data, read from a TOML file: what may change, what is wanted, what must hold.

scenarios/design/studies/practical.toml shows all that may stand in one. Every quantity is text with a unit, or a number
in SI units. A mistake is told with its line and key.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

from transplanter_linkage.measures import GEOMETRY, LENGTHS, MASSES, MEASURES, Operation

from scenarios.common import units
from scenarios.common.masses import plausible
from scenarios.common.variants import PHASE, PREFIX, PUBLISHED, unit_of

STUDIES = Path(__file__).with_name("studies")
GROUPS = {
    "lengths": tuple(name for name in LENGTHS if name[0] == "L"),
    "pivots": tuple(name for name in LENGTHS if name[0] != "L"),
    # theta8 stays: L8, L9, theta8 and theta9 place the tip and turn the nozzle, four for three.
    "angles": ("phi1", "phi4", "theta3", "theta9"),
}
MEASURE_UNITS = {"mm": "m", "deg": "rad", "mm/s": "m/s"}
OPERATION = {"spacing": "m", "rate": "rad/s", "depth": "m", "body": "m", "seedling": "m"}
LIMITS = ("least", "most", "between", "size_most", "near")
TABLES = ("title", "question", "operation", "masses", "parameters", "objectives", "constraints", "search", "tolerances")


PLAUSIBLE = "plausible"  # the bodies of scenarios/common/masses.py
COUNTERWEIGHT = ("counterweight.m", "counterweight.x", "counterweight.y")  # a point on crank OA


class StudyError(ValueError):
    """A study that cannot be run; the message says where in its file and why."""


@dataclass(frozen=True)
class Range:
    """A parameter that may change, between two values in SI units: of the geometry, PHASE, or spacing."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Objective:
    """A measure to be made small (sign +1) or great (-1)."""

    measure: str
    sign: int


@dataclass(frozen=True)
class Constraint:
    """least <= measure <= most; with two or more measures, how far they may be, taken together, from ``near``."""

    measures: tuple[str, ...]
    least: float | None = None
    most: float | None = None
    near: tuple[float, ...] = ()

    @property
    def text(self) -> str:
        """As people read it."""
        unit = MEASURES[self.measures[0]].unit

        def number(value: float) -> str:
            return f"{MEASURES[self.measures[0]].shown(value):.6g} {unit}".removesuffix(" 1")

        if self.near:
            place = ", ".join(f"{MEASURES[m].shown(v):.1f}" for m, v in zip(self.measures, self.near, strict=True))
            return f"{', '.join(self.measures)} within {number(self.most or 0.0)} of {place}"
        low = "" if self.least is None else f"{number(self.least)} <= "
        return low + self.measures[0] + ("" if self.most is None else f" <= {number(self.most)}")


@dataclass(frozen=True)
class Study:
    """What a run computes: two with the same study, and the same FMU, give the same designs. SI units."""

    name: str
    title: str
    question: str
    operation: Operation
    ranges: tuple[Range, ...]
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...] = ()
    starts: int = 4
    seed: int = 1
    points: int = 13
    reference: tuple[float, ...] = ()  # of a front's hypervolume
    tolerances: dict[str, float] = field(default_factory=dict)
    samples: int = 2000
    masses: dict[str, float] = field(default_factory=dict)  # of the bodies, by the FMU's names; those left out are 0

    def number(self, fmu: bytes) -> str:
        """Tells apart what was computed with another file or another study, in eight digits."""
        content = json.dumps(asdict(self), sort_keys=True).encode() + hashlib.sha256(fmu).digest()
        return hashlib.sha256(content).hexdigest()[:8]


@dataclass
class _Reader:
    """The file, to say where a mistake stands in it."""

    path: Path
    text: str

    def fault(self, key: str, said: str, table: str = "") -> StudyError:
        line = self.line(key, table)
        where = f"{self.path}, line {line}" if line else str(self.path)
        return StudyError(f"{where}: {'.'.join(filter(None, (table, key)))}: {said}")

    def line(self, key: str, table: str = "") -> int | None:
        """The line of a key, in its table where that is found; ``key`` may be table headings' own name."""
        name, _, number = table.partition("[")
        wanted, seen = int(number.rstrip("]") or 0) if number else 0, -1
        inside = not table
        for k, line in enumerate(self.text.splitlines(), start=1):
            heading = re.match(r"\s*\[\[?\s*([^\]\s]+)\s*\]\]?", line)
            if heading:
                seen += heading[1] == name
                inside = not table or (heading[1] == name and (not number or seen == wanted))
                if heading[1] == key and not table:
                    return k
            if inside and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
                return k
        return self.line(name) if table and key else None


def load(path: Path, nominal: Mapping[str, float], published: Mapping[str, float], depth: float | None = None) -> Study:
    """Read a study. ``nominal``: the FMU's geometry; ``published``: its measures in the published operation; ``depth``:
    of the ridge, where the study gives none. Raises StudyError.
    """
    if not path.is_file() and (STUDIES / f"{path}.toml").is_file():
        path = STUDIES / f"{path}.toml"
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        shipped = ", ".join(sorted(each.stem for each in STUDIES.glob("*.toml")))
        raise StudyError(f"{path} cannot be read ({error}); studies that are shipped: {shipped}") from error
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{path}: {error}") from error
    reader = _Reader(path, text)
    _known(reader, table, TABLES, "")
    for name in ("parameters", "objectives"):
        if not table.get(name):
            raise StudyError(f"{path}: {name}: a study needs some")
    for name, kind in (
        ("operation", dict),
        ("masses", dict),
        ("parameters", dict),
        ("search", dict),
        ("tolerances", dict),
    ):
        if not isinstance(table.get(name, kind()), kind):
            raise reader.fault(name, f"is to be a table, [{name}]")
    for name in ("objectives", "constraints"):
        if not isinstance(table.get(name, []), list) or not all(isinstance(each, dict) for each in table.get(name, [])):
            raise reader.fault(name, f"is to be a list of tables, [[{name}]]")
    operation = _operation(reader, table.get("operation", {}), depth)
    search = table.get("search", {})
    _known(reader, search, ("starts", "seed", "points", "reference"), "search")
    numbers = {key: _whole(reader, search, key, least) for key, least in (("starts", 1), ("seed", 0), ("points", 3))}
    tolerances = dict(table.get("tolerances", {}))
    samples = tolerances.pop("samples", Study.samples)
    if isinstance(samples, bool) or not isinstance(samples, int) or samples < 2:
        raise reader.fault("samples", f"{samples!r} is not a whole number from 2", "tolerances")
    masses = _masses(reader, table.get("masses", {}), nominal)
    study = Study(
        path.stem,
        str(table.get("title", path.stem)),
        str(table.get("question", "")),
        operation,
        _ranges(reader, table["parameters"], nominal, masses),
        tuple(_objective(reader, each, k) for k, each in enumerate(table["objectives"])),
        tuple(_constraint(reader, each, k, published) for k, each in enumerate(table.get("constraints", []))),
        tolerances=_tolerances(reader, tolerances),
        samples=samples,
        masses=masses,
    )
    varied = {each.name for each in study.ranges}
    if varied & set(COUNTERWEIGHT) and not study.masses.get("body.OA.m"):
        raise reader.fault("counterweight.m", "needs crank OA to have a mass, as [masses] gives", "parameters")
    if varied & set(COUNTERWEIGHT) and any(name.startswith("body.OA.") for name in varied):
        raise reader.fault("counterweight.m", "body.OA may not change as well: it is told by both", "parameters")
    if len(study.objectives) > 2 or len({each.measure for each in study.objectives}) < len(study.objectives):
        raise reader.fault("objectives", "one, or two different ones for a front")
    if "reference" in search:
        study = replace(study, reference=_reference(reader, search["reference"], study.objectives))
    return replace(study, **{key: value for key, value in numbers.items() if value is not None})


def _reference(reader: _Reader, written: Any, objectives: tuple[Objective, ...]) -> tuple[float, ...]:
    if len(objectives) != 2 or not isinstance(written, list) or len(written) != 2:
        raise reader.fault("reference", "a value for each of two objectives", "search")
    return tuple(
        _si(reader, value, unit_of_measure(objective.measure), "reference", "search")
        for value, objective in zip(written, objectives, strict=True)
    )


def unit_of_measure(name: str) -> str:
    """The SI unit of a measure."""
    return MEASURE_UNITS.get(MEASURES[name].unit, MEASURES[name].unit)


def _known(reader: _Reader, table: Mapping[str, Any], names: Iterable[str], of: str) -> None:
    for key in table:
        if key not in names:
            raise reader.fault(key, f"there is no such key; there are {', '.join(names)}", of)


def _whole(reader: _Reader, table: Mapping[str, Any], key: str, least: int) -> int | None:
    value = table.get(key)
    if key in table and (isinstance(value, bool) or not isinstance(value, int) or value < least):
        raise reader.fault(key, f"{value!r} is not a whole number from {least}", "search")
    return value


def _si(reader: _Reader, written: Any, unit: str, key: str, table: str) -> float:
    try:
        return units.si(written, unit)
    except units.UnitError as error:
        raise reader.fault(key, str(error), table) from error


def _operation(reader: _Reader, table: Mapping[str, Any], depth: float | None) -> Operation:
    _known(reader, table, OPERATION, "operation")
    given = {key: _si(reader, value, OPERATION[key], key, "operation") for key, value in table.items()}
    for key, value in given.items():
        if value < 0 or (value == 0 and key != "body"):
            raise reader.fault(key, "must be greater than 0", "operation")
    if depth is not None:
        given.setdefault("depth", depth)
    if "rate" in given:
        given["w"] = given.pop("rate")
    return Operation(**given)


def _masses(reader: _Reader, table: Mapping[str, Any], nominal: Mapping[str, float]) -> dict[str, float]:
    """Those of the plausible machine, or none, and over them the ones that are named."""
    _known(reader, table, ("bodies", *MASSES), "masses")
    if table.get("bodies", PLAUSIBLE) != PLAUSIBLE:
        raise reader.fault("bodies", f'may be "{PLAUSIBLE}", or left out', "masses")
    found = plausible(nominal) if "bodies" in table else {}
    return found | {key: _si(reader, table[key], unit_of(key), key, "masses") for key in table if key in MASSES}


def _ranges(
    reader: _Reader, table: Mapping[str, Any], nominal: Mapping[str, float], masses: Mapping[str, float]
) -> tuple[Range, ...]:
    """Groups first, so that a parameter's own range replaces that of its group."""
    found: dict[str, Range] = {}
    alone = {key: value for key, value in table.items() if key not in GROUPS}
    for key, value in [*((key, table[key]) for key in GROUPS if key in table), *alone.items()]:
        names = GROUPS.get(key, (key.removeprefix(PREFIX),))
        for name in names:
            if name not in (*GEOMETRY, PHASE, "spacing", *MASSES, *COUNTERWEIGHT):
                known = ", ".join((*GROUPS, *(PREFIX + each for each in GEOMETRY), PHASE, "spacing", *COUNTERWEIGHT))
                known += ", body.OA.m and so on"
                raise reader.fault(key, f"there is no such parameter; there are {known}", "parameters")
            found[name] = _range(reader, key, name, value, nominal, masses)
    if PHASE in found and "phi4" in found:
        if "phi4" not in [key.removeprefix(PREFIX) for key in alone]:
            del found["phi4"]  # of its group
        else:
            raise reader.fault(PHASE, f"{PREFIX}phi4 may not change as well: it is phi1 + {PHASE}", "parameters")
    return tuple(found.values())


def _range(
    reader: _Reader, key: str, name: str, value: Any, nominal: Mapping[str, float], masses: Mapping[str, float]
) -> Range:
    unit = "m" if name == "spacing" else unit_of(name)
    middle = (
        Operation.spacing
        if name == "spacing"
        else nominal["phi4"] - nominal["phi1"]
        if name == PHASE
        else masses.get(name, 0.0)
        if name in (*MASSES, *COUNTERWEIGHT)
        else nominal[name]
    )
    if isinstance(value, list):
        if len(value) != 2:
            raise reader.fault(key, "a range has two ends", "parameters")
        low, high = (_si(reader, each, unit, key, "parameters") for each in value)
    elif isinstance(value, str) and value.rstrip().endswith("%"):
        half = abs(middle) * _si(reader, value, "1", key, "parameters")
        low, high = middle - half, middle + half
    else:
        half = _si(reader, value, unit, key, "parameters")
        low, high = middle - half, middle + half
    if not low < high:
        raise reader.fault(key, f"the range from {low:g} to {high:g} is empty", "parameters")
    return Range(name, low, high)


def _measure(reader: _Reader, table: Mapping[str, Any], of: str) -> tuple[str, ...]:
    written = table.get("measure")
    names = tuple(written) if isinstance(written, list) and written else (written,)
    for name in names:
        if name not in MEASURES:
            raise reader.fault("measure", f"{name!r} is no measure; there are {', '.join(MEASURES)}", of)
    return names


def _objective(reader: _Reader, table: Mapping[str, Any], number: int) -> Objective:
    of = f"objectives[{number}]"
    _known(reader, table, ("measure", "goal"), of)
    names, goal = _measure(reader, table, of), table.get("goal", "least")
    if len(names) > 1 or goal not in ("least", "greatest"):
        raise reader.fault("goal" if len(names) == 1 else "measure", "one measure, goal least or greatest", of)
    return Objective(names[0], 1 if goal == "least" else -1)


def _constraint(reader: _Reader, table: Mapping[str, Any], number: int, published: Mapping[str, float]) -> Constraint:
    of = f"constraints[{number}]"
    _known(reader, table, ("measure", *LIMITS), of)
    names = _measure(reader, table, of)
    limits = [key for key in table if key in LIMITS]
    shown = {MEASURES[name].unit for name in names}
    if not limits or (len(limits) > 1 and set(limits) != {"least", "most"}):
        raise reader.fault("measure", f"one limit of {', '.join(LIMITS)}, or least and most", of)
    if (len(names) > 1 and limits != ["near"]) or len(shown) > 1:
        raise reader.fault("measure", "several measures go with near alone, and must be of one unit", of)
    unit = unit_of_measure(names[0])

    def value(written: Any, key: str) -> float:
        return published[names[0]] if written == PUBLISHED else _si(reader, written, unit, key, of)

    if limits == ["near"] and len(names) == 1:
        far, middle = value(table["near"], "near"), published[names[0]]
        return Constraint(names, middle - far, middle + far)
    if limits == ["near"]:
        return Constraint(names, most=value(table["near"], "near"), near=tuple(published[name] for name in names))
    if limits == ["size_most"]:
        size = abs(value(table["size_most"], "size_most"))
        return Constraint(names, -size, size)
    if limits == ["between"]:
        ends = table["between"]
        if not isinstance(ends, list) or len(ends) != 2:
            raise reader.fault("between", "has two ends", of)
        least, most = (value(each, "between") for each in ends)
    else:
        least, most = (value(table[key], key) if key in table else None for key in ("least", "most"))
    if least is not None and most is not None and least > most:
        raise reader.fault(limits[0], f"nothing lies between {least:g} and {most:g}", of)
    return Constraint(names, least, most)


def _tolerances(reader: _Reader, table: Mapping[str, Any]) -> dict[str, float]:
    """Standard deviation of each parameter of the geometry; 0 of those not named."""
    found = dict.fromkeys(GEOMETRY, 0.0)
    everything = {**GROUPS, "angles": ("phi1", "phi4", "theta3", "theta8", "theta9")}
    for key, value in table.items():
        names = everything.get(key, (key.removeprefix(PREFIX),))
        for name in names:
            if name not in GEOMETRY:
                raise reader.fault(
                    key, f"there is no such parameter; there are {', '.join(everything)}, ...", "tolerances"
                )
            found[name] = _si(reader, value, unit_of(name), key, "tolerances")
            if found[name] < 0:
                raise reader.fault(key, "must not be negative", "tolerances")
    return found
