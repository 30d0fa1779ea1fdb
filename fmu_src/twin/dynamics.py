"""What moves has mass: inertia, torque and forces of the linkage, in complex numbers, to read and to edit.

Six bodies turn about a joint each: both cranks, link AB, the plate BDE, link EF with the nozzle, and rocker GF. A
body's centre of mass is at start + (x + iy) u, u being the unit vector of its link, so x counts along the link and y
to the left of it. By the crank angle:

    Jr = sum of m |c'|^2 + J theta'^2       reflected inertia, as the cranks feel it
    S  = sum of m c                         first moment of mass, relative to O

The torque follows from Lagrange's equation (interface.toml has it), the force on the machine from Newton's law for all
bodies together, the forces in the joints from Newton's and Euler's equations of each.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

try:
    from .linkage import Geometry, Solution
except ImportError:  # inside the FMU the files lie side by side
    from linkage import Geometry, Solution  # type: ignore[no-redef, import-not-found, unused-ignore]

BODIES = {"OA": "O", "CD": "C", "AB": "A", "DE": "D", "EF": "E", "GF": "G"}  # and the joint that each turns about


@dataclass(frozen=True)
class Body:
    """Mass in kg; its centre in m along the link and to the left of it; moment of inertia about the centre, kg m2."""

    m: float
    x: float
    y: float
    J: float


@dataclass(frozen=True)
class MovingBody:
    """A body in one pose; lists by order of the derivative by phi, 0 to 2; angle: of its link, from order 1 on."""

    body: Body
    start: list[Any]
    centre: list[Any]
    angle: list[Any]


def bodies_of(values: Mapping[str, float]) -> dict[str, Body]:
    """The bodies by name, from values such as {"body.OA.m": 0.35, ...}."""
    return {name: Body(*(values[f"body.{name}.{key}"] for key in "mxyJ")) for name in BODIES}


def move(geometry: Geometry, solution: Solution, bodies: Mapping[str, Body]) -> dict[str, MovingBody]:
    """The bodies in a pose that is solved to order 2."""
    g, points = geometry, solution.points
    orders = range(3)
    unit = {
        "OA": [np.exp(1j * (g.phi1 - solution.phi)) * (-1j) ** n for n in orders],
        "CD": [np.exp(1j * (g.phi4 - solution.phi)) * (-1j) ** n for n in orders],
        "AB": [(points["B"][n] - points["A"][n]) / g.L2 for n in orders],
        "DE": [np.exp(-1j * g.theta3) * (points["B"][n] - points["D"][n]) / g.L3 for n in orders],
        "EF": [(points["F"][n] - points["E"][n]) / g.L6 for n in orders],
        "GF": [(points["F"][n] - points["G"][n]) / g.L7 for n in orders],
    }
    moving = {}
    for name, joint in BODIES.items():
        body, u = bodies[name], unit[name]
        start = points[joint]
        centre = [start[n] + (body.x + 1j * body.y) * u[n] for n in orders]
        # u' = i theta' u,  u'' = (i theta'' - theta'^2) u
        angle = [np.imag(np.conj(u[0]) * u[n]) for n in (1, 2)]
        moving[name] = MovingBody(body, start, centre, angle)
    return moving


def inertia(moving: Mapping[str, MovingBody]) -> list[Any]:
    """Jr and its derivative by phi, kg m2."""
    parts = [(b.body, b.centre, b.angle) for b in moving.values()]
    return [
        sum(b.m * abs(c[1]) ** 2 + b.J * t[0] ** 2 for b, c, t in parts),
        sum(2 * (b.m * np.real(np.conj(c[1]) * c[2]) + b.J * t[0] * t[1]) for b, c, t in parts),
    ]


def moment(moving: Mapping[str, MovingBody]) -> list[Any]:
    """S and its derivatives by phi, complex, kg m."""
    return [sum(b.body.m * b.centre[n] for b in moving.values()) for n in range(3)]


def joint_forces(
    solution: Solution,
    moving: Mapping[str, MovingBody],
    w: float,
    a: float,
    frame: complex,
    tip_force: complex,
) -> tuple[dict[str, complex], float, float]:
    """The force in each joint, complex, N, and what each crank takes of the torque, in the working direction, N m.

    w, a: of the cranks; frame: acceleration of the machine plus i times gravity, m/s2; tip_force: of the soil. At O, C
    and G the machine acts on the linkage; at A crank OA on AB, at D crank CD on the plate; at B and E the plate on AB
    and EF, at F rocker GF on EF.
    """
    J = {name: float(np.real(b.body.J * (b.angle[1] * w**2 + b.angle[0] * a))) for name, b in moving.items()}
    force = {name: b.body.m * (frame + b.centre[2] * w**2 + b.centre[1] * a) for name, b in moving.items()}
    about = {name: J[name] + _cross(b.centre[0] - b.start[0], force[name]) for name, b in moving.items()}
    point = {name: jets[0] for name, jets in solution.points.items()}
    EF, GF = point["F"] - point["E"], point["F"] - point["G"]
    AB, DB = point["B"] - point["A"], point["B"] - point["D"]
    DE, EJ = point["E"] - point["D"], point["J"] - point["E"]
    # in each dyad the moments about its two ends leave the force in its joint alone
    F = _force_of_moments(EF, about["EF"] - _cross(EJ, tip_force), GF, -about["GF"])
    E = force["EF"] - F - tip_force
    B = _force_of_moments(AB, about["AB"], DB, -(about["DE"] + _cross(DE, E)))
    A, D = force["AB"] - B, force["DE"] + B + E
    forces = {"O": force["OA"] + A, "A": A, "B": B, "C": force["CD"] + D, "D": D, "E": E, "F": F, "G": force["GF"] + F}
    on_oa = -(about["OA"] + _cross(point["A"], A))
    on_cd = -(about["CD"] + _cross(point["D"] - point["C"], D))
    return forces, on_oa, on_cd


def _cross(a: complex, b: complex) -> float:
    """The product of two plane vectors that is positive where b is to the left of a."""
    return float(np.imag(np.conj(a) * b))


def _force_of_moments(u: complex, p: float, v: complex, q: float) -> complex:
    """The force R with u x R = p and v x R = q."""
    return (v * p - u * q) / _cross(u, v)
