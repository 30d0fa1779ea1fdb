"""Conveyor: a ring of cups drops one seedling a turn of the crank into the nozzle, or beside it.

    ring     one cup further a turn of the crank: angle = crank.phi / count of cups
    drop     a flap below the ring opens whenever the crank passes flap.phi, the nozzle then being at its top
    fall     y(t) = flap.y − g·t²/2, x = flap.x + scatter    free fall [1]; the air's drag on a plug is neglected
    mouth    I = J − l·e(tip.angle), the upper end of the nozzle IJ
    catch    where the seedling comes down to the mouth's height, |x − I_x| <= mouth.radius − plug.radius, else a miss

Frame of the machine, x forward and y up from the linkage's O; that the machine gains or loses
speed during the fall (about 0.13 s) is neglected: 3 mm at 0.3 m/s2. Whether the operator left the cup empty,
and the scatter (normal), are drawn for each cup anew from the seed and its number.

Inputs are followed from sample to sample, linearly: what happens within a step is told after the next.

[1] Standard acceleration of free fall g = 9.80665 m/s2 (3rd CGPM 1901).
"""

from __future__ import annotations

import math
import random
from typing import ClassVar

if __package__:
    from .planting_partner import Partner, Variable
else:  # inside the FMU
    from planting_partner import Partner, Variable

GRAVITY = 9.80665
FOLLOWED = ("crank.phi", "tip.x", "tip.y", "tip.angle")


