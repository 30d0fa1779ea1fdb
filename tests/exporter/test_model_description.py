"""modelDescription.xml says what the binary does: starts, references, units, dependencies (FMI 2.0.4, section 2.2)."""

from __future__ import annotations

import math
import re
import zipfile
from itertools import product

import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from fmu_src.exporter.compiler import SOURCE_ROOT
from fmu_src.exporter.model_description import Edition, ModelDescriptionError, model_description_xml
from tests.harness.host import DISCARD, OK, Instance
from tests.harness.masses import MASSES, PLAUSIBLE


@pytest.fixture(scope="module")
def root(fmu_file) -> etree._Element:
    with zipfile.ZipFile(fmu_file) as archive:
        return etree.fromstring(archive.read("modelDescription.xml"))


@pytest.fixture(scope="module")
def variables(root) -> dict[str, etree._Element]:
    return {variable.get("name"): variable for variable in root.iter("ScalarVariable")}


def test_fmpy_finds_no_problem(fmu_file):
    assert validate_fmu(str(fmu_file)) == []


def test_the_schema_is_asked(interface):
    """A description that FMI does not know is not written."""
    with pytest.raises(ModelDescriptionError, match="canFly"):
        edition = Edition(2, suffix="", remark="", capabilities={"CoSimulation": {"canFly": "true"}})
        model_description_xml(interface, edition)


def test_token(root, fmu, interface):
    """The same in XML, C header and binary: files of different builds do not work together."""
    header = (SOURCE_ROOT / "component" / "interface.h").read_text(encoding="utf-8")
    (in_c,) = re.findall(r'INTERFACE_TOKEN "(.*)"', header)
    assert root.get("guid") == in_c == interface.token
    assert in_c.encode() in fmu.library.read_bytes()


# ---- variables -----------------------------------------------------------------------------------


def test_value_references_count_from_one(variables):
    references = [int(variable.get("valueReference")) for variable in variables.values()]
    assert references == list(range(1, len(variables) + 1))


def test_starts_are_those_of_the_binary(new, variables):
    """To the last bit: what the XML promises is what an instance has that nobody has set anything in."""
    instance = new().setup().enter()
    seen = 0
    for name, variable in variables.items():
        start = variable[0].get("start")
        if start is not None:
            seen += 1
            if variable[0].tag == "Boolean":
                assert instance.get_boolean(name) == (start == "true")
            else:
                assert instance.get(name)[0].hex() == float(start).hex(), name
    assert seen == 6 + 45 + 1, "inputs, parameters, machine.s"


def test_attributes(variables, fmu):
    """Causality, variability and initial in the combinations of FMI 2.0.4, section 2.2.7."""
    allowed = {
        ("independent", "continuous", None),
        ("input", "continuous", None),
        ("output", "continuous", "calculated"),
        ("output", "continuous", "exact"),
        ("parameter", "fixed", "exact"),
        ("local", "continuous", "calculated"),
    }
    found = {
        name: (variable.get("causality"), variable.get("variability"), variable.get("initial"))
        for name, variable in variables.items()
    }
    assert set(found.values()) == allowed
    exact = [name for name, attributes in found.items() if attributes == ("output", "continuous", "exact")]
    assert exact == ["machine.s"]
    local = {name for name, (causality, *_) in found.items() if causality == "local"}
    assert local == {"der(machine.s)", *fmu.names("local")} and len(local) == 41
    assert all(variable.get("description") for variable in variables.values())


def test_what_may_be_set_is_what_can_be_set(new, variables):
    """Inputs, parameters and exact starts before initialization ends; nothing else, ever."""
    for name, variable in variables.items():
        value = True if variable[0].tag == "Boolean" else 0.125
        may_be_set = variable.get("initial") == "exact" or variable.get("causality") == "input"
        assert (new().setup().enter().try_set({name: value}) == OK) == may_be_set, name
        assert (new().initialize().try_set({name: value}) == OK) == (variable.get("causality") == "input"), name


# ---- units ---------------------------------------------------------------------------------------

