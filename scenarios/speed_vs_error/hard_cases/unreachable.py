"""Poses that the geometry cannot reach: entered, left, at initialization, tried for ever."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial

from scenarios.common.instance import DISCARD, ERROR, OK, Instance, UnpackedFmu, bits
from scenarios.speed_vs_error.hard_cases.driving import OPEN, OPEN_ANGLE, STEP
from scenarios.speed_vs_error.hard_cases.measured import Measured, Worst

PATIENCE = 5000  # tries after which a host counts as one that never ends
LIMIT = 1000  # as component.h states it
EDGES = (5.4, 6.1)  # rad: dyad ABD closes there, on both sides of OPEN_ANGLE


def measure(fmu: UnpackedFmu) -> list[Measured]:
    return [line for part in (through, at_initialization, stubborn_hosts) for line in part(fmu)]


def started(fmu: UnpackedFmu, phi: float, w: float = 1.0) -> Instance:
    """Two steps on, at the angle phi, rad, where a third is taken: the crank has come there at the speed w, rad/s."""
    before = phi - 2 * STEP * w
    instance = Instance(fmu, "open").initialize(OPEN | {"crank.phi": before, "crank.w": w, "machine.v": 0.4})
    return instance.step(0.0, STEP).step(STEP, STEP, {"crank.phi": before + STEP * w})


def traceless(instance: Instance, call: Callable[[], int], expected: int) -> int:
    """1 where a call has another status than expected, or changes an output or the state; else 0.

    After a discarded step the state tells of it in its mode alone, which allows what it allowed before.
    """
    outputs, settings = bits(instance.outputs()), instance.get(*instance.fmu.names("input"), "time")
    status = call()
    return int(
        status != expected
        or bits(instance.outputs()) != outputs
        or instance.get(*instance.fmu.names("input"), "time") != settings
    )


def through(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Crank turns into the gap, in both directions and steps of many sizes; comes out on its own or on the far side."""
    traces, later = Worst(), Worst()
    for direction, (near, far) in ((1, EDGES), (-1, EDGES[::-1])):
        for h in (1e-6, 1e-3, 0.35):
            for leave in (near, far):
                with started(fmu, near, direction) as instance, started(fmu, near, direction) as plain:
                    aim = {"crank.phi": OPEN_ANGLE - direction * h, "crank.w": float(direction)}
                    instance.set(aim)
                    where = f"{'forwards' if direction > 0 else 'backwards'}, h = {h:g} s"
                    traces.see(
                        traces.value + traceless(instance, partial(instance.try_step, 2 * STEP, h), DISCARD), where
                    )
                    for i in range(2, 9):
                        values = {"crank.phi": leave + 1e-3 * i, "crank.w": 0.1, "machine.v": 0.5}
                        for one in (instance, plain):
                            one.step(i * STEP, STEP, values)
                        later.see(
                            sum(a != b for a, b in zip(bits(instance.outputs()), bits(plain.outputs()), strict=True)),
                            where,
                        )
    yield Measured(
        "an unreachable pose, entered in a run",
        "refused steps that change an output, an input or the time",
        "steps",
        traces.value,
        0,
        traces.where,
    )
    yield Measured(
        "an unreachable pose, left again",
        "outputs that differ from a run that never tried",
        "outputs",
        later.value,
        0,
        later.where,
    )


def at_initialization(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Refused with a message as often as it is tried; goes on once the angle can be reached."""
    wrong = 0
    with Instance(fmu, "open") as instance:
        instance.setup().enter().set(OPEN | {"crank.phi": OPEN_ANGLE})
        before = instance.serialize()
        for _ in range(3):
            wrong += instance.try_get(["tip.x"])[0] != DISCARD or "dyad ABD" not in instance.messages[-1]
            wrong += instance.call("fmi2ExitInitializationMode") != ERROR or "dyad ABD" not in instance.messages[-1]
        wrong += instance.serialize() != before
        wrong += instance.set({"crank.phi": EDGES[0]}).try_get(["tip.x"])[0] != OK
        wrong += instance.exit().try_step(0.0, STEP) != OK
    yield Measured("an unreachable pose at initialization", "wrong statuses, messages, changes", "", wrong, 0)


def halving() -> Iterator[float]:
    h = 0.35
    while True:
        yield h
        h = h / 2 or 5e-324


def stubborn_hosts(fmu: UnpackedFmu) -> Iterable[Measured]:
    """Hosts that go on until a step is done or Error is returned; the crank stands where no pose is."""
    tries = {"the same step again and again": Worst(), "ever other steps": Worst()}
    hosts: dict[str, tuple[str, Iterator[float]]] = {
        "same step": ("the same step again and again", iter(lambda: STEP, None)),
        "two steps in turns": ("ever other steps", (STEP * (1 + i % 2) for i in range(10**9))),
        "halving": ("ever other steps", halving()),
        "growing": ("ever other steps", (STEP * (1 + i) for i in range(10**9))),
    }
    for name, (kind, sizes) in hosts.items():
        with started(fmu, EDGES[0]) as instance:
            instance.set({"crank.phi": OPEN_ANGLE, "crank.w": 0.0})
            # the derivatives are used up by a step that is done only
            instance.set_derivatives({("crank.phi", 1): 0.0})
            count = 1
            while instance.try_step(2 * STEP, next(sizes)) == DISCARD and count < PATIENCE:
                count += 1
            tries[kind].see(count, name)
    for kind, bound in (("the same step again and again", 2), ("ever other steps", LIMIT)):
        yield Measured(
            f"a host that tries {kind}",
            "tries until it is told Error",
            "tries",
            tries[kind].value,
            bound,
            tries[kind].where,
        )
