"""Torque, inertia and forces of the moving masses to 50 digits: Lagrange's equation on the vector loops.

Each body is a point c of the plane and an angle theta, both functions of phi through the pose of oracle.py. The
kinetic energy over ground is the sum of m |c' w + v|^2 / 2 + J (theta' w)^2 / 2, the potential energy that of m g c_y;
Lagrange's equation for phi, with the machine's motion given, is the torque. The force on the machine is Newton's law
for all bodies together. Nothing here knows how the code under test arranges these sums.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from mpmath import mp, mpc, mpf

from fmu_src.oracle.oracle import Oracle, Pose

# Of each body: where its first joint is, and the unit vector of its link.
Place = Callable[[Pose, mpc], tuple[mpc, mpc]]
PLACES: dict[str, Place] = {
    "OA": lambda p, C: (mpc(0), p.A / abs(p.A)),
    "CD": lambda p, C: (C, (p.D - C) / abs(p.D - C)),
    "AB": lambda p, C: (p.A, mp.expj(p.phi2)),
    "DE": lambda p, C: (p.D, mp.expj(p.phi5)),
    "EF": lambda p, C: (p.E, mp.expj(p.phi6)),
    "GF": lambda p, C: (p.G, mp.expj(p.phi7)),
}


@dataclass(frozen=True)
class Dynamics:
    """Masses by name, `{"OA.m": 0.35, "OA.x": 0.025, ...}`, in the linkage of an oracle; gravity in m/s2."""

    oracle: Oracle
    masses: Mapping[str, float]
    gravity: float

    def bodies(self, phi: float) -> list[tuple[mpf, mpf, list[mpc], list[mpf]]]:
        """(m, J, [c, c', c''], [theta', theta'']) of each body."""
        g = self.oracle.geometry
        C, found = mpc(g["XC"], g["YC"]), []
        for name, place in PLACES.items():
            m, x, y, J = (mpf(self.masses[f"{name}.{key}"]) for key in "mxyJ")

            def angle(pose: Pose, place: Place = place) -> mpf:
                return mp.arg(place(pose, C)[1])

            theta = self.oracle.angle(angle, phi, 2)
            found.append((m, J, self.oracle.derivatives(partial(_centre, place, C, mpc(x, y)), phi, 2), theta[1:]))
        return found

    def outputs(
        self, phi: float, w: float, a: float, machine: tuple[float, float], force: tuple[float, float]
    ) -> dict[str, mpf]:
        """The outputs that masses are in, and the energies; machine: its speed and acceleration, m/s and m/s2."""
        w, a, v, machine_a, fx, fy = map(mpf, (w, a, *machine, *force))
        g, bodies = mpf(self.gravity), self.bodies(phi)
        inertia = sum(m * abs(c[1]) ** 2 + J * t[0] ** 2 for m, J, c, t in bodies)
        slope = sum(2 * m * mp.re(mp.conj(c[1]) * c[2]) + 2 * J * t[0] * t[1] for m, J, c, t in bodies)
        total = sum(m for m, _, _, _ in bodies)
        moment = [sum(m * c[n] for m, _, c, _ in bodies) for n in range(3)]
        tip = self.oracle.derivatives(lambda pose: pose.J, phi, 1)[1]
        bias = slope * w**2 / 2 + moment[1].real * machine_a + g * moment[1].imag - fx * tip.real - fy * tip.imag
        swing = moment[2] * w**2 + moment[1] * a
        return {
            "crank.tau": bias + inertia * a,
            "crank.inertia": inertia,
            "crank.tau_bias": bias,
            "machine.fx": fx - total * machine_a - swing.real,
            "machine.fy": fy - total * g - swing.imag,
            "linkage.kinetic": inertia * w**2 / 2 + w * v * moment[1].real + total * v**2 / 2,
            "linkage.potential": g * moment[0].imag,
        }


def _centre(place: Place, C: mpc, at: mpc, pose: Pose) -> mpc:
    start, along = place(pose, C)
    return start + at * along
