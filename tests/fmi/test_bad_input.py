"""Bad input, each kind: the right status, a message that names what is wrong, nothing changed, no crash."""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_char_p, c_double, c_int32, c_size_t, c_uint32, c_void_p

import pytest

from fmu_src.interface import load_interface
from tests.fmi.test_state_machine import CALLS
from tests.harness.host import (
    DISCARD,
    ERROR,
    FUNCTIONS,
    LAST_SUCCESSFUL_TIME,
    OK,
    PENDING_STATUS,
    STEP_STATUS,
    TERMINATED,
    Instance,
)
from tests.harness.life import between_steps, in_initialization

INTERFACE = load_interface()
COUNT = len(INTERFACE.variables)
AT_STEP_END = INTERFACE["crank.at_step_end"].value_reference
UNKNOWN = [0, COUNT + 1, 1000, 2**31, 2**32 - 1]
OF_AN_INSTANCE = [
    name
    for name in FUNCTIONS
    if name not in ("fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2Instantiate", "fmi2FreeInstance")
]
REALS = [v.name for v in INTERFACE.variables if v.kind in ("input", "parameter") and v.type == "real"] + ["machine.s"]
NOT_FINITE = [math.nan, math.inf, -math.inf]
TOO_GREAT = [1.5e60, -1e300]  # beyond 1e60 derivatives of outputs could overflow


@contextmanager
def refused(instance: Instance, *said: str) -> Iterator[None]:
    """What happens inside logs one error that says these words, and changes nothing."""
    before, logged = instance.serialize(), len(instance.messages)
    yield
    assert instance.serialize() == before, "something changed"
    (message,) = instance.messages[logged:]
    assert message.category == "logStatusError" and message.status == ERROR
    for word in said:
        assert word in message.text, message.text


# ---- instantiation -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"name": ""}, "instance name"),
        ({"guid": "{00000000-0000-0000-0000-000000000000}"}, "GUID"),
        ({"guid": ""}, "GUID"),
        ({"fmu_type": 2}, "fmi2Type"),
    ],
)
def test_no_instance(new, options, said):
    instance = new(**options)
    assert instance.component is None
    (message,) = instance.messages
    assert said in message.text and message.category == "logStatusError" and message.instance


def test_a_wrong_guid_is_told_the_right_one(new, fmu):
    """So that the user sees which of the two files is old."""
    instance = new(guid="{another}")
    assert fmu.description.guid in instance.last_message.text


@pytest.mark.parametrize("missing", ["name", "guid", "callbacks"])
def test_instantiating_with_null(new, missing):
    other = new()
    arguments = {
        "name": b"linkage", "type": 1, "guid": other.fmu.description.guid.encode(), "resources": None,
        "callbacks": byref(other.callbacks), "visible": False, "logging": False,
    }  # fmt: skip
    instantiate = other.slave.dll.fmi2Instantiate
    working = instantiate(*arguments.values())
    assert working, "the location of the resources may be missing: there are none"
    other.slave.dll.fmi2FreeInstance(working)
    assert not instantiate(*(arguments | {missing: None}).values())
    if missing != "callbacks":
        assert other.last_message.category == "logStatusError"


# ---- NULL ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", OF_AN_INSTANCE)
def test_no_component(fmu, function):
    call = getattr(fmu.load().dll, function)
    zero = [None if hasattr(kind, "contents") or kind in (c_void_p, c_char_p) else 0 for kind in call.argtypes[1:]]
    assert call(None, *zero) == ERROR


def one_real() -> ctypes.Array:
    return (c_double * 1)(1.0)


def one_integer() -> ctypes.Array:
    return (c_int32 * 1)(1)


def reference(number: int) -> ctypes.Array:
    return (c_uint32 * 1)(number)


