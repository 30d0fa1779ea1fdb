"""Soil: a wavy ridge that resists the nozzle's tip, and what the tip leaves in it.

At the depth z below the ridge, with the nozzle's axis I to J for direction a, the tip's velocity
over ground v and its components v_a along a, v_n across:

    end     A·(k_c/b + k_phi)·zⁿ                            pressure and sinkage [1]; only where v_a > 0
    skin    U·(c_a·z + tan(delta)·K0·gamma·z²/2)            adhesion and friction of the wall [2], K0 = 1 − sin(phi) [3]
    side    b_side·(K_p·gamma·z²/2 + 2·c·√K_p·z)            passive pressure, K_p = tan²(45° + phi/2) [4]
    force   F = −[(end⁺ + skin)·v_a·a + side·v_n·n] / √(v² + v_0²)

so that F·v <= 0 at all times, and F = 0 above the ridge. Soil moves and is at rest as fast as
the tip: nothing depends on the rate but for the small speed v_0, below which the resistance
fades. All of the force acts on the tip. On the way out the skin alone resists along the axis.

The tip opens at the lowest point of its path; there the seedling stands, and leans as the nozzle
does. Events are sought on the cubic through the samples of position and velocity (Hermite).

[1] Bekker 1969, Introduction to Terrain-Vehicle Systems; values of the loosest
    soil in Wong 2008, Theory of Ground Vehicles, table 2.3 (dry sand): 0.13 MPa at 100 mm, as in a tilled ridge.
[2] Coulomb's law with adhesion: Gill and Vanden Berg 1968, Soil Dynamics in Tillage and Traction, chapter 2.
[3] Jaky 1944.   [4] Rankine 1857; Terzaghi 1943, Theoretical Soil Mechanics.
"""

from __future__ import annotations

import math
from typing import ClassVar

if __package__:
    from .planting_partner import Partner, Variable
else:  # inside the FMU
    from planting_partner import Partner, Variable

FOLLOWED = ("ground.x", "ground.y", "ground.vx", "ground.vy", "tip.angle")
RIDGE = ("ridge.height", "ridge.wave", "ridge.wavelength")
FORCE = (  # what the force on the tip depends on
    *FOLLOWED, *RIDGE, "soil.k_c", "soil.k_phi", "soil.n", "soil.c", "soil.phi", "soil.gamma", "wall.c_a", "wall.delta",
    "tip.area", "tip.width", "nozzle.width", "nozzle.girth", "soil.v0",
)  # fmt: skip


