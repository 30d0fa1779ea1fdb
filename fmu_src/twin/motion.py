"""What the crank and the machine do between a host's samples: to read, and to edit.

A host gives its inputs at the start of a step, the outputs belong to its end (FMI 2.0.4, section 4.2.1).
So the crank is carried there: by crank.w and crank.a from the moment that they are not 0, else by the cubic
through the last four angles. The same rules as in fmu_src/component/crank.c and travel.c, less the
input derivatives, which PythonFMU does not pass on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from math import inf, pi
from typing import ClassVar

import numpy as np

TURN = 2 * pi
JUMP = pi / 2  # off what was expected, whole turns aside
MOST_GROWTH = 20.0  # of a step: a slope is carried on over at most this many times the gap it was seen over
# How far a prediction may go: as a share of the largest change between samples; of the largest slope of a smooth
# signal, whose polynomial is to miss by little, with a small last term; of the smallest slope of any other; of the
# largest speed or acceleration. See fmu_src/component/samples.h.
FARTHEST_CHANGE = {"phi": 1.67, "w": 1.67, "a": 3.0}
GREATEST_SLOPE, GREATEST_MISS, GREATEST_CUBIC = 3.0, 0.5, 1 / 3
GREATEST_UNPROVEN, GREATEST_OF_A_RATE = 1.5, 2.0
ROUNDING = 16 * 2.0**-52  # of a value
EVIDENCE = 0.02  # rad, that one sample may give against crank.w
MET = 0.1  # of a sample's change: a fit that is less off has met it, and is believed for such a step
OUTLIER = 8.0  # times what others did of late, that a sample lies off and is no noise
AGREEMENTS = 2  # in a row, until a crank.w that was ignored is believed again


@dataclass(frozen=True)
class CrankMotion:
    """Angle in rad and its time derivatives at one instant."""

    phi: float = 0.0
    w: float = 0.0
    a: float = 0.0
    jerk: float = 0.0

    def after(self, h: float) -> CrankMotion:
        """The motion h seconds later: Taylor's series."""
        return CrankMotion(
            self.phi + h * self.w + h**2 / 2 * self.a + h**3 / 6 * self.jerk,
            self.w + h * self.a + h**2 / 2 * self.jerk,
            self.a + h * self.jerk,
            self.jerk,
        )


def smaller(one: float, other: float) -> float:
    """The slope of smaller magnitude, 0 where they differ in sign: a jump is not carried on."""
    return 0.0 if one * other <= 0 else min(one, other, key=abs)


def within(most: float, value: float) -> float:
    return max(-most, min(most, value))