WITH_POINTERS = {
    "fmi2SetDebugLogging": lambda i: [True, 1, (c_char_p * 1)(b"logAll")],
    "fmi2GetReal": lambda i: [reference(8), 1, one_real()],
    "fmi2SetReal": lambda i: [reference(2), 1, one_real()],
    "fmi2GetBoolean": lambda i: [reference(AT_STEP_END), 1, one_integer()],
    "fmi2SetRealInputDerivatives": lambda i: [reference(2), 1, one_integer(), one_real()],
    "fmi2GetRealOutputDerivatives": lambda i: [reference(8), 1, one_integer(), one_real()],
    "fmi2GetDirectionalDerivative": lambda i: [reference(8), 1, reference(2), 1, one_real(), one_real()],
    "fmi2GetFMUstate": lambda i: [byref(i.save())],
    "fmi2SetFMUstate": lambda i: [i.save()],
    "fmi2SerializedFMUstateSize": lambda i: [i.save(), byref(c_size_t())],
    "fmi2SerializeFMUstate": lambda i: [i.save(), ctypes.create_string_buffer(4096), 4096],
    "fmi2DeSerializeFMUstate": lambda i: [
        ctypes.create_string_buffer(i.serialize(), len(i.serialize())), len(i.serialize()), byref(i.save())
    ],
    "fmi2GetStatus": lambda i: [STEP_STATUS, byref(c_int32())],
    "fmi2GetRealStatus": lambda i: [LAST_SUCCESSFUL_TIME, byref(c_double())],
    "fmi2GetIntegerStatus": lambda i: [0, byref(c_int32())],
    "fmi2GetBooleanStatus": lambda i: [TERMINATED, byref(c_int32())],
    "fmi2GetStringStatus": lambda i: [PENDING_STATUS, byref(c_char_p())],
}  # fmt: skip


def pointers(function: str) -> list[int]:
    count = {"fmi2GetDirectionalDerivative": [0, 2, 4, 5], "fmi2SetDebugLogging": [2], "fmi2SetFMUstate": [0]}
    count |= {"fmi2GetFMUstate": [0], "fmi2SerializeFMUstate": [0, 1], "fmi2DeSerializeFMUstate": [0, 2]}
    count |= {"fmi2SerializedFMUstateSize": [0, 1]}
    if function.endswith("Status"):
        return [1]
    return count.get(function, [0, 2, 3] if function.endswith("Derivatives") else [0, 2])


@pytest.mark.parametrize(
    ("function", "place"), [(function, place) for function in WITH_POINTERS for place in pointers(function)]
)
def test_null_in_place_of_a_pointer(new, function, place):
    instance = between_steps(new())
    arguments = WITH_POINTERS[function](instance)
    assert instance.call(function, *arguments) in (OK, DISCARD)  # Discard: fmi2GetIntegerStatus
    instance.messages.clear()
    arguments[place] = None
    with refused(instance, function, "NULL"):
        assert instance.call(function, *arguments) == ERROR


def test_null_for_no_elements(new):
    """Nothing to read, nothing to write."""
    instance = between_steps(new())
    for function in ("fmi2GetReal", "fmi2SetReal", "fmi2GetBoolean", "fmi2SetInteger", "fmi2GetString"):
        assert instance.call(function, None, 0, None) == OK
    assert instance.call("fmi2SetRealInputDerivatives", None, 0, None, None) == OK
    assert instance.call("fmi2GetRealOutputDerivatives", None, 0, None, None) == OK
    assert instance.call("fmi2GetDirectionalDerivative", None, 0, None, 0, None, None) == OK
    assert instance.messages == []


# ---- references ----------------------------------------------------------------------------------


@pytest.mark.parametrize("number", UNKNOWN)
@pytest.mark.parametrize("function", ["fmi2GetReal", "fmi2SetReal", "fmi2GetBoolean", "fmi2SetBoolean"])
def test_unknown_value_references(new, function, number):
    for make in (in_initialization, between_steps):
        instance = make(new())
        values = (c_int32 * 1)(1) if "Boolean" in function else one_real()
        if make is in_initialization or function != "fmi2SetBoolean":
            with refused(instance, str(number), "unknown", str(COUNT)):
                assert instance.call(function, reference(number), 1, values) == ERROR


@pytest.mark.parametrize("function", ["fmi2GetInteger", "fmi2SetInteger", "fmi2GetString", "fmi2SetString"])
def test_there_are_no_variables_of_other_types(new, function):
    instance = in_initialization(new())
    values = (c_char_p * 1)(b"") if "String" in function else one_integer()
    for number in (1, 8, COUNT):
        with refused(instance, "no variables of this type"):
            assert instance.call(function, reference(number), 1, values) == ERROR


