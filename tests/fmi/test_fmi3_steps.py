"""FMI 3.0 steps: the bits of FMI 2.0, and the two ways to outputs without lag: Event Mode and intermediate update."""

from __future__ import annotations

import itertools
import math

import pytest

from fmu_src.oracle.tables import rows
from tests.harness.drive import angle_and_speed, angle_only, distances, drive, exact_tip, uneven
from tests.harness.host import DISCARD, ERROR, OK, bits
from tests.harness.host3 import Instance3
from tests.harness.life import BEGINNING, END, MODES, OPEN, OPEN_ANGLE, begin, tell

pytestmark = pytest.mark.parametrize("version", [3], ids=["fmi3"])

INPUTS = {"crank.phi": 1.3, "crank.w": 5.0, "crank.a": -20.0, "machine.v": 0.4, "tip.fx": 20.0, "tip.fy": -70.0}


@pytest.fixture
def new2(fmus):
    """Makes instances of the FMI 2.0 FMU whose stories have no input derivatives."""
    made = []

    def make():
        made.append(fmus[2].instance())
        made[-1].has_input_derivatives = False
        return made[-1]

    yield make
    for instance in made:
        instance.free()


# ---- the same bits -------------------------------------------------------------------------------


@pytest.mark.parametrize("at_step_end", [False, True])
def test_the_bits_of_fmi2(new, new2, at_step_end):
    """Outputs, their derivatives, directional derivatives and states: one component behind both."""
    one, other = begin(new(), at_step_end), begin(new2(), at_step_end)
    assert tell(one, 0, END) == tell(other, 0, END)
    assert one.serialize() == other.serialize(), "a state of one version goes on in the other"
    outputs = one.fmu.names("output")
    wanted = [(name, order) for name in outputs for order in (1, 2)]
    assert bits(one.get_derivatives(*wanted)) == bits(other.get_derivatives(*wanted))
    for name in one.fmu.names("input"):
        assert bits(one.sensitivity(outputs, {name: 1.0})) == bits(other.sensitivity(outputs, {name: 1.0}))


def test_a_state_moves_between_the_versions(new, new2):
    """Begun in FMI 2.0, gone on with in FMI 3.0."""
    begun, whole = begin(new2()), begin(new2())
    told = tell(begun, 0, BEGINNING) + tell(new().deserialize(begun.serialize()), BEGINNING, END)
    assert told == tell(whole, 0, END)


@pytest.mark.parametrize("mode", MODES)
def test_the_states_of_fmi2_in_every_mode(new, fmus, mode):
    with fmus[2].instance() as instance:
        content = MODES[mode](instance).serialize()
        assert new().deserialize(content).serialize() == content


def test_what_a_step_tells(new):
    """Section 4.2.1: no event, no end, no early return of its own; the time reached."""
    instance = new().initialize(start=2.0)
    assert instance.do_step(2.0, 0.25) == (OK, False, False, False, 2.25)
    assert instance.do_step(3.0, 0.25) == (ERROR, False, False, False, 2.25)
    instance = new().initialize(OPEN | {"crank.phi": 1.0}).set({"crank.phi": OPEN_ANGLE})
    assert instance.do_step(0.0, 0.25) == (DISCARD, False, False, False, 0.0)
    assert instance.do_step(0.0, 0.25) == (ERROR, False, False, False, 0.0), "the same step again is an error"


@pytest.mark.parametrize("step", [0.0, -0.1, math.nan, math.inf])
def test_a_step_that_is_none_calls_nobody_back(new, step):
    called = []
    instance = new(intermediate=lambda *arguments: called.append(arguments)).initialize()
    assert instance.try_step(0.0, step) == ERROR and instance.try_step(0.7, 0.1) == ERROR
    assert called == []


# ---- Event Mode ----------------------------------------------------------------------------------


def stepped(instance: Instance3, steps: int = 6, giving=angle_and_speed) -> Instance3:
    """Along the uneven rotation to 6 ms."""
    instance.initialize({"crank.phi": 0.0}).to("Step")
    drive(instance, uneven(), [i * 1e-3 for i in range(steps + 1)], giving)
    return instance


def test_event_mode_begins_at_the_start_and_goes_on(new):
    """After initialization the outputs follow the inputs, as in initialization mode."""
    instance = new(event_mode=True).initialize({"crank.phi": 0.3})
    fresh = new().setup().enter()
    for row in rows("nominal")[::50]:
        values = INPUTS | {"crank.phi": row.phi}
        assert bits(instance.set(values).outputs()) == bits(fresh.set(values).outputs())
    assert bits(instance.to("Step").outputs()) == bits(fresh.outputs())


