"""What the crank and the machine do between a host's samples: to read, and to edit.

A host gives its inputs at the start of a step, the outputs belong to its end (FMI 2.0.4, section 4.2.1).
So the crank is carried there: by crank.w and crank.a from the moment that they are not 0, else by the cubic
through the last four angles. The same rules as in fmu_src/component/crank.c and travel.c, less the
input derivatives, which PythonFMU does not pass on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np

TURN = 2 * pi
JUMP = pi / 2  # off what was expected, whole turns aside
CLOSE = 0.05  # of a step: a sample nearer than this to the next one is left out


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


@dataclass(frozen=True)
class Samples:
    """The last samples of a signal, newest first: seconds before the newest one, and values."""

    degree: int  # of the polynomial through them
    ages: tuple[float, ...] = ()
    values: tuple[float, ...] = ()

    def add(self, value: float, gap: float, shift: float = 0.0) -> Samples:
        """With `value`, given `gap` seconds after the newest one; `shift` is added to the older values."""
        ages = (0.0, *(age + gap for age in self.ages))
        values = (value, *(old + shift for old in self.values))
        return replace(self, ages=ages[: self.degree + 1], values=values[: self.degree + 1])

    def differences(self) -> list[float]:
        """Newton's divided differences at the newest sample, orders 1, 2 and 3; 0 where samples are too few."""
        nodes, column, newton = [-age for age in self.ages], list(self.values), []
        for distance in range(1, len(nodes)):
            column = [
                (column[i] - column[i + 1]) / (nodes[i] - nodes[i + distance]) for i in range(len(column) - 1)
            ]
            newton.append(column[0])
        return newton + [0.0] * (3 - len(newton))

    def derivatives(self, older: Samples) -> tuple[float, float, float]:
        """First three time derivatives, at the newest sample, of the polynomial that continues the signal.

        `older` are the samples without the newest one. Where that one tells of a jump, in what a polynomial of
        degree 2 or 3 has slopes of, the smaller of the last two slopes goes on: the polynomial would overshoot.
        """
        newton, before = self.differences(), older.differences()
        if self.degree > 1 and len(older.ages) > self.degree:
            slope, higher = self.degree - 2, self.degree - 1
            expected = before[higher] * self.ages[-1]
            if abs(newton[slope] - before[slope] - expected) > 0.75 * (abs(before[slope]) + abs(expected)):
                newton[slope] = smaller(newton[slope], before[slope])
                newton[higher] = 0.0
        first, second, third = newton
        one, two = (self.ages + (0.0, 0.0, 0.0))[1:3]
        return first + one * (second + two * third), 2 * (second + (one + two) * third), 6 * third

    def without_newest(self) -> Samples:
        """The older samples, their ages still counted from the one taken away."""
        return replace(self, ages=self.ages[1:], values=self.values[1:])

    def are_flat(self) -> bool:
        return len(set(self.values)) <= 1


@dataclass(frozen=True)
class Fit:
    """All samples that still weigh, newest first: what smoothing fits a polynomial to."""

    ages: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()

    def add(self, value: float, gap: float, shift: float, smoothing: float) -> Fit:
        """With `value`, given `gap` seconds after the newest one; the weights of the others fade."""
        fade = max((1 + gap / smoothing) ** -4, 1 / 16)  # about exp(-4 gap / smoothing)
        older = [
            (age + gap, old + shift, weight * fade)
            for age, old, weight in zip(self.ages, self.values, self.weights)
            if weight * fade > 1e-16
        ]
        return Fit(*zip((0.0, value, 1.0), *older))

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
class Crank:
    """The crank's motion at the end of the last step, and the samples that it was carried from."""

    end: CrankMotion = CrankMotion()
    source: str = "phi"  # the highest derivative that the host gives: "phi", "w" or "a"
    phi: float | None = None  # the newest angle sample as given
    samples: Samples = Samples(degree=3)  # of the source
    fit: Fit = Fit()  # likewise; used with smoothing only

    DEGREES = {"phi": 3, "w": 2, "a": 1}

    def _best_source(self, w: float, a: float) -> str:
        if self.source == "a" or (self.source == "phi" and w == 0):
            return self.source
        return "a" if a != 0 else "w"

    def start(self, phi: float, w: float, a: float) -> Crank:
        """The inputs at the start count as a sample."""
        values, source = {"phi": phi, "w": w, "a": a}, self._best_source(w, a)
        first = values[source]
        samples = Samples(self.DEGREES[source]).add(first, 0.0)
        return replace(self, phi=phi, source=source, samples=samples, fit=Fit((0.0,), (first,), (1.0,)))

    def advance(
        self, phi: float, w: float, a: float, gap: float, h: float, at_step_end: bool, smoothing: float = 0.0
    ) -> Crank:
        """After a step of h seconds with these inputs; `gap` seconds since the last sample."""
        values, source = {"phi": phi, "w": w, "a": a}, self._best_source(w, a)
        samples, fit, shift, has_jumped = self.samples, self.fit, 0.0, False
        if self.phi is not None:
            expected = (replace(self.end, phi=self.phi).after(h) if at_step_end else self.end).phi
            shift = TURN * round((phi - expected) / TURN)
            has_jumped = abs(phi - expected - shift) > JUMP
        if source != self.source:
            # Zeros so far are samples if the crank did not change what was given below, else the derivative was
            # not connected; one sample shows no change, but from rest the crank comes half as far.
            is_from_rest = len(samples.ages) > 1 or abs(phi - (self.phi or 0.0) - shift) < 0.75 * abs(w * gap)
            zeros = (0.0,) * len(samples.ages) if samples.are_flat() and is_from_rest else ()
            samples = Samples(self.DEGREES[source], samples.ages[: len(zeros)], zeros)
            fit = Fit(fit.ages, (0.0,) * len(fit.ages), fit.weights) if zeros else Fit()
        if has_jumped:
            samples, fit = Samples(self.DEGREES[source]), Fit()
        elif source == self.source and gap < CLOSE * h and not smoothing:
            samples = samples.without_newest()
        shift = shift if source == "phi" else 0.0
        older, samples = samples, samples.add(values[source], gap, shift)

        trend = (values[source], *samples.derivatives(older))
        if smoothing:
            fit = fit.add(values[source], gap, shift, smoothing)
            trend = fit.polynomial(samples.degree)
        motion = {
            "phi": CrankMotion(trend[0], trend[1], a or trend[2], trend[3]),
            "w": CrankMotion(phi, *trend[:3]),
            "a": CrankMotion(phi, w, *trend[:2]),
        }[source]
        return Crank(motion if at_step_end else motion.after(h), source, phi, samples, fit)


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
            elif gap < CLOSE * h:
                slope = 0.0
        beyond = 0.0 if at_step_end else h
        end = distance + beyond * (v + beyond * slope / 2)
        return Travel(end, v + beyond * slope, slope, distance, v, to_sample)
