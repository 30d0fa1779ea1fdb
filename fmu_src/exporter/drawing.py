"""The mechanism as a drawing, fmu_src/documentation/linkage.svg, computed by the twin.

Three panels of the same pose: the whole linkage with its lengths, the path of its tip and a scale; its cranks and
pivots, enlarged, with the angles there; its nozzle, enlarged. Coordinates are millimetres in the machine's frame
until a panel makes pixels of them, rounded to a tenth, so that the file is the same wherever it is written.
"""

from __future__ import annotations

import cmath
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from lxml import etree

from ..twin.linkage import Geometry, solve
from .compiler import SOURCE_ROOT

DRAWING = SOURCE_ROOT / "documentation" / "linkage.svg"
POSE = np.radians(105.0)  # crank angle of the drawing: no two joints lie over each other
HOLE_SURFACE = 103.2  # mm above the lowest point: where the published hole of 46.7 mm comes out
WIDTH, HEIGHT = 1010.0, 700.0  # of the drawing, pixels
STYLE = """
text { font: 16px sans-serif; fill: #222; text-anchor: middle; }
.title { font-size: 15px; fill: #555; text-anchor: start; }
.parameter { font: 15px monospace; fill: #7a1f5c; paint-order: stroke; stroke: #fff; stroke-width: 4px; }
.note { font-size: 14px; fill: #555; }
.paper { fill: #fff; }
.frame { fill: none; stroke: #bbb; stroke-width: 1; }
.path { fill: none; stroke: #c44e00; stroke-width: 2; }
.ridge { stroke: #7a5c3a; stroke-width: 1.5; stroke-dasharray: 8 5; }
.crank { stroke: #0b5394; stroke-width: 5; stroke-linecap: round; }
.link { stroke: #555; stroke-width: 4; stroke-linecap: round; }
.body { fill: #9db6cf; fill-opacity: 0.55; stroke: #555; stroke-width: 2.5; stroke-linejoin: round; }
.tool { fill: none; stroke: #333; stroke-width: 5; stroke-linejoin: round; stroke-linecap: round; }
.joint { fill: #fff; stroke: #222; stroke-width: 2; }
.pivot { fill: #222; }
.axis { fill: none; stroke: #888; stroke-width: 1; }
.initial { stroke: #0b5394; stroke-width: 1.5; stroke-dasharray: 4 4; }
.angle { fill: none; stroke: #7a1f5c; stroke-width: 1.5; }
.angle-head { fill: #7a1f5c; }
.turn { fill: none; stroke: #0b5394; stroke-width: 2.5; }
.turn-head { fill: #0b5394; }
.axis-head { fill: #888; }
@media (prefers-color-scheme: dark) {
  text { fill: #eee; } .title, .note { fill: #bbb; } .paper { fill: #1b1e22; } .frame { stroke: #555; }
  .parameter { fill: #f0a6d8; stroke: #1b1e22; } .angle { stroke: #f0a6d8; } .angle-head { fill: #f0a6d8; }
  .crank, .turn, .initial { stroke: #6fb1f0; } .turn-head { fill: #6fb1f0; } .path { stroke: #ff9a52; }
  .link, .tool { stroke: #ccc; } .body { fill: #3c5670; stroke: #ccc; } .ridge { stroke: #c79a6b; }
  .joint { fill: #1b1e22; stroke: #eee; } .pivot { fill: #eee; }
}
"""
Offset = tuple[float, float]  # pixels to the right and up, from the point that a text names to its middle

