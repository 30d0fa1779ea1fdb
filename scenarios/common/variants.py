"""A design other than the published one: from the command line, or from a parameter set (SSV) as tools exchange them.

    --set geometry.L1=55mm --set theta41=180deg        a variant, called by what it changes
    --variant long --set ... --variant late --set ...  several, each with its name
    --ssv design.ssv                                   one for each file

theta41 is the phase difference of the cranks, phi4 - phi1 (paper, section 4.2): phi4 moves, phi1 stays.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
from lxml import etree
from transplanter_linkage.measures import GEOMETRY, LENGTHS, Operation

from scenarios.common import units

PREFIX = "geometry."
PHASE = "theta41"
SPACE = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"
COMMON = "http://ssp-standard.org/SSP1/SystemStructureCommon"
SCHEMA = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureParameterValues.xsd"
EXPLORER = "transplanter-linkage.explorer"  # the type of the annotation in which it keeps what is no parameter
PUBLISHED = "published"


class VariantError(ValueError):
    """A variant that cannot be read; the message says where and why."""


def unit_of(name: str) -> str:
    """The SI unit of a parameter of the geometry, named as in GEOMETRY, or of a body or the counterweight."""
    if name.startswith(("body.", "counterweight.")):
        return {"m": "kg", "x": "m", "y": "m", "J": "kg.m2"}[name.rpartition(".")[2]]
    return "m" if name in LENGTHS else "rad"


@dataclass(frozen=True)
class Variant:
    """A name, and what the geometry has other than the published one, {"L1": 0.055} in SI units."""

    name: str
    changes: dict[str, float]

    def geometry(self, nominal: Mapping[str, float]) -> dict[str, float]:
        """Whole, where PHASE is told by phi4; ``nominal``: that of the FMU's start values."""
        whole = {**nominal, **{name: value for name, value in self.changes.items() if name != PHASE}}
        if PHASE in self.changes:
            whole["phi4"] = whole["phi1"] + self.changes[PHASE]
        return whole

    def parameters(self, nominal: Mapping[str, float]) -> dict[str, float]:
        """What is other than the FMU's start values, by its names."""
        whole = self.geometry(nominal)
        return {PREFIX + name: value for name, value in whole.items() if value != nominal[name]}


def changed(text: str) -> tuple[str, float]:
    """NAME=VALUE as (name, SI value); names with or without "geometry.". Raises VariantError."""
    written, equals, value = text.partition("=")
    name = written.strip().removeprefix(PREFIX)
    if not equals or name not in (*GEOMETRY, PHASE):
        known = ", ".join((*(PREFIX + each for each in GEOMETRY), PHASE))
        raise VariantError(f"{text!r} is not NAME=VALUE with a NAME of {known}")
    try:
        return name, units.si(value, unit_of(name))
    except units.UnitError as error:
        raise VariantError(f"{written.strip()}: {error}") from error


def read_ssv(path: Path) -> Variant:
    """The parameters of the geometry in a parameter set; others than those of the linkage are left alone.

    A name may have the component's before it, as in a system. Units are converted. Raises VariantError.
    """
    try:
        root = etree.parse(str(path)).getroot()
    except (OSError, etree.XMLSyntaxError) as error:
        raise VariantError(f"{path} cannot be read: {error}") from error
    if root.tag != f"{{{SPACE}}}ParameterSet":
        raise VariantError(f"{path} is no parameter set of SSP 1.0: its root is {etree.QName(root).localname}.")
    found: dict[str, float] = {}
    for parameter in root.iter(f"{{{SPACE}}}Parameter"):
        name = (parameter.get("name") or "").rpartition(PREFIX)[2]
        real = parameter.find(f"{{{SPACE}}}Real")
        if name not in GEOMETRY or PREFIX not in (parameter.get("name") or "") or real is None:
            continue
        written = f"{real.get('value')} {real.get('unit') or ''}"
        try:
            found[name] = units.si(written, unit_of(name))
        except units.UnitError as error:
            raise VariantError(f"{path}, line {parameter.sourceline}: {PREFIX}{name}: {error}") from error
    if not found:
        raise VariantError(f"{path} sets no parameter {PREFIX}...")
    return Variant(path.stem, found)


def explored(operation: Operation) -> dict[str, float]:
    """How the linkage is used, as the explorer names it; SI units."""
    return {"crank.w": operation.w, "plant.spacing": operation.spacing, "ridge.depth": operation.depth}


