"""modelDescription.xml of FMI 2.0 and 3.0 from the interface (FMI 2.0.4, section 2.2; FMI 3.0, section 2.4)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import fmpy
from lxml import etree

from ..interface import Computed, Derivative, Interface, Output, Parameter, Unit, Unknown, Variable
from .sources import source_name
from .version import generation_tool, project_version

SCHEMAS = Path(fmpy.__file__).parent / "schema"


@dataclass(frozen=True)
class Edition:
    """What differs between the FMUs that share the interface; `suffix` makes the model's name.

    fmi: 2 or 3; capabilities: of each interface type, by the name of its element; has_sources: C sources come along.
    """

    fmi: int
    suffix: str
    remark: str
    capabilities: dict[str, dict[str, str]]
    has_sources: bool = False


# Each of these has a test in tests/fmi.
_STATES = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true", "providesDirectionalDerivative": "true"}
_STATES_FMI3 = {
    "canGetAndSetFMUState": "true",
    "canSerializeFMUState": "true",
    "providesDirectionalDerivatives": "true",
    "providesAdjointDerivatives": "true",
}
NATIVE = Edition(
    fmi=2,
    suffix="",
    remark="",
    capabilities={
        "ModelExchange": {"completedIntegratorStepNotNeeded": "true"} | _STATES,
        "CoSimulation": {
            "canHandleVariableCommunicationStepSize": "true",
            "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "2",
        }
        | _STATES,
    },
    has_sources=True,
)
FMI3 = Edition(
    fmi=3,
    suffix="",
    remark="",
    capabilities={
        "ModelExchange": _STATES_FMI3,
        "CoSimulation": {
            "canHandleVariableCommunicationStepSize": "true",
            "maxOutputDerivativeOrder": "2",
            "providesIntermediateUpdate": "true",
            "canReturnEarlyAfterIntermediateUpdate": "true",
            "hasEventMode": "true",
        }
        | _STATES_FMI3,
    },
    has_sources=True,
)
TWIN = Edition(
    fmi=2,
    suffix="Twin",
    remark=" (readable edition in Python: needs Python with numpy on the host)",
    capabilities={
        "CoSimulation": {
            "needsExecutionTool": "true",
            "canHandleVariableCommunicationStepSize": "true",
            "canNotUseMemoryManagementFunctions": "true",
        }
    },
)


class ModelDescriptionError(ValueError):
    """The XML does not satisfy the FMI schema; the message says where."""


def model_description_xml(interface: Interface, edition: Edition) -> bytes:
    """The document, checked against the schema of the edition's FMI version."""
    name = interface.model.name + edition.suffix
    token = interface.edition_token(edition.suffix)
    root = etree.Element(
        "fmiModelDescription",
        {
            "fmiVersion": f"{edition.fmi}.0",
            "modelName": name,
            "guid" if edition.fmi == 2 else "instantiationToken": token,
        },
        description=interface.model.description + edition.remark,
        version=project_version(),
        copyright="The Transplanter Linkage FMU developers",
        license="BSD-2-Clause",
        generationTool=generation_tool(),
        variableNamingConvention="structured",
    )
    if edition.fmi == 2:
        root.set("numberOfEventIndicators", "0")
    for interface_type, capabilities in edition.capabilities.items():
        etree.SubElement(root, interface_type, {"modelIdentifier": name} | capabilities)
    units = etree.SubElement(root, "UnitDefinitions")
    for unit in interface.units.values():
        _add_unit(units, unit)
    categories = etree.SubElement(root, "LogCategories")
    for category, description in interface.log_categories.items():
        etree.SubElement(categories, "Category", name=category, description=description)
    etree.SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(interface.model.turn_time),
        stepSize=repr(interface.model.step_size),
    )
    variables = etree.SubElement(root, "ModelVariables")
    for variable in interface.variables:
        _ADD_VARIABLE[edition.fmi](variables, interface, variable)
    _ADD_STRUCTURE[edition.fmi](etree.SubElement(root, "ModelStructure"), interface)
    if edition.fmi == 2 and edition.has_sources:  # FMI 3.0 has sources/buildDescription.xml
        for element in root.iterchildren("ModelExchange", "CoSimulation"):
            etree.SubElement(etree.SubElement(element, "SourceFiles"), "File", name=source_name(interface))

    schema = etree.XMLSchema(etree.parse(str(SCHEMAS / f"fmi{edition.fmi}" / f"fmi{edition.fmi}ModelDescription.xsd")))
    try:
        schema.assertValid(root)
    except etree.DocumentInvalid as problem:
        raise ModelDescriptionError(f"modelDescription.xml: {problem}") from None
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _add_unit(units: etree._Element, unit: Unit) -> None:
    element = etree.SubElement(units, "Unit", name=unit.name)
    etree.SubElement(element, "BaseUnit", {base: str(exponent) for base, exponent in unit.exponents.items()})
    if unit.display is not None:
        name, factor = unit.display
        etree.SubElement(element, "DisplayUnit", name=name, factor=repr(factor))