WHOLE_JOINTS: dict[str, Offset] = {
    "O": (-14, -12), "A": (14, 10), "B": (0, 20), "C": (16, 6), "D": (-2, -18), "E": (-2, 18), "F": (-14, -14),
    "G": (17, -6), "H": (14, -9), "I": (-14, 6), "J": (14, -10),
}  # fmt: skip
LENGTHS: dict[str, tuple[str, str, Offset]] = {  # the length's name, its ends, and the offset from their middle
    "L1": ("O", "A", (-4, 14)), "L2": ("A", "B", (32, 22)), "L3": ("B", "D", (0, 19)),
    "L4": ("C", "D", (12, -18)), "L5": ("D", "E", (-62, 38)), "L6": ("E", "F", (-15, 24)),
    "L7": ("F", "G", (-40, -7)), "L8": ("H", "I", (0, 12)), "L9": ("I", "J", (-18, 0)),
}  # fmt: skip
CRANK_JOINTS: dict[str, Offset] = {"O": (-13, -14), "A": (15, -9), "B": (-4, -20), "C": (13, 12), "D": (-4, 16),
                                   "G": (-14, -14)}  # fmt: skip
NOZZLE_JOINTS: dict[str, Offset] = {"E": (16, 8), "F": (-15, -2), "H": (17, 0), "I": (6, 18)}


@dataclass(frozen=True)
class Panel:
    """A window on the machine's plane. Points are complex, x + iy in mm; y goes up.

    left, top: its place in the drawing, pixels; width, height: its size, pixels; corner: the point of the plane at
    its upper left; scale: pixels per mm.
    """

    svg: etree._Element
    left: float
    top: float
    width: float
    height: float
    corner: complex
    scale: float

    def __post_init__(self) -> None:
        place = {"x": self.left, "y": self.top, "width": self.width, "height": self.height}
        window = etree.SubElement(self.svg, "svg", {name: _number(value) for name, value in place.items()})
        object.__setattr__(self, "svg", window)
        etree.SubElement(window, "rect", {"class": "frame", "width": "100%", "height": "100%"})

    def pixels(self, point: complex) -> tuple[str, str]:
        from_corner = (point - self.corner) * self.scale
        return _number(from_corner.real), _number(-from_corner.imag)

    def line(self, style: str, start: complex, end: complex) -> None:
        (x1, y1), (x2, y2) = self.pixels(start), self.pixels(end)
        etree.SubElement(self.svg, "line", {"class": style, "x1": x1, "y1": y1, "x2": x2, "y2": y2})

    def polyline(self, style: str, points: Iterable[complex], kind: str = "polyline") -> None:
        listed = " ".join(",".join(self.pixels(point)) for point in points)
        etree.SubElement(self.svg, kind, {"class": style, "points": listed})

    def circle(self, style: str, centre: complex, radius: float) -> None:
        """radius in pixels."""
        x, y = self.pixels(centre)
        etree.SubElement(self.svg, "circle", {"class": style, "cx": x, "cy": y, "r": _number(radius)})

    def text(self, at: complex, text: str, style: str | None = None, offset: Offset = (0, 0)) -> None:
        """Text with its middle at a point, off it by `offset` pixels."""
        x, y = self.pixels(at + complex(*offset) / self.scale)
        place = {"x": x, "y": y, "dominant-baseline": "central"}
        etree.SubElement(self.svg, "text", place | ({"class": style} if style else {})).text = text

    def head(self, style: str, tip: complex, direction: complex) -> None:
        """The head of an arrow, 10 pixels long."""
        back = -direction / abs(direction) * 10 / self.scale
        self.polyline(f"{style}-head", [tip, tip + back * (1 + 0.35j), tip + back * (1 - 0.35j)], kind="polygon")

    def arrow(self, style: str, start: complex, end: complex) -> None:
        self.line(style, start, end)
        self.head(style, end, end - start)

    def arc(self, style: str, centre: complex, radius: float, start: float, turn: float) -> None:
        """An arrow around a centre: radius in mm, from the direction `start` on by `turn` rad, counter-clockwise."""
        ends_at = start + turn
        shortened = turn - np.sign(turn) * 8 / self.scale / radius  # the line ends within its head
        angles = start + np.linspace(0, shortened, max(2, round(abs(np.degrees(turn)) / 4)))
        self.polyline(style, centre + radius * np.exp(1j * angles))
        tip = centre + radius * cmath.exp(1j * ends_at)
        self.head(
            style, tip, tip - (centre + radius * cmath.exp(1j * (ends_at - np.sign(turn) * 9 / self.scale / radius)))
        )


