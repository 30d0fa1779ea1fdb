"""Drivetrain: a ground wheel turns the crank through an elastic shaft, one turn a plant.

    speed   v(t)    = v_cruise·[u(t/T) − u((t − t_headland)/T)]·[1 + share·sin(2π·f·t)]
            u(x)    = 6x⁵ − 15x⁴ + 10x³ on 0…1       the smoothest step of degree 5 [1]
    wheel   w_drive = 2π·v/S                         rolling without slip, one turn of the crank in S
    shaft   tau     = k·(phi_drive − phi) + c·(w_drive − w)          elastic and viscous [2, section 2]
    crank   (J + crank.inertia)·a = tau − crank.tau_bias             Newton and Euler [2, section 2]
    power   pull·v  = tau·w_drive − machine.fx·v     the tractor pays for the wheel and for the linkage's drag

crank.inertia is what the masses of the linkage weigh on the crank, crank.tau_bias what else it takes. With both the
drive solves for the acceleration of all that turns; the linkage's whole torque would contain the acceleration of the
last step, and what a drive makes of that diverges where its own inertia is small.

In a step the inputs go on as the straight line through their last two samples: of order 2
in the step where their samples belong to its begin; or they are held, where inputs.held says so. The
equations are solved by Runge and Kutta's method of order 4 in substeps of at most 0.5 ms.

[1] Flash and Hogan 1985, J. Neuroscience 5(7): minimum-jerk motion.
[2] Rao, Mechanical Vibrations: torsional systems. k = G·π·d⁴/(32·l): a steel shaft of 20 mm by 0.6 m.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar

if __package__:
    from .planting_partner import Partner, Variable
else:  # inside the FMU
    from planting_partner import Partner, Variable

SUBSTEP = 0.5e-3  # s, at most
LOADS = ("crank.inertia", "crank.tau_bias", "machine.fx")
Rates = Callable[[float, float, float, float], tuple[float, ...]]
LEVEL = (0.0, 0.0, 0.0)  # slopes of the loads that do not change
SPEED = ("speed.cruise", "speed.ramp", "speed.headland", "disturbance.share", "disturbance.f")  # what v(t) is made of


class Drivetrain(Partner):
    """From the ground wheel to the crank, which the linkage's torque loads."""

    description = "Ground-wheel drive with an elastic shaft: machine speed and crank angle, loaded by the linkage"
    variables = (
        Variable("crank.inertia", "input", 0.0, "kg.m2", "Inertia of the linkage about the crank; optional"),
        Variable("crank.tau_bias", "input", 0.0, "N.m", "Torque that the linkage takes besides crank.inertia·crank.a"),
        Variable("machine.fx", "input", 0.0, "N", "Force of the linkage on the machine, forward; optional: the pull's"),
        Variable("crank.phi", "output", 0.0, "rad", "Angle turned by the crank in the working direction, unbounded"),
        Variable("crank.w", "output", 0.0, "rad/s", "Angular velocity of the crank"),
        Variable("crank.a", "output", 0.0, "rad/s2", "Angular acceleration of the crank"),
        Variable("machine.v", "output", 0.0, "m/s", "Forward speed of the machine over ground"),
        Variable("machine.s", "output", 0.0, "m", "Way of the machine since the start"),
        Variable("machine.pull", "output", 0.0, "N", "Pull of the tractor on this row: ground wheel and linkage"),
        Variable("shaft.tau", "output", 0.0, "N.m", "Torque in the shaft"),
        Variable("energy.tractor", "output", 0.0, "J", "Work of the pull since the start"),
        Variable("energy.crank", "output", 0.0, "J", "Work done on the linkage through the crank"),
        Variable("energy.shaft", "output", 0.0, "J", "Heat of the shaft's damping"),
        Variable("energy.stored", "output", 0.0, "J", "In the twisted shaft and the turning crank"),
        Variable("plant.spacing", "tunable", 0.4, "m", "Way of the machine in one turn of the crank, S"),
        Variable("speed.cruise", "parameter", 0.4 * 65 / 60, "m/s", "Cruising speed: 65 plants a minute at 400 mm"),
        Variable("speed.ramp", "parameter", 1.5, "s", "Duration T of starting, and of stopping"),
        Variable("speed.headland", "parameter", 1e9, "s", "Time at which the machine begins to stop"),
        Variable("disturbance.share", "parameter", 0.05, "1", "Amplitude of the ground speed's swing, of the speed"),
        Variable("disturbance.f", "parameter", 0.7, "Hz", "Frequency of the ground speed's swing"),
        Variable("crank.start", "parameter", -math.pi / 2, "rad", "Crank angle at the start: the nozzle rising"),
        Variable("shaft.k", "parameter", 2000.0, "N.m/rad", "Torsional stiffness of the shaft"),
        Variable("shaft.c", "parameter", 4.0, "N.m.s/rad", "Damping of the shaft: a tenth of the critical"),
        Variable("crank.J", "parameter", 0.2, "kg.m2", "Inertia of the drive turning with the crank: 5 kg at 0.2 m"),
        Variable("inputs.held", "parameter", False, "", "True where inputs are held in a step, as in most FMUs"),
    )
    positive = ("plant.spacing", "speed.cruise", "speed.ramp", "shaft.k", "crank.J")
    initially: ClassVar = {
        "crank.phi": ("crank.start",),
        "machine.v": SPEED,
        "shaft.tau": (*SPEED, "plant.spacing", "shaft.c"),
        "crank.a": (*SPEED, "plant.spacing", "shaft.c", "crank.inertia", "crank.tau_bias", "crank.J"),
        "machine.pull": (*SPEED, "plant.spacing", "shaft.c", "machine.fx"),
    }

    _at: float | None = None  # the time of the last speed that was asked for, and that speed
    _v = 0.0

    def enter_initialization_mode(self) -> None:
        self._start()

    def exit_initialization_mode(self) -> None:
        super().exit_initialization_mode()
        self._start()  # with the parameters as they are now
        self.memory |= {"loads": None, "slopes": LEVEL}

    def _set_fmu_state(self, state: dict) -> None:
        super()._set_fmu_state(state)
        self._at = None  # the parameters may be others

    def _start(self) -> None:
        self._at = None
        phi = self.value["crank.start"]
        self.memory.setdefault("time", 0.0)
        self._show([phi, phi, 0.0, 0.0, 0.0, 0.0, 0.0])

    def speed(self, time: float) -> float:
        if self._at != time:  # each is asked for twice or more
            self._at, self._v = time, self._speed(time)
        return self._v

    def _speed(self, time: float) -> float:
        p = self.value
        share = _smooth_step(time / p["speed.ramp"]) - _smooth_step((time - p["speed.headland"]) / p["speed.ramp"])
        return p["speed.cruise"] * share * (1 + p["disturbance.share"] * math.sin(math.tau * p["disturbance.f"] * time))

    def _loads(self, time: float) -> tuple[float, float, float]:
        """crank.inertia, crank.tau_bias and machine.fx after the begin of the present step."""
        p, m = self.value, self.memory
        since, (inertia, bias, fx) = time - m["time"], m.get("slopes", LEVEL)
        return p["crank.inertia"] + inertia * since, p["crank.tau_bias"] + bias * since, p["machine.fx"] + fx * since

    def equations(self) -> Rates:
        """Of the present step, with its parameters and loads: rates(time, phi_drive, phi, w).

        They give the derivatives of phi_drive, phi, w, the way, and the work of pull, crank and shaft damping.
        """
        p, speed, loads = self.value, self.speed, self._loads
        k, c, own, spacing = p["shaft.k"], p["shaft.c"], p["crank.J"], p["plant.spacing"]

        def rates(time: float, drive: float, phi: float, w: float) -> tuple[float, ...]:
            v, (inertia, bias, fx) = speed(time), loads(time)
            w_drive = math.tau * v / spacing
            twisting = w_drive - w
            tau = k * (drive - phi) + c * twisting
            a = (tau - bias) / (own + inertia)
            return w_drive, w, a, v, tau * w_drive - fx * v, (inertia * a + bias) * w, c * twisting * twisting

        return rates

    def do_step(self, current_time: float, step_size: float) -> bool:
        m, loads = self.memory, tuple(self.value[name] for name in LOADS)
        if m["loads"] and current_time > m["sampled"] and not self.value["inputs.held"]:
            m["slopes"] = tuple(
                (now - was) / (current_time - m["sampled"]) for now, was in zip(loads, m["loads"], strict=True)
            )
        m |= {"time": current_time, "sampled": current_time, "loads": loads}
        count, y, rates = math.ceil(step_size / SUBSTEP - 1e-9), m["y"], self.equations()
        for i in range(count):
            y = _runge_kutta(rates, current_time + i * step_size / count, y, step_size / count)
        self._show(y, step_size)
        return True

    def _show(self, y: list[float], ahead: float = 0.0) -> None:
        """Keep the state, which is ``ahead`` of the step's begin, and give its outputs."""
        self.memory["y"] = y
        time = self.memory["time"] + ahead
        p, (drive, phi, w, way, pulled, given, lost) = self.value, y
        w_drive, _, a, v, *_ = self.equations()(time, drive, phi, w)
        tau = p["shaft.k"] * (drive - phi) + p["shaft.c"] * (w_drive - w)
        p |= {
            "crank.phi": phi,
            "crank.w": w,
            "crank.a": a,
            "machine.v": v,
            "machine.s": way,
            "shaft.tau": tau,
            "machine.pull": tau * math.tau / p["plant.spacing"] - self._loads(time)[2],
            "energy.tractor": pulled,
            "energy.crank": given,
            "energy.shaft": lost,
            "energy.stored": (p["shaft.k"] * (drive - phi) ** 2 + p["crank.J"] * w * w) / 2,
        }


def _smooth_step(x: float) -> float:
    return x * x * x * (10 + x * (6 * x - 15)) if 0 < x < 1 else float(x > 0)


def _runge_kutta(rates: Rates, time: float, y: list[float], h: float) -> list[float]:
    """One step of the classical method (Kutta 1901). The rates depend on the first three of y alone."""
    (drive, phi, w, *_), half = y, h / 2
    k1 = rates(time, drive, phi, w)
    k2 = rates(time + half, drive + half * k1[0], phi + half * k1[1], w + half * k1[2])
    k3 = rates(time + half, drive + half * k2[0], phi + half * k2[1], w + half * k2[2])
    k4 = rates(time + h, drive + h * k3[0], phi + h * k3[1], w + h * k3[2])
    return [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(y, k1, k2, k3, k4, strict=True)]
