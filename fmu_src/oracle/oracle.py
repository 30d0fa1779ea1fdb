"""The mechanism to 50 digits, by another road than the code under test: the judge of all numbers.

The pose is the paper's (Chen et al. 2010, DOI 10.3969/j.issn.1000-1298.2010.12.010): the angle of every link,
from the law of cosines, equations (1) to (8). No derivative is written down: the pose is computed at
neighbouring crank angles, with so many digits that finite differences are right to the digits wanted. No
formula and no code is shared with the linkage in C or in numpy.

Points are complex x + iy in metres, x forward, y up, origin O; angles are in radians, counter-clockwise. `phi`
counts in the working direction, clockwise; derivatives are by `phi`. Parameters and `phi` are exactly the
doubles given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from mpmath import mp, mpc, mpf


@dataclass(frozen=True)
class Pose:
    """Joints and link angles at one crank angle, by the paper's names."""

    A: mpc
    B: mpc
    D: mpc
    E: mpc
    F: mpc
    G: mpc
    H: mpc
    I: mpc
    J: mpc
    phi2: mpf  # direction A to B
    phi3: mpf  # D to B
    phi5: mpf  # D to E
    phi6: mpf  # E to F
    phi7: mpf  # G to F
    phi8: mpf  # H to I
    phi9: mpf  # I to J
    angle_ABD: mpf  # within the triangle, 0 to pi
    angle_EFG: mpf


class Oracle:
    """One geometry, `{"L1": 0.05, ...}`, answered to so many decimal digits.

    Each question takes the order of the highest derivative wanted and returns a list: [n] is the n-th derivative.
    Raises ValueError where a dyad cannot close.
    """

    def __init__(self, geometry: Mapping[str, float], digits: int = 50) -> None:
        self.geometry = {name: mpf(value) for name, value in geometry.items()}
        self.digits = digits
        self._steps_to_pose: dict[tuple[float, int], dict[int, Pose]] = {}

    def tip(self, phi: float, order: int) -> list[tuple[mpf, mpf]]:
        """The point J, as (x, y)."""
        return [(z.real, z.imag) for z in self.derivatives(lambda pose: pose.J, phi, order)]

    def nozzle_angle(self, phi: float, order: int) -> list[mpf]:
        """The direction from I to J; its value within half a turn of straight down."""
        angle, *rates = self.angle(lambda pose: pose.phi9, phi, order)
        with mp.workdps(self.digits):
            down = -mp.pi / 2
            return [down + _principal(angle - down), *rates]

    def margin(self, phi: float, order: int) -> list[mpf]:
        """The smaller sine of the angles ABD and EFG."""
        pose = self.pose(phi)
        name = min(("angle_ABD", "angle_EFG"), key=lambda name: mp.sin(getattr(pose, name)))
        return self.derivatives(lambda pose: mp.sin(getattr(pose, name)), phi, order)

    def angle(self, of: Callable[[Pose], mpf], phi: float, order: int) -> list[mpf]:
        """Any angle of the pose; it may jump by whole turns beside phi."""
        here = of(self.pose(phi))
        return self.derivatives(lambda pose: here + _principal(of(pose) - here), phi, order)

    def derivatives(self, of: Callable[[Pose], mpf | mpc], phi: float, order: int) -> list[mpf | mpc]:
        """Any smooth quantity of the pose, by central differences.

        Their relative error is about the square of the step over the range in which the pose changes its nature,
        some 1e-12 beside the nearest dead points asked for. Each difference costs as many digits as the step has.
        """
        step_digits = self.digits // 2 + 15
        step = mp.ldexp(1, -math.ceil(step_digits * math.log2(10)))
        with mp.workdps(self.digits + 20 + order * step_digits):
            key, reach = (phi, order), (order + 1) // 2
            if key not in self._steps_to_pose:
                self._steps_to_pose[key] = {k: self._pose(phi + k * step) for k in range(-reach, reach + 1)}
            value = {k: of(pose) for k, pose in self._steps_to_pose[key].items()}
            exact = [_central_difference(value, n) / step**n for n in range(order + 1)]
        with mp.workdps(self.digits):
            return [+number for number in exact]

    def pose(self, phi: float) -> Pose:
        """The pose itself."""
        with mp.workdps(self.digits + 10):
            return self._pose(mpf(phi))

    def _pose(self, phi: mpf) -> Pose:
        """Equations (1) to (8) at the working precision."""
        g = self.geometry
        A = g["L1"] * mp.expj(g["phi1"] - phi)
        D = mpc(g["XC"], g["YC"]) + g["L4"] * mp.expj(g["phi4"] - phi)
        AD = abs(D - A)
        phi3 = mp.arg(A - D) + _corner("ABD", g["L3"], AD, g["L2"])  # plus: B on the right of A to D
        B = D + g["L3"] * mp.expj(phi3)
        phi5 = phi3 - g["theta3"]
        E = D + g["L5"] * mp.expj(phi5)
        G = mpc(g["XG"], g["YG"])
        GE = abs(E - G)
        phi7 = mp.arg(E - G) + _corner("EFG", g["L7"], GE, g["L6"])  # plus: F on the right of E to G
        F = G + g["L7"] * mp.expj(phi7)
        phi6 = mp.arg(F - E)
        phi8 = phi6 - mp.pi + g["theta8"]
        phi9 = phi8 + g["theta9"]
        H = (E + F) / 2
        I = H + g["L8"] * mp.expj(phi8)
        J = I + g["L9"] * mp.expj(phi9)
        angle_ABD = _corner("ABD", g["L2"], g["L3"], AD)
        angle_EFG = _corner("EFG", g["L6"], g["L7"], GE)
        phi2 = mp.arg(B - A)
        return Pose(A, B, D, E, F, G, H, I, J, phi2, phi3, phi5, phi6, phi7, phi8, phi9, angle_ABD, angle_EFG)