class Soil(Partner):
    """The ridge that the nozzle enters."""

    description = "Wavy ridge: resists the nozzle's tip, records the hole and the plant"
    variables = (
        Variable("ground.x", "input", 0.0, "m", "Position of the nozzle tip over ground, forward"),
        Variable("ground.y", "input", 0.0, "m", "Position of the nozzle tip over ground, above the height of O"),
        Variable("ground.vx", "input", 0.0, "m/s", "Velocity of the tip over ground, forward"),
        Variable("ground.vy", "input", 0.0, "m/s", "Velocity of the tip over ground, upward"),
        Variable("ground.ax", "input", 0.0, "m/s2", "Acceleration of the tip, forward; optional"),
        Variable("ground.ay", "input", 0.0, "m/s2", "Acceleration of the tip, upward; optional"),
        Variable("tip.angle", "input", -math.pi / 2, "rad", "Direction of the nozzle axis, from forward"),
        Variable("seedling.in_nozzle", "input", False, "", "Whether a seedling waits in the nozzle"),
        Variable("tip.fx", "output", 0.0, "N", "Force of the soil on the tip, forward"),
        Variable("tip.fy", "output", 0.0, "N", "Force of the soil on the tip, upward"),
        Variable("tip.depth", "output", 0.0, "m", "Depth of the tip below the ridge, negative above"),
        Variable("energy.soil", "output", 0.0, "J", "Work that the soil has taken since the start"),
        Variable("hole.count", "output", 0, "", "Holes dug; the other figures of hole and plant are of the last"),
        Variable("hole.entry", "output", 0.0, "m", "Where the tip entered the ridge"),
        Variable("hole.exit", "output", 0.0, "m", "Where the tip left it"),
        Variable("hole.length", "output", 0.0, "m", "From entry to exit along the ridge"),
        Variable("hole.depth", "output", 0.0, "m", "Depth of the path's lowest point below the ridge"),
        Variable("hole.speed", "output", 0.0, "m/s", "Speed of the tip over ground at the lowest point"),
        Variable("plant.count", "output", 0, "", "Seedlings planted"),
        Variable("plant.in_hole", "output", False, "", "Whether a seedling stands in the last hole"),
        Variable("plant.x", "output", 0.0, "m", "Where it stands, or would: the tip at its lowest point"),
        Variable("plant.lean", "output", 0.0, "rad", "Its lean out of the vertical, forward: that of the nozzle"),
        Variable("ridge.height", "parameter", -0.3347, "m", "Mean height of the ridge, from the height of O"),
        Variable("ridge.wave", "parameter", 0.005, "m", "Amplitude of the ridge's waves"),
        Variable("ridge.wavelength", "parameter", 1.7, "m", "Length of the ridge's waves"),
        Variable("soil.k_c", "parameter", 0.99e3, "N/m(n+1)", "Cohesive modulus of deformation, k_c [1]"),
        Variable("soil.k_phi", "parameter", 1528.43e3, "N/m(n+2)", "Frictional modulus of deformation, k_phi [1]"),
        Variable("soil.n", "parameter", 1.1, "1", "Exponent of sinkage, n [1]"),
        Variable("soil.c", "parameter", 1040.0, "Pa", "Cohesion, c [1]"),
        Variable("soil.phi", "parameter", math.radians(28), "rad", "Angle of internal friction, phi [1]"),
        Variable("soil.gamma", "parameter", 13000.0, "N/m3", "Weight of a volume of tilled soil, gamma"),
        Variable("wall.c_a", "parameter", 500.0, "Pa", "Adhesion of soil to steel, c_a"),
        Variable("wall.delta", "parameter", math.radians(20), "rad", "Angle of friction of soil on steel, delta"),
        Variable("tip.area", "parameter", 6e-4, "m2", "Area of the shut tip's end, A: 40 mm by 15 mm"),
        Variable("tip.width", "parameter", 0.015, "m", "Its smaller side, b"),
        Variable("nozzle.width", "parameter", 0.04, "m", "Width of the nozzle across the direction of travel, b_side"),
        Variable("nozzle.girth", "parameter", 0.14, "m", "Girth of the nozzle, U"),
        Variable("soil.v0", "parameter", 0.05, "m/s", "Speed below which the resistance fades, v_0"),
        Variable("inputs.at_step_end", "parameter", False, "", "True where inputs set before a step are of its end"),
    )
    positive = ("ridge.wavelength", "soil.n", "tip.width", "soil.v0")
    initially: ClassVar = {"tip.fx": FORCE, "tip.fy": FORCE, "tip.depth": ("ground.x", "ground.y", *RIDGE)}

    def exit_initialization_mode(self) -> None:
        super().exit_initialization_mode()
        self.memory.setdefault("time", 0.0)
        self.memory |= {"sample": self._sample(), "turning": 0.0, "work": 0.0, "hole": None}
        self._show(self.memory["sample"])

    def _sample(self) -> list[float]:
        return [self.value[name] for name in FOLLOWED]

    def ridge(self, x: float) -> float:
        """Height of the ridge at a place over ground."""
        p = self.value
        return p["ridge.height"] + p["ridge.wave"] * math.sin(math.tau * x / p["ridge.wavelength"])

    def below_ridge(self, sample: list[float]) -> float:
        """Of a sample's tip below the ridge, negative above."""
        return self.ridge(sample[0]) - sample[1]

    def force(self, x: float, y: float, vx: float, vy: float, angle: float) -> tuple[float, float]:
        """Force of the soil on the tip, N."""
        p, z = self.value, self.ridge(x) - y
        if z <= 0:
            return 0.0, 0.0
        end = p["tip.area"] * (p["soil.k_c"] / p["tip.width"] + p["soil.k_phi"]) * z ** p["soil.n"]
        at_rest, passive = 1 - math.sin(p["soil.phi"]), math.tan(math.pi / 4 + p["soil.phi"] / 2) ** 2
        weight = p["soil.gamma"] * z * z / 2
        skin = p["nozzle.girth"] * (p["wall.c_a"] * z + math.tan(p["wall.delta"]) * at_rest * weight)
        side = p["nozzle.width"] * (passive * weight + 2 * p["soil.c"] * math.sqrt(passive) * z)
        ax, ay = math.cos(angle), math.sin(angle)
        along, across = vx * ax + vy * ay, vy * ax - vx * ay
        speed = math.sqrt(vx * vx + vy * vy + p["soil.v0"] ** 2)
        fa, fn = -(skin + (end if along > 0 else 0.0)) * along / speed, -side * across / speed
        return fa * ax - fn * ay, fa * ay + fn * ax

    def do_step(self, current_time: float, step_size: float) -> bool:
        p, m = self.value, self.memory
        time, now = current_time + step_size * p["inputs.at_step_end"], self._sample()
        if time > m["time"]:
            length, was = time - m["time"], m["sample"]
            self._record(was, now, length)
            m |= {
                "time": time,
                "sample": now,
                "turning": (now[4] - was[4]) / length,
                "work": m["work"] + self._work(was, now, length),
            }
        self._show(now, current_time + step_size - time)
        return True

    def _show(self, sample: list[float], ahead: float = 0.0) -> None:
        """The outputs ``ahead`` of a sample, to where the tip is carried by its acceleration."""
        p, m, (x, y, vx, vy, angle) = self.value, self.memory, sample
        ax, ay = p["ground.ax"], p["ground.ay"]
        carried = [
            x + ahead * (vx + ahead * ax / 2),
            y + ahead * (vy + ahead * ay / 2),
            vx + ahead * ax,
            vy + ahead * ay,
            angle + ahead * m["turning"],
        ]
        p["tip.fx"], p["tip.fy"] = self.force(*carried)
        p["tip.depth"] = self.below_ridge(carried)
        p["energy.soil"] = m["work"] + self._work(sample, carried, ahead)

    def _work(self, was: list[float], now: list[float], length: float) -> float:
        """What the soil takes between two samples ``length`` seconds apart: Simpson's rule."""

        def power(sample: list[float]) -> float:
            fx, fy = self.force(*sample)
            return -(fx * sample[2] + fy * sample[3])

        if length <= 0 or (self.below_ridge(was) <= 0 and self.below_ridge(now) <= 0):
            return 0.0
        return length / 6 * (power(was) + 4 * power(_between(was, now, length, 0.5)) + power(now))

    def _record(self, was: list[float], now: list[float], length: float) -> None:
        """Entry, lowest point and exit, where they lie between two samples."""
        p, m, before, after = self.value, self.memory, self.below_ridge(was), self.below_ridge(now)
        if before <= 0 and after <= 0 and not m["hole"]:
            return

        def found(value) -> list[float]:
            """Where ``value`` of the sample turns positive."""
            low, high = 0.0, 1.0
            for _ in range(45):
                middle = (low + high) / 2
                low, high = (low, middle) if value(_between(was, now, length, middle)) > 0 else (middle, high)
            return _between(was, now, length, high)

        if before <= 0 < after:
            m["hole"] = {"entry": found(self.below_ridge)[0]}
        if m["hole"] and was[3] < 0 <= now[3]:
            lowest = found(lambda sample: sample[3])
            m["hole"] |= {
                "depth": self.below_ridge(lowest),
                "speed": math.hypot(lowest[2], lowest[3]),
                "plant.x": lowest[0],
                "lean": -math.pi / 2 - lowest[4],
                "planted": p["seedling.in_nozzle"],
            }
        if after <= 0 < before and m["hole"] and "depth" in m["hole"]:
            hole, away = m["hole"], found(lambda sample: -self.below_ridge(sample))[0]
            p |= {
                "hole.count": p["hole.count"] + 1,
                "hole.entry": hole["entry"],
                "hole.exit": away,
                "hole.length": away - hole["entry"],
                "hole.depth": hole["depth"],
                "hole.speed": hole["speed"],
                "plant.count": p["plant.count"] + hole["planted"],
                "plant.in_hole": hole["planted"],
                "plant.x": hole["plant.x"],
                "plant.lean": hole["lean"],
            }
            m["hole"] = None


def _between(was: list[float], now: list[float], length: float, share: float) -> list[float]:
    """A sample between two: the cubic through positions and velocities, the angle linearly."""
    u, rest = share, 1 - share
    place, speed = [], []
    for i in (0, 1):
        a, b, da, db = was[i], now[i], was[i + 2] * length, now[i + 2] * length
        place.append(rest * rest * ((1 + 2 * u) * a + u * da) + u * u * ((3 - 2 * u) * b - rest * db))
        speed.append((6 * u * rest * (b - a) + rest * (1 - 3 * u) * da + u * (3 * u - 2) * db) / length)
    return [*place, *speed, was[4] + u * (now[4] - was[4])]