def test_inputs_of_the_first_event_mode_are_the_first_samples(new):
    """As those of initialization mode, where the inputs before a step belong to its end."""
    start = {"crank.phi": 1.0, "machine.v": 0.4}
    for smoothing, rates in ((0.0, {}), (0.02, {}), (0.0, {"crank.w": 7.0})):
        parameters = {"crank.at_step_end": True, "crank.smoothing": smoothing}
        late = new(event_mode=True).initialize(parameters).set({"crank.phi": 0.2, "crank.w": 0.0})
        early = new(event_mode=True).initialize(parameters | start | rates)
        for instance in (late.set(start | rates), early):
            instance.to("Step")
            for i in range(5):
                instance.step(i * 1e-3, 1e-3, {"crank.phi": 1.0 + 7e-3 * (i + 1)})
        assert bits(late.outputs()) == bits(early.outputs())
        assert late.get("machine.s") == pytest.approx([0.4 * 5e-3], abs=1e-15)


def test_event_mode_changes_nothing_by_itself(new):
    """Entered and left: outputs and steps to the bit as if it had not been."""
    one, other = stepped(new(event_mode=True)), stepped(new(event_mode=True))
    before = bits(one.outputs())
    assert bits(one.to("Event").outputs()) == before
    assert bits(one.to("Step").outputs()) == before
    for i in range(6, 12):
        told = [instance.set({"crank.phi": 0.1 * i}).step(i * 1e-3, 1e-3).outputs() for instance in (one, other)]
        assert bits(told[0]) == bits(told[1])


def test_outputs_follow_the_inputs_in_event_mode(new):
    """All rates given: to the bit the outputs of these inputs, but for the travel, which is a state."""
    instance, other = (stepped(new(event_mode=True)) for _ in range(2))
    fresh = new().setup().enter()
    for one in (instance, other):
        one.step(6e-3, 1e-3, {"machine.v": 0.5})
    fresh.set(INPUTS | {"machine.s": other.get("machine.s")[0]})
    instance.to("Event")  # its travel has not been read before
    assert bits(instance.set(INPUTS).outputs()) == bits(fresh.outputs())
    assert instance.get("der(machine.s)") == [INPUTS["machine.v"]]
    for name in instance.fmu.names("input"):
        outputs = instance.fmu.names("output")
        assert instance.sensitivity(outputs, {name: 1.0}) == fresh.sensitivity(outputs, {name: 1.0})
    for angle in (2.0, 0.5, 2.0):  # an algebraic loop tries again and again
        assert instance.set({"crank.phi": angle}).get("tip.x") == fresh.set({"crank.phi": angle}).get("tip.x")
    assert bits(instance.to("Step").outputs()) == bits(fresh.outputs()), "also when Event Mode is left"


def test_rates_that_the_host_does_not_give_stay_as_predicted(new):
    instance = stepped(new(event_mode=True), giving=angle_only).to("Event")
    rotation, t = uneven(), 6e-3
    before = instance.get("tip.vx", "tip.ax")
    instance.set({"crank.phi": rotation.phi(t)})
    exact = exact_tip(rotation, [t])[0]
    assert instance.get("tip.x")[0] == pytest.approx(exact[0], abs=1e-15), "no lag"
    assert instance.get("tip.vx", "tip.ax") == pytest.approx(before, rel=1e-3)
    assert instance.get("tip.vx")[0] == pytest.approx(exact[2], abs=1e-5)


def test_event_mode_does_not_disturb_the_prediction(new):
    """Inputs that were set in Event Mode are those of the next step, and no sample more than these."""
    rotation, times = uneven(), [i * 1e-3 for i in range(40)]
    plain = drive(new().initialize(), rotation, times, angle_only)
    instance, found = new(event_mode=True).initialize().to("Step"), []
    for start, end in itertools.pairwise(times):
        instance.to("Event").set({"crank.phi": 7.0}).set({"crank.phi": rotation.phi(start)}).to("Step")
        instance.step(start, end - start)
        found.append(instance.get("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay"))
    assert [bits(row) for row in found] == [bits(row) for row in plain]


def test_a_wrapped_angle_in_event_mode(new):
    """An angle modulo one turn is still taken as continuing by the next step."""
    rotation, times = uneven(), [0.9 + i * 1e-3 for i in range(60)]
    plain = drive(new().initialize(start=0.9), rotation, times, angle_only)
    instance, found = new(event_mode=True).initialize(start=0.9).to("Step"), []
    for start, end in itertools.pairwise(times):
        instance.to("Event").set({"crank.phi": rotation.phi(start) % (2 * math.pi)}).to("Step").step(start, end - start)
        found.append(instance.get("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay"))
    assert found == [pytest.approx(list(row), abs=1e-6) for row in plain]


