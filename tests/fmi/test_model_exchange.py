"""Model Exchange in both versions: outputs follow the inputs without lag, the host integrates machine.s."""

from __future__ import annotations

import math
from ctypes import byref, c_bool, c_double, c_int32, c_size_t

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model, fmi2EventInfo
from fmpy.fmi3 import FMU3Model

from fmu_src.interface import load_interface
from fmu_src.oracle.tables import rows
from fmu_src.twin.linkage import Geometry, solve
from tests.conftest import BOTH_VERSIONS
from tests.harness.host import DISCARD, ERROR, MACHINE_SPEED, OK, PLANTING_SPEED, Instance, bits
from tests.harness.life import OPEN, OPEN_ANGLE

pytestmark = BOTH_VERSIONS

INPUTS = {"crank.phi": 1.3, "crank.w": 5.0, "crank.a": -20.0, "machine.v": 0.4, "tip.fx": 20.0, "tip.fy": -70.0}
COMPUTED = [variable.name for variable in load_interface().unknowns]
FMI3 = {"fmi2GetDerivatives": "fmi3GetContinuousStateDerivatives"}  # all others have the same name


def call(instance: Instance, function: str, *arguments) -> int:
    """A function of Model Exchange, by its name in FMI 2.0."""
    if instance.fmu.description.fmiVersion.startswith("3"):
        function = FMI3.get(function, function.replace("fmi2", "fmi3"))
    return instance.call(function, *arguments)


def demand(instance: Instance, function: str, *arguments) -> None:
    instance.demand(call(instance, function, *arguments), function)


def update_discrete_states(instance: Instance) -> list[float]:
    """All that it tells, as numbers."""
    if instance.fmu.description.fmiVersion.startswith("3"):
        told = [*(c_bool(True) for _ in range(5)), c_double(1.0)]
        demand(instance, "fmi3UpdateDiscreteStates", *map(byref, told))
        return [value.value for value in told]
    told = fmi2EventInfo(*[1] * len(fmi2EventInfo._fields_))
    demand(instance, "fmi2NewDiscreteStates", byref(told))
    return [getattr(told, name) for name, _ in fmi2EventInfo._fields_]


def number(instance: Instance, function: str) -> float:
    """The one continuous state, its derivative or its nominal value."""
    value = c_double(math.nan)
    demand(instance, function, byref(value), 1)
    return value.value


def set_state(instance: Instance, travel: float) -> int:
    return call(instance, "fmi2SetContinuousStates", byref(c_double(travel)), 1)


def exchanging(new, start: dict[str, float | bool] | None = None) -> Instance:
    """In continuous-time mode."""
    instance = new(model_exchange=True).initialize(start or {})
    assert update_discrete_states(instance) == [0] * 6
    demand(instance, "fmi2EnterContinuousTimeMode")
    return instance


# ---- outputs -------------------------------------------------------------------------------------


def test_the_bits_of_co_simulation_without_lag(new):
    """Where the same inputs are given: all outputs and the state's derivative to the last bit."""
    instance, initializing = exchanging(new), new().setup().enter()
    at_end = new().initialize({"crank.at_step_end": True, "crank.w": 1.0, "crank.a": 1.0})
    for i, row in enumerate(rows("nominal")[::10]):
        inputs = INPUTS | {"crank.phi": row.phi, "crank.w": 1.0 + i, "machine.v": 0.1 * i}
        travelled = 0.25 * i
        found = bits(instance.set(inputs).get(*COMPUTED)) if set_state(instance, travelled) == OK else []
        assert found == bits(initializing.set(inputs | {"machine.s": travelled}).get(*COMPUTED))
        at_end.step(float(i), 1.0, inputs)
        names = ["tip.x", "tip.y", "tip.vx", "tip.vy", "crank.tau", "tip.angle", "assembly.margin", "ground.y"]
        assert bits(instance.get(*names)) == bits(at_end.get(*names))


def test_outputs_follow_in_event_mode_and_in_continuous_time(new):
    instance, fresh = new(model_exchange=True).initialize(), new().setup().enter()
    for mode in ("fmi2EnterContinuousTimeMode", "fmi2EnterEventMode", "fmi2EnterContinuousTimeMode"):
        for angle in (0.1, 3.0, -20.0):
            values = INPUTS | {"crank.phi": angle}
            assert bits(instance.set(values).outputs()) == bits(fresh.set(values).outputs())
        demand(instance, mode)


def test_rates_are_those_set(new):
    """From crank.w and crank.a alone: 0 is 0, whatever the angle does."""
    instance = exchanging(new)
    for angle in (0.0, 1.0, 2.0):
        assert instance.set({"crank.phi": angle}).get("tip.vx", "tip.vy", "tip.ax", "tip.ay") == [0.0] * 4
    instance.set({"crank.a": 3.0})
    assert instance.get("tip.vx") == [0.0] and instance.get("tip.ax")[0] != 0.0
    instance.set({"crank.w": -2.0, "crank.a": 0.0})
    slope = instance.sensitivity(["tip.x"], {"crank.phi": -2.0})
    assert instance.get("tip.vx") == slope


