"""No step history, however ugly, makes the crank's prediction worse than 2.5 times no prediction, or keeps it wrong.

Hypothesis makes the histories (histories.py): dozens for each thing that a host can give; LINKAGE_HISTORIES=1000 tries
that many of each. Thousands of others, in C: tests/soak/histories.py.
"""

from __future__ import annotations

import itertools
import math
import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from fmu_src.twin.linkage import Geometry, solve
from tests.harness.angles import NOZZLE, TURN, angles_of
from tests.harness.histories import TAIL, History, Played, histories, play
from tests.harness.host import PLANTING_SPEED

MOST = 2.5  # times what holding the angle misses by
MOST_GROWTH = 20.0  # of a step over which a slope is carried on
SAMPLES = 4  # of a full history
LEVER = 0.27  # m/rad, more than the tip moves at any angle
ROUNDING = 64 * np.finfo(float).eps

# What a host gives of a crank beside its angle: inputs, input derivatives.
SOURCES = {
    "angle": ((), ()),
    "speed": (("w",), ()),
    "acceleration": (("w", "a"), ()),
    "one derivative": ((), ("w",)),
    "two derivatives": ((), ("w", "a")),
}


def drive(instance, played: Played, source: str, at_step_end: bool) -> np.ndarray:
    """NOZZLE and the tip's speed after each step; instance: initialized here."""
    inputs, derivatives = SOURCES[source]
    end_a = np.append(played.a[1:], played.a[-1])
    law = {"w": played.end_w, "a": end_a} if at_step_end else {"w": played.w, "a": played.a}
    angles = played.end_given if at_step_end else played.given
    rows = []
    for i, (start, end) in enumerate(zip(played.time[:-1], played.time[1:], strict=True)):
        instance.set({"crank.phi": angles[i]} | {f"crank.{name}": law[name][i] for name in inputs})
        if derivatives:
            instance.set_derivatives({("crank.phi", n + 1): law[name][i] for n, name in enumerate(derivatives)})
        instance.step(start, end - start)
        rows.append(instance.get(*NOZZLE, "tip.vx", "tip.vy"))
    return np.array(rows)


def windowed(values: np.ndarray, played: Played) -> np.ndarray:
    """The greatest of each value and those before it that the history may hold: tiny steps do not fill it."""
    steps, greatest = np.diff(played.time), np.empty(len(values))
    for i, step in enumerate(steps):
        counts = np.flatnonzero(steps[: i + 1] >= step / MOST_GROWTH)
        first = counts[-SAMPLES - 1] if len(counts) > SAMPLES else 0
        greatest[i] = values[first : i + 1].max()
    return greatest


def missed(found: np.ndarray, played: Played) -> np.ndarray:
    """By how much the angle after each step is off, rad."""
    return abs((angles_of(found) - played.end + TURN / 2) % TURN - TURN / 2)


def allowed(played: Played) -> np.ndarray:
    """2.5 times the most that holding missed by of late, a jump counting as much as the motion that went on."""
    held = windowed(np.maximum(abs(played.end - played.phi), abs(played.jump)), played)
    going_on = windowed(np.where(played.is_smooth, 0.0, played.greatest_speed), played) * np.diff(played.time)
    return MOST * held + going_on + 3e-6


def tip_speed(played: Played, w: np.ndarray) -> np.ndarray:
    velocity = solve(Geometry(), played.end, 1).velocity(w)
    return np.column_stack([velocity.real, velocity.imag])


def check(found: np.ndarray, played: Played) -> dict[str, float]:
    """The worst in each respect, in units of what is allowed."""
    off = missed(found, played)
    exact, held = (solve(Geometry(), angles, 0).tip[0] for angles in (played.end, played.phi))
    before = solve(Geometry(), played.phi - played.jump, 0).tip[0]
    distance = abs(found[:, 0] + 1j * found[:, 1] - exact)
    held_distance = np.maximum(abs(held - exact), abs(held - before))
    going_on = np.where(played.is_smooth, 0.0, played.greatest_speed * np.diff(played.time)).max() * LEVER
    speed = abs(played.end_w[-1]) + 1e-2 * abs(played.greatest_speed).max()
    settled = slice(len(off) - TAIL + 2 * SAMPLES, None)
    step = played.time[-1] - played.time[-2]
    rounding = ROUNDING * (1 + abs(played.end).max())
    off_speed = abs(found[:, 3:] - tip_speed(played, played.end_w)).max(axis=1)
    return {
        "position": (distance.max() - 1e-9) / (MOST * held_distance.max() + going_on + 1e-9),
        "angle": (off / allowed(played)).max(),
        "settled position": off[settled].max() / (0.1 * speed * step + 3e-6 + rounding),
        "settled speed": off_speed[settled].max() / (0.5 * LEVER * speed + 1e-6 + 8 * rounding / step),
    }


