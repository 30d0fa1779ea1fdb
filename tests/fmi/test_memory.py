"""Memory: from the host where it gives some, given back in full, and none of it while stepping."""

from __future__ import annotations

import subprocess
import sys
from ctypes import byref, c_void_p

import fmpy
import pytest

from tests.harness.host import ERROR, OK, Instance
from tests.harness.life import END, begin, tell


class Heap:
    """Memory callbacks that know what is out."""

    def __init__(self) -> None:
        self.out: set[int] = set()
        self.allocations = 0
        self.is_empty = False

    def allocate(self, count: int, size: int) -> int | None:
        if self.is_empty:
            return None
        self.allocations += 1
        address = fmpy.calloc(count, size)
        self.out.add(address)
        return address

    def free(self, address: int) -> None:
        self.out.remove(address)  # raises, and the test fails, where it was never out
        fmpy.free(address)


@pytest.fixture
def heap() -> Heap:
    return Heap()


def test_memory_comes_from_the_host(new, heap):
    """FMI 2.0.4, section 2.1.5: the callbacks are used where they are given."""
    instance = new(allocate=heap.allocate, free=heap.free)
    assert heap.allocations > 0 and instance.component in heap.out
    instance.free()
    assert heap.out == set()


def test_states_come_from_the_host_and_are_given_back(new, heap):
    instance = begin(new(allocate=heap.allocate, free=heap.free))
    before = set(heap.out)
    state, other = instance.save(), instance.save()
    assert heap.out == before | {state.value, other.value}
    _, third = instance.try_deserialize(instance.serialize(state))
    assert heap.out == before | {state.value, other.value, third.value}
    for one in (other, state, third):
        assert instance.call("fmi2FreeFMUstate", byref(one)) == OK
    assert heap.out == before
    assert instance.call("fmi2GetFMUstate", byref(state)) == OK
    instance.free()
    assert heap.out == set()


def test_no_memory_callback_while_stepping(new, heap):
    instance = begin(new(allocate=heap.allocate, free=heap.free))
    before = heap.allocations
    tell(instance, 0, END)
    assert heap.allocations == before


@pytest.mark.skipif(sys.platform != "linux", reason="the counting host takes the place of glibc's malloc")
def test_no_allocation_while_stepping(fmu, compile_host):
    """Not behind the callbacks either: a host of its own counts every malloc of the process."""
    command = [compile_host("allocations"), fmu.library, fmu.description.guid]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    while_instantiating, while_stepping = map(int, done.stdout.split())
    assert while_instantiating > 0, "the host sees what the FMU allocates"
    assert while_stepping == 0


@pytest.mark.skipif(sys.platform != "linux", reason="the counting host takes the place of glibc's malloc")
def test_loaded_and_freed_a_thousand_times(fmus, compile_host):
    """Both versions in one process, both interface types of each: the same bits, no leak, nothing allocated between."""
    command = [compile_host("loads"), fmus[2].library, fmus[3].library, fmus[2].description.guid, "1000"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()) == (0, ["0", "0"]), done.stderr


@pytest.mark.parametrize("given", [{"allocate": None, "free": None}, {"allocate": None}, {"free": None}])
def test_memory_callbacks_may_be_missing(new, given):
    """A host that has none leaves both NULL; one of the two alone is of no use."""
    expected = tell(begin(new()), 0, END)
    instance = begin(new(**given))
    state = instance.save()
    assert tell(instance, 0, END) == expected
    instance.restore(state)
    instance.free()


# ---- no memory left ------------------------------------------------------------------------------


def test_no_memory_for_an_instance(fmu, heap):
    heap.is_empty = True
    instance = Instance(fmu, allocate=heap.allocate, free=heap.free)
    assert instance.component is None
    assert "memory" in instance.last_message.text


def test_no_memory_for_a_state(new, heap):
    instance = begin(new(allocate=heap.allocate, free=heap.free))
    serialized = instance.serialize()
    heap.is_empty = True
    state = c_void_p()
    assert instance.call("fmi2GetFMUstate", byref(state)) == ERROR and not state
    assert "memory" in instance.last_message.text
    status, state = instance.try_deserialize(serialized)
    assert status == ERROR and not state and "memory" in instance.last_message.text
    heap.is_empty = False
    assert instance.serialize() == serialized
