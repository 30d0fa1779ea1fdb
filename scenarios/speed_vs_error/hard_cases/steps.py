"""What hosts do with the crank and the clock: many turns, reversals, odd steps, jumps, wraps, steps done again."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from mpmath import mp, mpf

from scenarios.common.instance import OK, Instance, UnpackedFmu, bits
from scenarios.common.operating_point import MACHINE_SPEED, PLANTING_SPEED, TURN
from scenarios.speed_vs_error.hard_cases.driving import (
    END,
    Giving,
    Rotation,
    angle_and_speed,
    angle_around_zero,
    angle_modulo_turn,
    angle_only,
    angle_speed_acceleration,
    begin,
    distances,
    drive,
    even,
    exact_tip,
    swinging,
    tell,
)
from scenarios.speed_vs_error.hard_cases.measured import CONDITIONING, TIP, Measured, Probe, Worst
from scenarios.speed_vs_error.yardstick import NOMINAL, Oracle, conditioning, error, twin

GIVEN = 2.0  # the bound where the host gives the speed: the end of the step is rounded once more
# Four angles, each rounded by half a unit, continued by a cubic: (4 + 6 + 4 + 1)/2 units, and half a one at the end.
EXTRAPOLATED = 8.0


def measure(fmu: UnpackedFmu) -> list[Measured]:
    return [
        line
        for part in (
            turns,
            far_angles,
            sizes,
            several_turns,
            reversal,
            standstill,
            jump,
            wraps,
            set_again,
            done_again,
            absurd,
        )
        for line in part(fmu)
    ]


def off(instance: Instance, phi: mpf, speed: float, order: int = 0) -> float:
    """Error of the tip, and of its velocity for order 1, at an even speed, over the conditioning."""
    exact, allowed = Oracle(NOMINAL).tip(phi, order), conditioning(NOMINAL, float(phi), order)
    found = np.reshape(instance.get(*TIP[: 2 * order + 2]), (-1, 2)) / np.array([[1.0], [speed]][: order + 1])
    return max(error(found[n][k], exact[n][k]) / allowed[n][k] for n in range(order + 1) for k in (0, 1))


def evenly(fmu: UnpackedFmu, start: float, speed: float, steps: Sequence[float], with_speed: bool) -> float:
    """An even crank over some steps; `off` after the last one.

    The truth is the motion of the exact numbers; the angles given are these rounded.
    """
    with Instance(fmu, "even") as instance, mp.workdps(60):
        instance.initialize({"crank.phi": start})
        time = mpf(0)
        for h in steps:
            phi = float(start + speed * time)
            instance.step(float(time), h, {"crank.phi": phi} | ({"crank.w": speed} if with_speed else {}))
            time += mpf(h)
            expected = mpf(phi) + mpf(speed) * h if with_speed else start + speed * time
        return off(instance, expected, speed, int(with_speed))


def turns(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Far from the start of the count, in both directions."""
    for with_speed, bound in ((True, GIVEN), (False, EXTRAPOLATED)):
        worst = Worst()
        for count in (1e3, 1e6, 1e9):
            for sign in (1, -1):
                value = evenly(fmu, sign * count * TURN, sign * PLANTING_SPEED, [2.0**-7] * 6, with_speed)
                worst.see(value, f"{sign * count:g} turns")
        given = (
            "angle and speed given: error of position and velocity" if with_speed else "angle given: error of position"
        )
        yield Measured("crank at 1e3, 1e6, 1e9 turns, both ways", given, CONDITIONING, worst.value, bound, worst.where)


