"""fmi2GetDirectionalDerivative (FMI 2.0.4, section 2.1.9): every output by every input."""

from __future__ import annotations

import math

import pytest
from mpmath import mp, mpf

from fmu_src.interface import load_interface
from fmu_src.oracle.oracle import error
from fmu_src.oracle.tables import rows
from tests.conftest import BOTH_VERSIONS
from tests.harness.host import ERROR, PLANTING_SPEED, bits

pytestmark = BOTH_VERSIONS

INPUTS = [variable.name for variable in load_interface().of_kind("input")]
OUTPUTS = [variable.name for variable in load_interface().of_kind("output")]
COUNT = len(load_interface().variables)
POINTS = [
    {"crank.phi": 0.7, "crank.w": 6.8, "crank.a": -12.0, "machine.v": 0.43, "tip.fx": 15.0, "tip.fy": -80.0},
    {"crank.phi": 2.6, "crank.w": -3.0, "crank.a": 40.0, "machine.v": -0.2, "tip.fx": -35.0, "tip.fy": 60.0},
    {"crank.phi": -14.0, "crank.w": 0.0, "crank.a": 0.0, "machine.v": 0.0, "tip.fx": 0.0, "tip.fy": 0.0},
]
SIXTH_ORDER = {-3: -1 / 60, -2: 3 / 20, -1: -3 / 4, 1: 3 / 4, 2: -3 / 20, 3: 1 / 60}


@pytest.mark.parametrize("point", POINTS, ids=lambda point: f"phi={point['crank.phi']}")
@pytest.mark.parametrize("name", INPUTS)
def test_against_differences_of_the_outputs(new, name, point):
    """Central differences of sixth order, in initialization mode."""
    instance, apart = new().setup().enter(), 2e-3
    differences = [0.0] * len(OUTPUTS)
    for k, weight in SIXTH_ORDER.items():
        instance.set(point | {name: point[name] + k * apart})
        differences = [
            sum_ + weight * value / apart for sum_, value in zip(differences, instance.outputs(), strict=True)
        ]
    found = instance.set(point).sensitivity(OUTPUTS, {name: 1.0})
    for output, value, difference in zip(OUTPUTS, found, differences, strict=True):
        assert value == pytest.approx(difference, rel=1e-9, abs=1e-9), output


@pytest.mark.parametrize("row", rows("nominal")[::20], ids=str)
def test_against_the_reference(new, row):
    """By the crank angle: the next derivative of each output, exact to rounding."""
    instance = new().initialize({"crank.phi": row.phi, "crank.w": PLANTING_SPEED, "tip.fy": 1.0})
    found = instance.sensitivity(["tip.y", "tip.vy", "tip.ay", "crank.tau"], {"crank.phi": 1.0})
    with mp.workdps(30):
        w = mpf(PLANTING_SPEED)
        exact = [row.exact[1][1], row.exact[2][1] * w, row.exact[3][1] * w**2, -row.exact[2][1]]
    bounds = (1e-14, 2e-13, 4e-12, 1e-14)
    for value, right, bound in zip(found, exact, bounds, strict=True):
        assert error(value, right) <= bound


@pytest.mark.parametrize("point", POINTS, ids=lambda point: f"phi={point['crank.phi']}")
def test_seeds_add_up(new, point):
    """Along a direction: the sum of the columns, each with its share; doubled seeds double it."""
    instance = new().setup().enter().set(point)
    seed = dict(zip(INPUTS, (2.0, -3.0, 0.5, 4.0, -1.0, 8.0), strict=True))
    columns = [instance.sensitivity(OUTPUTS, {name: share}) for name, share in seed.items()]
    expected = [sum(column[i] for column in columns) for i in range(len(OUTPUTS))]
    found = instance.sensitivity(OUTPUTS, seed)
    assert found == pytest.approx(expected, rel=1e-14, abs=1e-14)
    assert instance.sensitivity(OUTPUTS, {name: 2 * share for name, share in seed.items()}) == [2 * f for f in found]
    assert instance.sensitivity(OUTPUTS, dict.fromkeys(INPUTS, 0.0)) == [0.0] * len(OUTPUTS)
    assert instance.sensitivity(OUTPUTS, {}) == [0.0] * len(OUTPUTS)
    assert instance.sensitivity([], seed) == []


