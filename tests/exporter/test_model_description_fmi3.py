"""modelDescription.xml of FMI 3.0 says the same as that of FMI 2.0, in its own words (FMI 3.0, section 2.4)."""

from __future__ import annotations

import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from fmu_src.exporter.model_description import FMI3, NATIVE, Edition, ModelDescriptionError, model_description_xml


@pytest.fixture(scope="module")
def old(interface) -> etree._Element:
    return etree.fromstring(model_description_xml(interface, NATIVE))


@pytest.fixture(scope="module")
def new_(interface) -> etree._Element:
    return etree.fromstring(model_description_xml(interface, FMI3))


def test_fmpy_finds_no_problem(fmu_files):
    assert validate_fmu(str(fmu_files[3])) == []


def test_the_schema_is_asked(interface):
    edition = Edition(3, suffix="", remark="", capabilities={"CoSimulation": {"hasEventMode": "maybe"}})
    with pytest.raises(ModelDescriptionError, match="hasEventMode"):
        model_description_xml(interface, edition)


def test_the_same_model(old, new_):
    """Name, token, texts, units, log categories, experiment; the version is FMI 3.0's."""
    assert new_.get("fmiVersion") == "3.0" and new_.get("instantiationToken") == old.get("guid")
    for attribute in ("modelName", "description", "version", "license", "variableNamingConvention", "generationTool"):
        assert new_.get(attribute) == old.get(attribute)
    for element in ("UnitDefinitions", "LogCategories", "DefaultExperiment"):
        assert etree.tostring(new_.find(element)) == etree.tostring(old.find(element))
    for interface_type in ("ModelExchange", "CoSimulation"):
        assert new_.find(interface_type).get("modelIdentifier") == old.find(interface_type).get("modelIdentifier")
    assert new_.find("ScheduledExecution") is None


def test_the_same_variables(old, new_):
    """Value references, names, causality, variability, initial, start, units: each as in FMI 2.0."""
    types = {"Real": "Float64", "Boolean": "Boolean"}
    expected = [dict(v.items()) | dict(v[0].items()) | {"type": types[v[0].tag]} for v in old.iter("ScalarVariable")]
    found = [dict(v.items()) | {"type": v.tag} for v in new_.find("ModelVariables")]
    intermediate = {v["name"] for v in found if v.pop("intermediateUpdate", None) == "true"}
    assert found == expected
    assert intermediate == {v["name"] for v in found if v["causality"] in ("input", "output")}


def test_the_same_dependencies(old, new_):
    structure = new_.find("ModelStructure")
    for element, list_name in (
        ("Output", "Outputs"), ("ContinuousStateDerivative", "Derivatives"), ("InitialUnknown", "InitialUnknowns")
    ):  # fmt: skip
        expected = [dict(unknown.items()) for unknown in old.find(f"ModelStructure/{list_name}")]
        found = [dict(unknown.items()) for unknown in structure.findall(element)]
        for unknown in found:
            unknown["index"] = unknown.pop("valueReference")
        assert found == expected and found
    assert structure.findall("EventIndicator") == structure.findall("ClockedState") == []