def test_reals_are_no_booleans(new):
    instance = in_initialization(new())
    for variable in INTERFACE.variables:
        kind, wrong = ("Boolean", "real") if variable.type == "boolean" else ("real", "Boolean")
        own, other = ("Boolean", "Real") if kind == "Boolean" else ("Real", "Boolean")
        value, number = {"Real": one_real(), "Boolean": one_integer()}, reference(variable.value_reference)
        for verb in ("Get", "Set"):
            with refused(instance, variable.name, f"is a {kind}, not a {wrong}"):
                assert instance.call(f"fmi2{verb}{other}", number, 1, value[other]) == ERROR
        assert instance.call(f"fmi2Get{own}", number, 1, value[own]) == OK


@pytest.mark.parametrize("name", [v.name for v in INTERFACE.variables if v.kind in ("output", "independent")])
def test_what_is_computed_cannot_be_set(new, name):
    for make in (in_initialization, between_steps):
        if make is between_steps or name != "machine.s":
            instance = make(new())
            with refused(instance, name, "set"):
                assert instance.try_set({name: 1.0}) == ERROR


@pytest.mark.parametrize("name", [v.name for v in INTERFACE.variables if v.kind == "parameter"] + ["machine.s"])
def test_parameters_are_fixed_after_initialization(new, name):
    instance = between_steps(new())
    with refused(instance, name, "initialization"):
        assert instance.try_set({name: True if name == "crank.at_step_end" else 0.1}) == ERROR


# ---- values --------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", NOT_FINITE + TOO_GREAT)
@pytest.mark.parametrize("name", REALS)
def test_values_that_are_no_numbers(new, name, value):
    instance = in_initialization(new())
    least, greatest = INTERFACE.limits(INTERFACE[name])
    least = getattr(INTERFACE[name], "smallest", 0.0) or least
    with refused(instance, name, "finite", f"{value:g}", f"from {least:g} to {greatest:g}"):
        assert instance.try_set({name: value}) == ERROR


@pytest.mark.parametrize("value", [-1e-300, -1.0, 1000.5])
def test_values_beyond_the_range_of_a_parameter(new, value):
    instance = in_initialization(new())
    with refused(instance, "crank.smoothing", f"{value:g}", "from 0 to 1000"):
        assert instance.try_set({"crank.smoothing": value}) == ERROR
    assert instance.try_set({"crank.smoothing": 1000.0}) == OK


@pytest.mark.parametrize("value", [1e60, -1e60])
def test_the_greatest_inputs_overflow_nothing(new, value):
    """Every output and derivative is a number still, with all inputs at their limit."""
    inputs = [v.name for v in INTERFACE.variables if v.kind == "input"]
    instance = new().initialize(dict.fromkeys(inputs, value))
    outputs = instance.fmu.names("output")
    numbers = instance.outputs() + instance.get_derivatives(*[(name, order) for name in outputs for order in (1, 2)])
    for name in inputs:
        numbers += instance.sensitivity(outputs, {name: 1.0})
    assert all(map(math.isfinite, numbers))


@pytest.mark.parametrize("value", NOT_FINITE + TOO_GREAT)
@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_that_are_no_numbers(new, order, value):
    instance = between_steps(new())
    with refused(instance, "machine.v", "finite", str(value), "1e+60"):
        assert instance.try_set_derivatives({("machine.v", order): value}) == ERROR


@pytest.mark.parametrize("order", [0, 3, -1, 2**31 - 1])
def test_input_derivatives_of_other_orders(new, order):
    instance = between_steps(new())
    with refused(instance, "crank.w", "order", str(order)[:6]):
        assert instance.try_set_derivatives({("crank.w", order): 1.0}) == ERROR


@pytest.mark.parametrize("name", ["tip.x", "time", "geometry.L1", "machine.s", "crank.at_step_end", *UNKNOWN])
def test_derivatives_are_of_inputs(new, name):
    instance = between_steps(new())
    with refused(instance, str(name)):
        assert instance.try_set_derivatives({(name, 1): 1.0}) == ERROR


BAD = [("tip.x", 1.0), (COUNT + 1, 1.0), ("crank.at_step_end", 1.0), ("tip.fx", math.nan), ("geometry.L1", 0.06)]


