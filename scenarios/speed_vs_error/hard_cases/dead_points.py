"""Dead points: links of a dyad in one line, where the tip's derivatives are infinite.

A gap is the length in m that the dyad's base lacks to the dead point. The tip and its derivatives grow as the
root of the gap falls, so the question loses sharpness; the answer must lose no more than that.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

from mpmath import mp, mpc, mpf

from scenarios.common.instance import DISCARD, OK, Instance, UnpackedFmu, bits
from scenarios.speed_vs_error.hard_cases.measured import CONDITIONING, Measured, Probe, Worst, ask, printed_tip
from scenarios.speed_vs_error.yardstick import NOMINAL, Oracle, error, exact_rows

# The length that brings a dyad to its dead point, the dyad's other link, and 1 where the links fold there, -1 where
# they stretch: length = base + side * (other link) at the dead point itself.
DEAD_POINTS = {
    "ABD stretched": ("L2", "L3", -1),
    "ABD folded, AB longer": ("L2", "L3", 1),
    "ABD folded, DB longer": ("L3", "L2", 1),
    "EFG stretched": ("L7", "L6", -1),
    "EFG folded, GF longer": ("L7", "L6", 1),
    "EFG folded, EF longer": ("L6", "L7", 1),
}
GAPS = tuple(10.0**-n for n in range(3, 13))  # m
BOTH_GAPS = tuple(10.0**-n for n in range(3, 10))  # m: nearer, the rounding of one input decides whether EFG closes
ORDERS = ("position", "velocity", "acceleration")
BOUND = 2.0


@dataclass(frozen=True)
class Approach:
    """A pose near a dead point."""

    case: str
    gap: float
    place: str
    geometry: dict[str, float]
    phi: float

    def __str__(self) -> str:
        return f"gap {self.gap:g} m, {self.place}"


@dataclass(frozen=True)
class Answered:
    """Error over conditioning at one pose, by order; of the FMU and of the printed equations."""

    approach: Approach
    ours: list[float]
    printed: list[float]


def base(case: str, pose) -> mpf:
    """The base of the dyad of this case: AD or EG."""
    return abs(pose.D - pose.A) if case.startswith("ABD") else abs(pose.G - pose.E)


def with_gap(geometry: dict[str, float], case: str, length: mpf, gap: float) -> dict[str, float]:
    """The geometry with one link changed so that a base of this length lacks `gap` to the dead point."""
    name, other, side = DEAD_POINTS[case]
    return geometry | {name: float(length + side * (mpf(geometry[other]) - mpf(gap)))}


def closes(geometry: dict[str, float], *angles: float) -> bool:
    try:
        return all(Oracle(geometry, 20).pose(phi) for phi in angles)
    except ValueError:
        return False


def extreme(geometry: dict[str, float], case: str, phi: float) -> float:
    """The angle, to the last bit, at which the base is longest (stretched) or shortest (folded), uphill from phi."""
    oracle, sign, step = Oracle(geometry, 40), -1 if "folded" in case else 1, 0.1

    def height(angle: float) -> mpf:
        return sign * base(case, oracle.pose(angle))

    while step > 1e-17 and phi + step != phi:
        side = max((-step, 0.0, step), key=lambda off: height(phi + off))
        phi, step = phi + side, step if side else step / 2
    return phi


@cache
def approaches() -> tuple[Approach, ...]:
    """To each dead point in two ways: touched in passing, and as the end of the crank's range."""
    return tuple(approach for case in DEAD_POINTS for approach in (*touching(case), *ending(case)))


