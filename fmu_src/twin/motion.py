"""What the crank and the machine do between a host's samples: to read, and to edit.

A host gives its inputs at the start of a step, the outputs belong to its end (FMI 2.0.4, section 4.2.1).
So the crank is carried there: by crank.w and crank.a from the moment that they are not 0, else by the cubic
through the last four angles. The same rules as in fmu_src/component/crank.c and travel.c, less the
input derivatives, which PythonFMU does not pass on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

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

    def derivatives(self) -> tuple[float, float, float]:
        """First three time derivatives of the polynomial at the newest sample: Newton's divided differences."""
        nodes, column, newton = [-age for age in self.ages], list(self.values), []
        for distance in range(1, len(nodes)):
            column = [
                (column[i] - column[i + 1]) / (nodes[i] - nodes[i + distance]) for i in range(len(column) - 1)
            ]
            newton.append(column[0])
        first, second, third = newton + [0.0] * (3 - len(newton))
        one, two = (self.ages + (0.0, 0.0, 0.0))[1:3]
        return first + one * (second + two * third), 2 * (second + (one + two) * third), 6 * third

    def without_newest(self) -> Samples:
        """The older samples, their ages still counted from the one taken away."""
        return replace(self, ages=self.ages[1:], values=self.values[1:])

    def are_flat(self) -> bool:
        return len(set(self.values)) <= 1


@dataclass(frozen=True)
class Crank:
    """The crank's motion at the end of the last step, and the samples that it was carried from."""

    end: CrankMotion = CrankMotion()
    source: str = "phi"  # the highest derivative that the host gives: "phi", "w" or "a"
    phi: float | None = None  # the newest angle sample as given
    samples: Samples = Samples(degree=3)  # of the source

    DEGREES = {"phi": 3, "w": 2, "a": 1}

    def _best_source(self, w: float, a: float) -> str:
        if self.source == "a" or (self.source == "phi" and w == 0):
            return self.source
        return "a" if a != 0 else "w"

    def start(self, phi: float, w: float, a: float) -> Crank:
        """The inputs at the start count as a sample."""
        values, source = {"phi": phi, "w": w, "a": a}, self._best_source(w, a)
        return replace(self, phi=phi, source=source, samples=Samples(self.DEGREES[source]).add(values[source], 0.0))

    def advance(self, phi: float, w: float, a: float, gap: float, h: float, at_step_end: bool) -> Crank:
        """After a step of h seconds with these inputs; `gap` seconds since the last sample."""
        values, source = {"phi": phi, "w": w, "a": a}, self._best_source(w, a)
        samples, shift, has_jumped = self.samples, 0.0, False
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
        if has_jumped:
            samples = Samples(self.DEGREES[source])
        elif source == self.source and gap < CLOSE * h:
            samples = samples.without_newest()
        samples = samples.add(values[source], gap, shift if source == "phi" else 0.0)

        trend = samples.derivatives()
        motion = {
            "phi": CrankMotion(phi, trend[0], a or trend[1], trend[2]),
            "w": CrankMotion(phi, w, trend[0], trend[1]),
            "a": CrankMotion(phi, w, a, trend[0]),
        }[source]
        return Crank(motion if at_step_end else motion.after(h), source, phi, samples)


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
            if self.slope is not None:  # the smaller one, or 0 where they differ in sign: a jump is not carried on
                slope = 0.0 if slope * self.slope <= 0 else min(slope, self.slope, key=abs)
            elif gap < CLOSE * h:
                slope = 0.0
        beyond = 0.0 if at_step_end else h
        end = distance + beyond * (v + beyond * slope / 2)
        return Travel(end, v + beyond * slope, slope, distance, v, to_sample)
