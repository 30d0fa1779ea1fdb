"""Random geometries by the thousand, judged by the loop equations, by the oracle and by power balance.

Hypothesis draws them, the same ones in each run, and shrinks a counterexample. Joints are drawn, not lengths: the
linkage closes by construction, at any transmission angle down to a ten-thousandth of a radian.
"""

from __future__ import annotations

import cmath
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpc, mpf

from scenarios.common.instance import Instance, UnpackedFmu
from scenarios.speed_vs_error.hard_cases.measured import CONDITIONING, TINY, TIP, Measured, Probe, Worst, ask
from scenarios.speed_vs_error.yardstick import Oracle

EPSILON = sys.float_info.epsilon
LOOPS, ORACLE = 2000, 150  # how many geometries are drawn
LOOP_BOUND, POWER_BOUND, ORACLE_BOUND = 8.0, 2.0, 2.0


@dataclass(frozen=True)
class Case:
    """A linkage that closes, and what it does there."""

    geometry: dict[str, float]
    phi: float
    w: float
    a: float
    fx: float
    fy: float


def unit(angle: float) -> complex:
    return cmath.exp(1j * angle)


@st.composite
def cases(draw: st.DrawFn) -> Case:
    def number(low: float, high: float) -> float:
        return draw(st.floats(low, high))

    length, angle = st.floats(1e-2, 1.0), st.floats(-7.0, 7.0)
    g = {name: draw(length) for name in ("L3", "L5", "L6")} | dict.fromkeys(("L2", "L7"), 10.0)
    g |= {name: draw(st.just(0.0) | length) for name in ("L1", "L4", "L8", "L9")}
    g |= {name: number(-1.0, 1.0) for name in ("XC", "YC")} | {"XG": 0.0, "YG": 0.0}
    g |= {name: draw(angle) for name in ("phi1", "phi4", "theta3", "theta8", "theta9")}
    phi = draw(angle | st.floats(-1e4, 1e4))
    near = draw(st.sampled_from(("ABD", "EFG")))

    def corner(dyad: str) -> float:
        """Between the base of a dyad and a link, 0 to pi. One of the dyads may come near its dead point: where both
        do, the rounding of one length decides whether EFG closes.
        """
        straight = 10.0 ** number(-4.0 if dyad == near else -1.0, 0.2)
        return math.pi - straight if draw(st.booleans()) else straight

    A = g["L1"] * unit(g["phi1"] - phi)
    D = complex(g["XC"], g["YC"]) + g["L4"] * unit(g["phi4"] - phi)
    # C far from O, as linkage.h demands: else ABD turns with the cranks nearly as one body
    assume(abs(complex(g["XC"], g["YC"])) > 0.1 and abs(D - A) > 1e-3)
    # on the right of A to D: counter-clockwise from D to A
    g["L2"] = abs(D + g["L3"] * (A - D) / abs(A - D) * unit(corner("ABD")) - A)
    assume(g["L2"] > 1e-3)
    E = complex(Oracle(g | {"L6": 10.0}, 20).pose(phi).E)
    base = draw(length)
    G = E + base * unit(draw(angle))
    F = E + g["L6"] * (G - E) / base * unit(-corner("EFG"))
    g |= {"XG": G.real, "YG": G.imag, "L7": abs(F - G)}
    assume(g["L7"] > 1e-3)
    rate = st.floats(-100.0, 100.0)
    return Case(g, phi, draw(rate), draw(rate), draw(rate), draw(rate))


# ---- the loop equations --------------------------------------------------------------------------


def dot(a: mpc, b: mpc) -> mpf:
    return a.real * b.real + a.imag * b.imag