@dataclass(frozen=True)
class Samples:
    """The last samples of a signal, newest first: seconds before the newest one, and values."""

    source: str  # "phi", "w" or "a"
    ages: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    # Where one was taken away from a full history, its highest difference: how slopes were expected to change.
    reserve: float | None = None
    # Where samples right before the newest one were left out: seconds since the newest of them (else 0), and by how
    # much it lay above the one that is left.
    skipped_gap: float = 0.0
    skipped_rise: float = 0.0

    DEGREES: ClassVar[dict[str, int]] = {"phi": 3, "w": 2, "a": 1}

    @property
    def degree(self) -> int:
        """Of the polynomial through them."""
        return self.DEGREES[self.source]

    @property
    def are_full(self) -> bool:
        return len(self.ages) > self.degree or self.reserve is not None

    def add(self, value: float, gap: float, shift: float = 0.0) -> Samples:
        """With `value`, given `gap` seconds after the newest one; `shift` is added to the older values."""
        ages = (0.0, *(age + gap for age in self.ages))[: self.degree + 1]
        values = (value, *(old + shift for old in self.values))[: self.degree + 1]
        return Samples(self.source, ages, values, None, self.skipped_gap, self.skipped_rise)

    def without_close(self, gap: float, h: float) -> tuple[Samples, float]:
        """Less those that lie close to a sample `gap` later, for a step of h; the gap to the newest one left."""
        left, since_newest = replace(self, skipped_gap=0.0, skipped_rise=0.0), gap
        while MOST_GROWTH * gap < h and left.ages:
            is_full = len(left.ages) > left.degree
            gap += left.ages[1] if len(left.ages) > 1 else 0.0
            ages = tuple(age - left.ages[1] for age in left.ages[1:])
            reserve = left.differences()[left.degree - 1] if is_full else None
            rise = self.values[0] - left.values[1] if len(left.values) > 1 else 0.0
            left = Samples(self.source, ages, left.values[1:], reserve, since_newest, rise)
        return left, gap

    def changes(self) -> list[float]:
        """Between successive samples, the newest first."""
        return [new - old for new, old in pairwise(self.values)]

    def slopes(self) -> list[float]:
        """Likewise."""
        gaps = [then - now for now, then in pairwise(self.ages)]
        return [change / gap for change, gap in zip(self.changes(), gaps, strict=True)]

    def differences(self) -> list[float]:
        """Newton's divided differences at the newest sample, orders 1, 2 and 3; 0 where samples are too few."""
        nodes, column, newton = [-age for age in self.ages], list(self.values), []
        for distance in range(1, len(nodes)):
            column = [(column[i] - column[i + 1]) / (nodes[i] - nodes[i + distance]) for i in range(len(column) - 1)]
            newton.append(column[0])
        return newton + [0.0] * (3 - len(newton))

    def derivatives(self, older: Samples, h: float) -> tuple[float, float, float]:
        """First three time derivatives, at the newest sample, of the polynomial that goes on for h seconds.

        `older` are the samples without the newest one. Where that one tells of a jump, in what a polynomial of
        degree 2 or 3 has slopes of, the smaller of the last two slopes goes on: the polynomial would overshoot. It
        is of lower degree where it would go farther than the samples bear out.
        """
        newton, before = self.differences(), older.differences()
        if older.reserve is not None:
            before[self.degree - 1] = older.reserve
        one, two, three = (*self.ages, 0.0, 0.0, 0.0)[1:4]
        is_smooth = self.degree > 1 and older.are_full
        if is_smooth:
            slope, higher = self.degree - 2, self.degree - 1
            expected = before[higher] * self.ages[-1]
            if abs(newton[slope] - before[slope] - expected) > 0.75 * (abs(before[slope]) + abs(expected)):
                newton[slope] = smaller(newton[slope], before[slope])
                newton[higher] = 0.0
                is_smooth = False
        changes = self.changes()[:1]
        rounding = ROUNDING * abs(self.values[0]) if h > 2 * one else -1.0  # in a step as long as others it is small
        if changes and abs(changes[0]) <= rounding:
            newton[0] = 0.0
        if abs(newton[1] * one * two) <= rounding:
            newton[1] = 0.0
            if abs(newton[2] * one * two * three) <= 4 * rounding:
                newton[2] = 0.0
        self._restrain(newton, older, is_smooth and not self.skipped_gap, h)
        first, second, third = newton
        return first + one * (second + two * third), 2 * (second + (one + two) * third), 6 * third

    def largest_change(self, older: Samples) -> float:
        """That holding the signal missed by between these samples; `older` are those without the newest one."""
        changes = [*map(abs, (self.changes()[:1] + older.changes())[:3])]
        if self.skipped_gap and changes:  # one of the two that it is made of; speeds are no angles that were missed by
            if self.source != "phi":
                return 0.0
            changes[:1] = abs(self.skipped_rise), abs(self.changes()[0] - self.skipped_rise)
        return max(changes, default=0.0)

    def farthest(self, older: Samples, change: float, h: float) -> float:
        """How far a prediction over h seconds that changes the signal by `change` is believed to go."""
        slopes = (*self.slopes()[:1], *older.slopes(), *(() if len(older.values) > 1 else (0.0,)))[:3]
        proven = reduce(smaller, slopes)
        if self.skipped_gap and proven:  # and no more than since the newest of those that were left out
            rise = self.changes()[0] - self.skipped_rise
            forward = -rise if proven < 0 else rise
            proven = within(max(0.0, forward + ROUNDING * abs(self.values[0])) / self.skipped_gap, proven)
        reach = min(h, MOST_GROWTH * self.ages[1]) if len(self.ages) > 1 else 0.0
        believed = GREATEST_UNPROVEN * abs(proven) * reach if proven * change > 0 else 0.0
        return max(FARTHEST_CHANGE[self.source] * self.largest_change(older), believed)

    def farthest_of_a_rate(self, older: Samples) -> float:
        """And of a speed or an acceleration."""
        return GREATEST_OF_A_RATE * max(map(abs, (self.values[0], *older.values[:2])))

    def _is_borne_out(self, newton: list[float], older: Samples, h: float) -> bool:
        """Whether the polynomial of a full history is believed for h seconds: it missed the newest sample by little."""
        one, two, three = self.ages[1], self.ages[2], self.ages[1] + older.ages[2]
        now, then = self.differences(), older.differences()
        if self.source == "phi":
            missed = (now[1] - then[1] - then[2] * three) * one * two * (h + three) / three
        else:
            missed = (now[0] - then[0] - then[1] * two) * one
        longer = h / one
        missed *= longer * (h + one) * (h + two) / (two * three) * max(1.0, longer)
        line, bend, cubic = newton[0], newton[1] * (h + one), newton[2] * (h + one) * (h + two)
        steepest = max(map(abs, self.slopes()[:1] + older.slopes()))
        largest = self.largest_change(older)
        return (
            abs(missed) <= GREATEST_MISS * largest
            and abs(cubic) <= GREATEST_CUBIC * (abs(line) + abs(bend))
            and abs(line + bend + cubic) * h
            <= max(FARTHEST_CHANGE[self.source] * largest, GREATEST_SLOPE * steepest * min(h, MOST_GROWTH * one))
        )

    def _restrain(self, newton: list[float], older: Samples, is_smooth: bool, h: float) -> None:
        """Lower the degree until the polynomial goes no farther in h seconds than is believed."""
        one, two = (*self.ages, 0.0, 0.0)[1:3]
        slopes = (self.slopes()[:1] + older.slopes())[:2]
        most = self.farthest_of_a_rate(older) if self.source == "w" else inf

        def change() -> float:
            return h * (newton[0] + (h + one) * (newton[1] + (h + two) * newton[2]))

        def farthest() -> float:
            return min(most, self.farthest(older, change(), h))

        is_near = slopes and abs(change()) <= FARTHEST_CHANGE[self.source] * abs(self.changes()[0])
        if not slopes or (is_near and (self.source == "a" or not self.skipped_gap)):
            return
        if is_smooth and self._is_borne_out(newton, older, h):
            return
        second_is_small = abs(newton[1] * (h + one)) <= abs(newton[0])
        third_is_small = abs(newton[2] * (h + one) * (h + two)) <= abs(newton[0])
        if third_is_small and second_is_small and abs(change()) <= farthest():
            return
        newton[2] = 0.0
        if second_is_small and abs(change()) <= farthest():
            return
        newton[1] = 0.0
        believed = farthest()
        if abs(change()) <= believed:
            return
        if len(slopes) > 1:
            newton[0] = smaller(slopes[0], slopes[1])
        newton[0] = within(believed, newton[0] * h) / h

    def are_flat(self) -> bool:
        return len(set(self.values)) <= 1