def test_parameters_and_starts(new):
    instance = exchanging(new, {"geometry.L1": 0.051, "machine.s": 4.0, "crank.phi": 1.0})
    tip = solve(Geometry(L1=0.051), 1.0, 0).tip[0]
    assert instance.get("tip.x")[0] == pytest.approx(tip.real, abs=1e-15)
    assert instance.get("machine.s", "ground.x") == [4.0, 4.0 + instance.get("tip.x")[0]]
    assert number(instance, "fmi2GetContinuousStates") == 4.0
    assert instance.try_set({"geometry.L1": 0.05}) == ERROR


def test_an_unreachable_pose_is_a_discard(new):
    """A solver that tried too far tries nearer; nothing else is lost meanwhile."""
    instance = exchanging(new, OPEN | {"crank.phi": 1.0})
    before = bits(instance.outputs())
    for name in ("tip.x", "tip.vy", "crank.tau", "assembly.margin"):
        assert instance.set({"crank.phi": OPEN_ANGLE}).try_get([name])[0] == DISCARD
        assert "ABD" in instance.last_message.text and instance.last_message.category == "logStatusDiscard"
    assert instance.get("machine.s", "der(machine.s)", "crank.phi") == [0.0, 0.0, OPEN_ANGLE]
    assert number(instance, "fmi2GetDerivatives") == 0.0, "the travel needs no pose"
    assert bits(instance.set({"crank.phi": 1.0}).outputs()) == before


def test_no_start_from_an_unreachable_pose(new):
    instance = new(model_exchange=True).setup().enter().set(OPEN | {"crank.phi": OPEN_ANGLE})
    assert instance.call("fmi2ExitInitializationMode") == ERROR and "ABD" in instance.last_message.text
    instance.set({"crank.phi": 1.0}).exit()


# ---- the state and its derivative ----------------------------------------------------------------


def test_the_state_and_its_derivative(new):
    instance = exchanging(new)
    for travel, speed in ((0.0, 0.4), (3.5, -0.1), (-1e6, 0.0)):
        assert set_state(instance, travel) == OK
        instance.set({"machine.v": speed})
        assert number(instance, "fmi2GetContinuousStates") == travel == instance.get("machine.s")[0]
        assert number(instance, "fmi2GetDerivatives") == speed == instance.get("der(machine.s)")[0]
        x, ground = instance.get("tip.x", "ground.x")
        assert ground == travel + x
    assert number(instance, "fmi2GetNominalsOfContinuousStates") > 0.0
    assert call(instance, "fmi2GetEventIndicators", None, 0) == OK


def test_the_state_set_like_any_variable(new):
    """By fmi2SetReal or fmi3SetFloat64, alone and among inputs (FMI 2.0.4, section 3.2.3, note 5; FMI 3.0.2, 3.2.1)."""
    instance, other = exchanging(new), exchanging(new)
    for travel, speed in ((0.5, 0.4), (3.5, -0.1), (-1e6, 0.0)):
        assert set_state(other.set(INPUTS | {"machine.v": speed}), travel) == OK
        instance.set(INPUTS | {"machine.v": speed, "machine.s": travel})
        assert number(instance, "fmi2GetContinuousStates") == travel
        assert bits(instance.get(*COMPUTED)) == bits(other.get(*COMPUTED))
        assert instance.set({"machine.s": 2 * travel}).get("machine.s") == [2 * travel]
        assert number(instance, "fmi2GetDerivatives") == speed
    state = instance.save()
    assert instance.set({"machine.s": 9.0}).restore(state).get("machine.s") == [-2e6]


@pytest.mark.parametrize("travel", [math.nan, -math.inf, 1e61])
def test_a_state_that_is_no_number_set_like_any_variable(new, travel):
    instance = exchanging(new)
    before = instance.serialize()
    assert instance.try_set({"crank.phi": 1.0, "machine.s": travel}) == ERROR
    assert "machine.s" in instance.last_message.text and instance.serialize() == before


def test_the_state_in_event_mode(new, version):
    """FMI 3.0.2, section 2.3.5, lets it be set there; FMI 2.0.4, section 3.2.3, note 4, does not."""
    instance = new(model_exchange=True).initialize({"machine.s": 1.0})
    before = instance.serialize()
    assert instance.try_set({"crank.phi": 2.0, "machine.s": 4.0}) == (ERROR if version == 2 else OK)
    if version == 2:
        assert "machine.s" in instance.last_message.text and "event mode" in instance.last_message.text
        assert instance.serialize() == before
    else:
        assert number(instance, "fmi2GetContinuousStates") == 4.0
        assert instance.get("ground.x")[0] == 4.0 + instance.get("tip.x")[0]
    demand(instance, "fmi2EnterContinuousTimeMode")
    instance.set({"machine.s": 5.0})
    demand(instance, "fmi2EnterEventMode")
    assert instance.get("machine.s", "crank.phi") == [5.0, 0.0 if version == 2 else 2.0]