def touching(case: str) -> Iterator[Approach]:
    """The base passes its extreme, where only the gap is left: there, and on both sides where it has doubled."""
    chance = random.Random(case)
    while True:
        geometry, phi = dict(chance.choice(exact_rows("geometries")).geometry), chance.uniform(-1, 1)
        if not closes(geometry, *(phi + off for off in (-1.0, -0.5, 0.0, 0.5, 1.0))):
            continue
        phi = extreme(geometry, case, phi)
        length = base(case, Oracle(geometry).pose(phi))
        bend = abs(base(case, Oracle(geometry).pose(phi + 1e-3)) - length) * 1e6  # m/rad2
        near = with_gap(geometry, case, length, GAPS[0])
        if (
            geometry[DEAD_POINTS[case][0]] > 0.01
            and near[DEAD_POINTS[case][0]] > 0.01
            and closes(near, phi - 0.02, phi, phi + 0.02)
        ):
            break
    for gap in GAPS:
        beside = min(math.sqrt(gap / bend), 0.02)
        for place, off in {"at it": 0.0, "before": -beside, "after": beside}.items():
            yield Approach(case, gap, place, with_gap(geometry, case, length, gap), phi + off)


def ending(case: str) -> Iterator[Approach]:
    """The base still grows or falls where the gap is gone: the crank can come that far, from one side."""
    chance = random.Random(f"{case}, ending")
    while True:
        geometry, phi = dict(chance.choice(exact_rows("geometries")).geometry), chance.uniform(-1, 1)
        if not closes(geometry, phi):
            continue
        length = base(case, Oracle(geometry).pose(phi))
        if length > 0.02 and closes(with_gap(geometry, case, length, GAPS[0]), phi):
            break
    for gap in GAPS:
        yield Approach(case, gap, "on the way to it", with_gap(geometry, case, length, gap), phi)


@cache
def both_at_once() -> tuple[Approach, ...]:
    """ABD and EFG near a dead point in the same pose; the gap of EFG is that of ABD."""
    found = []
    for first in ("ABD stretched", "ABD folded, AB longer"):
        for second in ("EFG stretched", "EFG folded, GF longer"):
            for gap in BOTH_GAPS:
                phi, name = 1.0, f"both: {first}, {second}"
                nearly = with_gap(NOMINAL, first, base(first, Oracle(NOMINAL).pose(phi)), gap)
                # EFG first wide open, so that there is a pose to measure EG in
                wide = nearly | {"L6": 0.3, "L7": 0.3}
                length = base(second, Oracle(wide).pose(phi))
                found.append(Approach(name, gap, "at both", with_gap(nearly, second, length, gap), phi))
    return tuple(found)


SHORT_BASES = (1e-2, 1e-3, 1e-4)  # m, under links of 250 mm: a needle that is folded


@cache
def short_bases() -> tuple[Approach, ...]:
    """Folded dyads on a base much shorter than their links, 10 % and 0.1 % of it from the dead point."""
    found, phi = [], 1.0
    pose = Oracle(NOMINAL).pose(phi)
    C_for_A = pose.A - (pose.D - mpc(NOMINAL["XC"], NOMINAL["YC"]))  # there, D would lie on A
    for dyad, pivot, at, links in (("ABD", "C", C_for_A, "L2 L3"), ("EFG", "G", pose.E, "L6 L7")):
        for base_length in SHORT_BASES:
            for share in (0.1, 1e-3):
                place = at + base_length * mp.expj(2)
                long, short = links.split()
                geometry = NOMINAL | {f"X{pivot}": float(place.real), f"Y{pivot}": float(place.imag)}
                geometry |= {short: 0.25, long: 0.25 + (1 - share) * base_length}
                if dyad == "ABD":  # G within reach of where E comes to lie
                    E = Oracle(geometry | {"L6": 1.0, "L7": 1.0}).pose(phi).E
                    geometry |= {"XG": float(E.real + 0.1), "YG": float(E.imag), "L6": 0.2, "L7": 0.2}
                found.append(
                    Approach(
                        f"{dyad} folded on a short base", share * base_length, f"base {base_length:g} m", geometry, phi
                    )
                )
    return tuple(found)