@pytest.mark.parametrize("share", [math.nan, math.inf, -1e200])
def test_a_seed_that_is_no_number_is_refused(new, share):
    instance = new().setup().enter().set(POINTS[0])
    with pytest.raises(AssertionError, match=r"crank\.w = .*finite"):
        instance.sensitivity(OUTPUTS, {"crank.phi": 1.0, "crank.w": share})


def test_each_unknown_for_itself(new):
    """In any number and order the same bits."""
    instance = new().setup().enter().set(POINTS[0])
    together = instance.sensitivity(OUTPUTS, {"crank.phi": 1.0})
    apart = [instance.sensitivity([name], {"crank.phi": 1.0})[0] for name in OUTPUTS]
    backwards = instance.sensitivity(OUTPUTS[::-1], {"crank.phi": 1.0})[::-1]
    assert bits(together) == bits(apart) == bits(backwards)


def test_after_a_step_it_is_that_of_the_end(new):
    """At the instant that the outputs belong to, with the crank as it is there."""
    at_start = new().setup().enter().set(POINTS[0])
    stepped = new().initialize({**POINTS[0], "crank.at_step_end": True}).step(0.0, 0.01, POINTS[0])
    stepped.set(POINTS[1])  # for the step to come
    for name in INPUTS:
        assert stepped.sensitivity(OUTPUTS, {name: 1.0}) == at_start.sensitivity(OUTPUTS, {name: 1.0}), name


@pytest.mark.parametrize("name", ["crank.phi", "time", "geometry.L1", "crank.at_step_end", 0, COUNT + 1, 2**32 - 1])
def test_unknowns_are_outputs(new, name):
    instance = new().initialize()
    assert instance.try_sensitivity(["tip.x", name], {"crank.phi": 1.0})[0] == ERROR
    assert str(name) in instance.last_message.text


@pytest.mark.parametrize("mode", ["Initialization", "Event", "ContinuousTime", "Step", "Terminated"])
def test_nothing_depends_on_the_time_itself(new, mode, version):
    """The independent variable is a known in every mode (FMI 2.0.4, section 2.1.9; FMI 3.0.2, 2.4.8), of column 0."""
    prefix = f"fmi{version}"
    instance = new(model_exchange=mode in ("Event", "ContinuousTime")).setup().enter().set(POINTS[0])
    if mode != "Initialization":
        instance.exit()
    if mode == "ContinuousTime":
        instance.demand(instance.call(f"{prefix}EnterContinuousTimeMode"), mode)
    if mode in ("Step", "Terminated"):
        instance.step(0.0, 0.01)
    if mode == "Terminated":
        instance.demand(instance.call("fmi2Terminate"), mode)
    unknowns = [*OUTPUTS, "der(machine.s)"]
    assert instance.sensitivity(unknowns, {"time": 3.0}) == [0.0] * len(unknowns)
    others = {"crank.phi": 2.0, "machine.v": -1.0}
    assert bits(instance.sensitivity(unknowns, others | {"time": 5.0})) == bits(instance.sensitivity(unknowns, others))
    if version == 3:
        found = instance.adjoint(dict.fromkeys(unknowns, 1.0), ["time", "crank.phi"])
        assert found[0] == 0.0 != found[1]
    status, _ = instance.try_sensitivity(unknowns, {"time": math.nan})
    assert status == ERROR and "time = " in instance.last_message.text


@pytest.mark.parametrize("name", ["tip.x", "geometry.L1", "crank.at_step_end", 0, COUNT + 1, 2**32 - 1])
def test_knowns_are_inputs(new, name):
    instance = new().initialize()
    assert instance.try_sensitivity(["tip.x"], {"crank.phi": 1.0, name: 1.0})[0] == ERROR
    assert str(name) in instance.last_message.text