@pytest.mark.parametrize("place", [0, 1, 3])
@pytest.mark.parametrize(("name", "value"), BAD)
def test_all_or_nothing(new, name, value, place):
    """One that is wrong, at any place: none of the others is set."""
    instance = between_steps(new())
    values = [("crank.phi", 0.123), ("crank.w", 0.456), ("machine.v", 0.789)]
    values.insert(place, (name, value))
    with refused(instance):
        assert instance.try_set(dict(values)) == ERROR


@pytest.mark.parametrize("place", [0, 1, 3])
def test_all_derivatives_or_none(new, place):
    instance = between_steps(new())
    for bad in ((("tip.x", 1), 1.0), (("crank.a", 3), 1.0), (("tip.fx", 1), math.inf)):
        values = [(("crank.phi", 1), 5.0), (("crank.phi", 2), 5.0), (("machine.v", 1), 1.0)]
        values.insert(place, bad)
        with refused(instance):
            assert instance.try_set_derivatives(dict(values)) == ERROR


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("name", [COUNT + 1, "crank.at_step_end"])
def test_all_are_read_or_none(new, name, place):
    instance = between_steps(new())
    names = ["tip.x", "crank.tau"]
    names.insert(place, name)
    with refused(instance):
        status, values = instance.try_get(names)
    assert status == ERROR and all(map(math.isnan, values))


# ---- experiment ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "stop"),
    [(math.nan, None), (math.inf, None), (0.0, math.nan), (0.0, math.inf), (1.0, 0.5), (-math.inf, 0.0)],
)
def test_times_of_the_experiment(new, start, stop):
    instance = new()
    with refused(instance, "start time", "stop time"):
        assert instance.call("fmi2SetupExperiment", False, 0.0, start, stop is not None, stop or 0.0) == ERROR
    instance.initialize()


@pytest.mark.parametrize("tolerance", [0.0, -1.0, math.nan, 1e300])
def test_any_tolerance_will_do(new, tolerance):
    """There is nothing to iterate."""
    assert new().call("fmi2SetupExperiment", True, tolerance, 0.0, False, math.nan) == OK


# ---- geometry ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[(f"L{n}", value) for n in (2, 3, 6, 7) for value in (0.0, -0.1, 1e-7, 1e7)],
        *[(f"L{n}", value) for n in (1, 4, 5, 8, 9) for value in (-0.1, 1e-7, 1e7)],
        *[(name, value) for name in ("XC", "YC", "XG", "YG") for value in (1e7, -1e7)],
    ],
)
def test_impossible_geometry(new, name, value):
    """Refused when it is set, with the range that interface.toml declares; the greatest and the least are in it."""
    instance, parameter = new().setup().enter(), INTERFACE[f"geometry.{name}"]
    least, greatest = parameter.smallest or parameter.range[0], parameter.range[1]
    with refused(instance, "fmi2SetReal", f"{parameter.name} = {value:g}: ", f"from {least:g} to {greatest:g}"):
        assert instance.try_set({parameter.name: value}) == ERROR
    for limit in (least, greatest):
        assert instance.try_set({parameter.name: limit}) == OK
    instance.set({parameter.name: parameter.start}).exit().step(0.0, 0.01)


@pytest.mark.parametrize("name", ["L1", "L4", "L5", "L8", "L9", "XC", "YC", "XG", "YG"])
def test_lengths_that_may_be_zero(new, name):
    """An arm of no length is a point. Whether the linkage closes then is another question."""
    instance = new().setup().enter().set({f"geometry.{name}": 0.0})
    assert instance.try_get(["tip.x"])[0] in (OK, DISCARD)


# ---- serialized states ---------------------------------------------------------------------------


def test_a_state_of_the_wrong_size(new):
    instance = between_steps(new())
    right = instance.serialize()
    for wrong in (right[:-1], right + b"\0", right[:8], right[:-8], right + bytes(8)):
        with refused(instance, "bytes", str(len(wrong)), str(len(right))):
            status, state = instance.try_deserialize(wrong)
            assert status == ERROR and not state
    empty = c_void_p()
    with refused(instance, "0 bytes"):
        assert instance.call("fmi2DeSerializeFMUstate", ctypes.create_string_buffer(1), 0, byref(empty)) == ERROR


def test_a_damaged_state(new):
    """A flipped bit, wherever it is."""
    instance = between_steps(new())
    right = instance.serialize()
    for place in range(len(right)):
        damaged = bytearray(right)
        damaged[place] ^= 1 << place % 8
        status, state = instance.try_deserialize(bytes(damaged))
        assert status == ERROR and not state, f"byte {place}"
        assert instance.last_message.category == "logStatusError"
    assert instance.serialize() == right