UNITS = {  # exponents of SI base units; the unit that hosts show, and how many of it are one SI unit
    "s": ({"s": 1}, None),
    "rad": ({"rad": 1}, ("deg", 180 / math.pi)),
    "rad/s": ({"rad": 1, "s": -1}, ("rpm", 30 / math.pi)),
    "rad/s2": ({"rad": 1, "s": -2}, ("deg/s2", 180 / math.pi)),
    "m": ({"m": 1}, ("mm", 1000.0)),
    "m/s": ({"m": 1, "s": -1}, ("km/h", 3.6)),
    "m/s2": ({"m": 1, "s": -2}, None),
    "N": ({"kg": 1, "m": 1, "s": -2}, None),
    "N.m": ({"kg": 1, "m": 2, "s": -2}, None),
    "J": ({"kg": 1, "m": 2, "s": -2}, None),
    "kg": ({"kg": 1}, None),
    "kg.m2": ({"kg": 1, "m": 2}, None),
    "1": ({}, None),
}
UNITS_OF = {  # every variable by name: a new one is entered here, beside those of its unit
    "s": ["time", "crank.smoothing"],
    "rad": ["crank.phi", "tip.angle", "geometry.phi1", "geometry.phi4",
            "geometry.theta3", "geometry.theta8", "geometry.theta9"],
    "rad/s": ["crank.w"],
    "rad/s2": ["crank.a"],
    "m": ["machine.s", "tip.x", "tip.y", "ground.x", "ground.y", *(f"geometry.L{n}" for n in range(1, 10)),
          "geometry.XC", "geometry.YC", "geometry.XG", "geometry.YG",
          *(f"body.{body}.{axis}" for body in PLAUSIBLE for axis in "xy"),
          *(f"joint.{point}.{axis}" for point in "ABCDEFGHIJ" for axis in "xy")],
    "m/s": ["machine.v", "tip.vx", "tip.vy", "ground.vx", "ground.vy", "der(machine.s)"],
    "m/s2": ["tip.ax", "tip.ay", "ground.ax", "ground.ay", "gravity"],
    "N": ["tip.fx", "tip.fy", "machine.fx", "machine.fy",
          *(f"joint.{joint}.f{axis}" for joint in "OABCDEFG" for axis in "xy")],
    "N.m": ["crank.tau", "crank.tau_bias", "crank.OA.tau", "crank.CD.tau"],
    "J": ["linkage.kinetic", "linkage.potential"],
    "kg": [f"body.{body}.m" for body in PLAUSIBLE],
    "kg.m2": ["crank.inertia", *(f"body.{body}.J" for body in PLAUSIBLE)],
    "1": ["assembly.margin"],
    None: ["crank.at_step_end"],
}  # fmt: skip


def test_units_are_what_their_names_say(root):
    found = {}
    for unit in root.iter("Unit"):
        (base,) = unit.findall("BaseUnit")
        shown = [(display.get("name"), float(display.get("factor"))) for display in unit.findall("DisplayUnit")]
        assert len(shown) <= 1
        found[unit.get("name")] = ({name: int(power) for name, power in base.items()}, shown[0] if shown else None)
    assert found == UNITS, "SI units: no factor, no offset"


def test_each_variable_has_its_unit_and_shows_it(variables):
    unit_of = {name: unit for unit, names in UNITS_OF.items() for name in names}
    assert set(unit_of) == set(variables)
    for name, variable in variables.items():
        expected = unit_of[name]
        assert variable[0].get("unit") == expected, name
        display = UNITS[expected][1] if expected else None
        assert variable[0].get("displayUnit") == (display[0] if display else None), name


# ---- dependencies --------------------------------------------------------------------------------

POINTS = [  # in one the dyad ABD is nearer to its dead point, in the other EFG
    {"crank.phi": 0.7, "crank.w": 3.0, "crank.a": -5.0, "machine.v": 0.4, "tip.fx": 20.0, "tip.fy": -70.0},
    {"crank.phi": 3.5, "crank.w": -2.0, "crank.a": 9.0, "machine.v": -0.3, "tip.fx": -10.0, "tip.fy": 30.0},
]


