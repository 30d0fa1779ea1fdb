"""The seven-bar linkage in complex numbers: to read beside the paper, and to edit.

Chen, Wang, Ren, Huang (2010), DOI 10.3969/j.issn.1000-1298.2010.12.010; numbers in brackets are its
equations. A point x + iy is in metres, x forward (the way the machine travels), y up, origin O; angles are in
radians, counter-clockwise. Both cranks turn clockwise: `phi` is what they have turned *in the working
direction*. The paper prints phi1 + phi, its phi counted counter-clockwise; here that is phi1 - phi.

What is wrong in the paper's print (tests/twin/test_errata.py shows each):
- YC and YG have lost their signs: the pivots C and G lie *below* O, at -55 and -115 mm.
- (10) has phi3' in the third term of its numerator, where phi1' belongs.
- (12) and (20) have phi4 in their sines and cosines, where phi4 + phi belongs.
- (17) and (20) have phi4'' (which is 0) where phi4'^2 belongs.
- (23) has a stray cos(phi6 - phi7) on its L6 term.
Not wrong, but of no use where phi3 passes 180 degrees, twice in the working cycle: (4) divides by 0 there, and
(11) divides 0 by 0, so that it loses all digits on the way.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

try:
    from ..interface import load_interface
except ImportError:  # inside the FMU the files lie side by side
    from .interface import load_interface  # type: ignore[no-redef, import-untyped, import-not-found, unused-ignore]  # elsewhere

NOMINAL = load_interface().geometry
HIGHEST_ORDER = 3


@dataclass(frozen=True)
class Geometry:
    """The paper's table 1 in metres and radians; the defaults are its final set, the nominal one."""

    L1: float = NOMINAL["L1"]  # crank OA
    L2: float = NOMINAL["L2"]  # link AB
    L3: float = NOMINAL["L3"]  # link BD
    L4: float = NOMINAL["L4"]  # crank CD
    L5: float = NOMINAL["L5"]  # arm DE, fixed to BD
    L6: float = NOMINAL["L6"]  # link EF, which carries the nozzle
    L7: float = NOMINAL["L7"]  # rocker FG
    L8: float = NOMINAL["L8"]  # HI, from the middle H of EF
    L9: float = NOMINAL["L9"]  # nozzle IJ
    XC: float = NOMINAL["XC"]  # pivot C, forward of O
    YC: float = NOMINAL["YC"]  # pivot C, above O: negative, it lies below
    XG: float = NOMINAL["XG"]  # pivot G, forward of O
    YG: float = NOMINAL["YG"]  # pivot G, above O: negative, it lies below
    phi1: float = NOMINAL["phi1"]  # initial angle of OA
    phi4: float = NOMINAL["phi4"]  # initial angle of CD
    theta3: float = NOMINAL["theta3"]  # angle from DE to DB
    theta8: float = NOMINAL["theta8"]  # angle between EF and HI
    theta9: float = NOMINAL["theta9"]  # angle between HI and IJ

    def __post_init__(self) -> None:
        for name, value in ((field.name, getattr(self, field.name)) for field in fields(self)):
            if not np.isfinite(value):
                raise ValueError(f"geometry.{name} = {value} is not finite")
            if name in ("L2", "L3", "L6", "L7") and value <= 0:
                raise ValueError(f"geometry.{name} = {value}: this link must be longer than 0")
            if name in ("L1", "L4", "L5", "L8", "L9") and value < 0:
                raise ValueError(f"geometry.{name} = {value}: this length must not be negative")