def conditioning(
    geometry: Mapping[str, float], phi: float, order: int, of: Callable[[Oracle, float, int], list[Any]] = Oracle.tip
) -> list[tuple[float, ...]]:
    """How sharp the question is: what the roundings of its inputs alone do to the answer.

    For each derivative 0 to `order` and each component of Oracle.tip (or another of its answers): the sum, over
    phi and all parameters, of what one unit in the last place of that number does to the exact value.
    """
    digits = 30
    nudge = mpf(10) ** -20  # far below any unit in the last place, far above what the digits leave uncertain

    def answer(changed: Mapping[str, float], order: int) -> list[tuple[mpf, ...]]:
        found = of(Oracle({**geometry, **changed}, digits), phi, order)
        return [value if isinstance(value, tuple) else (value,) for value in found]

    with mp.workdps(digits):
        exact = answer({}, order + 1)
        effect = [[abs(slope) * math.ulp(phi) for slope in exact[n + 1]] for n in range(order + 1)]
        for name, value in geometry.items():
            nudged = answer({name: mpf(value) + nudge}, order)
            for n in range(order + 1):
                for i, (there, here) in enumerate(zip(nudged[n], exact[n], strict=True)):
                    effect[n][i] += abs(there - here) / nudge * math.ulp(value)
        return [tuple(float(component) for component in components) for components in effect]


def error(computed: float, exact: mpf) -> float:
    """|computed - exact|, the difference taken before anything is rounded."""
    with mp.workdps(60):
        return float(abs(mpf(computed) - exact))


def _corner(dyad: str, first: mpf, second: mpf, opposite: mpf) -> mpf:
    """The angle between the sides `first` and `second` of a triangle, 0 to pi, by the law of cosines, as in (6)."""
    cosine = (first**2 + second**2 - opposite**2) / (2 * first * second)
    if abs(cosine) > 1:
        raise ValueError(f"dyad {dyad} cannot close: a cosine would be {mp.nstr(cosine, 20)}")
    return mp.acos(cosine)


def _principal(angle: mpf) -> mpf:
    """The same direction within half a turn of 0."""
    return angle - 2 * mp.pi * mp.nint(angle / (2 * mp.pi))


def _central_difference(value: Mapping[int, mpf | mpc], order: int, at: int = 0) -> mpf | mpc:
    """Central difference at value[at]; an odd order is half that of the even one below, from -1 to +1."""
    if order % 2:
        above, below = (_central_difference(value, order - 1, at + side) for side in (1, -1))
        return (above - below) / 2
    return sum((-1) ** j * math.comb(order, j) * value[at + order // 2 - j] for j in range(order + 1))
