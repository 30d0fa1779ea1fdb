"""The FMI 3.0 FMU as a WebAssembly component, run by wasmtime beside the native binary: same bits, states and words."""

from __future__ import annotations

import math
from ctypes import c_double

import pytest

from fmu_src.exporter.fmi_ls_wasm import PAGES, SCALARS, web_assembly_content
from tests.harness.drive import uneven
from tests.harness.host import DISCARD, ERROR, bits
from tests.harness.life import MODES, STEP, begin, tell

pytest.importorskip("wasmtime", reason="wasmtime, which runs WebAssembly, is not installed")
wasm_host = pytest.importorskip("tests.harness.wasm_host")

EMPTY_OF_CLOCKS = ("interval-decimal", "interval-fraction", "shift-decimal", "shift-fraction")


@pytest.fixture(scope="module")
def component(interface, fmus):
    (content,) = (data for name, data in web_assembly_content(interface).items() if name.endswith(".wasm"))
    return wasm_host.ComponentFmu(content, fmus[3])


@pytest.fixture
def both(component, fmus):
    """Makes two instances with the same arguments: of the native binary, and of the component."""
    made = []

    def make(**options):
        pair = fmus[3].instance(**options), component.instance(**options)
        made.extend(pair)
        return pair

    yield make
    for instance in made:
        instance.free()


def alike(pair, answer):
    """What `answer` gives of the native instance, when the component's gives the same."""
    native, other = (answer(instance) for instance in pair)
    assert other == native
    return native


def test_it_fits_both_worlds(component):
    """Imports beyond what co-simulation-fmu and model-exchange-fmu share would keep one host or the other off."""
    assert component.imports() == {"fmi:fmi3/types@3.0.0", "fmi:fmi3/callbacks@3.0.0"}
    assert component.exports() == {f"fmi:fmi3/{name}@3.0.0" for name in ("common", "co-simulation", "model-exchange")}
    assert component.run().call("common", "get-version") == "3.0"


# ---- the native bits ---------------------------------------------------------------------------------


def test_co_simulation(both):
    """2000 steps of several lengths, every output; parameters off the nominal, the speed given in the second half."""
    pair, motion = both(), uneven()

    def answers(instance):
        instance.initialize({"geometry.L1": 0.0501, "geometry.theta3": 0.31, "machine.s": 4.0})
        numbers, time = [], 0.0
        for i in range(2000):
            step = 1e-3 * (1 + i % 3)
            given = {"crank.phi": motion.phi(time), "machine.v": 0.4 + 1e-5 * i, "tip.fy": -3.0 * (i % 5)}
            if i >= 1000:
                given["crank.w"] = motion.w(time)
            instance.step(time, step, given)
            time += step
            numbers += bits(instance.outputs())
        return numbers

    assert len(alike(pair, answers)) >= 20000


def test_model_exchange(both):
    """2000 instants, every output and the state's derivative, the state integrated by Euler's method."""
    pair, motion = both(model_exchange=True), uneven()

    def answers(instance):
        instance.initialize({"geometry.L1": 0.0498}).to("ContinuousTime")
        numbers, travel = [], (c_double * 1)()
        for i in range(2000):
            time = 1e-3 * i
            instance.demand(instance.call("fmi3SetTime", time), "fmi3SetTime")
            instance.demand(instance.call("fmi3SetContinuousStates", travel, 1), "fmi3SetContinuousStates")
            instance.set({"crank.phi": motion.phi(time), "crank.w": motion.w(time), "machine.v": 0.4 + 1e-5 * i})
            (slope,) = instance.get("der(machine.s)")
            travel[0] += 1e-3 * slope
            numbers += bits([slope, *instance.outputs()])
        return numbers

    assert len(alike(pair, answers)) >= 20000


