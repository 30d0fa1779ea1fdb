"""The host's clock: the component goes by its t and h, and never adds up time on its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import pytest

from tests.harness.host import ERROR, OK, bits

Clock = Callable[[float, float, int], Iterator[float]]


def multiplying(start: float, step: float, steps: int) -> Iterator[float]:
    return (start + i * step for i in range(steps))


def summing(start: float, step: float, steps: int) -> Iterator[float]:
    time = start
    for _ in range(steps):
        yield time
        time += step


def dividing(start: float, step: float, steps: int) -> Iterator[float]:
    per_second = round(1 / step)
    return (start + i / per_second for i in range(steps))


def counting_nanoseconds(start: float, step: float, steps: int) -> Iterator[float]:
    return (start + round(i * step * 1e9) * 1e-9 for i in range(steps))


@pytest.mark.parametrize("clock", [multiplying, summing, dividing, counting_nanoseconds])
@pytest.mark.parametrize(("start", "step", "steps"), [(0.0, 1e-3, 340_000), (1e6, 1e-4, 20_000), (-7.0, 1 / 3, 20_000)])
def test_every_way_to_count_time_is_accepted(new, clock, start, step, steps):
    """Sums and products of a step drift apart by rounding, and further the longer they run."""
    if (clock, step) == (counting_nanoseconds, 1e-4):
        start = 1.0  # a million seconds leave no room for nanoseconds
    instance = new().initialize(start=start)
    do_step, component = instance.slave.dll.fmi2DoStep, instance.component
    refused = sum(do_step(component, time, step, True) for time in clock(start, step, steps))
    assert refused == OK, instance.messages[:1]
    assert instance.last_successful_time() == pytest.approx(start + steps * step, rel=1e-9)


@pytest.mark.parametrize("clocks", [(multiplying, summing), (multiplying, dividing)])
def test_outputs_do_not_depend_on_the_clock(new, clocks):
    """Inputs alone decide: the same samples at times that differ by rounding."""
    found = []
    for clock in clocks:
        instance = new().initialize({"machine.v": 0.4})
        for i, time in enumerate(clock(0.0, 1e-3, 2000)):
            instance.step(time, 1e-3, {"crank.phi": 6.8 * i * 1e-3})
        found.append(bits(instance.outputs()))
    assert found[0] == found[1]


@pytest.mark.parametrize("off", [1e-3, -1e-3, 2e-3, -2e-3, 1e-5, -1e-5, 1e-8, 1e3])
def test_a_time_that_is_off_by_more_than_rounding(new, off):
    """Refused, with both times in the message, and nothing changed."""
    instance = new().initialize().step(0.0, 1e-3, {"crank.phi": 0.1}).step(1e-3, 1e-3, {"crank.phi": 0.2})
    before = instance.serialize()
    assert instance.try_step(2e-3 + off, 1e-3) == ERROR
    message = instance.last_message
    assert message.category == "logStatusError"
    for part in ("communication point", "0.002 s", repr(2e-3 + off)[:5]):
        assert part in message.text
    assert instance.serialize() == before
    assert instance.try_step(2e-3, 1e-3) == OK


@pytest.mark.parametrize(
    ("step", "said"), [(0.0, "0 s"), (-1e-3, "-0.001 s"), (math.nan, "nan"), (math.inf, "inf"), (-math.inf, "-inf")]
)
def test_a_step_size_that_is_none(new, step, said):
    instance = new().initialize().step(0.0, 1e-3)
    before = instance.serialize()
    assert instance.try_step(1e-3, step) == ERROR
    assert "step size" in instance.last_message.text and said in instance.last_message.text
    assert instance.serialize() == before


@pytest.mark.parametrize("time", [math.nan, math.inf, -math.inf])
def test_a_time_that_is_none(new, time):
    instance = new().initialize()
    before = instance.serialize()
    assert instance.try_step(time, 1e-3) == ERROR
    assert instance.serialize() == before


@pytest.mark.parametrize("step", [1e-12, 1e-6, 1.0, 3600.0])
def test_small_and_large_steps(new, step):
    """Any positive step will do: the crank's speed is what makes it too coarse."""
    instance = new().initialize({"machine.v": 0.5})
    for i in range(4):
        instance.step(i * step, step, {"crank.phi": 0.3 * i})
    assert instance.get("machine.s") == pytest.approx([2.0 * step], rel=1e-15)


# ---- the stop time (FMI 2.0.4, section 2.1.6) ----------------------------------------------------


def test_no_step_goes_beyond_the_stop_time(new):
    instance = new().initialize(stop=0.01)
    for i in range(9):
        instance.step(i * 1e-3, 1e-3)
    before = instance.serialize()
    assert instance.try_step(9e-3, 2e-3) == ERROR
    assert "beyond the stop time" in instance.last_message.text
    assert instance.serialize() == before
    assert instance.try_step(9e-3, 1e-3) == OK
    assert instance.try_step(10e-3, 1e-3) == ERROR


def test_the_stop_time_is_met_to_rounding(new):
    """Ten tenths are more than one, in doubles."""
    instance, time = new().initialize(stop=1.0), 0.0
    for _ in range(10):
        instance.step(time, 0.1 + 1e-17)
        time += 0.1
    instance = new().initialize(stop=0.3)
    instance.step(0.0, 0.1).step(0.1, 0.1).step(0.2, 0.1)  # 0.2 + 0.1 > 0.3


def test_without_a_stop_time_there_is_no_end(new):
    new().initialize().step(0.0, 1e9)
