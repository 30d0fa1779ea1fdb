"""Each capability flag of modelDescription.xml keeps what it says (FMI 2.0.4, sections 2.2.1, 3.3.1 and 4.3.1; FMI 3.0,
the description schemas of chapters 2, 3 and 4).

One check for each flag: a flag newly declared fails here until it has one. Finer tests are in the files named.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from ctypes import byref, c_int32

import pytest
from lxml import etree

from fmu_src.exporter.model_description import FMI3, NATIVE, model_description_xml
from fmu_src.interface import load_interface
from tests.harness.drive import angle_only, distances, drive, exact_tip, one_derivative, uneven
from tests.harness.host import ERROR, OK, PENDING, Instance, bits
from tests.harness.life import BEGINNING, END, begin, tell

EDITIONS = {2: NATIVE, 3: FMI3}
DECLARED = [
    (version, element.tag, name, value)
    for version, edition in EDITIONS.items()
    for element in etree.fromstring(model_description_xml(load_interface(), edition))
    if element.tag in ("CoSimulation", "ModelExchange", "ScheduledExecution")
    for name, value in element.items()
    if name != "modelIdentifier"
]
# True by default of the schema would be news; these are false where nothing is said.
FALSE_UNLESS_DECLARED = (
    "needsExecutionTool", "canRunAsynchronuously", "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions", "needsCompletedIntegratorStep", "providesEvaluateDiscreteStates",
    "providesPerElementDependencies", "mightReturnEarlyFromDoStep", "fixedInternalStepSize",
    "recommendedIntermediateInputSmoothness",
)  # fmt: skip


def variable_steps(new: Callable, value: str) -> None:
    """Steps that double and halve: the tip stays where it belongs. More in test_coupling.py."""
    times = [0.0]
    for i in range(60):
        times.append(times[-1] + 1e-3 * 2 ** (i % 3))
    off = distances(drive(new().initialize(), uneven(), times, angle_only), exact_tip(uneven(), times[1:]))
    assert value == "true" and off[5:].max() < 1e-6


def interpolates_inputs(new: Callable, value: str) -> None:
    """Input derivatives of order 1 and 2 change where the step ends. More in test_coupling.py."""
    held, carried = new().initialize().step(0.0, 0.01), new().initialize()
    carried.set_derivatives({("crank.phi", 1): 2.0, ("crank.phi", 2): 3.0}).step(0.0, 0.01)
    reached = new().initialize({"crank.phi": 2.0 * 0.01 + 3.0 * 0.01**2 / 2})
    assert value == "true" and carried.get("tip.x") != held.get("tip.x")
    assert carried.get("tip.x") == pytest.approx(reached.get("tip.x"), abs=1e-15)
    times = [i * 1e-3 for i in range(10)]
    found = drive(new().initialize(), uneven(), times, one_derivative)
    assert distances(found, exact_tip(uneven(), times[1:])).max() < 2e-6


def output_derivatives(new: Callable, value: str) -> None:
    """Every order up to the one declared, none above. More in test_output_derivatives.py."""
    instance = begin(new())
    tell(instance, 0, 6)
    for name in instance.fmu.names("output"):
        for order in range(1, int(value) + 1):
            status, (found,) = instance.try_get_derivatives((name, order))
            assert status == OK and math.isfinite(found)
        assert instance.try_get_derivatives((name, int(value) + 1))[0] == ERROR


def gets_and_sets_states(new: Callable, value: str) -> None:
    """More in test_state.py."""
    instance = begin(new())
    told = tell_any(instance, 0, BEGINNING)
    state = instance.save()
    expected = tell_any(instance, BEGINNING, END)
    assert value == "true" and told and tell_any(instance.restore(state), BEGINNING, END) == expected


def serializes_states(new: Callable, value: str) -> None:
    """More in test_state.py, in another process too."""
    instance = begin(new())
    tell_any(instance, 0, BEGINNING)
    serialized = instance.serialize()
    expected = tell_any(instance, BEGINNING, END)
    assert value == "true" and tell_any(new().deserialize(serialized), BEGINNING, END) == expected


def provides_directional_derivatives(new: Callable, value: str) -> None:
    """More in test_directional_derivatives.py and test_geometry_gradients.py."""
    instance = new().initialize({"crank.phi": 1.0, "crank.w": 3.0})
    vx, by_angle = instance.get("tip.vx")[0], instance.sensitivity(["tip.x"], {"crank.phi": 3.0})[0]
    assert value == "true" and by_angle == pytest.approx(vx, rel=1e-14)


def provides_adjoint_derivatives(new: Callable, value: str) -> None:
    """More in test_geometry_gradients.py."""
    instance = new().initialize({"crank.phi": 1.0, "crank.w": 3.0})
    vx, by_angle = instance.get("tip.vx")[0], instance.adjoint({"tip.x": 3.0}, ["crank.phi"])[0]
    assert value == "true" and by_angle == pytest.approx(vx, rel=1e-14)


def needs_no_completed_integrator_step(new: Callable, value: str) -> None:
    """The same outputs with and without the call."""
    told = []
    for is_called in (False, True):
        instance = new().initialize()
        assert instance.call("fmi2EnterContinuousTimeMode") == OK
        for i in range(5):
            if is_called:
                flags = [c_int32(), c_int32()]
                assert instance.call("fmi2CompletedIntegratorStep", True, *map(byref, flags)) == OK
            told.append(bits(instance.set({"crank.phi": 0.1 * i, "crank.w": 2.0}).outputs()))
    assert value == "true" and told[:5] == told[5:]


def provides_intermediate_updates(new: Callable, value: str) -> None:
    """Inputs given there count. More in test_fmi3_steps.py, as for the next two."""

    def give(instance: Instance, time: float, set_requested: bool, *_) -> None:
        if set_requested:
            instance.set({"crank.phi": 2.0})

    reached = new().initialize({"crank.phi": 2.0}).get("tip.x")
    instance = new(intermediate=give, required=["crank.phi"]).initialize()
    assert value == "true" and instance.step(0.0, 0.1).get("tip.x") == reached


def returns_early(new: Callable, value: str) -> None:
    instance = new(early_return=True, intermediate=lambda i, t, *_: 0.04 if t == 0.0 else None).initialize()
    assert value == "true" and instance.do_step(0.0, 0.1) == (OK, False, False, True, 0.04)


def has_event_mode(new: Callable, value: str) -> None:
    reached = new().initialize({"crank.phi": 2.0}).get("tip.x")
    instance = new(event_mode=True).initialize().to("Step").step(0.0, 0.1).to("Event")
    assert value == "true" and instance.set({"crank.phi": 2.0}).get("tip.x") == reached


def tell_any(instance: Instance, first: int, last: int) -> list[str]:
    """A story: of steps, or in Model Exchange of inputs."""
    if instance.model_exchange:
        return [
            bit
            for i in range(first, last)
            for bit in bits(instance.set({"crank.phi": 0.05 * i, "crank.w": 5 + 0.1 * i, "tip.fy": -i}).outputs())
        ]
    return tell(instance, first, last)


CHECKS: dict[str, Callable[[Callable, str], None]] = {
    "canHandleVariableCommunicationStepSize": variable_steps,
    "canInterpolateInputs": interpolates_inputs,
    "maxOutputDerivativeOrder": output_derivatives,
    "canGetAndSetFMUstate": gets_and_sets_states,
    "canGetAndSetFMUState": gets_and_sets_states,
    "canSerializeFMUstate": serializes_states,
    "canSerializeFMUState": serializes_states,
    "providesDirectionalDerivative": provides_directional_derivatives,
    "providesDirectionalDerivatives": provides_directional_derivatives,
    "providesAdjointDerivatives": provides_adjoint_derivatives,
    "completedIntegratorStepNotNeeded": needs_no_completed_integrator_step,
    "providesIntermediateUpdate": provides_intermediate_updates,
    "canReturnEarlyAfterIntermediateUpdate": returns_early,
    "hasEventMode": has_event_mode,
}


@pytest.mark.parametrize(("version", "type_", "flag", "value"), DECLARED)
def test_flag(new, version, type_, flag, value):
    assert flag in CHECKS, f"{flag} is declared, but nothing here tests what is behind it"
    options = {"model_exchange": True} if type_ == "ModelExchange" else {}
    CHECKS[flag](lambda **more: new(**options, **more), value)


def test_no_flag_is_missing():
    """What works is declared."""
    assert {flag for _, _, flag, _ in DECLARED} == set(CHECKS)
    assert {(version, type_) for version, type_, _, _ in DECLARED} == {
        (version, type_) for version in EDITIONS for type_ in ("CoSimulation", "ModelExchange")
    }


def test_flags_that_stay_false():
    """Several instances a process: test_instances.py. Memory of the host: test_memory.py. No tool behind it."""
    assert not set(FALSE_UNLESS_DECLARED) & {flag for _, _, flag, _ in DECLARED}


def test_steps_are_never_pending(new):
    """canRunAsynchronuously is false: a step is done when fmi2DoStep comes back, and cannot be cancelled."""
    instance = new().initialize()
    assert instance.try_step(0.0, 0.01) != PENDING
    assert instance.call("fmi2CancelStep") == ERROR
    assert instance.last_successful_time() == 0.01