@dataclass(frozen=True)
class Fit:
    """All samples that still weigh, newest first: what smoothing fits a polynomial to."""

    ages: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()
    noise: float = 0.0  # by how much samples lay off what was expected, of late
    useless: int = 0  # of the last samples: those that holding the signal would have met as well
    missed: float = 0.0  # by how much the last few samples lay off
    moved: float = 0.0  # how far they moved
    met: float = 0.0  # s, the longest over which it met a sample, since one that spoke against it
    slope: float = 0.0  # of the signal over that time, its magnitude
    is_tried: bool = False  # on a sample beyond those that it takes

    def add(self, value: float, gap: float, shift: float, smoothing: float, degree: int) -> Fit:
        """With `value`, given `gap` seconds after the newest one; the weights of the others fade.

        Where two samples in a row lie farther off than noise does, and than half of their change, it begins anew;
        a fit to many samples also where the last few lie farther off than they move.
        """
        noise, useless, missed, moved = self.noise, self.useless, self.missed, self.moved
        met, slope = self.met, self.slope
        is_tried = len(self.ages) > degree and self.reaches(gap)  # what lies farther is no test of it
        if is_tried:
            at, v, a, jerk = self.polynomial(degree)
            off = abs(value - (at + gap * (v + gap / 2 * (a + gap / 3 * jerk)) + shift))
            change = abs(value - self.values[0] - shift)
            is_useless = off > OUTLIER * noise and off > change / 2
            useless = useless + 1 if is_useless else 0
            if is_useless:
                met = 0.0
            elif off < MET * change and gap >= met:
                met, slope = gap, change / gap
            if useless != 1:
                noise += (min(off, change if is_useless else off) - noise) / 16
            missed, moved = missed + (off - missed) / 4, moved + (change - moved) / 4
            if useless == 2 or (sum(self.weights) > 10 and missed > 1.5 * moved):
                return Fit((0.0,), (value,), (1.0,), noise)
        fade = max((1 + gap / smoothing) ** -4, 1 / 16)  # about exp(-4 gap / smoothing)
        older = [
            (age + gap, old + shift, weight * fade)
            for age, old, weight in zip(self.ages, self.values, self.weights, strict=True)
            if weight * fade > 1e-16
        ]
        ages, values, weights = zip((0.0, value, 1.0), *older, strict=True)
        return Fit(ages, values, weights, noise, useless, missed, moved, met, slope, is_tried)

    def reaches(self, ahead: float) -> bool:
        """Whether it says anything of what lies that many seconds ahead."""
        spread = sum(weight * age**2 for weight, age in zip(self.weights, self.ages, strict=True))
        return ahead**2 * sum(self.weights) <= MOST_GROWTH**2 * spread

    def is_proven(self, ahead: float) -> bool:
        """Whether to believe it for the next `ahead` seconds."""
        return self.is_tried and self.useless == 0 and self.reaches(ahead)

    def polynomial(self, degree: int) -> list[float]:
        """Value and three time derivatives, at the newest sample, of the polynomial with the least weighted error."""
        ages, values, weights = map(np.array, (self.ages, self.values, self.weights))
        newest, unit = values[0], ages[-1] or 1.0
        powers = np.vander(-ages / unit, min(degree, len(ages) - 1) + 1, increasing=True)
        root = np.sqrt(weights)
        scaled = np.linalg.lstsq(powers * root[:, None], (values - newest) * root, rcond=None)[0]
        found = [coefficient / unit**n * (1, 1, 2, 6)[n] for n, coefficient in enumerate(scaled)]
        found[0] += newest
        return found + [0.0] * (4 - len(found))