def test_no_state_is_set_in_co_simulation(new):
    instance = new().initialize({"machine.s": 1.0})
    before = instance.serialize()
    assert instance.try_set({"machine.s": 2.0}) == ERROR and instance.serialize() == before
    assert "machine.s" in instance.last_message.text and "in Model Exchange only" in instance.last_message.text


def test_time_is_the_hosts(new):
    instance = new(model_exchange=True).initialize(start=2.0, stop=5.0)
    assert instance.get("time") == [2.0]
    demand(instance, "fmi2EnterContinuousTimeMode")
    before = bits(instance.outputs())
    for time in (2.5, 2.25, 4.0, 5.01):  # back as well, and a little beyond the end: solvers look ahead
        demand(instance, "fmi2SetTime", time)
        assert instance.get("time") == [time]
    assert bits(instance.outputs()) == before, "nothing depends on the time itself"


def test_a_solver_that_interpolates_looks_beyond_the_stop_time(fmu_files, version, monkeypatch):
    """Why time beyond it is not refused: FMPy's CVode tells the stop time, steps over it and comes back."""
    model, asked = {2: FMU2Model, 3: FMU3Model}[version], []
    set_time = model.setTime
    monkeypatch.setattr(model, "setTime", lambda self, time: asked.append(time) or set_time(self, time))
    file = str(fmu_files[version])
    result = fmpy.simulate_fmu(file, fmi_type="ModelExchange", solver="CVode", stop_time=1.0, output_interval=0.01)
    assert result["time"][-1] == pytest.approx(1.0) and max(asked) > 1.0 + 1e-3


def test_completed_integrator_step_asks_for_nothing(new):
    instance = exchanging(new)
    flag = c_bool if instance.fmu.description.fmiVersion.startswith("3") else c_int32
    told = [flag(1), flag(1)]
    demand(instance, "fmi2CompletedIntegratorStep", True, byref(told[0]), byref(told[1]))
    assert [value.value for value in told] == [0, 0]


def test_numbers_of_states_and_indicators(new):
    """Those of modelDescription.xml; FMI 3.0 has functions for them as well."""
    instance = exchanging(new)
    description = instance.fmu.description
    assert (description.numberOfContinuousStates, description.numberOfEventIndicators) == (1, 0)
    assert [unknown.variable.name for unknown in description.derivatives] == ["der(machine.s)"]
    assert description.derivatives[0].variable.derivative.name == "machine.s"
    if description.fmiVersion.startswith("3"):
        for function, expected in (("fmi3GetNumberOfContinuousStates", 1), ("fmi3GetNumberOfEventIndicators", 0)):
            count = c_size_t(99)
            demand(instance, function, byref(count))
            assert count.value == expected


@pytest.mark.parametrize("travel", [math.nan, math.inf, 1e61])
def test_a_state_that_is_no_number(new, travel):
    instance = exchanging(new)
    before = instance.serialize()
    assert set_state(instance, travel) == ERROR and "machine.s" in instance.last_message.text
    assert instance.serialize() == before


@pytest.mark.parametrize("time", [math.nan, -math.inf])
def test_a_time_that_is_no_number(new, time):
    instance = exchanging(new)
    before = instance.serialize()
    assert call(instance, "fmi2SetTime", time) == ERROR and "time" in instance.last_message.text
    assert instance.serialize() == before


VECTORS = ["SetContinuousStates", "GetContinuousStates", "GetDerivatives", "GetNominalsOfContinuousStates"]


@pytest.mark.parametrize("count", [0, 2, 1000])
@pytest.mark.parametrize("function", VECTORS)
def test_vectors_of_another_length(new, function, count):
    instance = exchanging(new)
    before, values = instance.serialize(), (c_double * 1000)()
    assert call(instance, f"fmi2{function}", values, count) == ERROR
    assert "one continuous state" in instance.last_message.text
    assert instance.serialize() == before and not any(values)


def test_event_indicators_that_are_not_there(new):
    instance, values = exchanging(new), (c_double * 3)()
    assert call(instance, "fmi2GetEventIndicators", values, 3) == ERROR
    assert "no event indicators" in instance.last_message.text


@pytest.mark.parametrize("function", VECTORS)
def test_null_for_a_vector(new, function):
    instance = exchanging(new)
    assert call(instance, f"fmi2{function}", None, 1) == ERROR and "NULL" in instance.last_message.text


