"""Steps that end where a dyad cannot close: Discard, then Error; what the user is told; nothing changed.

FMI 2.0.4, sections 2.1.3 (status) and 4.2.2 (fmi2DoStep).
"""

from __future__ import annotations

import re
from ctypes import byref, c_int
from dataclasses import dataclass

import numpy as np
import pytest
from mpmath import mp, mpf

from fmu_src.interface import load_interface
from fmu_src.oracle.oracle import Oracle
from tests.harness.host import DISCARD, ERROR, OK, STEP_STATUS, TERMINATED, Instance, bits

NOMINAL = load_interface().geometry


@dataclass(frozen=True)
class Case:
    """A linkage that turns from `near`, where it closes, but not to `far`."""

    dyad: str
    base: str
    fault: str
    geometry: dict[str, float]
    near: float
    far: float


def base_length(base: str, phi: float, geometry: dict[str, float]) -> mpf:
    """AD or EG at any angle; EG only where ABD closes."""
    g = {name: mpf(value) for name, value in geometry.items()}
    if base == "AD":
        A = g["L1"] * mp.expj(g["phi1"] - phi)
        D = mp.mpc(g["XC"], g["YC"]) + g["L4"] * mp.expj(g["phi4"] - phi)
        return abs(D - A)
    pose = Oracle(NOMINAL).pose(phi)  # the same ABD, an EFG that closes everywhere
    return abs(pose.G - pose.E)


def make_case(dyad: str, fault: str) -> Case:
    """Half of the turn is out of reach: the bases between their middle and their longest or shortest."""
    base = {"ABD": "AD", "EFG": "EG"}[dyad]
    angles = np.arange(0, 2 * np.pi, 0.05)
    lengths = np.array([float(base_length(base, angle, NOMINAL)) for angle in angles])
    limit = (lengths.min() + lengths.max()) / 2
    if dyad == "ABD":
        changed = {"L2": limit / 2, "L3": limit / 2} if fault == "long" else {"L2": NOMINAL["L3"] + limit}
    else:
        changed = {"L7": limit - NOMINAL["L6"] if fault == "long" else limit + NOMINAL["L6"]}
    order = np.argsort(lengths)
    near, far = (order[3], order[-3]) if fault == "long" else (order[-3], order[3])
    return Case(dyad, base, fault, NOMINAL | changed, float(angles[near]), float(angles[far]))


CASES = [make_case(dyad, fault) for dyad in ("ABD", "EFG") for fault in ("long", "short")]
STEP = 0.01


@pytest.fixture(params=CASES, ids=lambda case: f"{case.dyad} {case.fault}")
def case(request) -> Case:
    return request.param


def started(new, case: Case, **options) -> Instance:
    """Three steps at rest, at an angle that closes."""
    instance = new(**options)
    instance.initialize({f"geometry.{k}": v for k, v in case.geometry.items()} | {"crank.phi": case.near})
    for i in range(3):
        instance.step(i * STEP, STEP, {"machine.v": 0.4 + i})
    return instance


def aim(instance: Instance, angle: float) -> None:
    """Inputs whose next step ends at this angle."""
    instance.set({"crank.phi": angle}).set_derivatives({("crank.phi", 1): 0.0})


# ---- what is said --------------------------------------------------------------------------------


def check_message(text: str, case: Case, angle: float) -> None:
    found = re.search(r"dyad (\w+) at crank\.phi = (\S+) rad, where distance (\w+) is (\S+) mm too (\w+)", text)
    assert found, text
    dyad, phi, base, miss, fault = found.groups()
    assert (dyad, base, fault) == (case.dyad, case.base, case.fault)
    assert float(phi) == angle
    first, second = ("L2", "L3") if dyad == "ABD" else ("L6", "L7")
    lengths = mpf(case.geometry[first]), mpf(case.geometry[second])
    reach = sum(lengths) if fault == "long" else abs(lengths[0] - lengths[1])
    expected = abs(base_length(base, angle, case.geometry) - reach) * 1000
    assert float(miss) == pytest.approx(float(expected), rel=1e-5), "six digits, for people"


def test_the_message_names_dyad_angle_and_gap(new, case):
    instance = started(new, case)
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    (message,) = instance.messages
    assert (message.status, message.category) == (DISCARD, "logStatusDiscard")
    check_message(message.text, case, case.far)