@pytest.mark.parametrize("content", [bytes, lambda n: b"\xff" * n, lambda n: b"PK\3\4" * (n // 4)])
def test_bytes_that_are_no_state(new, content):
    instance = between_steps(new())
    foreign = content(len(instance.serialize()))
    with refused(instance, "no state of this component"):
        assert instance.try_deserialize(foreign)[0] == ERROR


def fnv1a(content: bytes) -> int:
    """The checksum of a serialized state, for those who would fit their own content with it."""
    value = 0xCBF29CE484222325
    for byte in content:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value


HEADER = 40  # bytes: magic, version, interface, payload size, checksum


@pytest.mark.parametrize(("word", "said"), [(1, "version"), (2, "another interface"), (3, "another interface")])
def test_a_state_of_another_release(new, word, said):
    instance = between_steps(new())
    other = bytearray(instance.serialize())
    other[8 * word : 8 * word + 8] = (99).to_bytes(8, "little")
    with refused(instance, said):
        assert instance.try_deserialize(bytes(other))[0] == ERROR


def test_a_forged_state_cannot_crash(new):
    """Right size, header and checksum, but values that no component saves: refused, or harmless."""
    instance = between_steps(new())
    right, not_a_number = instance.serialize(), b"\xff" * 8
    assert fnv1a(right[HEADER:]) == int.from_bytes(right[HEADER - 8 : HEADER], "little")
    refusals = 0
    for place in range(HEADER, len(right), 8):
        forged = bytearray(right)
        forged[place : place + 8] = not_a_number
        forged[HEADER - 8 : HEADER] = fnv1a(forged[HEADER:]).to_bytes(8, "little")
        status, state = instance.try_deserialize(bytes(forged))
        refusals += status == ERROR
        if status == OK:
            instance.restore(state)
            instance.try_get(instance.fmu.names("output"))
            instance.try_step(instance.last_successful_time(), 0.01)
            instance.call("fmi2CancelStep")
    assert refusals > COUNT, "at least the variables and the mode are looked at"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("geometry.L3", 0.0),
        ("geometry.L1", 1e-9),
        ("geometry.YG", -1e7),
        ("crank.smoothing", -1.0),
        ("crank.phi", 1e60),
    ],
)
def test_a_state_beyond_the_range_of_a_parameter(new, name, value):
    """Fitted with its checksum, it is refused; the greatest input is not."""
    instance = between_steps(new())
    forged, known = bytearray(instance.serialize()), INTERFACE["geometry.L7"]
    # the variables lie in the order of their references
    place = bytes(forged).index(struct.pack("<d", instance.get(known.name)[0]), HEADER)
    place += 8 * (INTERFACE[name].value_reference - known.value_reference)
    forged[place : place + 8] = struct.pack("<d", value)
    forged[HEADER - 8 : HEADER] = fnv1a(forged[HEADER:]).to_bytes(8, "little")
    if name == "crank.phi":
        assert instance.try_deserialize(bytes(forged))[0] == OK
        return
    with refused(instance, "makes no sense"):
        assert instance.try_deserialize(bytes(forged))[0] == ERROR


@pytest.mark.parametrize("size", [0, 1, 100])
def test_a_buffer_too_small(new, size):
    instance = between_steps(new())
    state, buffer = instance.save(), ctypes.create_string_buffer(b"\x55" * 200, 200)
    with refused(instance, "too small"):
        assert instance.call("fmi2SerializeFMUstate", state, buffer, size) == ERROR
    assert buffer.raw == b"\x55" * 200


# ---- logging -------------------------------------------------------------------------------------


@pytest.mark.parametrize("category", [b"logEverything", b"", None])
def test_unknown_log_categories(new, category):
    instance = new()
    with refused(instance, "category"):
        assert instance.call("fmi2SetDebugLogging", True, 2, (c_char_p * 2)(b"logAll", category)) == ERROR


def test_every_function_refuses_what_is_not_allowed():
    """Each function of the standard is met in this file or in the table of modes."""
    assert {function for function, _, _ in CALLS} | set(WITH_POINTERS) >= set(OF_AN_INSTANCE)