def test_a_state_saved_in_event_mode(new):
    instance = stepped(new(event_mode=True)).to("Event").set(INPUTS)
    outputs, state = bits(instance.outputs()), instance.save()
    instance.to("Step").step(6e-3, 1e-3)
    assert bits(instance.restore(state).outputs()) == outputs
    other = new(event_mode=True).deserialize(instance.serialize(state))
    assert bits(other.outputs()) == outputs
    assert bits(other.to("Step").step(6e-3, 1e-3).outputs()) == bits(instance.to("Step").step(6e-3, 1e-3).outputs())


def test_an_unreachable_pose_in_event_mode(new):
    """Reading it is a Discard; other inputs mend it, and the steps go on."""
    instance = new(event_mode=True).initialize(OPEN | {"crank.phi": 1.0}).to("Step").step(0.0, 0.1).to("Event")
    assert instance.set({"crank.phi": OPEN_ANGLE}).try_get(["tip.x"])[0] == DISCARD
    assert "ABD" in instance.last_message.text
    assert instance.set({"crank.phi": 1.1}).try_get(["tip.x"])[0] == OK
    assert instance.to("Step").try_step(0.1, 0.1) == OK


def test_update_discrete_states_tells_of_nothing(new):
    instance = new(event_mode=True).initialize().to("Step").to("Event")
    assert instance.slave.updateDiscreteStates.__name__  # fmpy's own call, as hosts make it
    instance.slave.component = instance.component
    assert instance.slave.updateDiscreteStates() == (False, False, False, False, False, 0.0)


# ---- intermediate update -------------------------------------------------------------------------


def test_who_is_called_when(new):
    """At the start, where values are final and early return may be asked for; at the end, where inputs are wanted."""
    seen = []
    for early_return in (False, True):
        instance = new(early_return=early_return, intermediate=lambda i, *told: seen.append(told)).initialize()
        assert instance.do_step(0.0, 0.25) == (OK, False, False, False, 0.25)
    # time, set requested, get allowed, step finished, can return early
    at_end = (0.25, True, True, False, False)
    assert seen == [(0.0, False, True, True, False), at_end, (0.0, False, True, True, True), at_end]


@pytest.mark.parametrize("h", [1e-3, 1e-2])
def test_inputs_at_the_end_leave_no_lag(new, h):
    """The host gives the inputs of the instant that the outputs belong to: exact, for any rotation and step."""
    rotation = uneven()

    def give(instance: Instance3, time: float, set_requested: bool, *_) -> None:
        if set_requested:
            instance.set({"crank.phi": rotation.phi(time), "crank.w": rotation.w(time), "crank.a": rotation.a(time)})

    times = [i * h for i in range(50)]
    instance, found = new(intermediate=give, required=["crank.phi"]).initialize({"crank.w": rotation.w(0)}), []
    for start, end in itertools.pairwise(times):
        instance.step(start, end - start)
        found.append(instance.get("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay"))
    off = abs(exact_tip(rotation, times[1:]) - found).max(axis=0)
    assert (off <= [1e-15] * 2 + [1e-14] * 2 + [5e-13] * 2).all(), off


def test_inputs_at_the_end_are_samples_of_the_next_step(new):
    """The prediction in between is that of a host which sets the same values before each step."""
    rotation, times = uneven(), [i * 1e-3 for i in range(40)]
    predicted = []

    def give(instance: Instance3, time: float, set_requested: bool, *_) -> None:
        if set_requested:
            predicted.append(instance.get("tip.x", "tip.y"))
            instance.set({"crank.phi": rotation.phi(time)})

    plain = drive(new().initialize(), rotation, times, angle_only)
    instance = new(intermediate=give).initialize()
    for start, end in itertools.pairwise(times):
        instance.step(start, end - start)
    assert [bits(row) for row in predicted] == [bits(row[:2]) for row in plain]
    off = distances(plain, exact_tip(rotation, times[1:]))
    assert off[5:].max() > 1e-12, "the prediction alone has an error"


def test_a_host_that_sets_nothing_changes_nothing(new):
    def look(instance: Instance3, *_) -> None:
        instance.outputs()
        instance.get_derivatives(("tip.x", 1))

    assert tell(begin(new(intermediate=look)), 0, END) == tell(begin(new()), 0, END)