def test_reading_where_inputs_cannot_be_followed(new, case):
    """Before the first step outputs belong to the inputs as set: those of an open linkage are discarded."""
    instance = new().setup().enter()
    instance.set({f"geometry.{k}": v for k, v in case.geometry.items()} | {"crank.phi": case.far})
    before = instance.serialize()
    assert instance.try_get(["tip.x"])[0] == DISCARD
    check_message(instance.last_message.text, case, case.far)
    assert instance.call("fmi2ExitInitializationMode") == ERROR
    check_message(instance.last_message.text, case, case.far)
    assert instance.serialize() == before
    instance.set({"crank.phi": case.near}).exit().step(0.0, STEP)


def test_a_dead_point_exactly_is_no_pose(new):
    """Velocities are infinite there. A needle of a triangle, whose lengths are whole binary fractions."""
    instance = new().setup().enter()
    straight = dict.fromkeys(("L1", "L4", "phi1", "phi4", "YC"), 0.0) | {"XC": 0.25, "L2": 0.125, "L3": 0.125}
    instance.set({f"geometry.{name}": value for name, value in straight.items()})
    status, _ = instance.try_get(["tip.x"])
    assert status == DISCARD
    assert "dead point" in instance.last_message.text and "ABD" in instance.last_message.text


# ---- Discard, then Error -------------------------------------------------------------------------


def test_nothing_has_changed(new, case):
    """Outputs, time and all that follows are those of an instance that never tried."""
    refused, plain = started(new, case), started(new, case)
    for instance in (refused, plain):
        aim(instance, case.far)
    assert refused.try_step(3 * STEP, STEP) == DISCARD
    assert bits(refused.outputs()) == bits(plain.outputs())
    assert refused.last_successful_time() == plain.last_successful_time()
    for i in range(3, 8):
        for instance in (refused, plain):
            instance.step(i * STEP, STEP, {"crank.phi": case.near + 0.001 * i, "machine.v": 0.5})
        assert bits(refused.outputs()) == bits(plain.outputs())
        assert refused.serialize() == plain.serialize()


def test_the_host_can_ask_what_happened(new, case):
    """FMI 2.0.4, section 4.2.3: status, last successful time; the FMU does not ask for an end."""
    instance, value = started(new, case), c_int(-1)
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    assert instance.call("fmi2GetStatus", STEP_STATUS, byref(value)) == OK and value.value == DISCARD
    assert instance.last_successful_time() == 2 * STEP + STEP
    value.value = -1
    assert instance.call("fmi2GetBooleanStatus", TERMINATED, byref(value)) == OK and value.value == 0
    instance.set({"crank.phi": case.near}).step(3 * STEP, STEP)
    assert instance.call("fmi2GetStatus", STEP_STATUS, byref(value)) == OK and value.value == OK


def test_the_same_step_again_is_an_error(new, case):
    """Lest a host tries it for ever; and again, and again."""
    instance = started(new, case)
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    outputs, state = bits(instance.outputs()), instance.serialize()
    for _ in range(3):
        assert instance.try_step(3 * STEP, STEP) == ERROR
        message = instance.last_message
        check_message(message.text, case, case.far)
        assert "discarded before" in message.text and message.category == "logStatusError"
    assert bits(instance.outputs()) == outputs and instance.serialize() == state


def test_restoring_a_state_makes_no_loop_of_it(new, case):
    """A host that goes back to the state before the step and tries it again learns that it is of no use."""
    instance = started(new, case)
    state = instance.save()
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    instance.restore(state)
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == ERROR


def test_another_instance_knows_nothing_of_it(new, case):
    """Nor does the same one after fmi2Reset."""
    instance, other = started(new, case), started(new, case)
    for one in (instance, other):
        aim(one, case.far)
        assert one.try_step(3 * STEP, STEP) == DISCARD
    assert instance.call("fmi2Reset") == OK
    instance.initialize({f"geometry.{k}": v for k, v in case.geometry.items()} | {"crank.phi": case.near})
    for i in range(3):
        instance.step(i * STEP, STEP)
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD


def test_a_step_in_between_makes_it_a_first_time(new, case):
    instance = started(new, case)
    state = instance.save()
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    aim(instance, case.near)
    instance.step(3 * STEP, STEP)
    instance.restore(state)
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD


