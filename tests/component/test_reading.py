"""Outputs are computed when they are read: which, when and how often must not change a bit of them."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

import pytest

from tests.harness.host import DISCARD, Instance, bits
from tests.harness.masses import MASSES

STEP = 10e-3
STEPS = 25


def inputs(i: int) -> dict[str, float]:
    return {
        "crank.phi": 0.068 * i + 1e-3 * i * i,
        "crank.w": 6.8 + 0.2 * i,
        "crank.a": 20.0 if i % 3 else 0.0,
        "machine.v": 0.4 + 0.01 * i,
        "tip.fx": -10.0 * i,
        "tip.fy": 80.0,
    }


def eagerly(instance: Instance) -> list[float]:
    return instance.outputs()


def one_by_one(instance: Instance) -> list[float]:
    return [instance.get(name)[0] for name in instance.fmu.names("output")]


def backwards(instance: Instance) -> list[float]:
    return instance.get(*reversed(instance.fmu.names("output")))[::-1]


def at_random(instance: Instance) -> list[float]:
    """In pieces of any size and order, some of them twice."""
    names, chance = instance.fmu.names("output"), random.Random(repr(instance.last_successful_time()))
    values: dict[str, float] = {}
    while len(values) < len(names):
        piece = chance.choices(names, k=chance.randint(1, 5))
        for name, value in zip(piece, instance.get(*piece), strict=True):
            assert values.setdefault(name, value) == value
    return [values[name] for name in names]


def highest_derivatives_first(instance: Instance) -> list[float]:
    """Fourth derivatives by the angle are there before the position is asked for."""
    instance.get_derivatives(("tip.ay", 2), ("assembly.margin", 2), ("crank.tau", 2))
    instance.sensitivity(["tip.ax", "crank.tau", "tip.angle"], {"crank.phi": 1.0, "tip.fx": 2.0})
    return instance.outputs()


def derivatives_between(instance: Instance) -> list[float]:
    values = []
    for i, name in enumerate(instance.fmu.names("output")):
        instance.get_derivatives((name, 1 + i % 2))
        values += instance.get(name)
    return values


def twice(instance: Instance) -> list[float]:
    values = instance.outputs()
    assert bits(instance.outputs()) == bits(values)
    return values


def from_a_saved_state(instance: Instance) -> list[float]:
    return instance.restore(instance.save()).outputs()


def run(instance: Instance, read: Callable[[Instance], list[float]], every: int = 1) -> dict[int, list[str]]:
    """Reads after every so many steps: step to bits."""
    instance.initialize({"crank.phi": 0.0} | MASSES)
    found = {-1: bits(read(instance))}
    for i in range(STEPS):
        instance.step(i * STEP, STEP, inputs(i))
        if i % every == 0:
            found[i] = bits(read(instance))
    return found


@pytest.mark.parametrize(
    "read",
    [
        one_by_one,
        backwards,
        at_random,
        highest_derivatives_first,
        derivatives_between,
        twice,
        from_a_saved_state,
    ],
)
def test_the_order_of_reading_changes_no_bit(new, read):
    assert run(new(), read) == run(new(), eagerly)


@pytest.mark.parametrize("every", [2, 7, STEPS - 1])
def test_not_reading_changes_no_bit(new, every):
    """A host that reads now and then finds what one finds that reads always."""
    all_of_them, some = run(new(), eagerly), run(new(), eagerly, every)
    assert some == {i: all_of_them[i] for i in some} and len(some) < len(all_of_them)


def test_every_single_output_alone(new, fmu):
    """Nothing has to be read before it."""
    expected = dict(zip(fmu.names("output"), run(new(), eagerly)[STEPS - 1], strict=True))
    for name, value in expected.items():
        found = run(new(), lambda instance, name=name: instance.get(name), STEPS - 1)
        assert found[STEPS - 1] == [value], name


def test_reading_leaves_the_state_alone(new):
    """Its bytes are the same before and after."""
    instance = new().initialize()
    for i in range(6):
        instance.step(i * STEP, STEP, inputs(i))
    before = instance.serialize()
    instance.outputs()
    assert instance.serialize() == before
    highest_derivatives_first(instance)
    assert instance.serialize() == before


def test_a_value_read_is_made_anew_for_the_next_step(new):
    """Nothing stale is left of the last step, nor of the inputs before the first."""
    instance = new().setup().enter().set(MASSES)
    for name in instance.fmu.names("output"):
        seen = set()
        for angle in (0.5, 1.5, 2.5):
            seen |= set(instance.set({"crank.phi": angle, "crank.w": 1.0 + angle, "tip.fx": 3.0}).get(name))
        assert len(seen) == (1 if name == "machine.s" else 3), name
    instance.exit()
    for name in instance.fmu.names("output"):
        seen = set()
        for _ in range(3):
            time = instance.last_successful_time()
            values = {"crank.phi": 0.5 + time, "crank.w": 1.0 + time**2, "machine.v": 1.0, "tip.fx": 3.0}
            seen |= set(instance.step(time, STEP, values).get(name))
        assert len(seen) == 3, name


def test_a_pose_that_cannot_be_had_spares_what_can(new):
    """machine.s needs no pose."""
    instance = new().setup().enter().set({"geometry.L2": 0.01, "machine.s": 2.0})
    assert instance.get("machine.s", "time") == [2.0, 0.0]
    status, values = instance.try_get(["machine.s", "tip.x"])
    assert status == DISCARD and all(map(math.isnan, values)), "none is given where one of them is missing"


def test_derivatives_too_are_given_all_or_none(new):
    """A status that is not OK leaves the caller's array as it was."""
    instance = new().initialize({"geometry.L2": 0.097, "geometry.L3": 0.097}).set({"crank.phi": 5.75})
    status, values = instance.try_get_derivatives(("machine.s", 1), ("tip.x", 1))
    assert status == DISCARD and all(map(math.isnan, values))
    status, values = instance.try_sensitivity(["machine.s", "tip.x"], {"crank.phi": 1.0})
    assert status == DISCARD and all(map(math.isnan, values))