def loop_residual(instance: Instance, case: Case) -> float:
    """How far the outputs are from the loop equations and two derivatives of them, in roundings of the terms.

    The tip and the nozzle's direction tell where E, F and B must be; then |GF| = L7, |DE| = L5, |AB| = L2, with B and
    F on their sides. Nothing of the code under test, and no other solution, is needed. inf: on the wrong side.
    """
    g = case.geometry
    instance.demand(instance.call("fmi2Reset"), "fmi2Reset")
    values = {f"geometry.{name}": value for name, value in g.items()}
    instance.initialize(values | {"crank.phi": case.phi, "crank.w": 1.0})
    x, y, vx, vy, ax, ay, alpha = instance.get(*TIP, "tip.angle")
    turn, turn_rate = instance.get_derivatives(("tip.angle", 1), ("tip.angle", 2))
    with mp.workdps(40):
        J = [mpc(x, y), mpc(vx, vy), mpc(ax, ay)]
        # a vector fixed to EF is z, iz turn, (i turn' - turn^2) z
        factors = [mpf(1), mpc(0, turn), mpc(-(mpf(turn) ** 2), turn_rate)]
        u = -mp.expj(mpf(alpha) - mpf(g["theta8"]) - mpf(g["theta9"]))
        to_tip = -(g["L8"] * mp.expj(g["theta8"]) + g["L9"] * mp.expj(mpf(g["theta8"]) + mpf(g["theta9"]))) * u
        E = [j - f * (g["L6"] / mpf(2) * u + to_tip) for j, f in zip(J, factors, strict=True)]
        F = [e + f * g["L6"] * u for e, f in zip(E, factors, strict=True)]
        crank = [mpf(1), mpc(0, -1), mpf(-1)]
        OA = g["L1"] * mp.expj(mpf(g["phi1"]) - case.phi)
        CD = g["L4"] * mp.expj(mpf(g["phi4"]) - case.phi)
        A = [f * OA for f in crank]
        D = [f * CD for f in crank]
        D[0] += mpc(g["XC"], g["YC"])
        scale = g["L3"] / mpf(g["L5"])
        B = [d + scale * mp.expj(g["theta3"]) * (e - d) for d, e in zip(D, E, strict=True)]
        G = [mpc(g["XG"], g["YG"]), mpf(0), mpf(0)]

        # what is rounded: the tip, and all that is turned with the angle of the nozzle or the crank
        reach = 5 * (g["L6"] + g["L8"] + g["L9"])
        size = [abs(j) + abs(f) * reach for j, f in zip(J, factors, strict=True)]
        cranks = abs(D[0]) + abs(OA) + 3 * (abs(OA) + abs(CD)) * (1 + abs(case.phi) / 16)
        worst = mpf(0)
        for start, end, length, lever in ((G, F, g["L7"], mpf(1)), (D, E, g["L5"], mpf(1)), (A, B, g["L2"], 1 + scale)):
            z = [b - a for a, b in zip(start, end, strict=True)]
            r = [lever * s + (cranks if start is not G else 0) for s in size]
            r[0] += abs(G[0]) + length
            residuals_and_terms = [
                (dot(z[0], z[0]) - mpf(length) ** 2, 2 * length * r[0]),
                (dot(z[0], z[1]), length * r[1] + r[0] * abs(z[1])),
                (dot(z[1], z[1]) + dot(z[0], z[2]), 2 * r[1] * abs(z[1]) + length * r[2] + r[0] * abs(z[2])),
            ]
            # a crank of length 0 stands still: nothing is rounded then
            worst = max(worst, *(abs(residual) / (terms + TINY) for residual, terms in residuals_and_terms))
        on_right = (dot(1j * (D[0] - A[0]), B[0] - A[0]) < 0) and (dot(1j * (G[0] - E[0]), F[0] - E[0]) < 0)
        return float(worst / EPSILON) if on_right else math.inf


# ---- power balance, and the oracle ---------------------------------------------------------------


def power_imbalance(probe: Probe, case: Case) -> float:
    """crank.tau w + F . v in roundings of its terms: what the massless linkage takes in, it gives out."""
    inputs = {"crank.w": case.w, "crank.a": case.a, "tip.fx": case.fx, "tip.fy": case.fy}
    vx, vy, tau = probe.place(case.geometry, case.phi, **inputs).get("tip.vx", "tip.vy", "crank.tau")
    with mp.workdps(40):
        power = [mpf(tau) * case.w, mpf(case.fx) * vx, mpf(case.fy) * vy]
        terms = abs(power[1]) + abs(power[2])
        # below the normal numbers, a product is rounded to a fixed place
        return float(abs(mp.fsum(power)) / (terms * EPSILON + TINY))


def oracle_ratio(probe: Probe, case: Case) -> float:
    """Error of position, velocity and acceleration against finite differences of 50 digits, over the conditioning."""
    (question,) = ask([(case.geometry, case.phi)])
    return max(question.ratios(probe.tip(case.geometry, case.phi)))


def survey(checks: Mapping[str, tuple[Callable[[Case], float], float]], count: int, strict: bool) -> dict[str, Worst]:
    """The worst of some checks, {name: (check, bound)}, over `count` geometries.

    strict: the first one beyond its bound is shrunk to a simple one and raised.
    """
    worst = {name: Worst() for name in checks}

    @settings(max_examples=count, derandomize=True, database=None, deadline=None, suppress_health_check=HealthCheck)
    @given(cases())
    def every(case: Case) -> None:
        for name, (check, bound) in checks.items():
            value = check(case)
            worst[name].see(value, str(case))
            assert value <= bound or not strict, f"{name}: {value:.3g}, allowed {bound:g}"

    every()
    return worst


def measure(fmu: UnpackedFmu, strict: bool = False) -> list[Measured]:
    """What random geometries come to; see survey."""
    loops, power = (
        "residual of the loop equations and two derivatives of them",
        "crank.tau w + F . v, random speeds and forces",
    )
    oracle = "error against finite differences of the 50-digit oracle"
    units = {loops: "roundings of their terms", power: "roundings of its terms", oracle: CONDITIONING}
    with Instance(fmu, "loops") as instance, Probe(fmu) as probe:
        checks = {
            LOOPS: {
                loops: (lambda case: loop_residual(instance, case), LOOP_BOUND),
                power: (lambda case: power_imbalance(probe, case), POWER_BOUND),
            },
            ORACLE: {oracle: (lambda case: oracle_ratio(probe, case), ORACLE_BOUND)},
        }
        return [
            Measured(f"{count} random geometries", name, units[name], worst.value, some[name][1], worst.where)
            for count, some in checks.items()
            for name, worst in survey(some, count, strict).items()
        ]