class UnreachablePose(ValueError):
    """A dyad cannot close: its ends are `miss` metres too far apart or, where `miss` < 0, too near.

    A dead point exactly (`miss` = 0) counts as one: the joint is there, but its rates are infinite.
    """

    def __init__(self, dyad: str, phi: float, miss: float) -> None:
        self.dyad, self.phi, self.miss = dyad, phi, miss
        where = f"dyad {dyad} cannot close at phi = {phi:.10g} rad ({np.degrees(phi) % 360:.4f} deg in its turn)"
        how = f"its ends are {abs(miss) * 1e3:.4g} mm too {'near each other' if miss < 0 else 'far apart'}"
        super().__init__(f"{where}: {how if miss else 'this is its dead point exactly'}")


@dataclass(frozen=True)
class Solution:
    """A pose and its derivatives by phi, not by time; every array has the shape of phi.

    tip[n]     n-th derivative of the point J, complex, m per rad^n
    angle[n]   n-th derivative of the direction I to J; angle[0] is within half a turn of straight down,
               in (-3pi/2, pi/2], so that it does not jump in use
    margin     the smaller sine of the angles ABD and EFG: 0 at a dead point
    joints     the points "O" and "A" to "J", complex, m
    points     the same with their derivatives, lists by order
    phi        the crank angles
    """

    tip: tuple[np.ndarray, ...]
    angle: tuple[np.ndarray, ...]
    margin: np.ndarray
    joints: dict[str, Any]
    points: dict[str, list[Any]]
    phi: np.ndarray

    def velocity(self, crank_speed: float) -> np.ndarray:
        """(16): velocity of J, complex, m/s; crank_speed in rad/s in the working direction. Needs order 1."""
        return self.tip[1] * crank_speed

    def acceleration(self, crank_speed: float, crank_acceleration: float = 0.0) -> np.ndarray:
        """(25), and for cranks that do not turn evenly too: acceleration of J, complex, m/s2. Needs order 2."""
        return self.tip[2] * crank_speed**2 + self.tip[1] * crank_acceleration


def solve(geometry: Geometry, phi: float | np.ndarray, order: int = 2) -> Solution:
    """The pose at `phi` (rad, one angle or an array) with its derivatives by phi up to `order`, 0 to 3.

    Raises UnreachablePose for the first dyad, and the first angle, that cannot close. A name stands for a list
    by order: A[n] is the n-th derivative of A.
    """
    if order not in range(HIGHEST_ORDER + 1):
        raise ValueError(f"order = {order!r}: derivatives go from 0 to {HIGHEST_ORDER}")
    if not np.all(np.isfinite(phi)):
        raise ValueError(f"phi = {phi!r} is not finite")
    g, phi = geometry, np.asarray(phi, dtype=float)
    orders = range(order + 1)

    # (1), (2), and the crank terms of (9), (12), (17), (20): each derivative of e(-phi) brings a factor -i.
    turned = np.exp(-1j * phi)
    C = [np.full_like(turned, g.XC + 1j * g.YC if n == 0 else 0) for n in orders]
    G = [np.full_like(turned, g.XG + 1j * g.YG if n == 0 else 0) for n in orders]
    A = [g.L1 * np.exp(1j * g.phi1) * turned * (-1j) ** n for n in orders]
    D = [C[n] + g.L4 * np.exp(1j * g.phi4) * turned * (-1j) ** n for n in orders]

    # (3), (4); (9) to (11); (17) to (19): AB and DB meet in B.
    _, DB, _, margin_ABD = _close("ABD", phi, A, D, g.L2, g.L3)

    # (5), (12), (20): DE is DB turned back by theta3 and drawn out to L5.
    E = [D[n] + g.L5 / g.L3 * np.exp(-1j * g.theta3) * DB[n] for n in orders]

    # (6), (7); (13) to (15); (21) to (24): EF and GF meet in F.
    EF, GF, EF_rates, margin_EFG = _close("EFG", phi, E, G, g.L6, g.L7)

    # (8), (16), (25): HI and IJ are fixed to EF, at phi8 = phi6 - pi + theta8 and phi9 = phi8 + theta9.
    direction_HI = -np.exp(1j * g.theta8)  # over that of EF
    direction_IJ = direction_HI * np.exp(1j * g.theta9)
    H = [E[n] + EF[n] / 2 for n in orders]
    I = [H[n] + g.L8 / g.L6 * direction_HI * EF[n] for n in orders]
    J = [I[n] + g.L9 / g.L6 * direction_IJ * EF[n] for n in orders]
    phi9 = np.angle(1j * direction_IJ * EF[0]) - np.pi / 2  # a factor i lays straight down on the axis x

    O = [np.zeros_like(turned) for _ in orders]
    B, F = [D[n] + DB[n] for n in orders], [G[n] + GF[n] for n in orders]
    points = {"O": O, "A": A, "B": B, "C": C, "D": D, "E": E, "F": F, "G": G, "H": H, "I": I, "J": J}
    joints = {name: point[0] for name, point in points.items()}
    return Solution(tuple(J), (phi9, *EF_rates), np.minimum(margin_ABD, margin_EFG), joints, points, phi)


