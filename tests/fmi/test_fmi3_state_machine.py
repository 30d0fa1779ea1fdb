"""FMI 3.0: which call is allowed when (sections 2.3, 3.2 and 4.2), for both interface types."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import byref, c_bool, c_double, c_int32, c_size_t, c_uint64, c_void_p
from typing import NamedTuple

import pytest

from tests.harness.host import DISCARD, ERROR, OK, bits
from tests.harness.host3 import CLOCK_FUNCTIONS, FUNCTIONS, Instance3
from tests.harness.life import OPEN, OPEN_ANGLE, STEP, begin, tell

pytestmark = pytest.mark.parametrize("version", [3], ids=["fmi3"])

# ---- every mode of an instance's life: each calls `act` on an instance that is in it ---------------

Act = Callable[[Instance3], None]
TIME = 3 * STEP


def initializing(instance: Instance3) -> Instance3:
    return instance.setup().enter().set(OPEN | {"crank.phi": 1.0})


def stepped(instance: Instance3) -> Instance3:
    initializing(instance).exit().to("Step")
    for i in range(3):
        instance.step(i * STEP, STEP, {"crank.phi": 1 + 0.06 * i, "crank.w": 6.0, "machine.v": 0.4})
    return instance


def instantiated(make: Callable, act: Act, **options) -> None:
    act(make(**options))


def in_initialization(make: Callable, act: Act, **options) -> None:
    act(initializing(make(**options)))


def in_event_mode(make: Callable, act: Act, **options) -> None:
    instance = make(**options)
    act(initializing(instance).exit() if options.get("model_exchange") else stepped(instance).to("Event"))


def in_continuous_time(make: Callable, act: Act, **options) -> None:
    act(initializing(make(**options)).exit().to("ContinuousTime"))


def between_steps(make: Callable, act: Act, **options) -> None:
    act(stepped(make(**options)))


def after_a_discarded_step(make: Callable, act: Act, **options) -> None:
    instance = stepped(make(**options)).set({"crank.phi": OPEN_ANGLE, "crank.w": 0.0})
    assert instance.try_step(TIME, STEP) == DISCARD
    act(instance.set({"crank.phi": 1.2}))


def in_update(at_end: bool) -> Callable:
    """Within fmi3DoStep, at its start or at its end."""

    def visit(make: Callable, act: Act, **options) -> None:
        acted = []

        def update(instance: Instance3, time: float, set_requested: bool, *_) -> None:
            if set_requested == at_end and time >= TIME + at_end * STEP / 2:
                acted.append(time)
                act(instance)

        instance = stepped(make(intermediate=update, **options))
        instance.try_step(TIME, STEP)
        assert acted == [TIME + STEP if at_end else TIME]

    return visit


def terminated(make: Callable, act: Act, **options) -> None:
    if options.get("model_exchange"):
        return in_continuous_time(make, lambda i: (i.call("fmi3Terminate"), act(i)), **options)
    return between_steps(make, lambda i: (i.call("fmi3Terminate"), act(i)), **options)


BEFORE, INITIALIZATION, EVENT, CONTINUOUS = (
    "before initialization", "in initialization mode", "in event mode", "in continuous-time mode"
)  # fmt: skip
STEPS, REFUSED, END = "between steps", "after a discarded step", "after termination"
AT_START, AT_END = "in an intermediate update at the start of a step", "in an intermediate update at the end of a step"
CO_SIMULATION = {
    BEFORE: instantiated, INITIALIZATION: in_initialization, EVENT: in_event_mode, STEPS: between_steps,
    REFUSED: after_a_discarded_step, AT_START: in_update(False), AT_END: in_update(True), END: terminated,
}  # fmt: skip
MODEL_EXCHANGE = {
    BEFORE: instantiated, INITIALIZATION: in_initialization, EVENT: in_event_mode, CONTINUOUS: in_continuous_time,
    END: terminated,
}  # fmt: skip
TYPES = {"CS": (CO_SIMULATION, {"event_mode": True}), "ME": (MODEL_EXCHANGE, {"model_exchange": True})}
PLACES = [(type_, mode) for type_, (modes, _) in TYPES.items() for mode in modes]

# ---- every function: its arguments, and where it is allowed ----------------------------------------

UPDATES, STEPPING = {AT_START, AT_END}, {STEPS, REFUSED}
SETTING = {BEFORE, INITIALIZATION, EVENT, CONTINUOUS, *STEPPING, AT_END}
GETTING = SETTING | {AT_START, END}
UNTIL_START = {BEFORE, INITIALIZATION}
DERIVATIVES = {INITIALIZATION, EVENT, CONTINUOUS, *STEPPING, END}
ANYWHERE = GETTING - UPDATES  # with the state of the instance, which a step in progress needs
NOWHERE: set[str] = set()


class Call(NamedTuple):
    """A function of FMI 3.0, arguments for it, and the states in which it is legal."""

    function: str
    arguments: Callable[[Instance3], tuple]
    co_simulation: set[str]
    model_exchange: set[str]


def both(function: str, arguments: Callable[[Instance3], tuple], modes: set[str]) -> Call:
    return Call(function, arguments, modes, modes)


def one(name: str, c_type: type, value: float) -> Callable[[Instance3], tuple]:
    return lambda i: (i.references([name]), 1, (c_type * 1)(value), 1)


def none(count: int) -> Callable[[Instance3], tuple]:
    return lambda i: (None, 0, *[None] * count, 0)


def derivative(i: Instance3) -> tuple:
    unknown, known = i.references(["tip.x"]), i.references(["crank.phi"])
    return unknown, 1, known, 1, (c_double * 1)(1.0), 1, (c_double * 1)(), 1


def new_state(i: Instance3) -> tuple:
    i._states.append(state := c_void_p())
    return (byref(state),)


def serialized(i: Instance3) -> tuple:
    content = i.serialize()
    i._states.append(state := c_void_p())
    return ctypes.create_string_buffer(content, len(content)), len(content), byref(state)


def flags(count: int) -> tuple:
    return tuple(byref(c_bool()) for _ in range(count))


def co_simulation(function: str, arguments: Callable[[Instance3], tuple], modes: set[str]) -> Call:
    return Call(function, arguments, modes, NOWHERE)


def model_exchange(function: str, arguments: Callable[[Instance3], tuple], modes: set[str]) -> Call:
    return Call(function, arguments, NOWHERE, modes)


def values(i: Instance3) -> tuple:
    return (c_double * 1)(1.0), 1


CALLS = [
    both("fmi3SetDebugLogging", lambda i: (True, 0, None), GETTING),
    both("fmi3EnterInitializationMode", lambda i: (False, 0.0, 0.0, False, 0.0), {BEFORE}),
    both("fmi3ExitInitializationMode", lambda i: (), {INITIALIZATION}),
    both("fmi3EnterEventMode", lambda i: (), {CONTINUOUS, *STEPPING}),
    both("fmi3Terminate", lambda i: (), {EVENT, CONTINUOUS, *STEPPING}),
    both("fmi3Reset", lambda i: (), ANYWHERE),
    both("fmi3GetFloat64", one("tip.x", c_double, 0), GETTING),
    both("fmi3GetFloat64", one("geometry.L1", c_double, 0), GETTING),
    both("fmi3SetFloat64", one("crank.phi", c_double, 1.0), SETTING),
    both("fmi3SetFloat64", one("geometry.L1", c_double, 0.05), UNTIL_START),
    Call("fmi3SetFloat64", one("machine.s", c_double, 1.0), UNTIL_START, UNTIL_START | {EVENT, CONTINUOUS}),
    both("fmi3SetFloat64", one("tip.x", c_double, 1.0), NOWHERE),
    both("fmi3SetFloat64", one("time", c_double, 1.0), NOWHERE),
    both("fmi3SetFloat64", one("der(machine.s)", c_double, 1.0), NOWHERE),
    both("fmi3GetBoolean", one("crank.at_step_end", c_bool, 0), GETTING),
    both("fmi3SetBoolean", one("crank.at_step_end", c_bool, 0), UNTIL_START),
    *[
        both(f"fmi3{verb}{type_}", none(1), GETTING if verb == "Get" else SETTING)
        for type_ in ("Float32", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "String")
        for verb in ("Get", "Set")
    ],
    both("fmi3GetBinary", none(2), GETTING),
    both("fmi3SetBinary", none(2), SETTING),
    both("fmi3GetClock", lambda i: (None, 0, None), {EVENT}),
    both("fmi3SetClock", lambda i: (None, 0, None), {EVENT}),
    both("fmi3GetIntervalDecimal", lambda i: (None, 0, None, None), {INITIALIZATION, EVENT}),
    both("fmi3GetIntervalFraction", lambda i: (None, 0, None, None, None), {INITIALIZATION, EVENT}),
    both("fmi3GetShiftDecimal", lambda i: (None, 0, None), {INITIALIZATION}),
    both("fmi3GetShiftFraction", lambda i: (None, 0, None, None), {INITIALIZATION}),
    both("fmi3SetIntervalDecimal", lambda i: (None, 0, None), {INITIALIZATION, EVENT}),
    both("fmi3SetIntervalFraction", lambda i: (None, 0, None, None), {INITIALIZATION, EVENT}),
    both("fmi3SetShiftDecimal", lambda i: (None, 0, None), {INITIALIZATION}),
    both("fmi3SetShiftFraction", lambda i: (None, 0, None, None), {INITIALIZATION}),
    both("fmi3GetNumberOfVariableDependencies", lambda i: (8, byref(c_size_t())), NOWHERE),
    both("fmi3GetVariableDependencies", lambda i: (8, None, None, None, None, 0), NOWHERE),
    both("fmi3EnterConfigurationMode", lambda i: (), NOWHERE),
    both("fmi3ExitConfigurationMode", lambda i: (), NOWHERE),
    both("fmi3ActivateModelPartition", lambda i: (1, 0.0), NOWHERE),
    both("fmi3GetFMUState", new_state, ANYWHERE),
    both("fmi3SetFMUState", lambda i: (i.save(),), ANYWHERE),
    both("fmi3FreeFMUState", lambda i: (byref(c_void_p()),), ANYWHERE),
    both("fmi3SerializedFMUStateSize", lambda i: (i.save(), byref(c_size_t())), ANYWHERE),
    both("fmi3SerializeFMUState", lambda i: (i.save(), ctypes.create_string_buffer(4096), 4096), ANYWHERE),
    both("fmi3DeserializeFMUState", serialized, ANYWHERE),
    both("fmi3GetDirectionalDerivative", derivative, DERIVATIVES),
    both("fmi3GetAdjointDerivative", derivative, DERIVATIVES),
    both("fmi3EvaluateDiscreteStates", lambda i: (), {EVENT}),
    both("fmi3UpdateDiscreteStates", lambda i: (*flags(5), byref(c_double())), {EVENT}),
    co_simulation("fmi3EnterStepMode", lambda i: (), {EVENT}),
    co_simulation(
        "fmi3GetOutputDerivatives",
        lambda i: (i.references(["tip.x"]), 1, (c_int32 * 1)(1), (c_double * 1)(), 1),
        {EVENT, *STEPPING, *UPDATES, END},
    ),
    co_simulation("fmi3DoStep", lambda i: (TIME, STEP, True, *flags(3), byref(c_double())), STEPPING),
    model_exchange("fmi3EnterContinuousTimeMode", lambda i: (), {EVENT}),
    model_exchange("fmi3CompletedIntegratorStep", lambda i: (True, *flags(2)), {CONTINUOUS}),
    model_exchange("fmi3SetTime", lambda i: (0.5,), {EVENT, CONTINUOUS}),
    model_exchange("fmi3SetContinuousStates", values, {CONTINUOUS}),
    model_exchange("fmi3GetContinuousStates", values, DERIVATIVES),
    model_exchange("fmi3GetContinuousStateDerivatives", values, DERIVATIVES),
    model_exchange("fmi3GetNominalsOfContinuousStates", values, DERIVATIVES),
    model_exchange("fmi3GetEventIndicators", lambda i: (None, 0), DERIVATIVES),
    model_exchange("fmi3GetNumberOfEventIndicators", lambda i: (byref(c_size_t()),), DERIVATIVES | {BEFORE}),
    model_exchange("fmi3GetNumberOfContinuousStates", lambda i: (byref(c_size_t()),), DERIVATIVES | {BEFORE}),
]
# In an intermediate update no state can be had to call these with.
WITHOUT_STATES = {
    "fmi3GetFMUState": (None,), "fmi3SetFMUState": (None,), "fmi3FreeFMUState": (None,),
    "fmi3SerializedFMUStateSize": (None, None), "fmi3SerializeFMUState": (None, None, 0),
    "fmi3DeserializeFMUState": (None, 0, None),
}  # fmt: skip
ELSEWHERE = {name for name in FUNCTIONS if "Instantiate" in name} | {"fmi3GetVersion", "fmi3FreeInstance"}


def test_the_table_is_complete(version):
    assert {call.function for call in CALLS} | ELSEWHERE == set(FUNCTIONS)


@pytest.mark.parametrize(("type_", "mode"), PLACES)
@pytest.mark.parametrize("number", range(len(CALLS)), ids=[f"{n}-{c.function}" for n, c in enumerate(CALLS)])
def test_each_call_in_each_mode(new, number, type_, mode):
    """Allowed: it is done. Not allowed: refused with a message, and nothing has changed."""
    call = CALLS[number]
    modes, options = TYPES[type_]
    is_allowed = mode in (call.co_simulation if type_ == "CS" else call.model_exchange)
    seen = []

    def act(instance: Instance3) -> None:
        is_without_states = mode in UPDATES and call.function in WITHOUT_STATES
        arguments = WITHOUT_STATES[call.function] if is_without_states else call.arguments(instance)
        before = None if mode in UPDATES else instance.serialize()
        instance.messages.clear()
        status = instance.call(call.function, *arguments)
        seen.append(status)
        if is_allowed:
            assert status == OK, instance.last_message.text
            assert instance.messages == []
        else:
            assert status == ERROR
            assert before is None or instance.serialize() == before
            (message,) = instance.messages
            assert message.text.startswith(f"{call.function}: ")
            is_about_mode = call.co_simulation | call.model_exchange
            assert not is_about_mode or mode in message.text or "set" in message.text

    modes[mode](new, act, **options)
    assert seen, "the mode was never reached"


@pytest.mark.parametrize("mode", [STEPS, REFUSED])
def test_event_mode_only_where_the_host_said_so(new, mode):
    """Section 2.3.1: fmi3EnterEventMode must not be called where eventModeUsed was false."""
    instance = initializing(new()).exit()
    assert instance.try_step(0.0, STEP) == OK
    before = instance.serialize()
    assert instance.call("fmi3EnterEventMode") == ERROR and "eventModeUsed" in instance.last_message.text
    assert instance.serialize() == before


def test_the_other_interface_type_is_named(new):
    """A call of Model Exchange in co-simulation is told so, and the other way about."""
    instance = initializing(new())
    assert instance.call("fmi3GetContinuousStates", *values(instance)) == ERROR
    assert "in Co-Simulation" in instance.last_message.text
    other = initializing(new(model_exchange=True)).exit()
    assert other.call("fmi3EnterStepMode") == ERROR and "in Model Exchange" in other.last_message.text


@pytest.mark.parametrize("function", CLOCK_FUNCTIONS)
def test_there_are_no_clocks(new, function):
    instance = initializing(new())
    number, decimals, integers = instance.references([1]), (c_double * 1)(), (c_uint64 * 1)()
    qualifiers = ((c_int32 * 1)(),) if "GetInterval" in function else ()
    arguments = (decimals,) if function.endswith("Decimal") else (integers, integers)
    assert instance.call(function, number, 1, *arguments, *qualifiers) == ERROR
    assert "no variables of this type" in instance.last_message.text


def test_freeing_within_a_step_is_refused(new):
    """The step that called back needs the instance."""

    def update(instance: Instance3, *_) -> None:
        instance.slave.dll.fmi3FreeInstance(instance.component)

    instance = initializing(new(intermediate=update)).exit()
    assert instance.try_step(0.0, STEP) == OK
    assert [message.text.split(":")[0] for message in instance.messages] == ["fmi3FreeInstance"] * 2
    assert instance.outputs()


def test_freeing_nothing(fmu):
    fmu.load().dll.fmi3FreeInstance(None)


def test_version(fmu):
    assert fmu.load().dll.fmi3GetVersion() == b"3.0"


@pytest.mark.parametrize(("type_", "mode"), [place for place in PLACES if place[1] not in UPDATES])
def test_reset_gives_the_start_values(new, type_, mode):
    """Section 2.3.1: as after instantiation; a second life is like the first."""
    modes, options = TYPES[type_]
    fresh = new(**options).serialize()

    def act(instance: Instance3) -> None:
        assert instance.call("fmi3Reset") == OK
        assert instance.serialize() == fresh
        if type_ == "CS":
            begin(instance).to("Step")
            assert tell(instance, 0, 12) == tell(begin(new(**options)).to("Step"), 0, 12)

    modes[mode](new, act, **options)


@pytest.mark.parametrize(("source_type", "source"), [place for place in PLACES if place[1] not in UPDATES])
def test_a_state_brings_its_mode_along(new, source_type, source):
    """Restored in another instance of its type, it allows what its mode allows; in one of the other, it is refused."""
    modes, options = TYPES[source_type]
    _, other_options = TYPES["ME" if source_type == "CS" else "CS"]

    def act(instance: Instance3) -> None:
        content, twin, stranger = instance.serialize(), new(**options), new(**other_options)
        assert twin.deserialize(content).serialize() == content
        assert bits(twin.outputs()) == bits(instance.outputs())
        for function in ("fmi3ExitInitializationMode", "fmi3EnterStepMode", "fmi3EnterContinuousTimeMode"):
            assert twin.call(function) == instance.call(function), function
            assert twin.serialize() == instance.serialize(), function
        status, state = stranger.try_deserialize(content)
        assert status == OK
        assert stranger.call("fmi3SetFMUState", state) == ERROR
        assert "other interface type" in stranger.last_message.text

    modes[source](new, act, **options)