# ---- random histories ----------------------------------------------------------------------------

COUNT = int(os.environ.get("LINKAGE_HISTORIES", "40"))
UGLY = settings(
    max_examples=COUNT,
    deadline=None,
    derandomize="LINKAGE_HISTORIES" not in os.environ,
    database=None,
    suppress_health_check=list(HealthCheck),
)


@pytest.fixture
def instance(fmu):
    """Makes instances that the caller frees."""
    return fmu.instance


def measured(instance, history: History, source: str, **parameters: float | bool) -> dict[str, float]:
    played = play(history)
    at_step_end = bool(parameters.get("crank.at_step_end"))
    with instance() as driven:
        driven.initialize({"crank.phi": played.given[0], **parameters})
        return check(drive(driven, played, source, at_step_end), played)


@pytest.mark.parametrize("source", SOURCES)
def test_never_much_worse_than_holding(instance, source):
    """The angle at each step's end, the worst position, and what is left once all is regular again."""

    @UGLY
    @given(histories())
    def try_one(history: History) -> None:
        for respect, worst in measured(instance, history, source).items():
            assert worst <= 1.0, f"{respect}: {worst:.3g} of what is allowed"

    try_one()


@pytest.mark.parametrize("source", SOURCES)
def test_inputs_of_the_steps_end_are_taken_as_they_are(instance, source):
    """The position is the angle's, to rounding; speeds are right again once all is regular."""

    @UGLY
    @given(histories())
    def try_one(history: History) -> None:
        found = measured(instance, history, source, **{"crank.at_step_end": True})
        assert found["angle"] <= 1e-2 and found["settled speed"] <= 1.0

    try_one()


@pytest.mark.parametrize("smoothing", [0.02, 0.1])
@pytest.mark.parametrize("source", ["angle", "speed"])
def test_smoothing_is_never_much_worse_than_holding(instance, source, smoothing):
    """The worst position of a history; how soon it settles is a matter of its window."""

    @UGLY
    @given(histories())
    def try_one(history: History) -> None:
        assert measured(instance, history, source, **{"crank.smoothing": smoothing})["position"] <= 1.01  # a chord

    try_one()


# ---- what was found ------------------------------------------------------------------------------


def steps(instance, rows, values=lambda phi: {"crank.phi": phi}):
    """Steps of (length, angle); the instance."""
    t = 0.0
    for h, phi in rows:
        instance.step(t, h, values(phi))
        t += h
    return instance


def test_a_crank_that_stands_after_a_jump_stands(new):
    """Steps that grow fifteenfold after the jump: its slope is not carried on, nor taken for whole turns."""
    instance = new(logging=True).initialize()
    steps(instance, [(1e-3, 0.0)] * 100 + [(15e-3, 0.45)] * 1000)
    assert instance.get("tip.vx", "tip.vy", "tip.ax", "tip.ay") == [0.0] * 4
    assert not any("whole turns" in message.text for message in instance.messages)


@pytest.mark.parametrize("jump", [0.1, 0.5, 1.0, 1.5, -0.5])
@pytest.mark.parametrize("step", [5e-3, 15e-3])
def test_a_jump_before_longer_steps_leaves_no_trace(new, jump, step):
    """At 65 rpm: the speed of the tip is that of the crank again."""
    instance = new().initialize()
    times = [*(i * 1e-3 for i in range(101)), *(0.1 + i * step for i in range(1, 40))]
    for i, (start, end) in enumerate(itertools.pairwise(times)):
        phi = PLANTING_SPEED * start + (jump if i >= 100 else 0.0)
        instance.step(start, end - start, {"crank.phi": phi})
    exact = solve(Geometry(), PLANTING_SPEED * times[-1] + jump, 1).velocity(PLANTING_SPEED)
    assert instance.get("tip.vx", "tip.vy") == pytest.approx([exact.real, exact.imag], abs=1e-8)