def test_what_model_exchange_alone_has(component):
    with component.instance(model_exchange=True) as instance:
        instance.initialize({"machine.v": 0.4, "machine.s": 2.0})
        info = vars(instance.method("update-discrete-states"))
        assert info.pop("next-event-time") == 0.0 and len(info) == 5 and not any(info.values())
        instance.to("ContinuousTime")
        assert instance.method("get-continuous-states") == [2.0]
        assert instance.method("get-continuous-state-derivatives") == [0.4]
        assert instance.method("get-nominals-of-continuous-states") == [1.0]
        assert instance.method("get-event-indicators") == []
        assert instance.method("get-number-of-continuous-states") == 1
        assert instance.method("get-number-of-event-indicators") == 0
        step = vars(instance.method("completed-integrator-step", True))
        assert step == {"enter-event-mode": False, "terminate-simulation": False}


def test_derivatives(both, fmus):
    """Adjoint by every parameter of the geometry, directional by every input, output derivatives."""
    outputs = fmus[3].names("output")
    geometry = [name for name in fmus[3].names("parameter") if name.startswith("geometry.")]

    def answers(instance):
        seed = {name: 1 + 0.1 * k for k, name in enumerate(fmus[3].names("input"))}
        weights = {name: 1 + 0.3 * k for k, name in enumerate(outputs)}
        instance.setup().enter().set({"crank.phi": 1.0, "crank.w": 6.0, "tip.fx": 9.0})
        adjoint = bits(instance.adjoint(weights, geometry))
        instance.exit()
        tell(instance, 0, 25)
        slopes = instance.get_derivatives(("tip.x", 1), ("tip.y", 2), ("ground.vx", 1))
        return bits(instance.sensitivity(outputs, seed)), adjoint, bits(slopes)

    directional, adjoint, slopes = alike(both(), answers)
    assert (len(directional), len(adjoint), len(slopes)) == (len(outputs), len(geometry), 3)


# ---- states ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", MODES)
def test_a_state_has_the_native_bytes(both, mode):
    alike(both(), lambda instance: MODES[mode](instance).serialize())


@pytest.mark.parametrize("of", [0, 1], ids=["native", "component"])
def test_a_state_goes_on_over_there(both, of):
    """Saved where one side runs, restored where the other does: the story ends with the same bits, and state."""
    pair, others = both(), both()
    whole = tell(begin(pair[of]), 0, 40)
    told = tell(begin(others[of]), 0, 12)
    told += tell(others[1 - of].deserialize(others[of].serialize()), 12, 40)
    assert told == whole and others[1 - of].serialize() == pair[of].serialize()


def test_a_state_of_the_other_kind_or_damaged(both):
    co_simulation, model_exchange = both(), both(model_exchange=True)
    state = co_simulation[0].serialize()
    for serialized in (model_exchange[0].serialize(), state[:-1], state[:50] + b"\x07" + state[51:], b""):
        assert co_simulation[1].method("set-fmu-state", serialized) == "error"
    assert co_simulation[1].serialize() == state


# ---- errors and messages -------------------------------------------------------------------------------


def test_refusals(both):
    """The native status and words of calls that are refused, and a state that none of them has changed."""

    def answers(instance):
        instance.initialize({"geometry.L2": 0.097, "geometry.L3": 0.097})
        refused = [
            instance.try_get([99999])[0],
            instance.try_set({"tip.x": 1.0}),
            instance.try_set({"crank.phi": math.nan}),
            instance.call("fmi2EnterInitializationMode"),
            instance.call("fmi3EnterStepMode"),
            instance.call("fmi3EnterConfigurationMode"),
            instance.try_step(0.5, STEP),
        ]
        instance.set({"crank.phi": 5.75})
        discarded = instance.try_step(0.0, STEP)
        return refused, discarded, [message.text for message in instance.messages], instance.serialize()

    refused, discarded, texts, _ = alike(both(), answers)
    assert refused == [ERROR] * 7 and discarded == DISCARD and len(texts) == 8
    assert any("dyad" in text or "mm" in text for text in texts)