def far_angles(fmu: UnpackedFmu) -> Iterable[Measured]:
    """An angle is the number that it is: one of a billion turns costs the tip no digit."""
    worst = Worst()
    with Probe(fmu) as probe:
        for count in (0.1, 1e3, 1e6, 1e9):
            for phi in (sign * count * TURN * (1 + 0.0123456789 * k) for sign in (1, -1) for k in range(20)):
                exact = Oracle(NOMINAL).tip(phi, 0)[0]
                worst.see(max(map(error, probe.tip(NOMINAL, phi)[0], exact)), f"{phi / TURN:g} turns")
    yield Measured(
        "crank at 1e3, 1e6, 1e9 turns, both ways",
        "error of position at an angle as given",
        "m",
        worst.value,
        1e-15,
        worst.where,
    )


def sizes(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Steps of all sizes, and of sizes that change."""
    plans = {
        "h from 1e-9 s to 10 s": [[10.0**n] * 6 for n in range(-9, 2)],
        "h changing by 1e6 from step to step": [[1.0, 1e-6] * 4, [1e-3, 1e-9] * 4, [1e-9, 1e-3] * 4, [10.0, 1e-5] * 4],
    }
    for case, runs in plans.items():
        for with_speed, bound in ((True, GIVEN), (False, EXTRAPOLATED)):
            worst = Worst()
            for steps in runs:
                # angles alone do not tell of turns within a step
                if with_speed or max(steps) * PLANTING_SPEED < math.pi / 2:
                    worst.see(
                        evenly(fmu, 1.0, PLANTING_SPEED, steps, with_speed), f"h = {steps[0]:g} s, {steps[1]:g} s"
                    )
            given = (
                "angle and speed given: error of position and velocity"
                if with_speed
                else "angle given (h to 0.1 s): error of position"
            )
            yield Measured(case, given, CONDITIONING, worst.value, bound, worst.where)


def several_turns(fmu: UnpackedFmu) -> Iterable[Measured]:
    worst, jumps, case = Worst(), Worst(), "steps of several turns"
    for sign in (1, -1):
        for h in (1.0, 5.0, 7.5):
            speed, where = sign * PLANTING_SPEED, f"{sign * h * PLANTING_SPEED / TURN:.2f} turns a step"
            worst.see(evenly(fmu, 0.5, speed, [h] * 6, True), where)
            with Instance(fmu, "fast", logging=True) as instance:
                instance.initialize({"crank.phi": 0.5})
                for i in range(6):
                    instance.step(i * h, h, {"crank.phi": 0.5 + i * h * speed, "crank.w": speed})
                jumps.see(len(instance.messages), where)
    given = "angle and speed given: error of position and velocity"
    yield Measured(case, given, CONDITIONING, worst.value, GIVEN, worst.where)
    yield Measured(case, "messages of a wrap or a jump", "messages", jumps.value, 0, jumps.where)


def reversal(fmu: UnpackedFmu) -> Iterable[Measured]:
    """A crank that swings to and fro: at the turning points the speed is 0, which is not to be taken for not given."""
    swing, h = swinging(), 2e-3
    rotation = Rotation(swing.phi, lambda t: round(swing.w(t), 12), lambda t: round(swing.a(t), 12))
    assert rotation.w(125 * h) == 0
    times = [i * h for i in range(1001)]
    lever = np.abs(twin.solve(twin.Geometry(), np.linspace(-0.2, 2.2, 2401), 1).tip[1]).max()
    fourth = 1.2 * TURN**4  # rad/s4, the greatest fourth derivative of its angle
    # the leading terms: cubic of four angles, parabola of three speeds, line of two accelerations
    rungs: dict[str, tuple[Giving, float]] = {
        "angle": (angle_only, 1.0),
        "angle, speed": (angle_and_speed, 3 / 8),
        "angle, speed, acceleration": (angle_speed_acceleration, 1 / 8),
    }
    worst = Worst()
    for name, (giving, term) in rungs.items():
        with Instance(fmu, "swing") as instance:
            found = drive(instance.initialize(), rotation, times, giving)
        worst.see(distances(found, exact_tip(rotation, times[1:]))[6:].max() / (term * h**4 * fourth * lever), name)
    yield Measured(
        "reversal",
        "error of position, a swing of +-69 deg at 1 Hz, h = 2 ms",
        "times the method's error term",
        worst.value,
        1.05,
        worst.where,
    )


def differing(one: Instance, other: Instance) -> int:
    """How many outputs are not the same bits."""
    return sum(a != b for a, b in zip(bits(one.outputs()), bits(other.outputs()), strict=True))


def standstill(fmu: UnpackedFmu) -> Iterable[Measured]:
    count = Worst()
    for given in ({}, {"crank.w": 5.0}):
        with Instance(fmu, "still") as instance, Instance(fmu, "at first") as first:
            for one in (instance, first):
                one.initialize({"crank.phi": 2.0})
            instance.step(0.0, 0.01, given).step(0.01, 0.01, {"crank.phi": 2.0, "crank.w": 0.0})
            for i in range(2, 1000):
                instance.step(i * 0.01, 0.01)
            count.see(differing(instance, first), f"after {given or 'nothing'}")
    yield Measured(
        "standstill",
        "outputs that differ after 1000 steps, also where the crank has been moving",
        "outputs",
        count.value,
        0,
        count.where,
    )


def jump(fmu: UnpackedFmu) -> Iterable[Measured]:
    """From a jump on, an instance is one that starts there."""
    count, h = Worst(), 0.01
    for giving in (angle_only, angle_and_speed, angle_speed_acceleration):
        for by in (1.6, -2.5, math.pi, TURN + 2, -5 * TURN - 2, 1e6 * TURN + 2):
            with Instance(fmu, "jumped") as jumped, Instance(fmu, "fresh") as fresh:
                rotation = even(PLANTING_SPEED)
                drive(jumped.initialize(), rotation, [i * h for i in range(9)], giving)
                fresh.initialize(start=8 * h)
                for i in range(8, 14):
                    values = giving(rotation, i * h)[0]
                    values["crank.phi"] += by
                    for one in (jumped, fresh):
                        one.step(i * h, h, values)
                    count.see(differing(jumped, fresh), f"{giving.__name__}, by {by:.3g} rad")
    yield Measured("a jump", "outputs that differ from a start there", "outputs", count.value, 0, count.where)


def wraps(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Cut at a whole turn or at half a one: as if the angle went on."""
    h, worst = 0.01, Worst()
    times = [i * h for i in range(300)]
    for speed in (PLANTING_SPEED, -PLANTING_SPEED):
        rotation = even(speed)
        for giving in (angle_modulo_turn, angle_around_zero):
            for at_end in (False, True):
                with Instance(fmu, "wrapped") as instance:
                    instance.initialize({"crank.at_step_end": at_end, **giving(rotation, 0.0)[0]})
                    found = drive(instance, rotation, times, giving, given_at_end=at_end)
                worst.see(
                    distances(found, exact_tip(rotation, times[1:]))[5:].max(), f"{giving.__name__}, {speed:+.3g} rad/s"
                )
    yield Measured(
        "wrap at 2 pi and at pi, both ways", "error of position, h = 10 ms", "m", worst.value, 1e-14, worst.where
    )


def story(i: int, h: float) -> dict[str, float]:
    """Inputs with all that a component remembers."""
    t = i * h
    return {
        "crank.phi": PLANTING_SPEED * t + 0.2 * math.sin(9 * t),
        "crank.w": PLANTING_SPEED + 1.8 * math.cos(9 * t),
        "machine.v": MACHINE_SPEED * (1 + 0.1 * math.sin(5 * t)),
        "tip.fx": 3.0 * t,
        "tip.fy": -40.0,
    }


def set_again(fmu: UnpackedFmu) -> Iterable[Measured]:
    """What was set before the last values leaves no trace, be it absurd; neither do outputs read in between."""
    chance, count, h = random.Random(1), 0, 0.01
    with Instance(fmu, "set often") as often, Instance(fmu, "set once") as once:
        for one in (often, once):
            one.initialize()
        for i in range(60):
            values = story(i, h)
            for _ in range(chance.randrange(4)):
                often.set({name: chance.choice([0.0, -0.0, 5e-324, 1e60, -7.0, 1e-9]) for name in values})
                often.set_derivatives({("crank.phi", 1): 1e9, ("machine.v", 2): -3.0})
                often.outputs()
            for one in (often, once):
                one.set(values).set_derivatives({("crank.phi", 1): values["crank.w"], ("machine.v", 2): 0.5})
                one.step(i * h, h)
            count += differing(often, once)
    yield Measured(
        "inputs set several times in a step", "outputs that differ from inputs set once, 60 steps", "outputs", count, 0
    )


def done_again(fmu: UnpackedFmu) -> Iterable[Measured]:
    """A step done again after its state was restored; also with another step, refused or done, in between."""

    def count_differing(between: Callable[[Instance, float], object]) -> int:
        count = 0
        for moment in range(12):
            with Instance(fmu, "again") as instance:
                tell(begin(instance), 0, moment)
                state, time, here = instance.save(), instance.last_successful_time(), bits(instance.outputs())
                first = tell(instance, moment, END)
                instance.restore(state)
                between(instance, time)
                instance.outputs()
                count += here != bits(instance.restore(state).outputs())
                count += sum(a != b for a, b in zip(tell(instance.restore(state), moment, END), first, strict=True))
        return count

    betweens: dict[str, Callable[[Instance, float], object]] = {
        "nothing in between": lambda instance, time: None,
        "a longer step in between": lambda instance, time: instance.step(time, 0.5, {"crank.phi": 3.0}),
        "a refused step in between": lambda instance, time: instance.try_step(time + 7.0, 0.01),
    }
    count = Worst()
    for name, between in betweens.items():
        count.see(count_differing(between), name)
    yield Measured(
        "a step repeated after a restored state",
        "outputs that differ in all that follows",
        "outputs",
        count.value,
        0,
        count.where,
    )


def absurd(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Inputs and steps as small and as large as the component takes them, denormal numbers and -0.0 among them."""
    chance, nonsense, taken, refused = random.Random(2), Worst(), 0, 0
    numbers = (0.0, -0.0, 5e-324, -1e-310, 1e-60, 1e-9, 1.0, -7.0, 1e6, 1e30, -1e60, 1e60)
    steps = (5e-324, 1e-300, 1e-100, 1e-30, 1e-9, 1e-3, 10.0, 1e6, 1e30, 1e100, 1e300)
    for life in range(300):
        with Instance(fmu, "absurd") as instance:
            instance.initialize({"crank.at_step_end": chance.random() < 0.3})
            outputs, inputs = fmu.names("output"), fmu.names("input")
            steady = chance.choice(steps)
            for _ in range(12):
                values = {name: chance.choice(numbers) for name in inputs if chance.random() < 0.5}
                instance.set(values)
                if chance.random() < 0.3:
                    instance.set_derivatives(
                        {(name, chance.randrange(1, 3)): chance.choice(numbers) for name in values}
                    )
                h = steady if chance.random() < 0.8 else chance.choice(steps)
                if instance.try_step(instance.last_successful_time(), h) != OK:
                    refused += 1
                    continue
                taken += 1
                found = instance.outputs() + instance.get_derivatives(*[(name, n) for name in outputs for n in (1, 2)])
                if not all(map(math.isfinite, found)):
                    bad = [name for name, value in zip(outputs, found, strict=True) if not math.isfinite(value)]
                    nonsense.see(nonsense.value + 1, f"life {life}, h = {h:g} s, {values}, {bad}")
    yield Measured(
        "inputs to +-1e60, denormal, -0.0; h from 5e-324 s to 1e300 s",
        f"steps done whose outputs or their derivatives are no numbers (of {taken}; {refused} refused)",
        "steps",
        nonsense.value,
        0,
        nonsense.where,
    )
