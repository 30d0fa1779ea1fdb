"""modelDescription.xml of FMI 2.0 from the interface (FMI 2.0.4, section 2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import fmpy
from lxml import etree

from ..interface import Interface, Unit, Variable
from .version import generation_tool, project_version

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"

@dataclass(frozen=True)
class Edition:
    """What differs between the FMUs that share the interface; `suffix` makes the model's name."""

    suffix: str
    remark: str
    capabilities: dict[str, str]


NATIVE = Edition(
    suffix="",
    remark="",
    capabilities={  # each of these has a test in tests/fmi
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "true",
        "maxOutputDerivativeOrder": "2",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    },
)
TWIN = Edition(
    suffix="Twin",
    remark=" (readable edition in Python: needs Python with numpy on the host)",
    capabilities={
        "needsExecutionTool": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canNotUseMemoryManagementFunctions": "true",
    },
)


class ModelDescriptionError(ValueError):
    """The XML does not satisfy the FMI schema; the message says where."""


def fmi2_xml(interface: Interface, edition: Edition = NATIVE) -> bytes:
    """The document, checked against the FMI 2.0 schema."""
    name = interface.model.name + edition.suffix
    root = etree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=name,
        guid=interface.edition_token(edition.suffix),
        description=interface.model.description + edition.remark,
        version=project_version(),
        copyright="The Transplanter Linkage FMU developers",
        license="BSD-2-Clause",
        generationTool=generation_tool(),
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    etree.SubElement(root, "CoSimulation", modelIdentifier=name, **edition.capabilities)
    units = etree.SubElement(root, "UnitDefinitions")
    for unit in interface.units.values():
        _add_unit(units, unit)
    categories = etree.SubElement(root, "LogCategories")
    for name, description in interface.log_categories.items():
        etree.SubElement(categories, "Category", name=name, description=description)
    etree.SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(interface.model.turn_time),
        stepSize=repr(interface.model.step_size),
    )
    variables = etree.SubElement(root, "ModelVariables")
    for variable in interface.variables:
        _add_variable(variables, variable)
    _add_structure(etree.SubElement(root, "ModelStructure"), interface)

    schema = etree.XMLSchema(etree.parse(str(SCHEMA)))
    if not schema.validate(root):
        raise ModelDescriptionError(f"modelDescription.xml: {schema.error_log.last_error}")
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _add_unit(units: etree._Element, unit: Unit) -> None:
    element = etree.SubElement(units, "Unit", name=unit.name)
    etree.SubElement(element, "BaseUnit", {base: str(exponent) for base, exponent in unit.exponents.items()})
    if unit.display_name is not None:
        etree.SubElement(element, "DisplayUnit", name=unit.display_name, factor=repr(unit.display_factor))


def _add_variable(variables: etree._Element, variable: Variable) -> None:
    attributes = {
        "name": variable.name,
        "valueReference": str(variable.value_reference),
        "description": variable.text,
        "causality": variable.kind,
        "variability": "fixed" if variable.kind == "parameter" else "continuous",
    }
    if variable.kind == "parameter" or variable.is_state:
        attributes["initial"] = "exact"
    elif variable.kind == "output":
        attributes["initial"] = "calculated"
    element = etree.SubElement(variables, "ScalarVariable", attributes)
    if variable.type == "boolean":
        etree.SubElement(element, "Boolean", start=str(variable.start).lower())
        return
    real = etree.SubElement(element, "Real")
    if variable.unit is not None:
        real.set("unit", variable.unit.name)
        if variable.unit.display_name is not None:
            real.set("displayUnit", variable.unit.display_name)
    if variable.range is not None:
        real.set("min", repr(variable.range[0]))
        real.set("max", repr(variable.range[1]))
    if variable.start is not None:
        real.set("start", repr(variable.start))


def _add_structure(structure: etree._Element, interface: Interface) -> None:
    outputs = etree.SubElement(structure, "Outputs")
    initial_unknowns = etree.SubElement(structure, "InitialUnknowns")
    for variable in interface.of_kind("output"):
        _add_unknown(outputs, interface, variable, variable.depends)
        if not variable.is_state:
            initially = variable.depends | dict.fromkeys(variable.initially, "dependent")
            _add_unknown(initial_unknowns, interface, variable, initially)


def _add_unknown(parent: etree._Element, interface: Interface, variable: Variable, depends: dict[str, str]) -> None:
    """`dependencies` in the order of their index, with the kinds in the same order."""
    known = sorted(depends, key=lambda name: interface[name].value_reference)
    etree.SubElement(
        parent,
        "Unknown",
        index=str(variable.value_reference),
        dependencies=" ".join(str(interface[name].value_reference) for name in known),
        dependenciesKind=" ".join(depends[name] for name in known),
    )