@cache
def answer(fmu: UnpackedFmu) -> tuple[Answered, ...]:
    """All approaches, asked once."""
    asked = (*approaches(), *both_at_once(), *short_bases())
    with Probe(fmu) as probe:
        return tuple(
            Answered(approach, question.ratios(probe.tip(*pose)), question.ratios(printed_tip(*pose)))
            for approach, question in zip(
                asked, ask((approach.geometry, approach.phi) for approach in asked), strict=True
            )
            for pose in [(approach.geometry, approach.phi)]
        )


def measure(fmu: UnpackedFmu) -> list[Measured]:
    """Error over conditioning for each kind of dead point, and what comes at and beyond one."""
    by_case: dict[str, Worst] = {}
    for answered in answer(fmu):
        approach = answered.approach
        worst = by_case.setdefault("both dyads at once" if approach.case.startswith("both") else approach.case, Worst())
        for order, ours in zip(ORDERS, answered.ours, strict=True):
            worst.see(ours, f"{order}, {approach}")
        worst.see_printed(max(answered.printed))
    lines = [
        Measured(
            case,
            "error of position, velocity and acceleration, "
            + (
                "gaps 1 mm to 1e-9 m"
                if case.startswith("both")
                else "bases 10 mm to 0.1 mm, links of 250 mm"
                if case.endswith("base")
                else "gaps 1 mm to 1e-12 m, at it and on both sides"
            ),
            CONDITIONING,
            worst.value,
            BOUND,
            worst.where,
            worst.printed,
        )
        for case, worst in by_case.items()
    ]
    return [*lines, *measure_digits(fmu), *measure_beyond(fmu), *measure_exact(fmu)]


def measure_beyond(fmu: UnpackedFmu) -> list[Measured]:
    """Beyond a dead point there is no pose: refused, with the gap that the oracle finds."""
    off, answers = Worst(), 0
    with Probe(fmu) as probe:
        for case, (name, other, side) in DEAD_POINTS.items():
            last = [approach for approach in approaches() if approach.case == case and approach.place == "at it"][-1]
            length = mpf(last.geometry[name]) - side * (mpf(last.geometry[other]) - mpf(last.gap))
            for gap in GAPS[:-1]:
                beyond = with_gap(last.geometry, case, length, -gap)
                if probe.place(beyond, last.phi).try_get(["tip.x"])[0] != DISCARD:
                    answers += 1
                    continue
                said = probe.instance.messages[-1]
                off.see(
                    abs(float(said.split(" is ")[-1].split(" mm")[0]) * 1e-3 - gap) / gap, f"{case}, {gap:g} m beyond"
                )
    return [
        Measured("beyond a dead point", "poses answered that do not exist", "poses", answers, 0),
        Measured(
            "beyond a dead point",
            "error of the miss in the message, 1 mm to 1e-11 m beyond",
            "of the miss",
            off.value,
            1e-3,
            off.where,
        ),
    ]


# ---- exactly there -------------------------------------------------------------------------------

# Triangles with sides 3, 4, 5 in sixteenths: every number is exact in binary, so that nothing is rounded. At phi = 0,
# A lies at (1, 0)/16, D = C at (9, 0)/16, B = E at (5, -3)/16.
EXACT = dict.fromkeys(NOMINAL, 0.0) | {
    "L1": 1 / 16,
    "L2": 5 / 16,
    "L3": 5 / 16,
    "L5": 5 / 16,
    "XC": 9 / 16,
    "L8": 1 / 16,
    "L9": 1 / 16,
}
EXACT_DEAD_POINTS = {
    "ABD stretched": EXACT | {"XC": -9 / 16, "L3": 7 / 16, "L2": 3 / 16, "XG": 0.0, "L6": 1.0, "L7": 1.0},
    "ABD folded": EXACT | {"L3": 1.0, "L2": 0.5, "XG": 1.0, "L6": 1.0, "L7": 1.0},
    "EFG stretched": EXACT | {"XG": 17 / 16, "YG": -3 / 16, "L6": 5 / 16, "L7": 7 / 16},
    "EFG folded": EXACT | {"XG": 17 / 16, "YG": -3 / 16, "L6": 1 / 4, "L7": 1.0},
}