def _attributes(variable: Variable) -> dict[str, str]:
    """What FMI 2.0 and 3.0 have in common on a variable as a whole."""
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.value_reference),
        "description": variable.text,
        "causality": "local" if variable.kind == "derivative" else variable.kind,
        "variability": "fixed" if variable.kind == "parameter" else "continuous",
    }
    if variable.kind == "parameter" or variable.is_state:
        attributes["initial"] = "exact"
    elif isinstance(variable, Computed):
        attributes["initial"] = "calculated"
    return attributes


def _type_attributes(interface: Interface, variable: Variable) -> dict[str, str]:
    """What they have in common on its type: units, start, and of which state it is the derivative."""
    attributes = {}
    if variable.unit is not None:
        attributes["unit"] = variable.unit.name
        if variable.unit.display_name is not None:
            attributes["displayUnit"] = variable.unit.display_name
    if isinstance(variable, Parameter) and variable.range is not None:
        attributes["min"], attributes["max"] = map(repr, variable.range)
    if variable.start is not None:
        attributes["start"] = str(variable.start).lower() if variable.type == "boolean" else repr(variable.start)
    if isinstance(variable, Derivative):
        attributes["derivative"] = str(interface[variable.of].value_reference)
    return attributes


def _add_variable_fmi2(variables: etree._Element, interface: Interface, variable: Variable) -> None:
    element = etree.SubElement(variables, "ScalarVariable", _attributes(variable))
    etree.SubElement(element, variable.type.capitalize(), _type_attributes(interface, variable))


def _add_variable_fmi3(variables: etree._Element, interface: Interface, variable: Variable) -> None:
    attributes = _attributes(variable) | _type_attributes(interface, variable)
    if variable.kind in ("input", "output"):
        attributes["intermediateUpdate"] = "true"
    etree.SubElement(variables, {"real": "Float64", "boolean": "Boolean"}[variable.type], attributes)


def _initial_unknowns(interface: Interface) -> list[Unknown]:
    """By reference: an ordered list in FMI 2.0.4 (section 2.2.8), which VDMCheck takes for one sorted by index."""
    unknowns = (variable for variable in interface.unknowns if not variable.is_state)
    return sorted(unknowns, key=lambda variable: variable.value_reference)


def _initially(variable: Unknown) -> dict[str, str]:
    parameters = variable.initially if isinstance(variable, Output) else ()
    return dict.fromkeys(parameters, "dependent") | variable.depends


def _add_structure_fmi2(structure: etree._Element, interface: Interface) -> None:
    outputs, derivatives, initial_unknowns = (
        etree.SubElement(structure, name) for name in ("Outputs", "Derivatives", "InitialUnknowns")
    )
    for variable in interface.unknowns:
        _add_unknown_fmi2(outputs if variable.kind == "output" else derivatives, interface, variable, variable.depends)
    for variable in _initial_unknowns(interface):
        _add_unknown_fmi2(initial_unknowns, interface, variable, _initially(variable))


def _add_unknown_fmi2(parent: etree._Element, interface: Interface, variable: Unknown, depends: dict[str, str]) -> None:
    """The index of a variable is its value reference: both count from 1."""
    etree.SubElement(parent, "Unknown", {"index": str(variable.value_reference)} | _dependencies(interface, depends))


def _add_structure_fmi3(structure: etree._Element, interface: Interface) -> None:
    for variable in interface.unknowns:
        element = "Output" if variable.kind == "output" else "ContinuousStateDerivative"
        _add_unknown_fmi3(structure, element, interface, variable, variable.depends)
    for variable in _initial_unknowns(interface):
        _add_unknown_fmi3(structure, "InitialUnknown", interface, variable, _initially(variable))


def _add_unknown_fmi3(
    structure: etree._Element, element: str, interface: Interface, variable: Unknown, depends: dict[str, str]
) -> None:
    etree.SubElement(
        structure, element, {"valueReference": str(variable.value_reference)} | _dependencies(interface, depends)
    )


def _dependencies(interface: Interface, depends: dict[str, str]) -> dict[str, str]:
    """`dependencies` in the order of their references, with the kinds in the same order."""
    known = sorted(depends, key=lambda name: interface[name].value_reference)
    return {
        "dependencies": " ".join(str(interface[name].value_reference) for name in known),
        "dependenciesKind": " ".join(depends[name] for name in known),
    }


_ADD_VARIABLE = {2: _add_variable_fmi2, 3: _add_variable_fmi3}
_ADD_STRUCTURE = {2: _add_structure_fmi2, 3: _add_structure_fmi3}