class Conveyor(Partner):
    """The cups over the nozzle, which turn with the crank."""

    description = "Ring of cups: drops a seedling a turn, which the nozzle catches or misses"
    variables = (
        Variable("crank.phi", "input", 0.0, "rad", "Angle turned by the crank in the working direction, unbounded"),
        Variable("tip.x", "input", 0.0, "m", "Position of the nozzle tip relative to the machine, forward of O"),
        Variable("tip.y", "input", 0.0, "m", "Position of the nozzle tip relative to the machine, above O"),
        Variable("tip.angle", "input", -math.pi / 2, "rad", "Direction of the nozzle axis, from forward"),
        Variable("cup.angle", "output", 0.0, "rad", "Angle turned by the ring of cups, unbounded"),
        Variable("seedling.in_nozzle", "output", False, "", "True from the catch until the nozzle shuts again"),
        Variable("seedling.y", "output", 0.0, "m", "Height of the falling seedling; the flap's while none falls"),
        Variable("seedling.offset", "output", 0.0, "m", "Where the last came down, forward of the mouth's middle"),
        Variable("cups.opened", "output", 0, "", "Cups opened over the nozzle"),
        Variable("cups.empty", "output", 0, "", "Of these, left empty by the operator"),
        Variable("seedlings.caught", "output", 0, "", "Seedlings that fell into the nozzle"),
        Variable("seedlings.missed", "output", 0, "", "Seedlings that fell beside it"),
        Variable("cups.count", "parameter", 8, "", "Cups in the ring"),
        Variable("cups.empty_rate", "parameter", 0.04, "1", "Share of the cups that the operator leaves empty"),
        Variable("cups.seed", "parameter", 6, "", "Seed of chance"),
        Variable("flap.phi", "parameter", 0.0, "rad", "Crank angle at which the flap opens (nozzle highest: -2 deg)"),
        Variable("flap.x", "parameter", -0.150, "m", "Position of the flap, forward of O"),
        Variable("flap.y", "parameter", 0.130, "m", "Position of the flap, above O: 60 mm over the mouth at its top"),
        Variable("flap.scatter", "parameter", 0.008, "m", "Standard deviation of where a seedling leaves the flap"),
        Variable("mouth.radius", "parameter", 0.030, "m", "Inner radius of the nozzle's mouth"),
        Variable("plug.radius", "parameter", 0.0125, "m", "Radius of the seedling's plug"),
        Variable("nozzle.length", "parameter", 0.2, "m", "Length of the nozzle IJ: geometry.L9 of the linkage"),
        Variable("nozzle.shuts", "parameter", 4.2, "rad", "Crank angle at which the nozzle shuts, risen from the soil"),
        Variable("inputs.at_step_end", "parameter", False, "", "True where inputs set before a step are of its end"),
    )
    positive = ("cups.count", "mouth.radius", "plug.radius", "nozzle.length")
    initially: ClassVar = {"cup.angle": ("crank.phi", "cups.count"), "seedling.y": ("flap.y",)}

    def exit_initialization_mode(self) -> None:
        super().exit_initialization_mode()
        self.memory |= {"sample": [self.value[name] for name in FOLLOWED], "fall": None}
        self.memory.setdefault("time", 0.0)
        p = self.value
        p |= {"cup.angle": p["crank.phi"] / p["cups.count"], "seedling.y": p["flap.y"]}

    def do_step(self, current_time: float, step_size: float) -> bool:
        p, m = self.value, self.memory
        time = current_time + step_size * p["inputs.at_step_end"]
        begin, was, now = m["time"], m["sample"], [p[name] for name in FOLLOWED]
        if time > begin:
            self._follow(begin, time, was, now)
            m |= {"time": time, "sample": now, "w": (now[0] - was[0]) / (time - begin)}
        ahead = current_time + step_size - m["time"]
        p["cup.angle"] = (m["sample"][0] + m.get("w", 0.0) * ahead) / p["cups.count"]
        fall = m["fall"]
        p["seedling.y"] = p["flap.y"] - (GRAVITY / 2 * (m["time"] + ahead - fall["since"]) ** 2 if fall else 0.0)
        return True

    def _follow(self, begin: float, end: float, was: list[float], now: list[float]) -> None:
        """What happens between two samples, in its order: the nozzle shuts, the flap opens, the seedling comes down."""
        p, m = self.value, self.memory
        if _passed(p["nozzle.shuts"], was[0], now[0]) is not None:
            p["seedling.in_nozzle"] = False
        opened = _passed(p["flap.phi"], was[0], now[0])
        if opened is not None:
            if m["fall"]:  # still above the nozzle when the next comes
                p["seedlings.missed"] += 1
            m["fall"] = self._open(begin + opened * (end - begin))
        if m["fall"]:
            self._come_down(begin, end, was, now)

    def _open(self, time: float) -> dict | None:
        """The next cup is opened: its seedling's fall, None where it was left empty."""
        p = self.value
        p["cups.opened"] += 1
        chance = random.Random(f"{p['cups.seed']}:{p['cups.opened']}")
        if chance.random() < p["cups.empty_rate"]:
            p["cups.empty"] += 1
            return None
        return {"since": time, "x": p["flap.x"] + chance.gauss(0.0, p["flap.scatter"])}

    def _come_down(self, begin: float, end: float, was: list[float], now: list[float]) -> None:
        p, fall = self.value, self.memory["fall"]

        def from_mouth(time: float) -> tuple[float, float]:
            """The seedling's position, from the middle of the mouth."""
            share = (time - begin) / (end - begin)
            _, x, y, angle = (a + share * (b - a) for a, b in zip(was, now, strict=True))
            length = p["nozzle.length"]
            return (
                fall["x"] - (x - length * math.cos(angle)),
                p["flap.y"] - GRAVITY / 2 * (time - fall["since"]) ** 2 - (y - length * math.sin(angle)),
            )

        if from_mouth(end)[1] > 0:
            return
        above, below = max(begin, fall["since"]), end
        for _ in range(40):
            middle = (above + below) / 2
            above, below = (middle, below) if from_mouth(middle)[1] > 0 else (above, middle)
        p["seedling.offset"] = from_mouth(below)[0]
        caught = abs(p["seedling.offset"]) <= p["mouth.radius"] - p["plug.radius"]
        p["seedlings.caught" if caught else "seedlings.missed"] += 1
        p["seedling.in_nozzle"] = p["seedling.in_nozzle"] or caught
        self.memory["fall"] = None


def _passed(angle: float, was: float, now: float) -> float | None:
    """Where between two crank angles the crank turned past ``angle``, as a share; None where it did not."""
    turns = math.floor((now - angle) / math.tau)
    reached = angle + turns * math.tau
    return (reached - was) / (now - was) if was < reached <= now else None
