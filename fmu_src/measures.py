"""What a planting cycle is judged by, each figure with its exact gradient: swept width, lean, heights, speeds, margin.

    from transplanter_linkage import Geometry, Kinematics
    from transplanter_linkage.measures import Operation, Turn

    turn = Turn(Kinematics(Geometry(L1=0.055)), Operation(spacing=0.38))
    turn["swept"].value, turn["swept"].gradient      # m; m per m, per rad, ... in the order of KNOWNS

A measure is a number that geometry and operation determine for a whole turn: a value at an event (the lowest point, the
way into the ridge), an extreme over the turn or over the stay in the ridge, or a mean. Events and extremes are not
samples: they are solved for between samples, to rounding, and their gradients follow from the implicit function
theorem and from the extreme's own condition. `Kinematics` computes in numpy; a source that drives an FMU does as well,
for a turn asks no more of it than `Source` says.

Frames and signs are those of the FMU: x forward, y up, the crank angle phi in the working direction; all in SI units
and rad. The ridge's surface lies `depth` above the tip's lowest point, whatever the design; the ground below a machine
that travels `spacing` a turn. A source that cannot make the turn raises its own error, a turn without what a measure
is about raises NoMeasure.

Where a measure has a kink, its gradient is that of one side: where two extremes over the turn are equal; where an
extreme changes from the end of the stay in the ridge to its inside; where the two dyads have the same least margin at
the same angle; where the tip just touches the seedling's line at the surface (`clearance` changes its side); where the
path is level as it crosses the surface, the lowest point or the highest one is not the only one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache, cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # of doubles, where nothing else is said

LENGTHS = ("L1", "L2", "L3", "L4", "L5", "L6", "L7", "L8", "L9", "XC", "YC", "XG", "YG")
GEOMETRY = (*LENGTHS, "phi1", "phi4", "theta3", "theta8", "theta9")
# The tip's place, its first and second derivative by phi, the nozzle's direction I to J, and assembly.margin.
SIGNALS = ("x", "y", "x1", "y1", "x2", "y2", "angle", "margin")
X, Y, X1, Y1, X2, Y2, ANGLE, MARGIN = range(len(SIGNALS))
NODES = 360  # of a turn, at which events and extremes are looked for
SOIL_NODES = 96  # of the stay in the ridge
WINDOWS, SOIL_WINDOWS = 18, 12  # into which an extreme is divided, see Part
CLOSE, FEW_STEPS, MOST_STEPS = 1e-9, 8, 60  # of the search for roots, in rad: the step that ends it; secants, halvings
TAIL = 1e-9  # of the spectrum's greatest coefficient, that its end may have where jerk is asked for


class NoMeasure(ValueError):
    """A turn lacks what the measure is about; the message says what."""


class Source(Protocol):
    """Who computes poses: `Kinematics`, or the FMU."""

    def sample(self, phi: Array) -> tuple[Array, Array]:
        """SIGNALS at each angle, a row each, and their derivatives by phi."""

    def gradient(self, phi: Array, weights: Array) -> Array:
        """A row each angle: the gradient by GEOMETRY, at that angle, of the SIGNALS times their weights, summed."""


class Driven(Source, Protocol):
    """A source that knows of masses, too: for the measures of torque."""

    def torque(self, phi: Array, w: float) -> tuple[Array, Array]:
        """What the drive gives at a steady speed w in rad/s, in N m, without soil, and its derivative by phi."""

    def torque_gradient(self, phi: Array, w: float) -> Array:
        """A row each angle: its gradient by GEOMETRY, MASSES and w."""


@dataclass(frozen=True)
class Operation:
    """How the linkage is used; SI units."""

    spacing: float = 0.4  # plant spacing S: what the machine travels in a turn, m
    w: float = 2 * math.pi * 65 / 60  # speed of the cranks, rad/s
    depth: float = 0.1032  # of the tip's lowest point below the ridge's surface, m
    body: float = 0.0  # width across its axis of the body that sweeps, m; 0: the axis itself
    seedling: float = 0.1  # height of the planted seedling above the surface, m


OPERATION = tuple(field.name for field in fields(Operation))
# Of the six moving bodies, as the FMU's parameters are called: mass, centre of mass, moment of inertia.
MASSES = tuple(f"body.{body}.{key}" for body in ("OA", "CD", "AB", "DE", "EF", "GF") for key in ("m", "x", "y", "J"))
KNOWNS = GEOMETRY + OPERATION + MASSES
SPACING, SPEED, DEPTH, BODY, SEEDLING = range(len(GEOMETRY), len(GEOMETRY) + len(OPERATION))


@dataclass(frozen=True)
class Measure:
    """What a name stands for. ``unit``: that people read it in, ``scale`` times the SI value."""

    text: str
    unit: str
    scale: float

    def shown(self, value: float) -> float:
        """A value in the unit that people read."""
        return value * self.scale


MM, DEG = ("mm", 1e3), ("deg", 180 / math.pi)
MEASURES = {
    "swept": Measure("width that the nozzle's axis, or its body, sweeps at the surface while the tip is below", *MM),
    "reach": Measure("extent of the tip's path over ground below the surface, along the row", *MM),
    "hole": Measure("from where the tip enters the surface to where it leaves it, forward", *MM),
    "lean": Measure("of the nozzle from straight down at the lowest point, positive with its tip forward", *DEG),
    "lean_change": Measure("by how much the lean changes while the tip is below the surface", *DEG),
    "ground_speed": Measure("of the tip over ground at its lowest point, forward", "mm/s", 1e3),
    "mean_ground_speed": Measure(
        "of the tip over ground while below the surface, forward, mean over time", "mm/s", 1e3
    ),
    "height": Measure("of the static trajectory, from its lowest to its highest point", *MM),
    "pickup_x": Measure("place of the tip at its highest, where it takes the seedling: forward of O", *MM),
    "pickup_y": Measure("place of the tip at its highest: above O", *MM),
    "pickup_angle": Measure("direction of the nozzle there, from straight down, positive with its tip forward", *DEG),
    "peak_speed": Measure("of the tip relative to the machine, greatest", "m/s", 1.0),
    "rms_speed": Measure("of the tip relative to the machine, root of its mean square", "m/s", 1.0),
    "peak_acceleration": Measure("of the tip, greatest", "m/s2", 1.0),
    "rms_acceleration": Measure("of the tip, root of its mean square", "m/s2", 1.0),
    "peak_jerk": Measure("of the tip, greatest", "m/s3", 1.0),
    "rms_jerk": Measure("of the tip, root of its mean square", "m/s3", 1.0),
    "margin": Measure("assembly.margin, least over the turn: 0 at a dead point", "1", 1.0),
    "clearance": Measure(
        "at which the tip, between surface and seedling's top, passes the place planted on its way out", *MM
    ),
    "peak_torque": Measure("that the drive gives for masses and weight at a steady speed, greatest size", "N.m", 1.0),
    "rms_torque": Measure("that the drive gives for masses and weight at a steady speed, root mean square", "N.m", 1.0),
}

TORQUE = ("peak_torque", "rms_torque")  # which a turn lacks without masses


class Event:
    """An angle at which something happens, in rad, and its gradient by KNOWNS."""

    def __init__(self, phi: float, gradient: Callable[[], Array]) -> None:
        self.phi, self._gradient = phi, gradient

    @cached_property
    def gradient(self) -> Array:
        return self._gradient()


class Part:
    """One term of a measure: a smooth value, or the greatest or least of several.

    An extreme over a range is the extreme of those over the windows into which the range is divided. Each of these,
    solved for between samples, changes smoothly with the design as long as it is one extreme: an optimiser that wants
    the measure below a limit keeps all ``values`` below it, and meets no kink where the extreme changes its place.
    """

    def __init__(self, sign: int, values: Array, phi: Array, gradients: Callable[[], Array]) -> None:
        self.sign = sign  # +1: the greatest of the values; -1: the least; 0: a smooth value
        self.values, self.phi = values, phi
        self._gradients = gradients

    @cached_property
    def gradients(self) -> Array:
        """Of each value by KNOWNS, a row each."""
        return self._gradients()

    @property
    def at(self) -> int:
        """Which of the values it is."""
        return int(np.argmax(self.values * (self.sign or 1)))


@dataclass(frozen=True)
class Found:
    """A measure of a turn: the sum of its parts, each with its factor."""

    parts: tuple[tuple[float, Part], ...]

    @property
    def value(self) -> float:
        """In SI units."""
        return math.fsum(factor * float(part.values[part.at]) for factor, part in self.parts)

    @property
    def gradient(self) -> Array:
        """By KNOWNS, SI units."""
        return np.asarray(sum(factor * part.gradients[part.at] for factor, part in self.parts))

    @property
    def phi(self) -> tuple[float, ...]:
        """The angles that it was read at, rad; NaN for a mean."""
        return tuple(float(part.phi[part.at]) for _, part in self.parts)


# How a quantity follows the signals: its derivatives by those it is made of, by their numbers, which ascend.
Weights = Mapping[int, Any]
# A quantity at given angles, from them and the signals there: its value, its weights of the signals, its derivative by
# phi where the signals stay, and what adds to its gradient by KNOWNS where signals and phi stay. The third argument is
# +1 where the greatest is sought and -1 where the least is: for what has two sides.
Quantity = Callable[[Array, Array, Any], tuple[Array, Weights, Any, Callable[[Array], None]]]


class Turn:
    """A whole turn of a source's linkage; ``turn[name]`` is a measure, computed when first asked for."""

    def __init__(self, source: Source, operation: Operation | None = None, nodes: int = NODES) -> None:
        self.source, self.operation = source, operation or Operation()
        if nodes % WINDOWS:
            raise ValueError(f"nodes = {nodes}: a multiple of {WINDOWS} is needed")
        self.nodes, self.soil_nodes = nodes, SOIL_NODES * -(-nodes // NODES)
        self.phi = 2 * math.pi / nodes * np.arange(nodes)
        self.values, self.rates = source.sample(self.phi)
        self._found: dict[str, Found] = {}
        self._lacking: dict[str, NoMeasure] = {}
        self._events: dict[float, tuple[Array, Array]] = {}
        self._stays: dict[tuple[float, float], tuple[Array, Array, Array]] = {}

    def __getitem__(self, name: str) -> Found:
        if name in self._lacking:
            raise self._lacking[name]
        if name not in self._found:
            try:
                self._found[name] = FORMULAS[name](self)
            except NoMeasure as lack:
                self._lacking[name] = lack
                raise
        return self._found[name]

    def measure(self, *names: str) -> dict[str, float]:
        """Values by name, of all measures unless some are named; NaN where the turn lacks what one is about."""
        found = {}
        for name in names or MEASURES:
            try:
                found[name] = self[name].value
            except NoMeasure:
                found[name] = math.nan
        return found

    # ---- gradients --------------------------------------------------------------------------------

    def _rows(self, phi: Array, weights: Weights) -> Array:
        """Gradients by KNOWNS, a row each angle, of the signals times their weights."""
        rows = np.zeros((len(phi), len(KNOWNS)))
        rows[:, : len(GEOMETRY)] = self.source.gradient(phi, _dense(weights, len(phi)))
        return rows

    def _row_of(self, signal: int, phi: Array) -> Array:
        """The gradient by KNOWNS of a signal at one angle."""
        return np.asarray(self._rows(phi, {signal: 1.0})[0])

    def _at(self, event: Event, quantity: Quantity) -> Found:
        """A smooth value at an event."""
        phi = np.array([event.phi])
        values, rates = self._signals_at(event.phi)
        q, weights, explicit, add = quantity(phi, values, 1.0)

        def gradients() -> Array:
            rows = self._rows(phi, weights)
            add(rows)
            moved: Array = _slope(weights, rates, explicit) * event.gradient
            return rows + moved

        return Found(((1.0, Part(0, q, phi, gradients)),))

    def _signals_at(self, phi: float) -> tuple[Array, Array]:
        """The signals at an event and their derivatives by phi: several measures ask for them."""
        if phi not in self._events:
            self._events[phi] = self.source.sample(np.array([phi]))
        return self._events[phi]

    # ---- events -------------------------------------------------------------------------------------

    def _level_point(self, k: int, falls: bool) -> Event:
        """Where y' = 0 beside the node k, an extreme of y; falls: the highest."""
        step = 2 * math.pi / self.nodes
        side = -1.0 if self.rates[k, Y] * self.rates[(k - 1) % self.nodes, Y] <= 0 else 1.0
        low, high = sorted((self.phi[k], self.phi[k] + side * step))
        phi, slope = self._newton(Y1, 0.0, low, high, falls)
        return Event(phi, lambda: -self._row_of(Y1, np.array([phi])) / slope)

    @cached_property
    def lowest(self) -> Event:
        """The tip at its lowest."""
        return self._level_point(int(self.values[:, Y].argmin()), falls=False)

    @cached_property
    def highest(self) -> Event:
        """The tip at its highest."""
        return self._level_point(int(self.values[:, Y].argmax()), falls=True)

    @cached_property
    def surface(self) -> tuple[float, Callable[[], Array]]:
        """Height of the ridge's surface above O, and its gradient by KNOWNS."""
        bottom = self._at(self.lowest, _signal(Y))
        return bottom.value + self.operation.depth, lambda: bottom.gradient + _unit(DEPTH)

    def _rising(self, start: Event, direction: int, level: tuple[float, Callable[[], Array]], what: str) -> Event:
        """Where the tip, from an event on in a direction of phi, first reaches a height."""
        height, gradient = level
        step = 2 * math.pi / self.nodes
        first = math.floor(start.phi / step) + (direction > 0)
        passed = first + direction * np.arange(self.nodes)
        is_above = self.values[passed % self.nodes, Y] >= height
        if not is_above.any():
            raise NoMeasure(f"the tip never reaches {what}: it lies above the whole path")
        outer = int(passed[is_above.argmax()])
        inner = max(outer * step - step, start.phi) if direction > 0 else min(outer * step + step, start.phi)
        low, high = sorted((outer * step, inner))
        phi, slope = self._newton(Y, height, low, high, falls=direction < 0)
        return Event(phi, lambda: (gradient() - self._row_of(Y, np.array([phi]))) / slope)

    def _newton(self, signal: int, level: float, low: float, high: float, falls: bool) -> tuple[float, float]:
        """Where a signal rises through a level, or falls, between two angles that enclose it, and its slope there:
        Newton's steps, halving what would leave the bracket.
        """
        phi = 0.5 * (low + high)
        for _ in range(MOST_STEPS):
            values, rates = self.source.sample(np.array([phi]))
            excess, slope = float(values[0, signal]) - level, float(rates[0, signal])
            low, high = (phi, high) if (excess > 0) == falls else (low, phi)
            step = -excess / slope if slope else math.inf
            step = step if low <= phi + step <= high else 0.5 * (low + high) - phi
            phi += step
            if abs(step) <= CLOSE:
                break
        return phi, float(self._signals_at(phi)[1][0, signal])

    @cached_property
    def entry(self) -> Event:
        """The tip on its way into the ridge: its phi may be below 0, as that of the exit may be above a turn."""
        return self._rising(self.lowest, -1, self.surface, "the ridge's surface")

    @cached_property
    def exit(self) -> Event:
        """The tip on its way out of the ridge."""
        return self._rising(self.lowest, +1, self.surface, "the ridge's surface")

    @cached_property
    def above_seedling(self) -> Event:
        """The tip on its way out, as high as the planted seedling's top."""
        height, gradient = self.surface
        top = height + self.operation.seedling, lambda: gradient() + _unit(SEEDLING)
        return self._rising(self.exit, +1, top, "the seedling's top")

    # ---- extremes -----------------------------------------------------------------------------------

    def over_turn(self, quantity: Quantity, sign: int) -> Found:
        """The greatest (sign +1) or least (-1) of a quantity over the turn, whose windows begin at fixed angles."""
        (part,) = self._extremes(quantity, (sign,), self._closed, WINDOWS)
        return Found(((1.0, part),))

    @cached_property
    def _closed(self) -> tuple[Array, Array, Array]:
        """Angles and signals of the turn, its end as its beginning."""
        values, rates = (np.concatenate([each, each[:1]]) for each in (self.values, self.rates))
        return np.append(self.phi, 2 * math.pi), values, rates

    def in_soil(self, quantity: Quantity) -> Found:
        """Greatest less least of a quantity while the tip is below the surface."""
        greatest, least = self._between(self.entry, self.exit, quantity, (+1, -1))
        return Found(((1.0, greatest), (-1.0, least)))

    def _between(self, start: Event, end: Event, quantity: Quantity, signs: tuple[int, ...]) -> list[Part]:
        """Extremes between two events: their windows move with them."""
        key = (start.phi, end.phi)
        if key not in self._stays:
            phi = start.phi + np.linspace(0, 1, self.soil_nodes + 1) * (end.phi - start.phi)
            self._stays[key] = (phi, *self.source.sample(phi))
        return self._extremes(quantity, signs, self._stays[key], SOIL_WINDOWS, (start, end))

    def _extremes(
        self,
        quantity: Quantity,
        signs: tuple[int, ...],
        sampled: tuple[Array, Array, Array],
        windows: int,
        ends: tuple[Event, Event] | None = None,
    ) -> list[Part]:
        """For each sign the extremes in all windows, from samples at equal steps of phi, both ends included."""
        phi, values, rates = sampled
        sides = np.array(signs, dtype=float)
        sign = np.repeat(sides, windows)

        def slope_at(phi: Array, chosen: Array) -> Array:
            values, rates = self.source.sample(phi)
            _, weights, explicit, _ = quantity(phi, values, sign[chosen])
            return np.asarray(_slope(weights, rates, explicit))

        q, weights, explicit, _ = quantity(phi, values, sides[:, None])
        shape = (len(signs), len(phi))
        slope = np.broadcast_to(_slope(weights, rates, explicit), shape)
        at = _window_extremes(phi, np.broadcast_to(q, shape), slope, sign, windows, slope_at)
        values, rates = self.source.sample(at)
        q, weights, explicit, add = quantity(at, values, sign)

        @cache
        def gradients() -> Array:
            rows = self._rows(at, weights)
            add(rows)
            if ends is not None:
                start, end = ends
                share = ((at - start.phi) / (end.phi - start.phi))[:, None]
                moves = (1 - share) * start.gradient + share * end.gradient
                rows += _slope(weights, rates, explicit)[:, None] * moves
            return rows

        def part(k: int) -> Part:
            chosen = slice(k * windows, (k + 1) * windows)
            return Part(signs[k], q[chosen], at[chosen], lambda: gradients()[chosen])

        return [part(k) for k in range(len(signs))]

    # ---- quantities ---------------------------------------------------------------------------------

    def ground_x(self, phi: Array, values: Array, _: Any) -> Any:
        """The tip's place along the row, over ground."""
        spacing, turned = self.operation.spacing, phi / (2 * math.pi)

        def add(rows: Array) -> None:
            rows[:, SPACING] += turned

        return values[:, X] + spacing * turned, {X: 1.0}, spacing / (2 * math.pi), add

    def ground_speed(self, _phi: Array, values: Array, _: Any) -> Any:
        """The tip's speed over ground along the row."""
        w = self.operation.w
        by_angle = values[:, X1] + self.operation.spacing / (2 * math.pi)

        def add(rows: Array) -> None:
            rows[:, SPACING] += w / (2 * math.pi)
            rows[:, SPEED] += by_angle

        return w * by_angle, {X1: w}, 0.0, add

    def at_surface(self, phi: Array, values: Array, side: Any) -> Any:
        """Where the nozzle meets the surface along the row over ground: its axis, with half the body on a side."""
        height, gradient = self.surface
        q, _, explicit, add_ground = self.ground_x(phi, values, side)
        sine, cosine = np.sin(values[:, ANGLE]), np.cos(values[:, ANGLE])
        cot, across, below = cosine / sine, side / np.abs(sine), height - values[:, Y]
        body = self.operation.body / 2 * across
        weights = {X: 1.0, Y: -cot, ANGLE: -below / sine**2 - body * cot}

        def add(rows: Array) -> None:
            add_ground(rows)
            rows += np.outer(cot, gradient())
            rows[:, BODY] += across / 2

        return q + below * cot + body, weights, explicit, add

    def magnitude(self, order: int) -> Quantity:
        """Of the tip's velocity (order 1) or acceleration (2), relative to the machine."""
        factor = self.operation.w**order
        x, y = (X1, Y1) if order == 1 else (X2, Y2)

        def quantity(_phi: Array, values: Array, _: Any) -> Any:
            length = np.hypot(values[:, x], values[:, y])
            weights = {x: factor * values[:, x] / length, y: factor * values[:, y] / length}

            def add(rows: Array) -> None:
                rows[:, SPEED] += order * factor / self.operation.w * length

            return factor * length, weights, 0.0, add

        return quantity

    def rms(self, order: int) -> Found:
        """Root of the mean square of the tip's velocity (order 1), acceleration (2) or jerk (3)."""
        factor = self.operation.w**order
        if order == 3:
            third, spectrum = self._jerk.on_nodes, self._jerk
            value = factor * math.sqrt(float(np.mean(np.abs(third) ** 2)))

            def gradients() -> Array:
                rows = factor**2 / value * np.real(np.conj(third)[:, None] * spectrum.gradient_on_nodes)
                return self._of_speed(rows.mean(axis=0), order * value)

        else:
            columns = [X1, Y1] if order == 1 else [X2, Y2]
            vectors = self.values[:, columns]
            value = factor * math.sqrt(float(np.mean((vectors**2).sum(axis=1))))

            def gradients() -> Array:
                weights = np.zeros_like(self.values)
                weights[:, columns] = factor**2 / (value * self.nodes) * vectors
                return self._of_speed(self.source.gradient(self.phi, weights).sum(axis=0), order * value)

        return Found(((1.0, Part(0, np.array([value]), np.array([math.nan]), gradients)),))

    def _of_speed(self, by_geometry: Array, by_speed: float) -> Array:
        """One row by KNOWNS, of what geometry and the crank's speed alone determine."""
        row = np.zeros((1, len(KNOWNS)))
        row[0, : len(GEOMETRY)] = by_geometry
        row[0, SPEED] = by_speed / self.operation.w
        return row

    @cached_property
    def _jerk(self) -> _Spectrum:
        return _Spectrum(self)

    def peak_jerk(self) -> Found:
        """The greatest jerk of the tip."""
        spectrum, factor = self._jerk, self.operation.w**3
        phi = np.append(self.phi, 2 * math.pi)
        jerk, snap = (np.append(each, each[:1])[None] for each in (spectrum.on_nodes, spectrum.snap_on_nodes))

        def slope_at(phi: Array, _: Array) -> Array:
            third, fourth = spectrum.at(phi, 1), spectrum.at(phi, 2)
            return np.real(np.conj(third) * fourth) / np.abs(third)

        slope = np.real(np.conj(jerk) * snap) / np.abs(jerk)
        at = _window_extremes(phi, np.abs(jerk), slope, np.ones(WINDOWS), WINDOWS, slope_at)
        third = spectrum.at(at, 1)
        values = factor * np.abs(third)

        def gradients() -> Array:
            rows = factor * np.real((np.conj(third) / np.abs(third))[:, None] * spectrum.gradient_at(at))
            return np.vstack([self._of_speed(row, 3 * value) for row, value in zip(rows, values, strict=True)])

        return Found(((1.0, Part(+1, values, at, gradients)),))

    # ---- torque -------------------------------------------------------------------------------------

    @cached_property
    def _torque(self) -> tuple[Array, Array]:
        """The torque and its derivative by phi over the turn."""
        if not hasattr(self.source, "torque"):
            raise NoMeasure("the torque is that of masses, of which this source knows nothing")
        torque, slope = self.source.torque(self.phi, self.operation.w)
        if not torque.any():
            raise NoMeasure("no body has a mass: the torque is 0")
        return torque, slope

    def _rows_of_torque(self, phi: Array) -> Array:
        """The gradient of the torque by KNOWNS, a row each angle."""
        found = self.source.torque_gradient(phi, self.operation.w)  # type: ignore[attr-defined]
        rows = np.zeros((len(phi), len(KNOWNS)))
        rows[:, : len(GEOMETRY)] = found[:, : len(GEOMETRY)]
        rows[:, -len(MASSES) :] = found[:, len(GEOMETRY) : -1]
        rows[:, SPEED] = found[:, -1]
        return rows

    def peak_torque(self) -> Found:
        """The greatest size of the torque: of each window its greatest and, turned round, its least."""
        torque, slope = (np.append(each, each[0]) for each in self._torque)
        side = np.repeat([1.0, -1.0], WINDOWS)

        def slope_at(phi: Array, chosen: Array) -> Array:
            _, slope = self.source.torque(phi, self.operation.w)  # type: ignore[attr-defined]
            return np.asarray(side[chosen] * slope)

        at = _window_extremes(
            np.append(self.phi, 2 * math.pi),
            np.array([torque, -torque]),
            np.array([slope, -slope]),
            np.ones(2 * WINDOWS),
            WINDOWS,
            slope_at,
        )
        values = side * self.source.torque(at, self.operation.w)[0]  # type: ignore[attr-defined]
        part = Part(+1, values, at, lambda: np.asarray(side[:, None] * self._rows_of_torque(at)))
        return Found(((1.0, part),))

    def rms_torque(self) -> Found:
        """Root of the mean square of the torque."""
        torque, _ = self._torque
        value = math.sqrt(float(np.mean(torque**2)))

        def gradients() -> Array:
            return (torque / (value * self.nodes) @ self._rows_of_torque(self.phi))[None]

        return Found(((1.0, Part(0, np.array([value]), np.array([math.nan]), gradients)),))

    # ---- measures of several events -----------------------------------------------------------------

    def between_ends(self) -> Found:
        """The tip's way over ground from entry to exit."""
        begin, end = (self._at(event, self.ground_x).parts[0][1] for event in (self.entry, self.exit))
        return Found(((-1.0, begin), (1.0, end)))

    def mean_ground_speed(self) -> Found:
        """Hole over the time in the ridge."""
        hole, stay = self["hole"], self.exit.phi - self.entry.phi
        value = hole.value * self.operation.w / stay

        def gradients() -> Array:
            longer = self.exit.gradient - self.entry.gradient
            row = hole.gradient * self.operation.w / stay - longer * value / stay
            row[SPEED] += value / self.operation.w
            return row[None]

        return Found(((1.0, Part(0, np.array([value]), np.array([math.nan]), gradients)),))

    def clearance(self) -> Found:
        """Least distance along the row, on the side on which the tip leaves the ridge, from the place planted."""
        planted = self._at(self.lowest, self.ground_x).parts[0][1]
        leaving = self._at(self.exit, self.ground_x).value
        if leaving >= planted.values[0]:
            nearest, side = -1, 1.0
        else:
            nearest, side = +1, -1.0
        (passing,) = self._between(self.exit, self.above_seedling, self.ground_x, (nearest,))
        return Found(((side, passing), (-side, planted)))


FORMULAS: Mapping[str, Callable[[Turn], Found]] = {
    "swept": lambda turn: turn.in_soil(turn.at_surface),
    "reach": lambda turn: turn.in_soil(turn.ground_x),
    "hole": Turn.between_ends,
    "lean": lambda turn: turn._at(turn.lowest, _signal(ANGLE, math.pi / 2)),
    "lean_change": lambda turn: turn.in_soil(_signal(ANGLE)),
    "ground_speed": lambda turn: turn._at(turn.lowest, turn.ground_speed),
    "mean_ground_speed": Turn.mean_ground_speed,
    "height": lambda turn: Found(
        ((1.0, turn._at(turn.highest, _signal(Y)).parts[0][1]), (-1.0, turn._at(turn.lowest, _signal(Y)).parts[0][1]))
    ),
    "pickup_x": lambda turn: turn._at(turn.highest, _signal(X)),
    "pickup_y": lambda turn: turn._at(turn.highest, _signal(Y)),
    "pickup_angle": lambda turn: turn._at(turn.highest, _signal(ANGLE, math.pi / 2)),
    "peak_speed": lambda turn: turn.over_turn(turn.magnitude(1), +1),
    "rms_speed": lambda turn: turn.rms(1),
    "peak_acceleration": lambda turn: turn.over_turn(turn.magnitude(2), +1),
    "rms_acceleration": lambda turn: turn.rms(2),
    "peak_jerk": Turn.peak_jerk,
    "rms_jerk": lambda turn: turn.rms(3),
    "margin": lambda turn: turn.over_turn(_signal(MARGIN), -1),
    "clearance": Turn.clearance,
    "peak_torque": Turn.peak_torque,
    "rms_torque": Turn.rms_torque,
}
assert tuple(FORMULAS) == tuple(MEASURES)


class _Spectrum:
    """The tip's acceleration over a turn, by phi, as a Fourier series: for jerk, which no source gives the gradient of.

    The motion is analytic and repeats itself, so that the series of a turn sampled often enough is exact to rounding,
    and so are its derivatives; where the sampling does not do, near dead points, NoMeasure is raised.
    """

    def __init__(self, turn: Turn) -> None:
        self._turn, n = turn, turn.nodes
        self._wave = np.fft.fftfreq(n, 1 / n)
        self._wave[np.abs(self._wave) * 2 >= n] = 0.0  # the highest has no sign, and its derivative no value
        self._series = np.fft.fft(turn.values[:, X2] + 1j * turn.values[:, Y2]) / n
        size = np.abs(self._series)
        end = size[np.abs(self._wave) > 0.45 * n].max() / size.max()
        if end > TAIL:
            raise NoMeasure(
                f"{n} angles a turn do not resolve the jerk: the end of its spectrum is {end:.0e} of the greatest part"
            )

    def at(self, phi: Array, order: int) -> NDArray[np.complex128]:
        """The derivative of the acceleration x + iy by phi, of this order."""
        return np.exp(1j * np.outer(phi, self._wave)) @ ((1j * self._wave) ** order * self._series)

    @cached_property
    def on_nodes(self) -> NDArray[np.complex128]:
        """The acceleration's first derivative at the turn's own angles."""
        return np.fft.ifft(1j * self._wave * self._series) * self._turn.nodes

    @cached_property
    def snap_on_nodes(self) -> NDArray[np.complex128]:
        """Its second one."""
        return np.fft.ifft((1j * self._wave) ** 2 * self._series) * self._turn.nodes

    @cached_property
    def _gradient_series(self) -> NDArray[np.complex128]:
        """Of the gradient of the acceleration's first derivative by GEOMETRY."""
        turn = self._turn
        x, y = (turn.source.gradient(turn.phi, _dense({signal: 1.0}, turn.nodes)) for signal in (X2, Y2))
        return np.asarray(1j * self._wave[:, None] * np.fft.fft(x + 1j * y, axis=0) / turn.nodes)

    def gradient_at(self, phi: Array) -> NDArray[np.complex128]:
        """A row each angle."""
        return np.exp(1j * np.outer(phi, self._wave)) @ self._gradient_series

    @cached_property
    def gradient_on_nodes(self) -> NDArray[np.complex128]:
        """A row each of the turn's own angles."""
        return np.fft.ifft(self._gradient_series, axis=0) * self._turn.nodes


def _dense(weights: Weights, poses: int) -> Array:
    """As a source takes them: a row each pose, a column each of SIGNALS."""
    rows = np.zeros((poses, len(SIGNALS)))
    for signal, weight in weights.items():
        rows[:, signal] = weight
    return rows


def _unit(known: int) -> Array:
    """The gradient of one of KNOWNS."""
    row = np.zeros(len(KNOWNS))
    row[known] = 1.0
    return row


def _slope(weights: Weights, rates: Array, explicit: Any) -> Any:
    """The derivative of a quantity by phi."""
    return sum(weight * rates[:, signal] for signal, weight in weights.items()) + explicit


def _nothing(_: Array) -> None:
    """Nothing to add."""


def _signal(number: int, offset: float = 0.0) -> Quantity:
    """A signal itself, with a constant added."""

    def quantity(_phi: Array, values: Array, _: Any) -> Any:
        return values[:, number] + offset, {number: 1.0}, 0.0, _nothing

    return quantity


@cache
def _windows(rounds: int, windows: int, steps: int) -> tuple[Array, Array, Array]:
    """Of each window of each round: the number of the round, its first node, and those of all its nodes in a grid of a
    row each round.
    """
    of, first = np.repeat(np.arange(rounds), windows), np.tile(np.arange(windows) * steps, rounds)
    return of, first, (of * (windows * steps + 1) + first)[:, None] + np.arange(steps + 1)


def _window_extremes(
    phi: Array,
    q: Array,
    slope: Array,
    sign: Array,
    windows: int,
    slope_at: Callable[[Array, Array], Array],
) -> Array:
    """Where q is greatest (sign +1) or least (-1) in each window of as many equal steps; its ends count.

    q and its slope have a row for each round of windows, and a column for each phi; ``sign`` is given for every window
    of every round. ``slope_at(phi, which)`` is asked for the slope in these of all the windows.
    """
    steps = (len(phi) - 1) // windows
    of, first, inside = _windows(len(q), windows, steps)
    best = first + (sign[:, None] * q.ravel()[inside]).argmax(axis=1)
    here = slope[of, best]
    rise = sign * here
    other = best + ((rise > 0) & (best < first + steps)) - ((rise < 0) & (best > first))
    there = slope[of, other]
    # The extreme lies between the nodes where the slope changes its sign there; else two lie there, and the node does.
    (chosen,) = (there * here < 0).nonzero()
    at: Array = phi[best]
    if len(chosen):
        ends = best[chosen], other[chosen]
        is_before = ends[0] < ends[1]
        low, high = (phi[np.where(is_before, *each)] for each in (ends, ends[::-1]))
        slopes = here[chosen], there[chosen]
        f_low, f_high = (np.where(is_before, *each) for each in (slopes, slopes[::-1]))
        at[chosen] = _roots(lambda phi: slope_at(phi, chosen), low, high, f_low, f_high)
    return at


def _roots(function: Callable[[Array], Array], low: Array, high: Array, f_low: Array, f_high: Array) -> Array:
    """Where a function is 0 in each of these brackets, at whose ends it has other signs: by secants, which need few
    steps where it is as good as straight, and by halving where they have not arrived.

    A secant's error shrinks faster than linearly: after a step of CLOSE the next would be of rounding's size.
    """
    before, f_before = low, f_low
    at: Array = low - f_low * (high - low) / (f_high - f_low)
    with np.errstate(divide="ignore", invalid="ignore"):  # where two values are the same, as at the end
        for _ in range(FEW_STEPS):
            f = function(at)
            step = f * (at - before) / (f - f_before)
            step[~np.isfinite(step)] = 0.0
            before, f_before, at = at, f, np.minimum(np.maximum(at - step, low), high)
            if np.abs(step).max() <= CLOSE:
                return at
    for _ in range(MOST_STEPS):
        at = 0.5 * (low + high)
        is_low = function(at) * f_low > 0
        low, high = np.where(is_low, at, low), np.where(is_low, high, at)
    return at
