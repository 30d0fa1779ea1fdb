"""Numbers read off trajectories: extremes, holes, crossings, shapes, rotations.

Curves are complex numbers x + iy in mm (x forward, y up), sampled at equal crank angles.
*Closed* curves (the static trajectory) come without their repeated last sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Extreme:
    """An extreme of a sampled signal: crank angle in degrees, value in the signal's unit."""

    phi_deg: float
    value: float
    is_maximum: bool


def extremes(phi_deg: np.ndarray, signal: np.ndarray) -> list[Extreme]:
    """All extremes of one turn of a periodic signal (both ends included, equal steps).

    A parabola through three samples places each between them.
    """
    y = signal[:-1]
    step = phi_deg[1] - phi_deg[0]
    before, after = np.roll(y, 1), np.roll(y, -1)
    found = []
    for k in np.flatnonzero((y - before) * (after - y) <= 0):
        curvature = before[k] - 2 * y[k] + after[k]
        # A flat pair is met twice: the sample before it is left to the one behind.
        if curvature == 0 or after[k] == y[k]:
            continue
        shift = 0.5 * (before[k] - after[k]) / curvature
        value = y[k] - 0.25 * (before[k] - after[k]) * shift
        found.append(Extreme(float((phi_deg[k] + shift * step) % 360), float(value), bool(curvature < 0)))
    return found


def highest(phi_deg: np.ndarray, signal: np.ndarray) -> Extreme:
    """The greatest maximum of a turn."""
    return max(extremes(phi_deg, signal), key=lambda e: e.value)


def lowest(phi_deg: np.ndarray, signal: np.ndarray) -> Extreme:
    """The smallest minimum of a turn."""
    return min(extremes(phi_deg, signal), key=lambda e: e.value)


def nearest(found: Sequence[Extreme], phi_deg: float) -> Extreme:
    """The extreme whose crank angle lies nearest, either way round."""
    return min(found, key=lambda e: abs(angle_between(e.phi_deg, phi_deg)))


def angle_between(a_deg: float, b_deg: float) -> float:
    """a - b, the short way round, in degrees."""
    return (a_deg - b_deg + 180) % 360 - 180


@dataclass(frozen=True)
class Hole:
    """Where the dynamic trajectory enters and leaves the ridge surface.

    ``entry`` and ``exit`` are points in mm. The hole's size is their distance along the
    surface, forward from entry to exit: negative where the tip leaves behind the place
    where it entered, so that its path has crossed itself below the surface.
    """

    entry: complex
    exit: complex

    @property
    def size(self) -> float:
        return self.exit.real - self.entry.real


def hole(dynamic: np.ndarray, surface_mm: float) -> Hole | None:
    """The hole (paper, section 4.1) that one turn digs at a ridge surface of this height.

    ``dynamic`` holds one turn, both ends included. The path repeats itself a plant spacing
    further on; followed both ways from its lowest point, it enters and leaves the surface
    where it first meets it. None where it does not reach down to the surface, or never leaves it.
    """
    spacing = dynamic[-1].real - dynamic[0].real
    turn = dynamic[:-1]
    return hole_around(
        np.concatenate([turn - spacing, turn, turn + spacing]), len(turn) + int(np.argmin(turn.imag)), surface_mm
    )


def hole_around(path: np.ndarray, bottom: int, surface_mm: float) -> Hole | None:
    """The hole that a path of any length digs about its sample ``bottom``; None as for `hole`."""
    above = path.imag >= surface_mm
    left, right = np.flatnonzero(above[:bottom]), np.flatnonzero(above[bottom:])
    if above[bottom] or not len(left) or not len(right):
        return None

    def meet(outside: complex, inside: complex) -> complex:
        return outside + (inside - outside) * (outside.imag - surface_mm) / (outside.imag - inside.imag)

    k, m = int(left[-1]), bottom + int(right[0])
    return Hole(complex(meet(path[k], path[k + 1])), complex(meet(path[m], path[m - 1])))