def test_messages_name_the_instance(component):
    with component.instance("Säer 3 – links") as instance:
        assert instance.try_get([99999])[0] == ERROR
        assert instance.running.logged == [
            ("Säer 3 – links", "error", "logStatusError", instance.messages[0].text),
        ]
        assert instance.method("set-debug-logging", True, ["logEvents", "logStatusError"]) == "ok"
        assert instance.method("set-debug-logging", True, ["logEvents", "no such"]) == "error"
        assert "unknown category" in instance.messages[-1].text


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"guid": "{0}"}, "instantiation token"),
        ({"name": ""}, "instance name"),
        ({"name": "a\0b"}, "instance name"),
        ({"required": ["tip.x"]}, "required-intermediate-variables"),
    ],
)
def test_no_instance(component, options, said):
    instance = component.instance(**options)
    assert instance.component is None and said in instance.messages[0].text
    if "guid" in options or "name" in options:
        assert component.instance(model_exchange=True, **options).component is None


def test_types_without_variables(component):
    """Nothing is answered for no reference; any reference or value is refused."""
    with component.instance(event_mode=True) as instance:
        instance.initialize()
        for name in (*SCALARS, *EMPTY_OF_CLOCKS):
            value = {"boolean": True, "clock": True, "string": "a", "binary": b"a", "float32": 1.0, "float64": 1.0}.get(
                name, 1
            )
            set_only_before = name.startswith("shift") or name == "clock"
            nothing = b"" if name == "uint8" else "error" if name.startswith("shift") else []  # wasmtime's words
            assert instance.method(f"get-{name}", []) == nothing, name
            assert instance.method(f"get-{name}", [99999]) == "error", name
            if name not in EMPTY_OF_CLOCKS:
                one, none = (b"a", b"") if name == "uint8" else ([value], [])
                assert instance.method(f"set-{name}", [], one) == "error", name
                assert set_only_before or instance.method(f"set-{name}", [], none) == "ok", name


def test_what_fmi_3_does_not_have(component):
    with component.instance() as instance:
        instance.initialize()
        assert instance.method("set-input-derivatives", [], []) == "ok"
        assert instance.method("set-input-derivatives", [(2, 1)], [1.0]) == "error"
        assert instance.messages[-1].text.startswith("set-input-derivatives: FMI 3.0 has no")
        assert instance.method("get-number-of-variable-dependencies", 2) == "error"
        assert instance.method("get-variable-dependencies", 2) == "error"
        assert instance.try_get_derivatives(("tip.x", 4_000_000_000))[0] == ERROR


# ---- memory --------------------------------------------------------------------------------------------


def test_calls_and_instances_leave_nothing_behind(component):
    """In 512 KB more than the memory has to begin with: calls that pass 2.4 MB, and 600 instances of a few KB."""
    running = component.run(memory=PAGES * 65536 + (512 << 10))
    with wasm_host.ComponentInstance(running, "a") as instance:
        instance.initialize({"crank.phi": 0.1})
        for _ in range(100):
            assert instance.method("get-float64", [2] * 2000) == [0.1] * 2000
        for k in range(600):
            another = wasm_host.ComponentInstance(running, f"{k}", model_exchange=k % 2 == 1)
            assert another.component is not None, another.messages[-1].text
            another.free()
        assert instance.method("set-fmu-state", instance.serialize()) == "ok"
        instance.step(0.0, STEP)


def test_instances_side_by_side(component):
    """Two in one memory, each as if alone."""
    with component.instance() as alone:
        wanted = tell(begin(alone), 0, 20)
    running = component.run()
    pair = [wasm_host.ComponentInstance(running, name) for name in ("a", "b")]
    told = [[], []]
    for instance in pair:
        begin(instance)
    for i in range(20):
        for instance, of in zip(pair, told, strict=True):
            of.extend(tell(instance, i, i + 1))
    assert told == [wanted, wanted]
    assert not running.logged
