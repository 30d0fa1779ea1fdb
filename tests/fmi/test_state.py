"""The state of an instance, kept, restored and sent elsewhere (FMI 2.0.4, section 2.1.8)."""

from __future__ import annotations

import subprocess
import sys
from ctypes import byref, c_void_p, create_string_buffer
from pathlib import Path

import pytest

from tests.conftest import BOTH_VERSIONS
from tests.harness.host import ERROR, OK, bits
from tests.harness.life import BEGINNING, END, MODES, begin, between_steps, tell

pytestmark = BOTH_VERSIONS

PROJECT_ROOT = Path(__file__).resolve().parents[2]
MOMENTS = [0, 1, 2, 3, 4, 11, 12, 22, 32]


@pytest.mark.parametrize("at_step_end", [False, True])
@pytest.mark.parametrize("moment", MOMENTS)
def test_replay(new, moment, at_step_end):
    """Back at a state, all that follows is the same to the last bit, whatever came in between."""
    instance = begin(new(), at_step_end)
    tell(instance, 0, moment)
    state = instance.save()
    first_time = tell(instance, moment, END)
    assert tell(instance.restore(state), moment, END) == first_time
    assert tell(instance.restore(state), moment, END) == first_time


@pytest.mark.parametrize("at_step_end", [False, True])
@pytest.mark.parametrize("moment", MOMENTS)
def test_replay_in_another_instance(new, moment, at_step_end):
    """A state holds parameters, start values, mode and time as well; what the other one was does not matter."""
    instance, fresh, busy = begin(new(), at_step_end), new(), between_steps(new())
    tell(instance, 0, moment)
    serialized = instance.serialize()
    expected = tell(instance, moment, END)
    for other in (fresh, busy):
        assert tell(other.deserialize(serialized), moment, END) == expected
        assert other.serialize() == instance.serialize()
        assert other.get("geometry.L1") == [0.0501] and other.get_boolean("crank.at_step_end") == at_step_end