def mechanism_svg() -> bytes:
    """The nominal mechanism in one pose: lengths and path of the tip; angles and pivots; the nozzle."""
    geometry = Geometry()
    joints = {name: complex(at) * 1e3 for name, at in solve(geometry, POSE, order=0).joints.items()}
    path = solve(geometry, np.radians(np.arange(0, 360, 2.0)), order=0).tip[0] * 1e3
    svg = etree.Element(
        "svg",
        nsmap={None: "http://www.w3.org/2000/svg"},  # type: ignore[dict-item]  # the stubs know no default one
        role="img",
        viewBox=f"0 0 {_number(WIDTH)} {_number(HEIGHT)}",
        width=_number(WIDTH),
        height=_number(HEIGHT),
    )
    svg.append(etree.Comment(" Generated by `linkage-fmu generate` from fmu_src/twin/linkage.py. "))
    etree.SubElement(svg, "title").text = "Seven-bar planting linkage: lengths, angles, pivots and the path of its tip"
    etree.SubElement(svg, "style").text = STYLE
    etree.SubElement(svg, "rect", {"class": "paper", "width": "100%", "height": "100%"})
    _whole(Panel(svg, 4, 4, 542, 692, complex(-275, 92), 1.25), joints, path)
    _cranks(Panel(svg, 552, 4, 454, 468, complex(-46, 80), 2.0), joints, geometry)
    _nozzle(Panel(svg, 552, 478, 454, 218, complex(-290, 46), 1.75), joints, geometry)
    return etree.tostring(svg, pretty_print=True, xml_declaration=True, encoding="UTF-8")


def _whole(panel: Panel, joints: dict[str, complex], path: np.ndarray) -> None:
    left, right = panel.corner.real, panel.corner.real + panel.width / panel.scale
    surface = float(path.imag.min()) + HOLE_SURFACE
    panel.line("ridge", complex(left, surface), complex(right, surface))
    panel.text(complex(right - 60, surface), "ridge surface", "note", (0, 12))
    panel.polyline("path", path, kind="polygon")
    panel.text(complex(path.real[path.imag.argmin()], path.imag.min()), "path of the tip J", "note", (96, 4))
    panel.text(panel.corner, "lengths, in the pose of phi = 105 deg", "title", (8, -14))
    _mechanism(panel, joints)
    _names(panel, joints, WHOLE_JOINTS)
    for name, (start, end, offset) in LENGTHS.items():
        panel.text((joints[start] + joints[end]) / 2, name, "parameter", offset)

    panel.arc("turn", joints["O"], 66, np.radians(150), np.radians(-95))
    panel.text(66 * cmath.exp(1j * np.radians(102)), "working direction", "note", (20, 13))
    corner = complex(right - 125, -235)
    for direction, label, offset in ((70, "x, forward", (-18, -14)), (70j, "y, up", (0, 10))):
        panel.arrow("axis", corner, corner + direction)
        panel.text(corner + direction, label, "note", offset)
    panel.text(corner, "fixed to the machine, origin O", "note", (30, -34))

    scale = complex(right - 125, -425)
    panel.line("axis", scale, scale + 100)
    for tick in (scale, scale + 100):
        panel.line("axis", tick - 4j, tick + 4j)
    panel.text(scale + 50, "100 mm", "note", (0, 12))