@dataclass(frozen=True)
class Doubt:
    """What speaks against crank.w: the angle moves otherwise. Sums in rad since the two disagreed."""

    missed: float = 0.0  # by how much the angle moved beyond what the speeds say
    moved: float = 0.0  # how far either of them moved
    is_ignored: int = 0  # crank.w is not believed: how often the two must agree until it is

    def after(self, change: float, told: float, greatest: float) -> Doubt:
        if not self.is_ignored and self.moved == 0 and abs(change - told) <= abs(change) / 4:
            return self
        missed = self.missed + within(EVIDENCE, change - told)
        moved = self.moved + min(EVIDENCE, greatest)
        if self.is_ignored:
            if moved > 4 * EVIDENCE and abs(missed) < 0.23 * moved:
                return Doubt(is_ignored=self.is_ignored - 1)
            is_over = moved > 8 * EVIDENCE
            return Doubt(is_ignored=AGREEMENTS) if is_over else Doubt(missed, moved, self.is_ignored)
        if abs(missed) > 1.5 * EVIDENCE and abs(missed) > 0.55 * moved:
            return Doubt(is_ignored=AGREEMENTS)
        return Doubt() if moved > 8 * EVIDENCE else Doubt(missed, moved)


@dataclass(frozen=True)
class Crank:
    """The crank's motion at the end of the last step, and the samples that it was carried from."""

    end: CrankMotion = CrankMotion()
    source: str = "phi"  # the highest derivative that the host gives: "phi", "w" or "a"
    phi: float = 0.0  # the newest sample of the angle as given
    w: float = 0.0  # likewise of the speed
    samples: Samples = Samples("phi")  # of the source
    fit: Fit = Fit()  # likewise; used with smoothing only
    doubt: Doubt = Doubt()

    def _best_source(self, w: float, a: float) -> str:
        if self.source == "a" or (self.source == "phi" and w == 0):
            return self.source
        return "a" if a != 0 else "w"

    def start(self, phi: float, w: float, a: float) -> Crank:
        """The inputs at the start count as a sample."""
        values, source = {"phi": phi, "w": w, "a": a}, self._best_source(w, a)
        first = values[source]
        samples = Samples(source).add(first, 0.0)
        return replace(self, phi=phi, w=w, source=source, samples=samples, fit=Fit((0.0,), (first,), (1.0,)))

    def _without_close(self, gap: float, h: float) -> tuple[Crank, float]:
        """Less samples that lie close to one `gap` later; angle and speed as they were at the newest one left."""
        samples, longer = self.samples.without_close(gap, h)
        dropped, phi, w = len(self.samples.ages) - len(samples.ages), self.phi, self.w
        for n in range(min(dropped, len(self.samples.ages) - 1)):
            (now, then), (new, old) = self.samples.ages[n : n + 2], self.samples.values[n : n + 2]
            if self.source == "phi":
                phi -= new - old
            else:
                older_w = old if self.source == "w" else w - (new + old) / 2 * (then - now)
                phi, w = phi - (w + older_w) / 2 * (then - now), older_w
        return replace(self, samples=samples, phi=phi, w=w), longer

    def _whole_turns(self, change: float, expected: float) -> int:
        """Those in a change of the angle: the speed tells, or a leap by more than half a turn."""
        if self.source == "phi":
            if abs(change) <= pi:
                return 0
            expected = within(pi, expected)
        return round((change - expected) / TURN)

    def advance(
        self, phi: float, w: float, a: float, gap: float, h: float, *, at_step_end: bool, smoothing: float = 0.0
    ) -> Crank:
        """After a step of h seconds with these inputs; `gap` seconds since the last sample."""
        before, is_first, shift, doubt = self, not self.samples.ages, 0.0, self.doubt
        if not is_first and not smoothing:
            before, gap = self._without_close(gap, h)
            is_first = not before.samples.ages
        change, source, is_contradicted = phi - before.phi, self._best_source(w, a), False
        if doubt.is_ignored:
            source = "phi"
        if not is_first:
            expected = (replace(self.end, phi=before.phi).after(h) if at_step_end else self.end).phi - before.phi
            if abs(change - expected) > JUMP:
                shift = TURN * before._whole_turns(change, expected)
                is_first = abs(change - shift - expected) > JUMP
            change -= shift
            if not at_step_end and (self.source != "phi" or doubt.is_ignored):
                told, greatest = (before.w + w) / 2 * gap, max(abs(change), abs(before.w * gap), abs(w * gap))
                doubt = doubt.after(change, told, greatest)
                is_contradicted = abs(change - told) > max(EVIDENCE, greatest / 2)
                source = "phi" if doubt.is_ignored else self._best_source(w, a)
        older, fit = before.samples, self.fit
        if is_first:
            older, fit = Samples(source), Fit()
        elif source != self.source:
            if source == "phi":
                older, fit = Samples("phi", (0.0,), (before.phi,)), Fit()
            else:
                # Zeros so far are samples if the crank did not change what was given below, else the derivative was
                # not connected; one sample shows no change, but from rest the crank comes half as far.
                is_from_rest = len(older.ages) > 1 or abs(change) < 0.75 * abs(w * gap)
                count = len(older.ages) if older.are_flat() and is_from_rest else 0
                count = min(count, Samples.DEGREES[source] + 1)
                zeros = (0.0,) * count
                older = Samples(source, older.ages[:count], zeros, None, older.skipped_gap)
                fit = replace(fit, values=(0.0,) * len(fit.ages), met=0.0) if zeros else Fit()
        values = {"phi": phi, "w": w, "a": a}
        shift = shift if source == "phi" else 0.0
        samples = older.add(values[source], gap, shift)

        trend: Sequence[float] = (values[source], *samples.derivatives(older, 0.0 if at_step_end else h))
        if smoothing:
            fit = fit.add(values[source], gap, shift, smoothing, samples.degree)
            ahead = 0.0 if at_step_end else h
            if fit.is_proven(ahead) and not is_contradicted:
                fitted = fit.polynomial(samples.degree)
                goes = CrankMotion(*fitted).after(ahead).phi - values[source]
                farthest = samples.farthest(older, goes, ahead)
                if source != "phi":
                    farthest = min(farthest, samples.farthest_of_a_rate(older))
                has_met = ahead <= 1.25 * fit.met and abs(goes) <= 2 * fit.slope * ahead
                if has_met or abs(goes) <= farthest + OUTLIER * min(fit.noise, fit.missed):
                    trend = fitted
        motion = {
            "phi": CrankMotion(trend[0], trend[1], a or trend[2], trend[3]),
            "w": CrankMotion(phi, *trend[:3]),
            "a": CrankMotion(phi, w, *trend[:2]),
        }[source]
        if is_contradicted and source != "phi" and abs(change) < abs(w * gap):
            motion = CrankMotion(phi, change / gap)
        return Crank(motion if at_step_end else motion.after(h), source, phi, w, samples, fit, doubt)


@dataclass(frozen=True)
class Travel:
    """The machine's distance: trapezoidal rule between samples of its speed, its line continued beyond."""

    s: float = 0.0  # at the end of the last step, m
    v: float = 0.0  # m/s
    a: float = 0.0  # m/s2
    until_sample: float = 0.0  # distance at the newest sample, m
    sample: float | None = None  # the newest speed as given
    slope: float | None = None  # that led to it

    def advance(self, v: float, gap: float, h: float, at_step_end: bool) -> Travel:
        distance, to_sample, slope = self.until_sample, None, 0.0
        if self.sample is not None:
            distance += (self.sample + v) / 2 * gap
            slope = to_sample = (v - self.sample) / gap
            if self.slope is not None:
                slope = smaller(slope, self.slope)
            elif MOST_GROWTH * gap < h:
                slope = 0.0
        beyond = 0.0 if at_step_end else h
        end = distance + beyond * (v + beyond * slope / 2)
        return Travel(end, v + beyond * slope, slope, distance, v, to_sample)
