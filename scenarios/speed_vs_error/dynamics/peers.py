"""Lagrange's equation for one degree of freedom by CasADi and numba, each as well used as we know how.

CasADi gets the closed form of every body's centre and direction, and differentiates it itself; numba gets
rates and bends of the dyads, written out. All have geometry, masses, speed and force as constants, which the core
reads as numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.speed_vs_error.dynamics.task import ACCELERATION, FORCE, GRAVITY, MASSES, ORDER, TORQUES
from scenarios.speed_vs_error.solving.in_c import Library
from scenarios.speed_vs_error.solving.peers import (
    _ARM,
    _CRANK_CD,
    _CRANK_OA,
    _NOZZLE,
    adopt_generated,
    closed_loops,
    dyad_in_numba,
    ways_of_numba,
)
from scenarios.speed_vs_error.solving.way import GEOMETRY, PEER, SPEED, Way

# Of each body: mass, centre over the vector of its link as a complex number, moment of inertia about the centre.
Body = tuple[float, complex, float]


def bodies() -> dict[str, Body]:
    """By name; the plate's centre over the vector from D to B, a crank's over the unit vector of -phi."""
    g = GEOMETRY
    over = {
        "OA": np.exp(-1j * g["phi1"]),
        "CD": np.exp(-1j * g["phi4"]),
        "AB": g["L2"],
        "DE": g["L3"] * np.exp(1j * g["theta3"]),
        "EF": g["L6"],
        "GF": g["L7"],
    }
    found = {}
    for name, vector in over.items():
        m, x, y, J = (MASSES[f"body.{name}.{key}"] for key in "mxyJ")
        found[name] = (m, complex(complex(x, y) / vector), J)
    return found


def builders(library: Library, folder: Path) -> dict[str, Callable[[], list[Way]]]:
    """By the name of each package, what builds its ways."""
    return {"CasADi": lambda: casadi_ways(library, folder), "numba": numba_ways}


# ---- by an algebra that differentiates -------------------------------------------------


def lagrange(phi, cos: Callable, sin: Callable, sqrt: Callable, slope: Callable) -> list:
    """Torque, inertia and bias; `slope` differentiates an expression by phi."""
    at = closed_loops(phi, cos, sin, sqrt)
    clockwise = (cos(phi), -sin(phi))
    c = {"C": (GEOMETRY["XC"], GEOMETRY["YC"]), "G": (GEOMETRY["XG"], GEOMETRY["YG"]), "O": (0.0, 0.0)}
    places = {
        "OA": (c["O"], clockwise, 1.0),
        "CD": (c["C"], clockwise, 1.0),
        "AB": (at["A"], at["AB"], GEOMETRY["L2"]),
        "DE": (at["D"], at["DB"], GEOMETRY["L3"]),
        "EF": (at["E"], at["EF"], GEOMETRY["L6"]),
        "GF": (c["G"], at["GF"], GEOMETRY["L7"]),
    }
    inertia: Any = 0.0
    weight: Any = 0.0  # of gravity, along phi
    for name, (m, z, J) in bodies().items():
        (x, y), (u, v), length = places[name]
        dx, dy = slope(x + z.real * u - z.imag * v), slope(y + z.real * v + z.imag * u)
        rate = (u * slope(v) - v * slope(u)) / length**2
        inertia += m * (dx * dx + dy * dy) + J * rate * rate
        weight += m * GRAVITY * dy
    tip = [slope(part) for part in at["tip"]]
    bias = slope(inertia) * (SPEED**2 / 2) + weight - FORCE[0] * tip[0] - FORCE[1] * tip[1]
    return [inertia * ACCELERATION + bias, inertia, bias]


def casadi_ways(library: Library, folder: Path) -> list[Way]:
    import casadi

    name = f"CasADi {casadi.__version__}"
    phi = casadi.SX.sym("phi")
    wanted = lagrange(phi, casadi.cos, casadi.sin, casadi.sqrt, lambda e: casadi.jacobian(e, phi))
    function = casadi.Function("dynamics", [phi], [casadi.cse(casadi.vertcat(*wanted))])

    def all_at_once(angles: np.ndarray, _order: int) -> np.ndarray:
        return function.map(len(angles))(angles[None, :]).full().T

    return [
        *(
            library.way(
                f"casadi_c_{which}",
                f"{name}, generated C{suffix}",
                PEER,
                f"derivatives by CasADi; {remark}",
                c_name=f"generated_dynamics_{which}",
                question=TORQUES,
            )
            for which, (suffix, remark) in enumerate(adopt_generated(library, folder, {ORDER: function}))
        ),
        Way("casadi_map", f"{name} in Python, mapped", PEER, all_at_once, remark="all angles in one call"),
    ]


# ---- numba -----------------------------------------------------------------------------


def numba_ways() -> list[Way]:
    import numba

    g, of = GEOMETRY, bodies()
    L2, L3, L6, L7, XC, YC, XG, YG = (g[name] for name in ("L2", "L3", "L6", "L7", "XC", "YC", "XG", "YG"))
    base_x, base_y, a_x, a_y, d_x, d_y, arm_x, arm_y, nozzle_x, nozzle_y = (
        float(part) for z in (_CRANK_CD - _CRANK_OA, _CRANK_OA, _CRANK_CD, _ARM, _NOZZLE) for part in (z.real, z.imag)
    )
    oa, cd, ab, de, ef, gf = ((m, z.real, z.imag, J) for m, z, J in of.values())
    cranks = sum(m * abs(z) ** 2 + J for m, z, J in (of["OA"], of["CD"]))
    swung_x, swung_y = (oa[0] * oa[k] + cd[0] * cd[k] for k in (1, 2))
    half, force_x, force_y, gravity, acceleration = SPEED**2 / 2, *FORCE, GRAVITY, ACCELERATION

    def build(_order: int, fastmath: bool) -> tuple[Callable, Callable]:
        compiled = numba.njit(inline="always", fastmath=fastmath)
        joint, first_rates, second_rates = dyad_in_numba(compiled)

        @compiled
        def body(of, dx, dy, ddx, ddy, x, y, rate, bend):  # noqa: PLR0917 - numba has no others
            """Inertia, half its slope and m c_y' of a link (x, y), its start's derivatives given."""
            m, z_x, z_y, J = of
            r_x, r_y = z_x * x - z_y * y, z_x * y + z_y * x
            cx, cy = dx - rate * r_y, dy + rate * r_x
            ccx, ccy = ddx - bend * r_y - rate * rate * r_x, ddy + bend * r_x - rate * rate * r_y
            return m * (cx * cx + cy * cy) + J * rate * rate, m * (cx * ccx + cy * ccy) + J * rate * bend, m * cy

        @compiled
        def solve(phi):
            c, s = math.cos(phi), -math.sin(phi)
            turning_x, turning_y = base_x * c - base_y * s, base_x * s + base_y * c
            A_x, A_y = a_x * c - a_y * s, a_x * s + a_y * c
            D_x, D_y = d_x * c - d_y * s, d_x * s + d_y * c  # from C
            p_x, p_y, q_x, q_y, inverse = joint(XC + turning_x, YC + turning_y, L2, L3)
            p_rate, q_rate = first_rates(p_x, p_y, q_x, q_y, inverse, turning_y, -turning_x)
            p_bend, q_bend = second_rates(p_x, p_y, q_x, q_y, inverse, -turning_x, -turning_y, p_rate, q_rate, L2, L3)
            e_x, e_y = arm_x * q_x - arm_y * q_y, arm_x * q_y + arm_y * q_x
            dE_x, dE_y = D_y - q_rate * e_y, -D_x + q_rate * e_x
            ddE_x = -D_x - q_bend * e_y - q_rate * q_rate * e_x
            ddE_y = -D_y + q_bend * e_x - q_rate * q_rate * e_y
            u_x, u_y, v_x, v_y, inverse_2 = joint(XG - XC - D_x - e_x, YG - YC - D_y - e_y, L6, L7)
            u_rate, v_rate = first_rates(u_x, u_y, v_x, v_y, inverse_2, -dE_x, -dE_y)
            u_bend, v_bend = second_rates(u_x, u_y, v_x, v_y, inverse_2, -ddE_x, -ddE_y, u_rate, v_rate, L6, L7)
            ab_0, ab_1, ab_y = body(ab, A_y, -A_x, -A_x, -A_y, p_x, p_y, p_rate, p_bend)
            de_0, de_1, de_y = body(de, D_y, -D_x, -D_x, -D_y, q_x, q_y, q_rate, q_bend)
            ef_0, ef_1, ef_y = body(ef, dE_x, dE_y, ddE_x, ddE_y, u_x, u_y, u_rate, u_bend)
            gf_0, gf_1, gf_y = body(gf, 0.0, 0.0, 0.0, 0.0, v_x, v_y, v_rate, v_bend)
            cranks_y = -(swung_x * c - swung_y * s)
            inertia = cranks + ab_0 + de_0 + ef_0 + gf_0
            n_x, n_y = nozzle_x * u_x - nozzle_y * u_y, nozzle_x * u_y + nozzle_y * u_x
            bias = (
                2.0 * half * (ab_1 + de_1 + ef_1 + gf_1)
                + gravity * (cranks_y + ab_y + de_y + ef_y + gf_y)
                - force_x * (dE_x - u_rate * n_y)
                - force_y * (dE_y + u_rate * n_x)
            )
            return inertia * acceleration + bias, inertia, bias

        @numba.njit(fastmath=fastmath)
        def answer(angles, out):
            for i in range(len(angles)):
                out[i, 0], out[i, 1], out[i, 2] = solve(angles[i])

        @numba.njit(fastmath=fastmath)
        def add_up(angles):
            total = 0.0
            for angle in angles:
                torque, inertia, bias = solve(angle)
                total += torque + inertia + bias
            return total

        return answer, add_up

    return ways_of_numba(
        build, "rates and bends of the dyads written out, a compiled loop over all angles", (ORDER,), TORQUES
    )