def declared(root, *list_names: str) -> dict[str, dict[str, str]]:
    """{unknown: {what it depends on: kind}} of the lists Outputs, Derivatives or InitialUnknowns."""
    names = [variable.get("name") for variable in root.iter("ScalarVariable")]
    found = {}
    for unknown in (unknown for name in list_names for unknown in root.find(f"ModelStructure/{name}")):
        known = [names[int(index) - 1] for index in unknown.get("dependencies").split()]
        kinds = unknown.get("dependenciesKind").split()
        assert len(kinds) == len(known)
        found[names[int(unknown.get("index")) - 1]] = dict(zip(known, kinds, strict=True))
    return found


def moved(instance: Instance, names: list[str], known: str, point: dict[str, float]) -> set[str]:
    """The outputs that change when this variable does, all else as it is."""
    (here,) = instance.set(point).get(known)
    before = instance.get(*names)
    instance.set({known: here * 1.01 + 1e-3})
    status, after = instance.try_get(names)
    assert status != DISCARD
    instance.set({known: here})
    assert instance.get(*names) == before
    return {name for name, a, b in zip(names, before, after, strict=True) if a != b}


def test_outputs_depend_on_the_inputs_declared_and_no_others(root, new, fmu):
    """Each output, and the state's derivative, against each input and the state, numerically."""
    outputs = [*fmu.names("output"), "der(machine.s)"]
    found: dict[str, set[str]] = {name: set() for name in outputs}
    instance = new().setup().enter().set(MASSES)
    for known, point in product([*fmu.names("input"), "machine.s"], POINTS):
        for name in moved(instance, outputs, known, point):
            found[name].add(known)
    assert found == {name: set(known) for name, known in declared(root, "Outputs", "Derivatives").items()}


def test_the_lists_of_unknowns_are_sorted(root):
    """Ordered lists (FMI 2.0.4, section 2.2.8): checkers take an index that falls for an error."""
    for unknowns in root.find("ModelStructure"):
        indices = [int(unknown.get("index")) for unknown in unknowns]
        assert indices == sorted(indices), unknowns.tag


def test_initial_unknowns_depend_on_what_is_declared_and_nothing_else(root, new, fmu):
    """Each calculated output against each input, parameter and exact start; time does not come in."""
    outputs = [*fmu.names("output"), "der(machine.s)"]
    parameters = [name for name in fmu.names("parameter") if name != "crank.at_step_end"]
    knowns = [*fmu.names("input"), *parameters, "machine.s"]
    found: dict[str, set[str]] = {name: set() for name in outputs if name != "machine.s"}
    instance = new().setup().enter().set(MASSES)
    for known, point in product(knowns, POINTS):
        for name in moved(instance, outputs, known, point) - {"machine.s"}:
            found[name].add(known)
    assert found == {name: set(known) for name, known in declared(root, "InitialUnknowns").items()}


def test_what_depends_on_nothing_else(root, new, fmu):
    """Neither the start time nor crank.at_step_end change an output before the first step."""
    outputs = fmu.names("output")
    plain, other = new().setup().enter(), new().setup(start=7.0).enter().set({"crank.at_step_end": True})
    assert plain.set(POINTS[0]).get(*outputs) == other.set(POINTS[0]).get(*outputs)


def test_constant_dependencies_are_constant(root, new):
    """dependenciesKind "constant": the same partial derivative everywhere; "dependent": not so."""
    instance = new().setup().enter().set(MASSES)
    for output, depends in declared(root, "Outputs", "Derivatives").items():
        for known, kind in depends.items():
            partials = {instance.set(point).sensitivity([output], {known: 1.0})[0] for point in POINTS}
            assert (len(partials) == 1) == (kind == "constant"), (output, known)


# ---- the experiment ------------------------------------------------------------------------------


def test_default_experiment_is_one_turn(root, interface):
    experiment = root.find("DefaultExperiment")
    assert float(experiment.get("startTime")) == 0
    assert float(experiment.get("stopTime")) == pytest.approx(60 / 65, rel=1e-15)
    assert float(experiment.get("stepSize")) == 1e-3
    assert interface.model.machine_speed == pytest.approx(0.4 * 65 / 60, rel=1e-15)