def write_ssv(
    path: Path, name: str, geometry: Mapping[str, float], operation: Operation, masses: Mapping[str, float] = {}
) -> None:
    """A geometry, and masses by the FMU's names, as a parameter set of SSP 1.0, SI units with all digits, checked
    against the standard's schema.

    How the linkage is used is no parameter of the FMU: it stands in an annotation, from which the explorer reads it.
    """
    root = etree.Element(
        f"{{{SPACE}}}ParameterSet", {"version": "1.0", "name": name}, nsmap={"ssv": SPACE, "ssc": COMMON}
    )
    parameters = etree.SubElement(root, f"{{{SPACE}}}Parameters")
    values = {PREFIX + key: (geometry[key], unit_of(key)) for key in GEOMETRY}
    values |= {key: (value, unit_of(key)) for key, value in masses.items()}
    for key, (value, unit) in values.items():
        parameter = etree.SubElement(parameters, f"{{{SPACE}}}Parameter", name=key)
        etree.SubElement(parameter, f"{{{SPACE}}}Real", value=repr(float(value)), unit=unit)
    used = etree.SubElement(root, f"{{{SPACE}}}Units")
    for unit in dict.fromkeys(unit for _, unit in values.values()):
        base = {"kg": "1", "m": "2"} if unit == "kg.m2" else {unit: "1"}
        etree.SubElement(etree.SubElement(used, f"{{{COMMON}}}Unit", name=unit), f"{{{COMMON}}}BaseUnit", base)
    annotations = etree.SubElement(root, f"{{{SPACE}}}Annotations")
    annotation = etree.SubElement(annotations, f"{{{COMMON}}}Annotation", type=EXPLORER)
    used_so = etree.SubElement(annotation, "operation")
    for key, value in explored(operation).items():
        etree.SubElement(used_so, "value", name=key).text = repr(float(value))
    etree.XMLSchema(file=str(SCHEMA)).assertValid(root)
    path.write_bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))


class _Collect(argparse.Action):
    """--set, --variant and --ssv in the order in which they come."""

    def __call__(self, parser, namespace, value, option_string=None) -> None:
        collected: list[Variant] = [*(getattr(namespace, "variants", None) or [])]
        try:
            if option_string == "--variant":
                collected.append(Variant(value, {}))
            elif option_string == "--ssv":
                collected.append(read_ssv(Path(value)))
            else:
                name, amount = changed(value)
                last = collected.pop() if collected else Variant("", {})
                collected.append(Variant(last.name, {**last.changes, name: amount}))
        except VariantError as error:
            parser.error(str(error))
        namespace.variants = collected


def add_options(parser: argparse.ArgumentParser) -> None:
    """--set, --variant and --ssv; ``options.variants`` holds what they name, in order, through `chosen`."""
    group = parser.add_argument_group("designs other than the published one, beside which they are shown")
    group.add_argument(
        "--set",
        action=_Collect,
        metavar="NAME=VALUE",
        dest="variants",
        default=[],
        help="change this of the variant, as geometry.L1=55mm or theta41=180deg; may be given several times",
    )
    group.add_argument("--variant", action=_Collect, metavar="NAME", dest="variants", help="begin another variant")
    group.add_argument("--ssv", action=_Collect, metavar="FILE", dest="variants", help="a variant from a parameter set")


def chosen(options: argparse.Namespace) -> list[Variant]:
    """The variants of a command line; one without a name is called by what it changes, none is called as another."""
    found: list[Variant] = []
    for variant in options.variants:
        name = variant.name or " ".join(
            f"{key}={units.shown(value, unit_of(key))}".replace(" ", "") for key, value in variant.changes.items()
        )
        taken = {PUBLISHED, *(other.name for other in found)}
        number = next(k for k in range(1, len(taken) + 2) if (name if k == 1 else f"{name} {k}") not in taken)
        found.append(Variant(name if number == 1 else f"{name} {number}", variant.changes))
    return found


def described(changes: Mapping[str, float], nominal: Mapping[str, float]) -> Sequence[tuple[str, str, str, str]]:
    """(name, published, of this design, change) of what is changed, as people read it."""
    rows = []
    for name, value in changes.items():
        before = nominal["phi4"] - nominal["phi1"] if name == PHASE else nominal[name]
        unit = unit_of(name)
        scale = 1e3 if unit == "m" else 180 / math.pi
        rows.append((name, units.shown(before, unit), units.shown(value, unit), f"{(value - before) * scale:+.3f}"))
    return rows
