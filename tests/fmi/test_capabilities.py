"""Each capability flag of modelDescription.xml keeps what it says (FMI 2.0.4, sections 2.2.1 and 4.3.1).

One check for each flag: a flag newly declared fails here until it has one. Finer tests are in the files named.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from lxml import etree

from fmu_src.exporter.model_description import NATIVE, model_description_xml
from fmu_src.interface import load_interface
from tests.fmi.drive import angle_only, distances, drive, exact_tip, one_derivative, uneven
from tests.fmi.host import ERROR, OK, PENDING
from tests.fmi.life import BEGINNING, END, begin, tell

COSIMULATION = etree.fromstring(model_description_xml(load_interface(), NATIVE)).find("CoSimulation")
DECLARED = {name: value for name, value in COSIMULATION.items() if name != "modelIdentifier"}
# True by default of the schema would be news; these are false where nothing is said.
FALSE_UNLESS_DECLARED = (
    "needsExecutionTool", "canRunAsynchronuously", "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions",
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
    tell(instance, 0, BEGINNING)
    state = instance.save()
    expected = tell(instance, BEGINNING, END)
    assert value == "true" and tell(instance.restore(state), BEGINNING, END) == expected


def serializes_states(new: Callable, value: str) -> None:
    """More in test_state.py, in another process too."""
    instance = begin(new())
    tell(instance, 0, BEGINNING)
    serialized = instance.serialize()
    expected = tell(instance, BEGINNING, END)
    assert value == "true" and tell(new().deserialize(serialized), BEGINNING, END) == expected


def provides_directional_derivatives(new: Callable, value: str) -> None:
    """More in test_directional_derivatives.py."""
    instance = new().initialize({"crank.phi": 1.0, "crank.w": 3.0})
    vx, by_angle = instance.get("tip.vx")[0], instance.sensitivity(["tip.x"], {"crank.phi": 3.0})[0]
    assert value == "true" and by_angle == pytest.approx(vx, rel=1e-14)


CHECKS: dict[str, Callable[[Callable, str], None]] = {
    "canHandleVariableCommunicationStepSize": variable_steps,
    "canInterpolateInputs": interpolates_inputs,
    "maxOutputDerivativeOrder": output_derivatives,
    "canGetAndSetFMUstate": gets_and_sets_states,
    "canSerializeFMUstate": serializes_states,
    "providesDirectionalDerivative": provides_directional_derivatives,
}


@pytest.mark.parametrize("flag", DECLARED)
def test_flag(new, flag):
    assert flag in CHECKS, f"{flag} is declared, but nothing here tests what is behind it"
    CHECKS[flag](new, DECLARED[flag])


def test_no_flag_is_missing():
    """What works is declared."""
    assert set(DECLARED) == set(CHECKS)


def test_flags_that_stay_false():
    """Several instances a process: test_instances.py. Memory of the host: test_memory.py. No tool behind it."""
    assert not set(FALSE_UNLESS_DECLARED) & set(DECLARED)


def test_steps_are_never_pending(new):
    """canRunAsynchronuously is false: a step is done when fmi2DoStep comes back, and cannot be cancelled."""
    instance = new().initialize()
    assert instance.try_step(0.0, 0.01) not in (PENDING,)
    assert instance.call("fmi2CancelStep") == ERROR
    assert instance.last_successful_time() == 0.01