@pytest.mark.parametrize("at_step_end", [False, True])
def test_replay_in_another_process(fmu, new, tmp_path, at_step_end, version):
    """Bytes written to a file go on elsewhere to the last bit: no addresses, nothing of this process in them."""
    instance, file = begin(new(), at_step_end), tmp_path / "state"
    tell(instance, 0, BEGINNING)
    file.write_bytes(instance.serialize())
    command = [sys.executable, "-m", "tests.harness.replay", fmu.folder, fmu.callbacks, file]
    command += map(str, (BEGINNING, END, version))
    done = subprocess.run(command, cwd=PROJECT_ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == tell(instance, BEGINNING, END)
    assert file.read_bytes() == instance.serialize()


def test_inputs_and_their_derivatives_are_part_of_the_state(new):
    """What was set for the next step is there again."""
    instance = begin(new())
    tell(instance, 0, 5)
    instance.set({"crank.phi": 0.2, "machine.v": 7.0})
    if instance.has_input_derivatives:
        instance.set_derivatives({("crank.phi", 2): 30.0, ("tip.fx", 1): 2.0})
    state, time = instance.save(), instance.last_successful_time()
    expected = bits(instance.step(time, 0.01).outputs())
    instance.set({"crank.phi": 9.0, "machine.v": 0.0})
    assert bits(instance.restore(state).step(time, 0.01).outputs()) == expected


def test_start_values_are_part_of_the_state(new):
    """Saved in initialization mode: parameters, the initial travel and inputs go on in another instance."""
    instance, other = new().setup(start=2.0).enter(), new()
    instance.set({"machine.s": 4.0, "geometry.L1": 0.051, "crank.phi": 1.0, "crank.at_step_end": True})
    other.deserialize(instance.serialize())
    for one in (instance, other):
        one.set({"crank.w": 3.0})
        assert one.get("machine.s", "geometry.L1", "crank.phi", "time") == [4.0, 0.051, 1.0, 2.0]
        one.exit().step(2.0, 0.125, {"crank.phi": 1.1, "machine.v": 1.0})
    assert bits(other.outputs()) == bits(instance.outputs())
    assert other.get("machine.s") == [4.0 + 0.125 / 2]


@pytest.mark.parametrize("sign", [1, -1])
def test_the_greatest_inputs_are_part_of_the_state(new, sign, fmu):
    """All that may be set may be saved, sent and restored."""
    instance, other = new().setup().enter(), new()
    instance.set(dict.fromkeys(fmu.names("input"), sign * 1e60) | {"machine.s": -sign * 1e60})
    assert bits(other.deserialize(instance.serialize()).outputs()) == bits(instance.outputs())


def test_what_is_read_right_after_restoring_is_of_the_state(new):
    """Not of the pose that the instance happened to be in; also in another geometry."""
    instance, other = begin(new()), new().initialize({"geometry.L1": 0.052, "crank.phi": 2.0})
    tell(instance, 0, 5)
    state, expected = instance.save(), bits(instance.outputs())
    tell(instance, 5, 9)
    assert bits(instance.outputs()) != expected
    assert bits(instance.restore(state).outputs()) == expected
    other.outputs()
    other.deserialize(instance.serialize())
    assert bits(other.outputs()) == expected


def test_states_are_independent(new):
    """Any number of them; going back to one leaves the others alone."""
    instance, states, expected = begin(new()), [], []
    for moment in range(8):
        states.append(instance.save())
        expected.append(tell(instance, moment, moment + 1))
    for moment in (3, 7, 0, 5, 5, 2):
        assert tell(instance.restore(states[moment]), moment, moment + 1) == expected[moment]


def test_the_memory_of_a_state_can_be_used_again(new):
    """fmi2GetFMUstate into a state that is there: no other is made."""
    instance = begin(new())
    state = instance.save()
    address = state.value
    tell(instance, 0, 5)
    assert instance.call("fmi2GetFMUstate", byref(state)) == OK
    assert state.value == address
    assert instance.serialize(state) == instance.serialize()


@pytest.mark.parametrize("fill", [0x00, 0x01, 0xA5, 0xFF])
def test_where_a_deserialized_state_comes_from_is_not_read(new, fill):
    """*FMUstate is an output of DeSerialize, whatever the host left there (2.0.4, section 2.1.8; 3.0.2, 2.2.7.4)."""
    instance = begin(new())
    tell(instance, 0, 5)
    serialized, expected = instance.serialize(), bits(instance.outputs())
    tell(instance, 5, 9)
    # eight bytes of the host, with others around them
    room = (c_void_p * 3)(*[int.from_bytes([fill] * 8, "little")] * 3)
    before = bytes(room)
    place = byref(c_void_p.from_buffer(room, 8))
    function, buffer = "fmi2DeSerializeFMUstate", create_string_buffer(serialized, len(serialized))
    assert instance.call(function, buffer, len(serialized), place) == OK
    assert bytes(room)[:8] == before[:8] and bytes(room)[16:] == before[16:]
    state = c_void_p(room[1])
    instance._states.append(state)
    assert bits(instance.restore(state).outputs()) == expected


def test_a_state_of_the_host_is_left_alone_by_deserializing(new):
    """Where *FMUstate is a state that the host still holds: it keeps what it holds; the read one is another."""
    instance = begin(new())
    tell(instance, 0, 5)
    held, content = instance.save(), instance.serialize()
    tell(instance, 5, 9)
    serialized, place = instance.serialize(), c_void_p(held.value)
    buffer = create_string_buffer(serialized, len(serialized))
    assert instance.call("fmi2DeSerializeFMUstate", buffer, len(serialized), byref(place)) == OK
    instance._states.append(place)
    assert place.value != held.value
    assert instance.serialize(held) == content and instance.serialize(place) == serialized


def test_equal_instances_have_equal_bytes(new):
    one, other = begin(new("one", logging=True)), begin(new("the other"))
    assert tell(one, 0, END) == tell(other, 0, END)
    assert one.serialize() == other.serialize()


@pytest.mark.parametrize("target", MODES)
@pytest.mark.parametrize("source", MODES)
def test_a_state_brings_its_mode_along(new, source, target):
    """Restored in an instance in any mode, it allows what its own mode allows."""
    saved, instance = MODES[source](new()), MODES[target](new())
    serialized = saved.serialize()
    instance.deserialize(serialized)
    assert instance.serialize() == serialized
    for function in ("fmi2EnterInitializationMode", "fmi2ExitInitializationMode", "fmi2Terminate"):
        assert saved.call(function) == instance.call(function), function
        assert saved.serialize() == instance.serialize(), function


# ---- giving states back --------------------------------------------------------------------------


@pytest.mark.parametrize("mode", MODES)
def test_freeing(new, mode):
    """A state is NULL afterwards; freeing NULL is allowed (FMI 2.0.4, section 2.1.8)."""
    instance, state = MODES[mode](new()), c_void_p()
    assert instance.call("fmi2GetFMUstate", byref(state)) == OK and state
    assert instance.call("fmi2FreeFMUstate", byref(state)) == OK and not state
    assert instance.call("fmi2FreeFMUstate", byref(state)) == OK
    assert instance.call("fmi2FreeFMUstate", None) == OK
    assert instance.messages == [] or mode == "after a discarded step"


def test_no_state_cannot_be_restored(new):
    instance = between_steps(new())
    before = instance.serialize()
    assert instance.call("fmi2SetFMUstate", None) == ERROR
    assert "NULL" in instance.last_message.text
    assert instance.serialize() == before
