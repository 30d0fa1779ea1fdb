"""Which call is allowed when (FMI 2.0.4, section 4.2.4: the state machine of a slave and its table)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import byref, c_char_p, c_double, c_int32, c_size_t, c_void_p

import pytest

from tests.harness.host import (
    ERROR,
    FUNCTIONS,
    LAST_SUCCESSFUL_TIME,
    OK,
    PENDING_STATUS,
    STEP_STATUS,
    TERMINATED,
    Instance,
    bits,
)
from tests.harness.life import MODES, STEP, begin, between_steps, tell

BEFORE, INITIALIZATION, STEPS, REFUSED, END = MODES
EVERYWHERE = set(MODES)
GETTING = {INITIALIZATION, STEPS, REFUSED, END}
# The table allows neither setting nor stepping after a discarded step before a state is restored. Nothing has changed
# then, so here both go on from where the step began.
SETTING = {BEFORE, INITIALIZATION, STEPS, REFUSED}
STEPPING = {STEPS, REFUSED}
STATUS = {STEPS, REFUSED, END}

Arguments = Callable[[Instance], tuple]
TIME = 3 * STEP  # where MODES leave off


def real(instance: Instance, name: str) -> tuple:
    return instance.references([name]), 1, (c_double * 1)(1.0)


def boolean(instance: Instance, name: str) -> tuple:
    return instance.references([name]), 1, (c_int32 * 1)(0)


def nothing(instance: Instance) -> tuple:
    return None, 0, None


def derivative(instance: Instance, name: str) -> tuple:
    return instance.references([name]), 1, (c_int32 * 1)(1), (c_double * 1)(0.0)


def directional(instance: Instance) -> tuple:
    unknown, known = instance.references(["tip.x"]), instance.references(["crank.phi"])
    return unknown, 1, known, 1, (c_double * 1)(1.0), (c_double * 1)()


def saved(instance: Instance) -> c_void_p:
    return instance.save()


def serialized(instance: Instance) -> tuple:
    content = instance.serialize()
    instance._states.append(state := c_void_p())
    return ctypes.create_string_buffer(content, len(content)), len(content), byref(state)


def new_state(instance: Instance) -> tuple:
    instance._states.append(state := c_void_p())
    return (byref(state),)


# Every function on an instance: its arguments, and the modes in which it is allowed.
CALLS: list[tuple[str, Arguments, set[str]]] = [
    ("fmi2SetDebugLogging", lambda i: (False, 0, None), EVERYWHERE),
    ("fmi2SetupExperiment", lambda i: (False, 0.0, 0.0, False, 0.0), {BEFORE}),
    ("fmi2EnterInitializationMode", lambda i: (), {BEFORE}),
    ("fmi2ExitInitializationMode", lambda i: (), {INITIALIZATION}),
    ("fmi2Terminate", lambda i: (), STEPPING),
    ("fmi2Reset", lambda i: (), EVERYWHERE),
    ("fmi2GetReal", lambda i: real(i, "tip.x"), GETTING),
    ("fmi2GetReal", lambda i: real(i, "crank.phi"), GETTING),
    ("fmi2GetReal", lambda i: real(i, "geometry.L1"), GETTING),
    ("fmi2GetInteger", nothing, GETTING),
    ("fmi2GetBoolean", lambda i: boolean(i, "crank.at_step_end"), GETTING),
    ("fmi2GetString", nothing, GETTING),
    ("fmi2SetReal", lambda i: real(i, "crank.phi"), SETTING),
    ("fmi2SetReal", lambda i: real(i, "geometry.L1"), {BEFORE, INITIALIZATION}),
    ("fmi2SetReal", lambda i: real(i, "machine.s"), {BEFORE, INITIALIZATION}),
    ("fmi2SetReal", lambda i: real(i, "tip.x"), set()),
    ("fmi2SetReal", lambda i: real(i, "time"), set()),
    ("fmi2SetInteger", nothing, SETTING),
    ("fmi2SetBoolean", lambda i: boolean(i, "crank.at_step_end"), {BEFORE, INITIALIZATION}),
    ("fmi2SetString", nothing, SETTING),
    ("fmi2GetFMUstate", new_state, EVERYWHERE),
    ("fmi2SetFMUstate", lambda i: (saved(i),), EVERYWHERE),
    ("fmi2FreeFMUstate", lambda i: (byref(c_void_p()),), EVERYWHERE),
    ("fmi2SerializedFMUstateSize", lambda i: (saved(i), byref(c_size_t())), EVERYWHERE),
    ("fmi2SerializeFMUstate", lambda i: (saved(i), ctypes.create_string_buffer(4096), 4096), EVERYWHERE),
    ("fmi2DeSerializeFMUstate", serialized, EVERYWHERE),
    ("fmi2GetDirectionalDerivative", directional, GETTING),
    ("fmi2SetRealInputDerivatives", lambda i: derivative(i, "crank.phi"), SETTING),
    ("fmi2GetRealOutputDerivatives", lambda i: derivative(i, "tip.x"), {STEPS, REFUSED, END}),
    ("fmi2DoStep", lambda i: (TIME, STEP, True), STEPPING),
    ("fmi2CancelStep", lambda i: (), set()),
    ("fmi2GetStatus", lambda i: (STEP_STATUS, byref(c_int32())), STATUS),
    ("fmi2GetRealStatus", lambda i: (LAST_SUCCESSFUL_TIME, byref(c_double())), STATUS),
    ("fmi2GetBooleanStatus", lambda i: (TERMINATED, byref(c_int32())), STATUS),
    ("fmi2GetStringStatus", lambda i: (PENDING_STATUS, byref(c_char_p())), STATUS),
]
# Those that need no instance, or end it; fmi2GetIntegerStatus has no status to give: tests below.
ELSEWHERE = {
    "fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2Instantiate", "fmi2FreeInstance", "fmi2GetIntegerStatus"
}  # fmt: skip


def test_the_table_is_complete():
    assert {function for function, _, _ in CALLS} | ELSEWHERE == set(FUNCTIONS)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    "number", range(len(CALLS)), ids=[f"{number}-{function}" for number, (function, _, _) in enumerate(CALLS)]
)
def test_each_call_in_each_mode(new, number, mode):
    """Allowed: it is done. Not allowed: refused with a message, and nothing has changed."""
    function, make_arguments, allowed = CALLS[number]
    instance = MODES[mode](new())
    arguments = make_arguments(instance)
    instance.messages.clear()
    before = instance.serialize()
    status = instance.call(function, *arguments)
    if mode in allowed:
        assert status == OK, instance.last_message.text
        assert instance.messages == []
    else:
        assert status == ERROR
        assert instance.serialize() == before
        (message,) = instance.messages
        assert message.text.startswith(f"{function}: ")
        is_about_mode = any(allowed_by for other, _, allowed_by in CALLS if other == function)
        assert not is_about_mode or mode in message.text or "set" in message.text


def test_what_needs_no_instance(fmu):
    slave = fmu.load()
    assert slave.dll.fmi2GetVersion() == b"2.0"
    assert slave.dll.fmi2GetTypesPlatform() == b"default"


@pytest.mark.parametrize("mode", MODES)
def test_freeing_in_each_mode(new, mode):
    MODES[mode](new()).free()


def test_freeing_nothing(fmu):
    """FMI 2.0.4, section 2.1.5: a NULL pointer is ignored."""
    fmu.load().dll.fmi2FreeInstance(None)


@pytest.mark.parametrize("kind", range(4))
def test_no_integer_status(new, kind):
    """None is defined by the standard: Discard, as for any status that a slave does not have."""
    instance = between_steps(new())
    assert instance.call("fmi2GetIntegerStatus", kind, byref(c_int32())) == 2


@pytest.mark.parametrize(
    ("function", "own_kinds"),
    [
        ("fmi2GetStatus", {STEP_STATUS}),
        ("fmi2GetRealStatus", {LAST_SUCCESSFUL_TIME}),
        ("fmi2GetBooleanStatus", {TERMINATED}),
        ("fmi2GetStringStatus", {PENDING_STATUS}),
    ],
)
def test_each_status_from_its_own_function(new, function, own_kinds):
    instance, buffer = between_steps(new()), ctypes.create_string_buffer(8)
    c_type = {"fmi2GetRealStatus": c_double, "fmi2GetStringStatus": c_char_p}.get(function, c_int32)
    for kind in (-1, 0, 1, 2, 3, 4):
        value = ctypes.cast(buffer, ctypes.POINTER(c_type))
        expected = OK if kind in own_kinds else 2
        assert instance.call(function, kind, value) == expected, kind
    assert all(message.category == "logStatusDiscard" for message in instance.messages)


# ---- a life from end to end, and again -----------------------------------------------------------


@pytest.mark.parametrize("mode", MODES)
def test_reset_gives_the_start_values(new, mode):
    """FMI 2.0.4, section 2.1.6: as after fmi2Instantiate."""
    instance, fresh = MODES[mode](new()), new()
    assert instance.call("fmi2Reset") == OK
    assert instance.serialize() == fresh.serialize()
    for one in (instance, fresh):
        one.initialize()
    names = [name for name in instance.fmu.reference if name != "crank.at_step_end"]
    assert bits(instance.get(*names)) == bits(fresh.get(*names))
    assert instance.get_boolean("crank.at_step_end") is False


@pytest.mark.parametrize("mode", MODES)
def test_a_second_life_is_like_the_first(new, mode):
    instance = MODES[mode](new())
    assert instance.call("fmi2Reset") == OK
    assert tell(begin(instance), 0, 20) == tell(begin(new()), 0, 20)


def test_an_error_does_not_end_the_instance(new):
    """fmi2Error, and nothing changed: the host goes on as if it had not called."""
    disturbed, plain = begin(new()), begin(new())
    found, expected = [], []
    for moment in range(12):
        found += tell(disturbed, moment, moment + 1)
        expected += tell(plain, moment, moment + 1)
        assert disturbed.call("fmi2EnterInitializationMode") == ERROR
        assert disturbed.try_step(-5.0, 1.0) == ERROR
        assert disturbed.try_set({"tip.x": 1.0}) == ERROR
        assert disturbed.try_get(["crank.at_step_end"])[0] == ERROR
    assert found == expected
    assert disturbed.serialize() == plain.serialize()


def test_after_the_end_values_can_still_be_read(new):
    instance = between_steps(new())
    outputs, derivatives = bits(instance.outputs()), instance.get_derivatives(("tip.x", 2))
    assert instance.call("fmi2Terminate") == OK
    assert bits(instance.outputs()) == outputs and instance.get_derivatives(("tip.x", 2)) == derivatives
    assert instance.last_successful_time() == TIME