def surface_of_hole(dynamic: np.ndarray, size_mm: float, heights_mm: tuple[float, float]) -> float | None:
    """Height of the ridge surface above the lowest point at which the hole has this size.

    Searched between the two ``heights_mm``, by halving; None where the size is not reached there.
    """
    bottom = float(dynamic.imag.min())

    def excess(height: float) -> float:
        found = hole(dynamic, bottom + height)
        return found.size - size_mm if found else np.nan

    low, high = heights_mm
    if not excess(low) * excess(high) < 0:
        return None
    rising = excess(high) > 0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if (excess(middle) > 0) == rising:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def _cross(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return (np.conj(u) * v).imag


def area(closed: np.ndarray) -> float:
    """Enclosed area in mm2, positive where the curve runs counter-clockwise."""
    return 0.5 * float(np.sum(_cross(closed, np.roll(closed, -1))))


def crossings(closed: np.ndarray) -> list[tuple[int, int]]:
    """Where the curve crosses itself: pairs of indices of the crossing segments."""
    n = len(closed)
    a, b = closed, np.roll(closed, -1)
    side_start = _cross((b - a)[:, None], a[None] - a[:, None])
    side_end = _cross((b - a)[:, None], b[None] - a[:, None])
    parted = side_start * side_end < 0  # segment j has its ends on both sides of line i
    i, j = np.nonzero(np.triu(parted & parted.T, 2))
    return [(int(p), int(q)) for p, q in zip(i, j, strict=True) if (p, q) != (0, n - 1)]


def hull_area(points: np.ndarray) -> float:
    """Area in mm2 of the convex hull of points."""
    ordered = sorted((float(p.real), float(p.imag)) for p in points)

    def chain(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for p in points:
            while len(kept) > 1 and (
                (kept[-1][0] - kept[-2][0]) * (p[1] - kept[-2][1]) <= (kept[-1][1] - kept[-2][1]) * (p[0] - kept[-2][0])
            ):
                kept.pop()
            kept.append(p)
        return kept

    corners = chain(ordered)[:-1] + chain(ordered[::-1])[:-1]
    return abs(area(np.array([complex(*p) for p in corners])))


@dataclass(frozen=True)
class Shape:
    """The form of a closed curve.

    ``minor_lobe``   share of the smaller lobe in the area of a curve that crosses itself once
    ``solidity``     enclosed area / area of the convex hull: 1 for a convex curve
    ``slenderness``  width / length along the curve's principal axes
    ``hollows``      number of stretches that curve inwards
    """

    crossings: int
    minor_lobe: float
    solidity: float
    slenderness: float
    hollows: int

    @property
    def name(self) -> str | None:
        """The paper's name for such a shape (section 4.2), or None between its shapes.

        The paper names shapes without defining them. These limits are this project's reading,
        drawn with the curves in view: but for the figure 8, they describe rather than prove.
        """
        if self.crossings == 1 and self.minor_lobe >= 0.05:
            return "figure 8"
        if self.crossings:
            return None
        if self.slenderness < 0.25 and self.solidity >= 0.92:
            return "crescent"
        if self.hollows == 1 and self.solidity < 0.92 and self.slenderness >= 0.25:
            return "kidney"
        if self.hollows == 2 and 0.90 <= self.solidity < 0.965:
            return "dolphin"
        if self.hollows <= 1 and self.solidity >= 0.965 and self.slenderness >= 0.30:
            return "loaf"
        return None

    def __str__(self) -> str:
        crossed = (
            f"crosses itself, smaller lobe {self.minor_lobe:.0%} of the area"
            if self.crossings == 1
            else f"{self.crossings} crossings"
            if self.crossings
            else "uncrossed"
        )
        hollows = f"{self.hollows} hollow{'' if self.hollows == 1 else 's'}"
        return f"{crossed}, solidity {self.solidity:.2f}, width/length {self.slenderness:.2f}, {hollows}"


def shape(closed: np.ndarray) -> Shape:
    """Measure the form of a closed curve."""
    found = crossings(closed)
    total = area(closed)
    minor = 0.0
    if len(found) == 1:
        i, j = found[0]
        lobe = area(closed[i + 1 : j + 1])
        lobes = sorted([abs(lobe), abs(total - lobe)])
        minor = lobes[0] / sum(lobes)
    forward = np.roll(closed, -1) - closed
    inwards = _cross(np.roll(forward, 1), forward) * total < 0
    _, axes = np.linalg.eigh(np.cov(closed.real, closed.imag))
    extent = [float(np.ptp(closed.real * x + closed.imag * y)) for x, y in axes.T]
    return Shape(
        crossings=len(found),
        minor_lobe=minor,
        solidity=abs(total) / hull_area(closed),
        slenderness=extent[0] / extent[1],
        hollows=int(np.sum(inwards & ~np.roll(inwards, 1))),
    )


@dataclass(frozen=True)
class Rotation:
    """The rotation that best carries one closed curve onto another about their centroids.

    ``angle_deg`` is counter-clockwise; ``residual`` and ``before`` are the root mean square
    distances in mm between points of equal crank angle with and without the rotation;
    ``radius`` is the root mean square distance of the first curve from its centroid.
    """

    angle_deg: float
    residual: float
    before: float
    radius: float


def best_rotation(curve: np.ndarray, target: np.ndarray) -> Rotation:
    """Least-squares rotation of ``curve`` onto ``target``, sample by sample."""
    a, b = curve - curve.mean(), target - target.mean()
    turn = np.sum(np.conj(a) * b)
    turn /= abs(turn)

    def rms(z: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.abs(z) ** 2)))

    return Rotation(float(np.degrees(np.angle(turn))), rms(b - turn * a), rms(b - a), rms(a))