@pytest.mark.parametrize(
    ("start", "lengths"),
    [(408.0, [0.5e-3 * 0.5**n for n in range(20)]), (4080.0, [1e-7] * 4), (408.0, [1e-9] * 12)],
    ids=["halving", "four equal", "tiniest"],
)
def test_samples_closer_than_rounding_allows(new, start, lengths):
    """As of a master that closes in on an event; then 1 ms again."""
    instance, t, phi = new().initialize({"crank.phi": start}), 0.0, start
    for h in [*lengths, *[1e-3] * 8]:
        instance.step(t, h, {"crank.phi": phi})
        held, exact = (solve(Geometry(), angle, 0).tip[0] for angle in (phi, phi + PLANTING_SPEED * h))
        x, y = instance.get("tip.x", "tip.y")
        assert abs(x + 1j * y - exact) <= 1.01 * abs(held - exact) + 1e-12
        t, phi = t + h, phi + PLANTING_SPEED * h
    assert abs(x + 1j * y - exact) < 1e-8


def worst_times_holding(instance, rows: list[tuple[float, float, float]]) -> float:
    """rad, of steps of (length, angle at its begin, speed given); the angle goes on straight to the next one's."""
    t, off, held = 0.0, 0.0, 0.0
    ends = [phi for _, phi, _ in rows[1:]] + [rows[-1][1]]
    for (h, phi, w), end in zip(rows, ends, strict=True):
        instance.step(t, h, {"crank.phi": phi, "crank.w": w})
        (found,) = angles_of(np.array([instance.get(*NOZZLE)]))
        off, held, t = max(off, abs(math.remainder(found - end, TURN))), max(held, abs(end - phi)), t + h
    return off / held


V, MS = PLANTING_SPEED, 1e-3


def running(lengths: list[float], w: float = 0.0) -> list[tuple[float, float, float]]:
    """Steps at the planting speed, from the angle 0."""
    return [(h, V * t, w) for h, t in zip(lengths, np.cumsum([0.0, *lengths[:-1]]), strict=True)]