def _close(
    name: str, phi: Any, start: list[Any], end: list[Any], start_length: float, end_length: float
) -> tuple[list[Any], list[Any], list[Any], Any]:
    """Two links, one from `start`, one from `end`, meet in a joint on the right of the line start to end.

    Returns the vectors p and q from start and from end to the joint, the rates of p's direction from order 1
    on (all lists by order), and the sine of the angle between the links.

    Position: where the joint's height meets the base follows from the law of cosines, as in (6); the height
    is twice the area over the base, the area by Heron's formula in factors, exact beside dead points too. No
    angle is formed. "On the right" is the minus before the root of (4) and the plus of phi7 = alpha + theta.

    Rates: p = q + base at every order, while p' = i w p, p'' = (i w' - w^2) p, and so on. The dot product
    with p takes p's unknown rate away and leaves q's; that with q the reverse. Both divide by the determinant
    p x q, which is 0 at dead points only.
    """
    base = [e - s for s, e in zip(start, end, strict=True)]
    square = _dot(base[0], base[0])
    longest, shortest = start_length + end_length, abs(start_length - end_length)
    closes = (longest**2 - square) * (square - shortest**2)
    if not np.all(closes > 0):
        at = np.flatnonzero(~(closes > 0))[0]
        length = float(np.sqrt(square.flat[at]))
        miss = length - (longest if length > max(start_length, end_length) else shortest)
        raise UnreachablePose(name, float(phi.flat[at]), miss)
    twice_area = np.sqrt(closes) / 2
    height = -1j * base[0] * (twice_area / square)  # -i turns to the right
    difference = (start_length - end_length) * (start_length + end_length)
    p = [base[0] * ((difference + square) / (2 * square)) + height]
    q = [base[0] * ((difference - square) / (2 * square)) + height]
    determinant = -twice_area

    p_rates: list[Any] = []
    q_rates: list[Any] = []
    for base_n in base[1:]:
        p_known, q_known = _known(p_rates), _known(q_rates)
        p_rate = (_dot(q[0], base_n - p_known * p[0]) + np.real(q_known) * end_length**2) / determinant
        q_rate = (_dot(p[0], base_n + q_known * q[0]) - np.real(p_known) * start_length**2) / determinant
        p.append((1j * p_rate + p_known) * p[0])
        q.append((1j * q_rate + q_known) * q[0])
        p_rates.append(p_rate)
        q_rates.append(q_rate)
    return p, q, p_rates, twice_area / (start_length * end_length)


def _known(rates: list[Any]) -> Any:
    """What lower orders tell of the next derivative of a turning link z: it is (i next_rate + this) z."""
    if not rates:
        return 0.0
    if len(rates) == 1:
        return -(rates[0] ** 2)
    return -3 * rates[0] * rates[1] - 1j * rates[0] ** 3


def _dot(a: Any, b: Any) -> Any:
    """Scalar product of two plane vectors."""
    return a.real * b.real + a.imag * b.imag