def test_null_for_what_is_told(new):
    instance = new(model_exchange=True).initialize()
    assert call(instance, "fmi2NewDiscreteStates" if instance.has_input_derivatives else "fmi3UpdateDiscreteStates",
                *[None] * (1 if instance.has_input_derivatives else 6)) == ERROR  # fmt: skip
    demand(instance, "fmi2EnterContinuousTimeMode")
    assert call(instance, "fmi2CompletedIntegratorStep", True, None, None) == ERROR
    assert all("NULL" in message.text for message in instance.messages)


# ---- derivatives, state --------------------------------------------------------------------------


@pytest.mark.parametrize("known", ["machine.s", "machine.v", "crank.phi"])
def test_directional_derivatives(new, known):
    """By inputs and by the state, of outputs and of the state's derivative."""
    instance = exchanging(new).set(INPUTS)
    found = dict(zip(COMPUTED, instance.sensitivity(COMPUTED, {known: 2.0}), strict=True))
    ones = {"machine.s": {"machine.s", "ground.x"}, "machine.v": {"der(machine.s)", "ground.vx"}}
    if known in ones:
        assert {name for name, value in found.items() if value} == ones[known]
        assert {found[name] for name in ones[known]} == {2.0}
    else:
        assert found["tip.x"] == pytest.approx(2 * instance.get("tip.vx")[0] / INPUTS["crank.w"], rel=1e-14)
    assert instance.try_sensitivity(["tip.x"], {"geometry.L1": 1.0})[0] == ERROR


def test_states_bring_back_everything(new):
    instance = exchanging(new, {"geometry.L1": 0.0501}).set(INPUTS)
    assert set_state(instance, 7.0) == OK
    demand(instance, "fmi2SetTime", 3.0)
    expected, state = bits(instance.get("time", *COMPUTED)), instance.save()
    instance.set({"crank.phi": 0.0, "machine.v": 0.0})
    assert set_state(instance, 0.0) == OK
    assert bits(instance.restore(state).get("time", *COMPUTED)) == expected
    other = new(model_exchange=True).deserialize(instance.serialize(state))
    assert bits(other.get("time", *COMPUTED)) == expected
    assert set_state(other, 8.0) == OK, "in continuous-time mode as well"


def test_a_state_of_the_other_interface_type_is_refused(new):
    instance, other = new().initialize(), exchanging(new)
    status, state = other.try_deserialize(instance.serialize())
    before = other.serialize()
    assert status == OK and other.call("fmi2SetFMUstate", state) == ERROR
    assert "other interface type" in other.last_message.text and other.serialize() == before


@pytest.mark.parametrize(
    "function", ["fmi2GetContinuousStates", "fmi2GetDerivatives", "fmi2SetTime", "fmi2EnterEventMode"]
)
def test_not_in_co_simulation(new, function):
    instance = new().initialize()
    before = instance.serialize()
    arguments = {"fmi2SetTime": (1.0,), "fmi2EnterEventMode": ()}.get(function, (byref(c_double()), 1))
    assert call(instance, function, *arguments) == ERROR and instance.serialize() == before


def test_no_steps_in_model_exchange(new):
    for instance in (new(model_exchange=True).initialize(), exchanging(new)):
        assert instance.try_step(0.0, 0.1) == ERROR and "in Model Exchange" in instance.last_message.text


# ---- through fmpy --------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["Euler", "CVode"])
def test_one_turn_in_fmpy(fmu_files, version, solver):
    """As a tool of Model Exchange runs it: the tip exact, the travel as the solver integrates it."""
    turn = 2 * math.pi / PLANTING_SPEED
    names = ("time", "crank.phi", "crank.w", "machine.v")
    table = [(t, PLANTING_SPEED * t, PLANTING_SPEED, MACHINE_SPEED) for t in (0.0, turn)]
    result = fmpy.simulate_fmu(
        str(fmu_files[version]), fmi_type="ModelExchange", solver=solver, stop_time=turn, output_interval=1e-2,
        input=np.array(table, dtype=[(name, float) for name in names]),
        output=["tip.x", "tip.vx", "tip.ax", "ground.x", "machine.s"], validate=True,
    )  # fmt: skip
    exact = solve(Geometry(), PLANTING_SPEED * result["time"], 2)
    for n, name in enumerate(("tip.x", "tip.vx", "tip.ax")):
        assert np.abs(result[name] - exact.tip[n].real * PLANTING_SPEED**n).max() <= (2e-15, 2e-14, 1e-12)[n]
    assert np.abs(result["machine.s"] - MACHINE_SPEED * result["time"]).max() <= 1e-6
    assert np.abs(result["ground.x"] - result["tip.x"] - result["machine.s"]).max() <= 1e-15
