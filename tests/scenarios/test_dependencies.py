"""What the FMUs of the row declare of their dependencies: it is so, and hosts that sort by it find no loop."""

from __future__ import annotations

import graphlib
import random
import zipfile

import pytest
from lxml import etree

from scenarios.field_row.partners.build import build
from scenarios.field_row.partners.conveyor import Conveyor
from scenarios.field_row.partners.drivetrain import Drivetrain
from scenarios.field_row.partners.planting_partner import Partner
from scenarios.field_row.partners.soil import Soil
from scenarios.field_row.system import ROW, load_system

PARTNERS = (Drivetrain, Conveyor, Soil)
DRAWS = 60


def drawn(kind: type[Partner], chance: random.Random) -> dict[str, float | int | bool]:
    """Inputs and parameters in the neighbourhood of their starts, such that every formula is in force."""
    values: dict[str, float | int | bool] = {}
    for variable in kind.variables:
        if variable.kind == "output":
            continue
        start = variable.start
        if type(start) is bool:
            values[variable.name] = chance.random() < 0.5
        elif type(start) is int:
            values[variable.name] = chance.randint(1, 20)
        else:
            values[variable.name] = start * chance.uniform(0.7, 1.3) if start else chance.uniform(-1.0, 1.0)
    return values | ({"ground.y": -0.5} if kind is Soil else {})  # in the soil


def started(kind: type[Partner], values: dict[str, float | int | bool]) -> Partner:
    partner = kind(instance_name="one")
    partner.setup_experiment(0.4)  # while the machine gains speed
    partner.value |= values
    partner.enter_initialization_mode()
    partner.exit_initialization_mode()
    return partner


def outputs(partner: Partner) -> dict[str, float | int | bool]:
    return {v.name: partner.value[v.name] for v in partner.variables if v.kind == "output"}


@pytest.mark.parametrize("kind", PARTNERS)
def test_initial_values_depend_on_what_is_declared(kind):
    """Each known changed alone: the outputs that follow are those declared, no less and no more."""
    chance, found = random.Random(5), set()
    for _ in range(DRAWS):
        values = drawn(kind, chance)
        before = outputs(started(kind, values))
        for name, value in values.items():
            changed = not value if type(value) is bool else value + (1 if type(value) is int else 0.05 * value)
            if name == "speed.headland":
                changed = 0.1  # in the past
            after = outputs(started(kind, values | {name: changed}))
            found |= {(output, name) for output, was in before.items() if after[output] != was}
    assert found == {(output, name) for output, names in kind.initially.items() for name in names}


@pytest.mark.parametrize("kind", PARTNERS)
def test_no_output_depends_on_an_input_at_a_communication_point(kind):
    """Between steps, inputs are set and outputs stay."""
    partner = started(kind, {})
    for step in range(100):
        partner.value |= {name: value for name, value in drawn(kind, random.Random(step)).items()
                          if name in {v.name for v in kind.variables if v.kind == "input"}}  # fmt: skip
        partner.do_step(0.4 + 0.01 * step, 0.01)
        before = outputs(partner)
        for variable in kind.variables:
            if variable.kind == "input":
                setter = next(v for v in partner.vars.values() if v.name == variable.name).setter
                setter(not variable.start if type(variable.start) is bool else 0.123 * step)
        assert {name: next(v for v in partner.vars.values() if v.name == name).getter() for name in before} == before


def declared(fmu, element: str) -> dict[str, list[str] | None]:
    """{output: what it depends on} of <Outputs> or <InitialUnknowns>; None where nothing is said: on all."""
    with zipfile.ZipFile(fmu) as archive:
        root = etree.fromstring(archive.read("modelDescription.xml"))
    names = [variable.get("name") for variable in root.iter("ScalarVariable")]
    found = {}
    for unknown in root.iterfind(f"ModelStructure/{element}/Unknown"):
        known = unknown.get("dependencies")
        found[names[int(unknown.get("index")) - 1]] = (
            None if known is None else [names[int(index) - 1] for index in known.split()]
        )
    return found


@pytest.mark.parametrize("element", ["Outputs", "InitialUnknowns"])
def test_the_row_has_no_algebraic_loop(element, fmu_files):
    """Neither in a step nor in initialization: a host that sorts by dependencies finds an order."""
    build()
    system = load_system(ROW)
    graph: dict[tuple[str, str], set[tuple[str, str]]] = {}
    for component in system.components:
        for output, known in declared(component.fmu, element).items():
            assert known is not None, f"{component.name}.{output}: on all, for nothing is declared"
            graph[component.name, output] = {(component.name, name) for name in known if name != output}
    for target, source in system.connections.items():
        graph.setdefault((target.component, target.variable), set()).add((source.component, source.variable))
    order = list(graphlib.TopologicalSorter(graph).static_order())
    assert set(graph) <= set(order)