def distance(closed: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance in mm of each point from a closed curve, its segments taken as straight."""
    forward = np.roll(closed, -1) - closed
    relative = np.asarray(points)[:, None] - closed
    along = np.clip((np.conj(forward) * relative).real / np.abs(forward) ** 2, 0, 1)
    return np.abs(relative - along * forward).min(axis=1)


@dataclass(frozen=True)
class CommonPoint:
    """A point in mm, and the distance within which every curve of a family passes it."""

    point: complex
    distance: float


def common_points(curves: Sequence[np.ndarray], start: np.ndarray, apart_mm: float) -> tuple[CommonPoint, CommonPoint]:
    """The two points, at least ``apart_mm`` from each other, that all curves pass nearest.

    Sought among the points ``start`` of one of the curves, then moved off that curve by
    a shrinking pattern of steps while that brings the farthest curve nearer.
    """

    def farthest(points: np.ndarray) -> np.ndarray:
        return np.max([distance(curve, points) for curve in curves], axis=0)

    reach = farthest(start)
    first = int(np.argmin(reach))
    second = int(np.argmin(np.where(np.abs(start - start[first]) < apart_mm, np.inf, reach)))
    compass = np.exp(0.25j * np.pi * np.arange(8))
    found = []
    for k in (first, second):
        point, best, step = start[k], float(reach[k]), 1.0
        while step > 0.005:
            around = point + step * compass
            value = farthest(around)
            if value.min() < best:
                point, best = around[int(np.argmin(value))], float(value.min())
            else:
                step /= 2
        found.append(CommonPoint(complex(point), best))
    return found[0], found[1]


@dataclass(frozen=True)
class Wall:
    """A boundary of the hole and its best straight line.

    ``lean_deg`` is that line's angle from vertical, positive where its top lies forward;
    ``bulge`` how far the curve departs from it and ``spread`` the curve's extent in x, mm.
    """

    lean_deg: float
    bulge: float
    spread: float


def wall(points: np.ndarray) -> Wall:
    """Fit x as a straight function of y to a curve that rises all the way.

    Resampled at equal heights: the tip is slow, and its samples dense, at the bottom.
    """
    y = np.linspace(points[0].imag, points[-1].imag, 400)
    x = np.interp(y, points.imag, points.real)
    slope, offset = np.polyfit(y, x, 1)
    return Wall(float(np.degrees(np.arctan(slope))), float(np.abs(x - slope * y - offset).max()), float(np.ptp(x)))


def width_at(closed: np.ndarray, level_mm: float) -> float:
    """Distance between the outermost points of a closed curve at one height."""
    after = np.roll(closed, -1)
    k = np.flatnonzero((closed.imag > level_mm) != (after.imag > level_mm))
    share = (level_mm - closed[k].imag) / (after[k].imag - closed[k].imag)
    x = closed[k].real + share * (after[k].real - closed[k].real)
    return float(np.ptp(x)) if len(x) else 0.0