@pytest.mark.parametrize("after_error", [False, True])
def test_a_shorter_step_is_another_step(new, case, after_error):
    """The way out that hosts take: as far as it goes."""
    instance, plain = started(new, case), started(new, case)
    speed = (case.far - case.near) / 1.0
    for one in (instance, plain):
        one.set({"crank.phi": case.near}).set_derivatives({("crank.phi", 1): speed})
    assert instance.try_step(3 * STEP, 1.0) == DISCARD
    if after_error:
        assert instance.try_step(3 * STEP, 1.0) == ERROR
    for one in (instance, plain):
        one.step(3 * STEP, 1e-4)
    assert bits(instance.outputs()) == bits(plain.outputs())
    assert instance.serialize() == plain.serialize()


def test_another_angle_is_another_step(new, case):
    instance = started(new, case)
    aim(instance, case.far)
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    aim(instance, case.far + 1e-9)
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    aim(instance, case.near)
    assert instance.try_step(3 * STEP, STEP) == OK


def test_a_thousand_other_steps_are_enough(new, case):
    """For hosts that never try the same step twice: from the 1000th one on, each refused step is an error."""
    instance = started(new, case)
    aim(instance, case.far)
    statuses = [instance.try_step(3 * STEP, STEP * (1 + i % 2)) for i in range(1001)]
    assert statuses == [DISCARD] * 999 + [ERROR] * 2
    check_message(instance.last_message.text, case, case.far)
    assert "999 steps in a row were discarded before" in instance.last_message.text
    aim(instance, case.near)
    instance.step(3 * STEP, STEP)
    aim(instance, case.far)
    assert instance.try_step(4 * STEP, STEP) == DISCARD


def test_the_first_step_of_all(new, case):
    instance = new()
    instance.initialize({f"geometry.{k}": v for k, v in case.geometry.items()} | {"crank.phi": case.near})
    aim(instance, case.far)
    assert instance.try_step(0.0, STEP) == DISCARD
    assert instance.last_successful_time() == 0.0
    aim(instance, case.near)
    assert instance.try_step(0.0, STEP) == OK


def test_at_step_end(new, case):
    instance = new()
    geometry = {f"geometry.{k}": v for k, v in case.geometry.items()}
    instance.initialize(geometry | {"crank.phi": case.near, "crank.at_step_end": True})
    instance.step(0.0, STEP, {"crank.phi": case.near})
    before = bits(instance.get("tip.x"))
    instance.set({"crank.phi": case.far})
    assert [instance.try_step(STEP, STEP) for _ in range(2)] == [DISCARD, ERROR]
    assert bits(instance.get("tip.x")) == before
    instance.step(STEP, STEP, {"crank.phi": case.near})


def test_the_instance_can_end_or_start_again(new, case):
    for function in ("fmi2Terminate", "fmi2Reset"):
        instance = started(new, case)
        aim(instance, case.far)
        assert instance.try_step(3 * STEP, STEP) == DISCARD
        assert instance.call(function) == OK


# ---- steps beyond all numbers --------------------------------------------------------------------


@pytest.mark.parametrize(
    "inputs", [{"crank.w": 1e60, "crank.a": 1e60}, {"machine.v": 1e60}, {"crank.phi": 1e60, "crank.w": 1e60}]
)
def test_a_step_beyond_all_numbers(new, inputs):
    """Finite inputs whose step would end at an infinite angle or distance."""
    instance = new().initialize().step(0.0, 1.0)
    before, outputs = instance.set(inputs).serialize(), bits(instance.outputs())
    assert instance.try_step(1.0, 1e300) == ERROR
    assert "beyond all numbers" in instance.last_message.text
    assert instance.serialize() == before and bits(instance.outputs()) == outputs
    instance.set(dict.fromkeys(inputs, 0.0)).step(1.0, 10.0)


@pytest.mark.parametrize(
    ("inputs", "derivatives"),
    [
        ({"crank.w": 1.0, "crank.a": 1e60}, {}),
        ({"crank.w": -1e60}, {("crank.w", 1): -1e60}),
        ({"tip.fy": 1.0}, {("tip.fx", 1): 1e60}),
    ],
)
def test_a_step_whose_outputs_would_be_beyond_all_numbers(new, inputs, derivatives):
    """The angle at its end is a number, but the square of the speed, or the torque, would be none."""
    instance = new().initialize().step(0.0, 1.0).set(inputs).set_derivatives(derivatives)
    before, outputs = instance.serialize(), bits(instance.outputs())
    assert instance.try_step(1.0, 1e100) == ERROR
    assert "beyond all numbers" in instance.last_message.text
    assert instance.serialize() == before and bits(instance.outputs()) == outputs
