"""FMI 3.0, bad input of each kind: the right status, a message that names what is wrong, nothing changed, no crash."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import POINTER, byref, c_bool, c_char_p, c_double, c_int32, c_size_t, c_uint8, c_void_p

import pytest
from fmpy.fmi3 import (
    fmi3ClockUpdateCallback,
    fmi3IntermediateUpdateCallback,
    fmi3LockPreemptionCallback,
    fmi3LogMessageCallback,
    fmi3UnlockPreemptionCallback,
)

from fmu_src.interface import load_interface
from tests.fmi.test_bad_input import HEADER, fnv1a
from tests.fmi.test_messages import numbers_as_in
from tests.harness.host import DISCARD, ERROR, OK
from tests.harness.host3 import FUNCTIONS, TYPES, Instance3
from tests.harness.life import OPEN, OPEN_ANGLE, between_steps, in_initialization

pytestmark = pytest.mark.parametrize("version", [3], ids=["fmi3"])

INTERFACE = load_interface()
COUNT = len(INTERFACE.variables)
WITHOUT_STATUS = ("fmi3GetVersion", "fmi3FreeInstance")
OF_AN_INSTANCE = [name for name in FUNCTIONS if "Instantiate" not in name and name not in WITHOUT_STATUS]
ABSENT = [type_ for type_ in TYPES if type_ not in ("Float64", "Boolean", "Clock", "Binary")]


@contextmanager
def refused(instance: Instance3, *said: str) -> Iterator[None]:
    """What happens inside logs one error that says these words, and changes nothing."""
    before, logged = instance.serialize(), len(instance.messages)
    yield
    assert instance.serialize() == before, "something changed"
    (message,) = instance.messages[logged:]
    assert message.category == "logStatusError" and message.status == ERROR
    for word in said:
        assert word in message.text, message.text


# ---- instantiation -------------------------------------------------------------------------------


@pytest.mark.parametrize("model_exchange", [False, True])
@pytest.mark.parametrize(
    ("options", "said"), [({"name": ""}, "instance name"), ({"guid": "{another}"}, "token"), ({"guid": ""}, "token")]
)
def test_no_instance(new, fmu, options, said, model_exchange):
    instance = new(logging=False, model_exchange=model_exchange, **options)
    assert instance.component is None
    (message,) = instance.messages
    assert said in message.text and message.category == "logStatusError"
    assert "name" in options or fmu.description.guid in message.text, "the right token is told"


def test_instantiating_with_null(fmu):
    library, token = fmu.load().dll, fmu.description.guid.encode()
    nobody = (None, fmi3LogMessageCallback(), fmi3IntermediateUpdateCallback())
    for name, of_build, required in ((None, token, 0), (b"a", None, 0), (b"a", token, 3)):
        assert not library.fmi3InstantiateCoSimulation(name, of_build, None, *[False] * 4, None, required, *nobody)
    assert not library.fmi3InstantiateModelExchange(None, token, None, False, False, *nobody[:2])
    working = library.fmi3InstantiateCoSimulation(b"a", token, None, *[False] * 4, None, 0, *nobody)
    assert working, "neither resources nor callbacks are needed"
    library.fmi3FreeInstance(working)


def test_no_scheduled_execution(new):
    other = new()
    made = other.slave.dll.fmi3InstantiateScheduledExecution(
        b"linkage", other.fmu.description.guid.encode(), None, False, True, None, other._logger,
        fmi3ClockUpdateCallback(), fmi3LockPreemptionCallback(), fmi3UnlockPreemptionCallback(),
    )  # fmt: skip
    assert made is None and "clocks" in other.last_message.text


# ---- NULL ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", OF_AN_INSTANCE)
def test_no_instance_at_all(fmu, function):
    call = getattr(fmu.load().dll, function)
    zero = [None if hasattr(kind, "contents") or kind in (c_void_p, c_char_p) else 0 for kind in call.argtypes[1:]]
    assert call(None, *zero) == ERROR


def flags() -> list:
    return [byref(c_bool()) for _ in range(3)] + [byref(c_double())]


WITH_POINTERS = {
    "fmi3SetDebugLogging": lambda i: [True, 1, (c_char_p * 1)(b"logAll")],
    "fmi3GetFloat64": lambda i: [i.references([8]), 1, (c_double * 1)(), 1],
    "fmi3SetFloat64": lambda i: [i.references([2]), 1, (c_double * 1)(1.0), 1],
    "fmi3GetBoolean": lambda i: [i.references(["crank.at_step_end"]), 1, (c_bool * 1)(), 1],
    "fmi3GetOutputDerivatives": lambda i: [i.references([8]), 1, (c_int32 * 1)(1), (c_double * 1)(), 1],
    "fmi3GetDirectionalDerivative": lambda i: [
        i.references([8]), 1, i.references([2]), 1, (c_double * 1)(1.0), 1, (c_double * 1)(), 1
    ],
    "fmi3GetAdjointDerivative": lambda i: [
        i.references([8]), 1, i.references([2]), 1, (c_double * 1)(1.0), 1, (c_double * 1)(), 1
    ],
    "fmi3GetFMUState": lambda i: [byref(i.save())],
    "fmi3SetFMUState": lambda i: [i.save()],
    "fmi3SerializedFMUStateSize": lambda i: [i.save(), byref(c_size_t())],
    "fmi3SerializeFMUState": lambda i: [i.save(), ctypes.create_string_buffer(4096), 4096],
    "fmi3DeserializeFMUState": lambda i: [
        (b := i.serialize()) and ctypes.create_string_buffer(b, len(b)), len(b), byref(i.save())
    ],
    "fmi3DoStep": lambda i: [0.03, 0.01, True, *flags()],
}  # fmt: skip


def pointers(function: str) -> list[int]:
    """Which arguments are pointers."""
    is_pointer = {
        "fmi3SetDebugLogging": [2], "fmi3GetOutputDerivatives": [0, 2, 3], "fmi3GetDirectionalDerivative": [0, 2, 4, 6],
        "fmi3GetAdjointDerivative": [0, 2, 4, 6], "fmi3GetFMUState": [0], "fmi3SetFMUState": [0],
        "fmi3SerializedFMUStateSize": [0, 1], "fmi3SerializeFMUState": [0, 1], "fmi3DeserializeFMUState": [0, 2],
        "fmi3DoStep": [3, 4, 5, 6],
    }  # fmt: skip
    return is_pointer.get(function, [0, 2])


@pytest.mark.parametrize(
    ("function", "place"), [(function, place) for function in WITH_POINTERS for place in pointers(function)]
)
def test_null_in_place_of_a_pointer(new, function, place):
    instance = between_steps(new())
    arguments = WITH_POINTERS[function](instance)
    state = instance.save()
    assert instance.call(function, *arguments) == OK, instance.last_message.text
    instance.restore(state).messages.clear()
    arguments[place] = None
    with refused(instance, function, "NULL"):
        assert instance.call(function, *arguments) == ERROR


# ---- numbers of values ---------------------------------------------------------------------------


@pytest.mark.parametrize("count", [0, 2, 7])
@pytest.mark.parametrize("function", ["fmi3GetFloat64", "fmi3SetFloat64"])
def test_as_many_values_as_references(new, function, count):
    """All variables are scalars."""
    instance, values = between_steps(new()), (c_double * 8)(*[1.0] * 8)
    with refused(instance, function, "as many values"):
        assert instance.call(function, instance.references(["crank.phi"]), 1, values, count) == ERROR
    assert list(values) == [1.0] * 8


@pytest.mark.parametrize(
    "function", ["fmi3GetDirectionalDerivative", "fmi3GetAdjointDerivative", "fmi3GetOutputDerivatives"]
)
@pytest.mark.parametrize(("seeds", "answers"), [(1, 2), (2, 1), (0, 1), (1, 0)])
def test_as_many_seeds_as_knowns(new, function, seeds, answers):
    instance, values = between_steps(new()), (c_double * 4)(*[1.0] * 4)
    unknown, known = instance.references(["tip.x"]), instance.references(["crank.phi"])
    arguments = (unknown, 1, known, 1, values, seeds, values, answers)
    if function == "fmi3GetOutputDerivatives":
        arguments = (unknown, 1, (c_int32 * 1)(1), values, 3 * answers - 1 if answers == 1 else 0)
    with refused(instance, function, "as many values"):
        assert instance.call(function, *arguments) == ERROR


# ---- references and types ------------------------------------------------------------------------


@pytest.mark.parametrize("type_", ABSENT)
def test_there_are_no_variables_of_other_types(new, type_):
    instance = in_initialization(new())
    for verb in ("Get", "Set"):
        function = f"fmi3{verb}{type_}"
        with refused(instance, function, "no variables of this type"):
            assert instance.call(function, instance.references([1]), 1, None, 1) == ERROR
        assert instance.call(function, None, 0, None, 0) == OK


def test_there_are_no_binaries_and_clocks(new):
    instance = in_initialization(new())
    sizes, binaries = (c_size_t * 1)(1), (POINTER(c_uint8) * 1)()
    for verb in ("Get", "Set"):
        with refused(instance, "no variables of this type"):
            assert instance.call(f"fmi3{verb}Binary", instance.references([1]), 1, sizes, binaries, 1) == ERROR
    events = new(event_mode=True).initialize()
    for verb in ("Get", "Set"):
        with refused(events, "no variables of this type"):
            assert events.call(f"fmi3{verb}Clock", events.references([1]), 1, (c_bool * 1)()) == ERROR


@pytest.mark.parametrize("number", [0, COUNT + 1, 2**31, 2**32 - 1])
def test_unknown_value_references(new, number):
    instance = in_initialization(new())
    for function, values in (("Float64", (c_double * 1)(1.0)), ("Boolean", (c_bool * 1)(True))):
        for verb in ("Get", "Set"):
            with refused(instance, str(number), "unknown", str(COUNT)):
                assert instance.call(f"fmi3{verb}{function}", instance.references([number]), 1, values, 1) == ERROR


@pytest.mark.parametrize("name", ["tip.x", "time", "der(machine.s)", "crank.at_step_end", "geometry.L1", COUNT + 1])
@pytest.mark.parametrize("place", [0, 1, 3])
def test_all_or_nothing(new, name, place):
    """One that is wrong, at any place: none of the others is set."""
    instance = between_steps(new())
    values = [("crank.phi", 0.123), ("crank.w", 0.456), ("machine.v", 0.789)]
    values.insert(place, (name, 1.0))
    with refused(instance):
        assert instance.try_set(dict(values)) == ERROR


@pytest.mark.parametrize("place", [0, 1])
def test_all_booleans_or_none(new, place):
    instance = in_initialization(new())
    names = ["crank.at_step_end"]
    names.insert(place, "tip.x")
    with refused(instance, "tip.x", "is a real, not a Boolean"):
        assert instance.call("fmi3SetBoolean", instance.references(names), 2, (c_bool * 2)(True, True), 2) == ERROR


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.5e60])
@pytest.mark.parametrize("name", ["crank.phi", "machine.v", "geometry.L3", "machine.s"])
def test_values_that_are_no_numbers(new, name, value):
    instance = in_initialization(new())
    with refused(instance, name, "finite", f"to {INTERFACE.limits(INTERFACE[name])[1]:g}"):
        assert instance.try_set({name: value}) == ERROR


@pytest.mark.parametrize("start,stop", [(math.nan, None), (0.0, math.nan), (1.0, 0.5), (-math.inf, 0.0)])
def test_times_of_the_experiment(new, start, stop):
    """FMI 3.0 gives them when initialization begins: refused, it has not begun."""
    instance = new()
    with refused(instance, "fmi3EnterInitializationMode", "start time", "stop time"):
        assert instance.setup(start, stop).call("fmi2EnterInitializationMode") == ERROR
    instance.initialize()


@pytest.mark.parametrize("buffer", [b"", b"short", b"\0" * 1000])
def test_states_that_are_none(new, buffer):
    instance = between_steps(new())
    with refused(instance, "serialized state"):
        status, state = instance.try_deserialize(buffer)
        assert status == ERROR and not state


# ---- messages ------------------------------------------------------------------------------------


def provoke(instance: Instance3) -> list[int]:
    """An error, an event, a Discard and an error again."""
    statuses = [instance.call("fmi3ExitInitializationMode")]
    instance.initialize(OPEN)
    instance.step(0.0, 0.25, {"crank.phi": 0.1}).step(0.25, 0.25, {"crank.phi": 3.5}).set({"crank.phi": OPEN_ANGLE})
    return statuses + [instance.try_step(0.5, 0.25) for _ in range(2)]


def categories(instance: Instance3, on: bool, *names: str) -> int:
    array = (c_char_p * len(names))(*[name.encode() for name in names])
    return instance.call("fmi3SetDebugLogging", on, len(names), array)


@pytest.mark.parametrize("logging", [False, True])
def test_errors_are_always_told_all_else_where_logging_is_on(new, logging):
    """FMI 3.0.3, section 2.2.4."""
    instance = new(logging=logging)
    assert provoke(instance) == [ERROR, DISCARD, ERROR]
    told = [message.category for message in instance.messages]
    others = ["logEvents", "logStatusDiscard"] if logging else []
    assert told == ["logStatusError", *others, "logStatusError"]


@pytest.mark.parametrize(
    ("on", "names", "told"),
    [
        (True, [], {"logEvents", "logStatusDiscard"}),
        (True, ["logAll"], {"logEvents", "logStatusDiscard"}),
        (False, [], set()),
        (False, ["logAll"], set()),
        (True, ["logEvents"], {"logEvents"}),
        (True, ["logStatusDiscard", "logStatusError"], {"logStatusDiscard"}),
        (True, ["logStatusError"], set()),
        (False, ["logEvents"], set()),
    ],
)
def test_categories_choose(new, on, names, told):
    """Those named are switched, the others stay as they were (FMI 3.0, section 2.3.1)."""
    every = {"logEvents", "logStatusDiscard"}
    from_off, from_on = new(logging=False), new(logging=True)
    for instance in (from_off, from_on):
        assert categories(instance, on, *names) == OK
        provoke(instance)
    assert {message.category for message in from_off.messages} == told | {"logStatusError"}
    switched_off = every & set(names) if names and names != ["logAll"] else every
    expected = every if on else every - switched_off
    assert {message.category for message in from_on.messages} == expected | {"logStatusError"}


@pytest.mark.parametrize("category", ["logEverything", ""])
def test_unknown_log_categories(new, category):
    instance = new()
    with refused(instance, "category"):
        assert categories(instance, True, "logAll", category) == ERROR


def test_no_logger(new):
    instance = new(with_logger=False)
    assert provoke(instance) == [ERROR, DISCARD, ERROR]
    assert new(with_logger=False, guid="{wrong}").component is None


def test_the_decimal_point(new):
    """The same in every locale that this machine has; C.UTF-8 at least."""
    with numbers_as_in("C.UTF-8"):
        instance = new()
        assert instance.setup(12.625, 0.1).call("fmi2EnterInitializationMode") == ERROR
    assert "start time 12.625 s, stop time 0.1 s" in instance.last_message.text


def test_every_function_is_met(version):
    """Here or in the table of modes."""
    from tests.fmi.test_fmi3_state_machine import CALLS

    assert {call.function for call in CALLS} >= set(OF_AN_INSTANCE)


def test_a_forged_mode(new):
    """Modes that an interface type lacks, or in which no state can be saved, with the right checksum: refused."""
    instance = new(model_exchange=True).initialize()
    content = instance.serialize()
    instance.demand(instance.call("fmi3EnterContinuousTimeMode"), "entering")
    other = instance.serialize()
    (place,) = {i // 8 * 8 for i in range(HEADER, len(content)) if content[i] != other[i]}
    accepted = 0
    for mode in range(20):
        forged = bytearray(content)
        forged[place : place + 8] = mode.to_bytes(8, "little")
        forged[HEADER - 8 : HEADER] = fnv1a(forged[HEADER:]).to_bytes(8, "little")
        status, state = instance.try_deserialize(bytes(forged))
        accepted += status == OK
        if status == OK:
            assert instance.call("fmi3SetFMUState", state) == OK and len(instance.serialize()) == len(content)
        else:
            assert "makes no sense" in instance.last_message.text
    assert accepted == 5, "before and in initialization, Event Mode, continuous time, terminated"