# The same triangles with one link that no binary fraction is: then its length is the only thing to round.
EXACT_BASES = {
    "ABD stretched": (EXACT | {"L1": 0.0, "XC": 0.25, "L5": 0.05, "XG": 1.0, "L6": 1.0, "L7": 1.0}, mpf(0.25)),
    "ABD folded, AB longer": (EXACT | {"L1": 0.0, "XC": 0.25, "L5": 0.05, "XG": 1.0, "L6": 1.0, "L7": 1.0}, mpf(0.25)),
    "EFG stretched": (EXACT | {"XG": 17 / 16, "YG": -3 / 16}, mpf(0.75)),
    "EFG folded, GF longer": (EXACT | {"XG": 17 / 16, "YG": -3 / 16}, mpf(0.75)),
}


def measure_digits(fmu: UnpackedFmu) -> list[Measured]:
    """Where the base is known exactly, nearness to a dead point costs no digit at all: the margin tells."""
    worst = Worst()
    with Probe(fmu) as probe:
        for case, (geometry, length) in EXACT_BASES.items():
            for gap in GAPS:
                near = with_gap(geometry | {DEAD_POINTS[case][1]: 0.1}, case, length, gap)
                (margin,) = probe.place(near, 0.0).get("assembly.margin")
                exact = Oracle(near).margin(0.0, 0)[0]
                worst.see(error(margin, exact) / float(exact), f"{case}, gap {gap:g} m")
    return [
        Measured(
            "base exact in binary",
            "error of assembly.margin, gaps 1 mm to 1e-12 m",
            "of the margin",
            worst.value,
            1e-15,
            worst.where,
        )
    ]


def measure_exact(fmu: UnpackedFmu) -> list[Measured]:
    """A run whose step ends at a dead point exactly; and the last double before it."""
    wrong, worst = Worst(), Worst()
    for case, geometry in EXACT_DEAD_POINTS.items():
        dyad = case.split()[0]
        side = next(sign for sign in (-1.0, 1.0) if closes(geometry, sign * 0.25) and closes(geometry, sign * 1e-3))
        with Instance(fmu, "exact") as run:
            values = {f"geometry.{name}": value for name, value in geometry.items()}
            run.initialize(values | {"crank.phi": side * 0.25, "crank.at_step_end": True})
            run.step(0.0, 0.5, {"crank.phi": side * 0.125})
            before, status = bits(run.outputs()), run.set({"crank.phi": 0.0}).try_step(0.5, 0.5)
            said = run.messages[-1] if run.messages else "nothing"
            is_told = status == DISCARD and f"dead point, where velocities are infinite: dyad {dyad}" in said
            goes_on = bits(run.outputs()) == before and run.set({"crank.phi": side * 0.0625}).try_step(0.5, 0.5) == OK
            if not (is_told and goes_on):
                wrong.see(wrong.value + 1, f"{case}: status {status}, {said}")
        with Probe(fmu) as probe:
            phi = side * (2.0**-18 if dyad == "ABD" else 2.0**-40)  # ABD touches its dead point, EFG runs into it
            if probe.place(geometry, phi).try_get(["tip.x"])[0] == OK:
                (question,) = ask([(geometry, phi)])
                worst.see(max(question.ratios(probe.tip(geometry, phi))), f"{case}, {abs(phi):.2g} rad beside it")
            else:
                worst.see(math.inf, f"{case}: refused {abs(phi):.2g} rad beside it")
    return [
        Measured("a dead point exactly", "runs that are not told so, by its name", "runs", wrong.value, 0, wrong.where),
        Measured(
            "a dead point exactly",
            "error beside it: 4e-6 rad (ABD), 1e-12 rad (EFG)",
            CONDITIONING,
            worst.value,
            BOUND,
            worst.where,
        ),
    ]
