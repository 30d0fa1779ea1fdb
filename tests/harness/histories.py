"""Random ugly step histories of the crank: what no host should do, and some do.

A history is a list of stretches. Each begins with something that happens to the crank (it jumps, stands, runs on,
turns back) and has steps of its own pattern (even, growing, long and short in turn, halving down to 1e-9 s, a cluster
of tiny ones); the last one is always regular. The angle may be far from 0, and given modulo one turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from scenarios.common.operating_point import PLANTING_SPEED, TURN

TAIL = 14  # regular steps at the end

PATTERNS = {
    "even": lambda h, i: h,
    "growing": lambda h, i: h * 2.0 ** min(i, 4),
    "leaping": lambda h, i: h * (15.0 if i else 1.0),
    "mixed": lambda h, i: h * (1.0, 0.1, 3.0, 0.5, 0.02, 2.0)[i % 6],
    "halving": lambda h, i: max(h * 0.5 ** (2 * i), 1e-9),
    "soaring": lambda h, i: 0.1 * h * (1.0, 8.0, 30.0)[min(i, 2)],
    "flickering": lambda h, i: h * (1.0, 0.04, 1.0, 1e-3)[i % 4],
    "tiny": lambda h, i: 1e-7,
    "tiniest": lambda h, i: 1e-9,
}


@dataclass(frozen=True)
class Stretch:
    """Steps of one kind, and what befalls the crank in them."""

    pattern: str
    count: int
    step: float  # s
    jump: float  # rad, at its beginning
    speed: float  # of the crank in it, of that of the history


@dataclass(frozen=True)
class History:
    """A motion of the crank, and the steps and slips through which a host gives it."""

    speed: float  # rad/s
    ripple: float  # of the speed
    beat: float  # rad/s, of the ripple
    start: float  # rad
    wrap: str  # "", "modulo" or "around 0"
    stretches: tuple[Stretch, ...]


@dataclass(frozen=True)
class Played:
    """What a host gives, and what is true: a row a step, angles in rad."""

    time: np.ndarray  # s, of the steps' begins, and of the last one's end
    given: np.ndarray  # angle as given for a step's begin
    end_given: np.ndarray  # and for its end
    phi: np.ndarray  # the same, unwrapped
    w: np.ndarray  # there, rad/s
    a: np.ndarray
    end: np.ndarray  # angle at the step's end
    end_w: np.ndarray  # speed there
    jump: np.ndarray  # that the angle makes at the step's begin
    greatest_speed: np.ndarray  # in this stretch and the one before it, where nothing else happens: 0
    is_smooth: np.ndarray  # nothing happens at the step's begin


def wrapped(phi: float, wrap: str) -> float:
    return phi % TURN if wrap == "modulo" else math.remainder(phi, TURN) if wrap == "around 0" else phi


def play(history: History) -> Played:
    rows, t, phi, before = [], 0.0, history.start, 0.0
    beat, ripple = history.beat, history.ripple
    for stretch in history.stretches:
        speed = stretch.speed * history.speed
        greatest = (1 + ripple) * max(abs(speed), abs(before))
        before = speed
        for i in range(stretch.count):
            h = PATTERNS[stretch.pattern](stretch.step, i)
            jump = stretch.jump if i == 0 else 0.0
            phi += jump
            w, end_w = (speed * (1 + ripple * math.sin(beat * at)) for at in (t, t + h))
            a = speed * ripple * beat * math.cos(beat * t)
            end = phi + speed * (h + ripple * (math.cos(beat * t) - math.cos(beat * (t + h))) / beat)
            given, end_given = (wrapped(angle, history.wrap) for angle in (phi, end))
            rows.append((t, given, end_given, phi, w, a, end, end_w, jump, greatest, i > 0))
            t, phi = t + h, end
    columns = np.array(rows).T
    return Played(np.append(columns[0], t), *columns[1:10], columns[10].astype(bool))


def log_uniform(low: float, high: float):
    return st.floats(math.log(low), math.log(high)).map(math.exp)


@st.composite
def histories(draw) -> History:
    stretches = [
        Stretch(
            draw(st.sampled_from(list(PATTERNS))),
            draw(st.integers(1, 12)),
            draw(log_uniform(1e-4, 1.5e-2)),
            draw(st.sampled_from((0.0, 0.0, 1.0))) * draw(st.floats(0.05, 3.0)) * draw(st.sampled_from((1.0, -1.0))),
            draw(st.sampled_from((1.0, 1.0, 0.0, 0.5, -1.0))),
        )
        for _ in range(draw(st.integers(1, 5)))
    ]
    tail = Stretch("even", TAIL, draw(log_uniform(3e-4, 1.5e-2)), 0.0, draw(st.sampled_from((1.0, 0.0, -1.0))))
    return History(
        draw(st.sampled_from((PLANTING_SPEED, -PLANTING_SPEED, 0.5, 30.0))),
        draw(st.sampled_from((0.0, 0.1, 0.3))),
        draw(st.sampled_from((6.0, 18.85))),
        draw(st.sampled_from((0.0, 2.0, 408.0, 4080.0, -1e5))),
        draw(st.sampled_from(("", "", "modulo", "around 0"))),
        (*stretches, tail),
    )
