"""Instances in every mode of their life, and a long story to replay."""

from __future__ import annotations

from collections.abc import Callable

from tests.harness.host import DISCARD, OK, Instance

STEP = 10e-3
OPEN = {"geometry.L2": 0.097, "geometry.L3": 0.097}  # dyad ABD cannot close between 5.60 and 5.89 rad
OPEN_ANGLE = 5.75


def instantiated(instance: Instance) -> Instance:
    return instance


def in_initialization(instance: Instance) -> Instance:
    return instance.setup().enter().set(OPEN | {"crank.phi": 1.0})


def between_steps(instance: Instance) -> Instance:
    in_initialization(instance).exit()
    for i in range(3):
        instance.step(i * STEP, STEP, {"crank.phi": 1 + 0.06 * i, "crank.w": 6.0, "machine.v": 0.4})
    return instance


def after_a_discarded_step(instance: Instance) -> Instance:
    between_steps(instance).set({"crank.phi": OPEN_ANGLE, "crank.w": 0.0})
    assert instance.try_step(3 * STEP, STEP) == DISCARD
    return instance.set({"crank.phi": 1.2})


def terminated(instance: Instance) -> Instance:
    assert between_steps(instance).call("fmi2Terminate") == OK
    return instance


MODES: dict[str, Callable[[Instance], Instance]] = {
    "before initialization": instantiated,
    "in initialization mode": in_initialization,
    "between steps": between_steps,
    "after a discarded step": after_a_discarded_step,
    "after termination": terminated,
}


# ---- a story of steps of every kind --------------------------------------------------------------

BEGINNING, END = 12, 40


def tell(instance: Instance, first: int, last: int) -> list[str]:
    """Steps number `first` to `last` of a story with all that a component remembers; the bits of all outputs."""
    told = []
    time = story_time(first)
    for i in range(first, last):
        step = STEP * (1 + i % 3)
        instance.set({"crank.phi": 0.05 * i + 1e-3 * i * i, "machine.v": 0.4 + 0.01 * i, "tip.fy": -3.0 * i})
        if i % 7 == 3 and instance.has_input_derivatives:
            instance.set_derivatives({("crank.phi", 1): 5.0, ("machine.v", 2): 0.3, ("tip.fx", 1): 9.0})
        if i > 20:
            instance.set({"crank.w": 5 + 0.1 * i})
        if i > 30:
            instance.set({"crank.a": 8.0})
        instance.step(time, step)
        time += step
        told += [value.hex() for value in instance.outputs()]
    return told


def story_time(number: int) -> float:
    """When step `number` begins."""
    time = 0.0
    for i in range(number):
        time += STEP * (1 + i % 3)
    return time


def begin(instance: Instance, at_step_end: bool = False) -> Instance:
    return instance.initialize({"crank.at_step_end": at_step_end, "geometry.L1": 0.0501, "machine.s": 4.0}, stop=9.0)