def standing(lengths: list[float], before: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """After these, where they end."""
    h, phi, _ = before[-1]
    return [*before, *((length, phi + V * h, 0.0) for length in lengths)]


def told(speeds: list[float], before: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """The same, but that the last steps are given these speeds."""
    return [
        *before[: -len(speeds)],
        *((h, phi, w) for (h, phi, _), w in zip(before[-len(speeds) :], speeds, strict=True)),
    ]


EVEN = [MS] * 20
FOUND = {  # smoothing, steps
    "a stop between samples": (0.0, standing([5e-5, MS, 25e-3, 25e-3], running(EVEN))),
    "a stop before steps that grow": (0.0, standing([1e-4, 4e-5, 8e-3, 8e-3, 8e-3], running(EVEN))),
    "a speed that turns": (0.0, told([V, -V, V, V], standing([3e-5, 4e-5, 5e-5, 1.6e-3], running(EVEN, V)))),
    "a speed that falls to 0": (0.02, told([-V, 0.0, 0.0], standing([MS, 15e-3, 15e-3], running(EVEN, V)))),
}


@pytest.mark.parametrize(("smoothing", "rows"), FOUND.values(), ids=FOUND)
def test_what_a_random_attack_found(new, smoothing, rows):
    assert worst_times_holding(new().initialize({"crank.smoothing": smoothing}), rows) <= MOST


def test_a_jump_does_not_make_a_wrong_speed_believed(new):
    """In rpm and slow; jumps the other way make up for what it says too much, once."""
    instance, phi, w = new(logging=True), 0.0, 0.3
    instance.initialize({"crank.w": w * 30 / math.pi})
    for i in range(400):
        phi += 0.01 if i in {200, 203, 206, 209, 212, 215} else 0.0
        instance.step(i * 1e-3, 1e-3, {"crank.phi": phi, "crank.w": w * 30 / math.pi})
        phi += w * 1e-3
    assert len(instance.messages) == 1


def test_smoothing_notices_a_jump(new):
    """With a window of 0.1 s, after a jump of 1.5 rad: as without smoothing within six samples."""
    instance, exact = new().initialize({"crank.smoothing": 0.1}), []
    for i in range(300):
        phi = PLANTING_SPEED * i * 1e-3 + (1.5 if i >= 200 else 0.0)
        instance.step(i * 1e-3, 1e-3, {"crank.phi": phi})
        tip = solve(Geometry(), phi + PLANTING_SPEED * 1e-3, 0).tip[0]
        exact.append(abs(complex(*instance.get("tip.x", "tip.y")) - tip))
    assert max(exact[206:]) < 1e-9


# ---- a speed that is none ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "allowed"),
    [
        (lambda i: PLANTING_SPEED * 30 / math.pi, 11.0),  # in rpm: the first steps cannot know
        (lambda i: PLANTING_SPEED if i < 50 else 0.0, 2.5),
        (lambda i: PLANTING_SPEED if i < 50 else -PLANTING_SPEED, 2.5),
    ],
    ids=["rpm", "falls to 0", "turns its sign"],
)
def test_a_speed_that_contradicts_the_angle_is_ignored(new, wrong, allowed):
    """Said once; from then on as with the angle alone."""
    instance, off = new(logging=True), []
    instance.initialize({"crank.w": wrong(0)})
    for i in range(200):
        instance.step(i * 1e-3, 1e-3, {"crank.phi": PLANTING_SPEED * i * 1e-3, "crank.w": wrong(i)})
        exact = solve(Geometry(), PLANTING_SPEED * (i + 1) * 1e-3, 1)
        found = instance.get("tip.x", "tip.y", "tip.vx", "tip.vy")
        off.append(abs(complex(*found[:2]) - exact.tip[0]) / (abs(exact.tip[1]) * PLANTING_SPEED * 1e-3))
    assert max(off) <= allowed and max(off[60:]) < 1e-6
    velocity = exact.velocity(PLANTING_SPEED)
    assert found[2:] == pytest.approx([velocity.real, velocity.imag], abs=1e-7)
    (message,) = instance.messages
    assert "crank.w" in message.text and "ignored" in message.text


def test_at_step_end_the_speed_is_as_given(new):
    """A sweep over angles, at whatever speed: nothing is predicted by it."""
    instance = new(logging=True).initialize({"crank.at_step_end": True})
    for i in range(50):
        phi = 0.3 * i
        instance.step(i * 1e-3, 1e-3, {"crank.phi": phi, "crank.w": 1.0})
        exact = solve(Geometry(), phi, 1).velocity(1.0)
        assert instance.get("tip.vx", "tip.vy") == pytest.approx([exact.real, exact.imag], abs=1e-14)
    assert instance.messages == []


def test_a_speed_that_fits_again_is_believed_again(new):
    """The tip's speed follows it again."""
    instance, t, phi = new(logging=True).initialize(), 0.0, 0.0
    for i in range(200):
        wrong = 50 <= i < 100
        instance.step(t, 1e-3, {"crank.phi": phi, "crank.w": 0.0 if wrong else PLANTING_SPEED})
        t, phi = t + 1e-3, phi + PLANTING_SPEED * 1e-3
    assert len(instance.messages) == 1
    instance.step(t, 1e-3, {"crank.phi": phi, "crank.w": 2 * PLANTING_SPEED})
    exact = solve(Geometry(), phi, 1).velocity(2 * PLANTING_SPEED)
    assert abs(complex(*instance.get("tip.vx", "tip.vy"))) == pytest.approx(abs(exact), rel=0.2)


@pytest.mark.parametrize("speed", [0.01, 0.5, PLANTING_SPEED])
def test_a_coarse_encoder_does_not_contradict_a_good_speed(new, speed):
    """1000 counts a turn: the angle stands and leaps, the speed goes on being used."""
    instance = new(logging=True).initialize()
    count = 2 * math.pi / 1000
    for i in range(2000):
        phi = math.floor(speed * i * 1e-3 / count) * count
        instance.step(i * 1e-3, 1e-3, {"crank.phi": phi, "crank.w": speed})
        exact = solve(Geometry(), phi + speed * 1e-3, 1).velocity(speed)
        assert instance.get("tip.vx", "tip.vy") == pytest.approx([exact.real, exact.imag], abs=1e-12)
    assert instance.messages == []