def _cranks(panel: Panel, joints: dict[str, complex], geometry: Geometry) -> None:
    _coordinates(panel, joints)
    _mechanism(panel, joints)
    for pivot, radius, turn_radius, initial, name_at, offset, turn_offset in (
        ("O", 34, 60, geometry.phi1, geometry.phi1 / 2, (26, 6), (-8, -21)),
        ("C", 31, 24, geometry.phi4, np.radians(75), (4, 16), (-30, -18)),
    ):
        centre = joints[pivot]
        panel.line("initial", centre, centre + (turn_radius + 4) * cmath.exp(1j * initial))
        panel.arc("angle", centre, radius, 0.0, initial)
        panel.text(centre + radius * cmath.exp(1j * name_at), f"phi{'1' if pivot == 'O' else '4'}", "parameter", offset)
        panel.arc("turn", centre, turn_radius, initial, -float(POSE))
        panel.text(centre + turn_radius * cmath.exp(1j * (initial - POSE / 2)), "phi", "parameter", turn_offset)
    corner, arm = joints["D"], cmath.phase(joints["E"] - joints["D"])
    panel.arc("angle", corner, 72, arm, geometry.theta3)
    panel.text(corner + 72 * cmath.exp(1j * (arm + geometry.theta3 / 2)), "theta3", "parameter", (34, 0))
    _names(panel, joints, CRANK_JOINTS)
    panel.text(panel.corner, "cranks and pivots; dashed: the cranks at phi = 0", "title", (8, -14))


def _coordinates(panel: Panel, joints: dict[str, complex]) -> None:
    """Those of the pivots C and G, from O: below and on the right of all else."""
    panel.arrow("axis", joints["O"] - 20, 178 + 0j)
    panel.text(178 + 0j, "x", "note", (-4, 14))
    lowest = -149.0
    panel.line("axis", joints["O"], complex(0, lowest))
    for pivot, x, y in (("C", 153.0, lowest), ("G", 170.0, -134.0)):
        at = joints[pivot]
        panel.line("axis", at, complex(x, at.imag))
        panel.arrow("axis", complex(x - 3, 0), complex(x - 3, at.imag))
        panel.text(complex(x - 3, -22 if pivot == "C" else at.imag / 2), f"Y{pivot}", "parameter")
        panel.line("axis", at, complex(at.real, y))
        panel.arrow("axis", complex(0, y + 3), complex(at.real, y + 3))
        panel.text(complex(at.real / 2, y + 3), f"X{pivot}", "parameter")


def _nozzle(panel: Panel, joints: dict[str, complex], geometry: Geometry) -> None:
    _mechanism(panel, joints)
    link = cmath.phase(joints["E"] - joints["H"])
    panel.arc("angle", joints["H"], 22, link, geometry.theta8)
    panel.text(joints["H"] + 22 * cmath.exp(1j * (link + geometry.theta8 / 2)), "theta8", "parameter", (-18, 16))
    onward = cmath.phase(joints["I"] - joints["H"])
    panel.line("axis", joints["I"], joints["I"] + 34 * cmath.exp(1j * onward))
    panel.arc("angle", joints["I"], 26, onward, geometry.theta9)
    panel.text(joints["I"] + 26 * cmath.exp(1j * (onward + geometry.theta9 / 2)), "theta9", "parameter", (-30, -8))
    _names(panel, joints, NOZZLE_JOINTS)
    panel.text(panel.corner, "nozzle: H is the middle of EF", "title", (8, -14))


def _mechanism(panel: Panel, joints: dict[str, complex]) -> None:
    panel.polyline("body", [joints[name] for name in "BDE"], kind="polygon")
    for style, ends in (("crank", "OA"), ("crank", "CD"), ("link", "AB"), ("link", "FG"), ("link", "EF")):
        panel.line(style, *(joints[name] for name in ends))
    panel.polyline("tool", [joints[name] for name in "HIJ"])
    for name in "OCG":
        panel.circle("pivot", joints[name], 6)
    for name in "ABDEF":
        panel.circle("joint", joints[name], 4.5)


def _names(panel: Panel, joints: dict[str, complex], offsets: dict[str, Offset]) -> None:
    for name, offset in offsets.items():
        panel.text(joints[name], name, offset=offset)


def _number(value: float) -> str:
    return f"{round(float(value), 1) + 0.0:.1f}"
