"""Several instances in one process: none knows of another (canBeInstantiatedOnlyOncePerProcess is false)."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

from tests.conftest import BOTH_VERSIONS
from tests.harness.host import Instance
from tests.harness.life import END, begin, tell

pytestmark = BOTH_VERSIONS


def scaled(instance: Instance, number: int) -> Instance:
    """Each with a geometry of its own."""
    return instance.initialize({"geometry.L1": 0.05 + 1e-4 * number, "crank.at_step_end": number % 2 == 1})


def test_interleaved(new):
    """Step by step in turn: the same bits as one after the other."""
    expected = [tell(scaled(new(), number), 0, END) for number in range(5)]
    instances = [scaled(new(f"number {number}"), number) for number in range(5)]
    told: list[list[str]] = [[] for _ in instances]
    for moment in range(END):
        for number, instance in enumerate(instances):
            told[number] += tell(instance, moment, moment + 1)
    assert told == expected


def test_in_threads(fmu):
    """At the same time: fmpy lets go of the interpreter's lock in each call."""
    threads, repeats = 4, 5
    together = threading.Barrier(threads)

    def run(number: int, wait: bool) -> list[str]:
        told = []
        with fmu.instance(f"number {number}") as instance:
            if wait:
                together.wait()
            for _ in range(repeats):
                told += tell(scaled(instance, number), 0, END)
                instance.call("fmi2Reset")
        return told

    expected = [run(number, wait=False) for number in range(threads)]
    with ThreadPoolExecutor(threads) as pool:
        found = list(pool.map(lambda number: run(number, wait=True), range(threads)))
    assert found == expected


def test_freeing_one_leaves_the_others(new):
    doomed, other, alone = begin(new()), begin(new()), begin(new())
    tell(doomed, 0, 9)
    first = tell(other, 0, 9)
    doomed.free()
    assert first + tell(other, 9, END) == tell(alone, 0, END)


def test_messages_go_to_the_instance_that_they_are_about(new):
    """By componentEnvironment and by name."""
    instances = [new(name) for name in ("left", "right")]
    for instance in instances:
        instance.call("fmi2ExitInitializationMode")
    for instance, name in zip(instances, ("left", "right"), strict=True):
        assert [message.instance for message in instance.messages] == [name]
