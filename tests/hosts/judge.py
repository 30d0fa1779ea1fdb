"""Is what a host returned the exact answer? Values decide: some hosts end with success and return zeros."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields

from tests.hosts.drives import COMPARED, STEP, Bound, Drive

TIME_TOLERANCE = 1e-9  # s
SHIFTS = (-2, -1, 1, 2)
UNITS = {"position": "mm", "velocity": "mm/s", "acceleration": "mm/s2", "travel": "mm"}


@dataclass(frozen=True)
class Errors:
    """Worst errors: mm, mm/s, mm/s2 of the tip, mm of the travel."""

    position: float
    velocity: float
    acceleration: float
    travel: float

    def beyond(self, bound: Bound) -> str:
        """What exceeds its bound, in words; "" if nothing does."""
        off = {f.name: getattr(self, f.name) for f in fields(self)}
        beyond = (name for name, error in off.items() if not error <= getattr(bound, name))
        return ", ".join(f"the {name} is {off[name]:.2g} {UNITS[name]} off" for name in beyond)


@dataclass(frozen=True)
class Judgement:
    """`errors` at all communication points compared; `wrong` says in words what does not hold, "" if all does."""

    errors: Errors | None
    wrong: str


def judge(drive: Drive, interface: str, rows: Sequence[Sequence[float]]) -> Judgement:
    """Rows of (time, *OUTPUTS) against the exact answer."""
    at = {round(row[0] / STEP): row for row in rows if abs(row[0] - round(row[0] / STEP) * STEP) <= TIME_TOLERANCE}
    bound = drive.bound(interface)
    missing = [point for point in COMPARED if point not in at]
    if missing:
        return Judgement(None, f"no values at {missing[0] * STEP:g} s and {len(missing) - 1} other times")
    apart = {point: errors(at[point][1:], drive.exact(point)) for point in COMPARED}
    worst = Errors(*map(max, zip(*map(astuple, apart.values()), strict=True)))
    for point in COMPARED:
        beyond = apart[point].beyond(bound)
        if beyond:
            return Judgement(worst, f"at {point * STEP:g} s {beyond}{explain(drive, at, point)}")
    return Judgement(worst, "")


def errors(found: Sequence[float], exact: Sequence[float]) -> Errors:
    """Not finite counts as infinitely far."""
    apart = [1e3 * abs(a - b) if math.isfinite(a) else math.inf for a, b in zip(found, exact, strict=True)]
    return Errors(math.hypot(*apart[0:2]), math.hypot(*apart[2:4]), math.hypot(*apart[4:6]), apart[6])


def explain(drive: Drive, at: dict, point: int) -> str:
    """Whether zeros or another communication point's answer were given at this one; "" if neither."""
    found, exact = at[point][1:], drive.exact(point)
    if not any(found):
        return ": all values are zero"
    off = errors(found, exact).position
    for shift in SHIFTS:
        if point + shift >= 0 and errors(found, drive.exact(point + shift)).position < off / 100:
            return f", the answer {abs(shift)} step{'s' * (abs(shift) > 1)} {'too late' if shift < 0 else 'too early'}"
    return ""
