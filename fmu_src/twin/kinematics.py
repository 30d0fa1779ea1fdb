"""The linkage with its gradients by the geometry, in numpy: what `transplanter_linkage.measures` takes without an FMU.

A change of the geometry moves each dyad's base and lengths; its links answer by turning, by angles that solve the same
2x2 system as their rates by the crank angle (linkage.py). What is differentiated by phi besides is a list by order, and
a product of two such lists follows Leibniz.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .linkage import Geometry, Solution, _close, _dot, solve

Array = NDArray[Any]
PARAMETERS = tuple(each.name for each in fields(Geometry))
ORDER = 3  # of the highest derivative by phi


@dataclass(frozen=True)
class _Dyad:
    """Two links, `first` from the start of the base and `second` from its end, with their derivatives by phi."""

    first: list[Any]
    second: list[Any]
    first_length: float
    second_length: float
    first_rate: Any  # of its direction
    second_rate: Any
    sine: Any  # of the angle between the links

    @property
    def cosine(self) -> Any:
        return _dot(self.first[0], self.second[0]) / (self.first_length * self.second_length)

    @property
    def sine_rate(self) -> Any:
        return -self.cosine * (self.second_rate - self.first_rate)

    def turn(self, base: list[Any], first_change: Any, second_change: Any) -> tuple[list[Any], list[Any]]:
        """The angles by which the links turn when the base changes by a vector and the lengths do."""
        orders = range(len(base))
        change = [
            base[n]
            - first_change / self.first_length * self.first[n]
            + second_change / self.second_length * self.second[n]
            for n in orders
        ]
        across = [_leibniz(_cross, self.first, self.second, n) for n in orders]
        along = ([_leibniz(_dot, change, link, n) for n in orders] for link in (self.second, self.first))
        first, second = (_over(each, across) for each in along)
        return first, second


@dataclass(frozen=True)
class Kinematics:
    """A geometry's poses and their gradients; raises UnreachablePose where it cannot be assembled."""

    geometry: Geometry = field(default_factory=Geometry)

    def solve(self, phi: float | Array, order: int = 2) -> Solution:
        """As `solve` of this geometry."""
        return solve(self.geometry, phi, order)

    def sample(self, phi: Array) -> tuple[Array, Array]:
        """The signals of `measures.SIGNALS` at each angle, a row each, and their derivatives by phi."""
        _, abd, efg = self._links(phi, ORDER)
        found = solve(self.geometry, phi, ORDER)
        tip = [(z.real, z.imag) for z in found.tip]
        margin_rate = np.where(abd.sine <= efg.sine, abd.sine_rate, efg.sine_rate)
        values = [*tip[0], *tip[1], *tip[2], found.angle[0], found.margin]
        rates = [*tip[1], *tip[2], *tip[3], found.angle[1], margin_rate]
        return np.column_stack(values), np.column_stack(rates)

    def gradient(self, phi: Array, weights: Array) -> Array:
        """A row each angle: the gradient by the 18 parameters, at that angle, of the weighted sum of the signals."""
        phi, weights = np.asarray(phi, dtype=float), np.asarray(weights, dtype=float)
        change = self._changes(phi, 2 if weights[:, 4:6].any() else 1 if weights[:, 2:4].any() else 0)
        gradient = np.zeros((len(PARAMETERS), len(phi)))
        for n, tip in enumerate(change.tip):
            gradient += weights[:, 2 * n] * tip.real + weights[:, 2 * n + 1] * tip.imag
        gradient += weights[:, 6] * change.angle + weights[:, 7] * change.margin
        return np.asarray(gradient.T)

    def _links(self, phi: Array, order: int) -> tuple[list[Any], _Dyad, _Dyad]:
        """The arm DE and both dyads, each with its derivatives by phi; equations as in linkage.py."""
        g, orders = self.geometry, range(order + 1)
        turned = np.exp(-1j * phi)
        oa = [g.L1 * np.exp(1j * g.phi1) * turned * (-1j) ** n for n in orders]
        cd = [g.L4 * np.exp(1j * g.phi4) * turned * (-1j) ** n for n in orders]
        d = [cd[n] + (g.XC + 1j * g.YC if n == 0 else 0) for n in orders]
        abd = self._dyad("ABD", phi, oa, d, g.L2, g.L3)
        de = [g.L5 / g.L3 * np.exp(-1j * g.theta3) * z for z in abd.second]
        e = [d[n] + de[n] for n in orders]
        pivot = [np.full_like(turned, g.XG + 1j * g.YG if n == 0 else 0) for n in orders]
        return de, abd, self._dyad("EFG", phi, e, pivot, g.L6, g.L7)

    @staticmethod
    def _dyad(name: str, phi: Array, start: list[Any], end: list[Any], first: float, second: float) -> _Dyad:
        p, q, _, sine = _close(name, phi, start, end, first, second)
        first_rate, second_rate = (
            _dot(1j * link[0], link[1]) / length**2 for link, length in ((p, first), (q, second))
        )
        return _Dyad(p, q, first, second, first_rate, second_rate, sine)

    def _changes(self, phi: Array, order: int) -> _Change:
        """What a unit change of each parameter does at each angle: arrays of parameters x angles."""
        g, orders = self.geometry, range(order + 1)
        de, abd, efg = self._links(phi, max(order, 1))
        unit = dict(zip(PARAMETERS, np.eye(len(PARAMETERS))[:, :, None], strict=True))

        def along(direction: float) -> list[Any]:
            """A unit vector that turns with the cranks."""
            return [np.exp(1j * direction) * np.exp(-1j * phi) * (-1j) ** n for n in orders]

        crank_oa, crank_cd = along(g.phi1), along(g.phi4)
        point_c, point_g = (unit[x] + 1j * unit[y] for x, y in (("XC", "YC"), ("XG", "YG")))
        d = [(unit["L4"] + 1j * g.L4 * unit["phi4"]) * crank_cd[n] + (point_c if n == 0 else 0) for n in orders]
        base = [d[n] - (unit["L1"] + 1j * g.L1 * unit["phi1"]) * crank_oa[n] for n in orders]
        ab, db = abd.turn(base, unit["L2"], unit["L3"])

        arm = np.exp(-1j * g.theta3) / g.L3  # DE over L5, by DB
        turn = [each - (unit["theta3"] if n == 0 else 0) for n, each in enumerate(db)]
        e = [d[n] + unit["L5"] * arm * abd.second[n] + 1j * _leibniz(np.multiply, turn, de, n) for n in orders]
        base = [(point_g if n == 0 else 0) - e[n] for n in orders]
        ef, gf = efg.turn(base, unit["L6"], unit["L7"])

        to_h, to_i = -np.exp(1j * g.theta8), -np.exp(1j * (g.theta8 + g.theta9))  # HI and IJ by EF's direction
        nozzle = 0.5 + (g.L8 * to_h + g.L9 * to_i) / g.L6
        both = unit["theta8"] + unit["theta9"]
        stretched = 0.5 * unit["L6"] + unit["L8"] * to_h + unit["L9"] * to_i
        stretched = stretched + 1j * (g.L8 * to_h * unit["theta8"] + g.L9 * to_i * both)
        tip = [
            e[n] + 1j * nozzle * _leibniz(np.multiply, ef, efg.first, n) + stretched / g.L6 * efg.first[n]
            for n in orders
        ]
        margin = np.where(abd.sine <= efg.sine, -abd.cosine * (db[0] - ab[0]), -efg.cosine * (gf[0] - ef[0]))
        return _Change(tip, ef[0] + both, margin)


@dataclass(frozen=True)
class _Change:
    """Of the tip and its derivatives by phi, the nozzle's direction, and the margin."""

    tip: list[Any]
    angle: Any
    margin: Any


def _cross(a: Any, b: Any) -> Any:
    """The z component of the vector product of two plane vectors."""
    return a.real * b.imag - a.imag * b.real


def _leibniz(product: Any, a: list[Any], b: list[Any], n: int) -> Any:
    """The n-th derivative of a product."""
    return sum(comb(n, k) * product(a[k], b[n - k]) for k in range(n + 1))


def _over(a: list[Any], b: list[Any]) -> list[Any]:
    """A quotient with its derivatives."""
    quotient: list[Any] = []
    for n, each in enumerate(a):
        known = sum(comb(n, k) * quotient[k] * b[n - k] for k in range(n))
        quotient.append((each - known) / b[0])
    return quotient