def test_setting_at_the_start_is_refused(new):
    """intermediateVariableSetRequested is false there: the inputs of that instant were set before the step."""
    statuses = []

    def give(instance: Instance3, time: float, set_requested: bool, *_) -> None:
        statuses.append(instance.try_set({"crank.phi": 0.1}))

    new(intermediate=give).initialize().step(0.0, 0.1)
    assert statuses == [ERROR, OK]


@pytest.mark.parametrize(("wanted", "reached"), [(0.1, 0.1), (0.2499, 0.2499), (0.25, 0.25), (0.7, 0.25)])
def test_early_return(new, wanted, reached):
    """The step ends where the host wants it to, if that is within it; all that follows is as after such a step."""
    instance = new(early_return=True, intermediate=lambda i, t, *_: wanted if t == 0.0 else None).initialize(INPUTS)
    plain = new().initialize(INPUTS)
    assert instance.do_step(0.0, 0.25) == (OK, False, False, reached < 0.25, reached)
    assert bits(instance.outputs()) == bits(plain.step(0.0, reached).outputs())
    assert bits(instance.step(reached, 0.1).outputs()) == bits(plain.step(reached, 0.1).outputs())


@pytest.mark.parametrize("wanted", [0.0, -1.0])
def test_early_return_at_once(new, wanted):
    """Nothing is done."""
    instance = new(early_return=True, intermediate=lambda *_: wanted).initialize(INPUTS)
    before = instance.serialize()
    assert instance.do_step(0.0, 0.25) == (OK, False, False, True, 0.0)
    assert instance.serialize() == before


def test_no_early_return_where_the_host_cannot(new):
    """earlyReturnAllowed was false: the request does not count."""
    instance = new(early_return=False, intermediate=lambda *_: 0.1).initialize(INPUTS)
    assert instance.do_step(0.0, 0.25) == (OK, False, False, False, 0.25)


def test_early_return_after_next_to_nothing(new):
    """A host's clock that is off by less than the step tolerates is no error where the step then ends early."""
    wanted = 1e-3 + 1e-9
    instance = new(
        early_return=True, intermediate=lambda self, time, *flags: wanted if time > 0.9e-3 and flags[-1] else None
    ).initialize()
    instance.step(0.0, 1e-3)
    assert instance.do_step(1e-3 + 4e-10, 1e-3) == (OK, False, False, True, wanted)


def test_early_return_at_a_time_that_is_none(new):
    instance = new(early_return=True, intermediate=lambda *_: math.nan).initialize(INPUTS)
    assert instance.do_step(0.0, 0.25) == (OK, False, False, False, 0.25)


def test_a_discarded_step_in_an_update(new):
    """The host is told at the start only; the state is as before, and the next step finds it so."""
    seen = []
    instance = new(intermediate=lambda i, t, *_: seen.append(t)).initialize(OPEN | {"crank.phi": 1.0})
    assert instance.set({"crank.phi": OPEN_ANGLE}).try_step(0.0, 0.1) == DISCARD
    assert seen == [0.0]
    assert instance.set({"crank.phi": 1.0}).try_step(0.0, 0.1) == OK and seen == [0.0, 0.0, 0.1]


@pytest.mark.parametrize(
    ("speed", "step", "status"),
    [(3.75, 0.1, DISCARD), (1e59, 1e250, ERROR)],
    ids=["discarded", "beyond all numbers"],
)
def test_a_step_that_is_not_done_leaves_what_followed_the_inputs(new, speed, step, status):
    """Outputs that follow inputs set in Event Mode lie where the next step is prepared."""
    steady = INPUTS | {"crank.phi": OPEN_ANGLE - 0.75, "crank.w": 3.75, "crank.a": 0.0}
    one, other = (new(event_mode=True).initialize(OPEN | steady).to("Step").step(0.0, 0.1) for _ in range(2))
    for instance in (one, other):
        instance.to("Event").set({"crank.phi": OPEN_ANGLE - 0.375, "crank.w": speed, "tip.fx": 5.0, "tip.fy": 7.0})
    assert one.to("Step").try_step(0.1, step) == status
    names = one.fmu.names("output")
    assert bits(one.get(*names)) == bits(other.to("Step").get(*names))


@pytest.mark.parametrize("name", ["geometry.L1", "time", "crank.at_step_end", "der(machine.s)", 0, 1000])
def test_intermediate_variables_are_inputs_and_outputs(new, name):
    assert new(required=["crank.phi", "tip.x", "machine.s"]).component is not None
    instance = new(required=["crank.phi", name] if isinstance(name, str) else [name])
    assert instance.component is None and "requiredIntermediateVariables" in instance.last_message.text
