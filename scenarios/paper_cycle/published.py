"""The paper's figures and sentences beside what the FMU gives.

Paper: Chen Jianneng et al. 2010, DOI 10.3969/j.issn.1000-1298.2010.12.010; the published
sentences are this project's translations. Where "about", "almost" or "basically unchanged"
needs a limit, it is one of those below. Speeds and accelerations are relative to the machine.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from scenarios.common import measures
from scenarios.common.linkage import LinkageFmu, Turns
from scenarios.common.measures import CommonPoint, Shape
from scenarios.common.operating_point import HOLE_MM, PLANTS_PER_MINUTE, SPACING, hole_depth
from scenarios.paper_cycle.families import FamilyRun, height, width

HEIGHT_MM = 334.9
# Crank angles at which section 5 begins its phases I to VI, deg.
BORDERS = {"I": 0.0, "II": 62.0, "III": 127.0, "IV": 143.0, "V": 163.0, "VI": 194.0}
# The paper does not say what sets its borders: these signals have an extreme near them.
BORDER_SIGNALS = {"II": "tip.ay", "III": "tip.ay", "IV": "tip.vy", "V": "tip.ay", "VI": "tip.vx"}
SCAN_STEP_DEG = 5  # between the phase differences at which shapes are sought
SHAPES = {40: "kidney", 65: "figure 8", 95: "dolphin", 130: "loaf", 190: "crescent"}  # by theta41, deg

ABOUT_DEG = 5.0  # "about" an angle
VERTICAL_DEG = 10.0  # "almost vertical": lean of the best straight line
UNCHANGED = 0.10  # "basically unchanged": spread over the nominal value
COMMON_MM = 1.0  # "through the same points"
GRAVITY = 9.80665  # m/s2, standard
SMALL_SPEED = 1 / 3  # "small": share of the greatest speed
ROUNDING = 0.5e-3  # m: lengths are printed in whole millimetres

AGREES, DIFFERS, OPEN = "agrees", "differs", "not determined"


@dataclass(frozen=True)
class Row:
    """One published statement. ``value`` is its leading computed number, for machines."""

    key: str
    source: str
    published: str
    computed: str
    verdict: str
    reason: str = ""
    value: float | None = None
    unit: str = ""


@dataclass(frozen=True)
class Results:
    """What the comparison found, for the table and the figures."""

    rows: list[Row]
    surface_mm: float  # height of the ridge surface in machine axes
    common: tuple[CommonPoint, CommonPoint]
    shapes: dict[float, Shape]  # of figure 4's curves, by theta41


@dataclass
class _Table:
    rows: list[Row] = field(default_factory=list)

    def add(
        self,
        key: str,
        *,
        source: str,
        published: str,
        computed: str,
        holds: bool | None,
        reason: str = "",
        value: float | None = None,
        unit: str = "",
    ) -> None:
        """``holds`` is None where the paper does not say enough to decide."""
        verdict = OPEN if holds is None else AGREES if holds else DIFFERS
        self.rows.append(Row(key, source, published, computed, verdict, reason, value, unit))


def lengths(fmu: LinkageFmu) -> list[str]:
    """Names of the parameters that are lengths or coordinates: their unit is m."""
    units = {v.name: v.unit for v in fmu.description.modelVariables}
    return [name for name in fmu.nominal if units[name] == "m"]


def rounding_spread(
    fmu: LinkageFmu, names: list[str], step_deg: float, done: Callable[[], object]
) -> tuple[float, str]:
    """How far rounding one printed length moves the height of the static trajectory.

    ``done`` is called after each name. Returns the greatest change in mm and the parameter that causes it.
    """

    def tall(turns: Turns) -> float:
        y = turns.static_mm.imag
        return measures.highest(turns.phi_deg, y).value - measures.lowest(turns.phi_deg, y).value

    base = tall(fmu.run(step_deg))
    changes = {}
    for name in names:
        changes[name] = max(
            abs(tall(fmu.run(step_deg, {name: fmu.nominal[name] + shift})) - base) for shift in (-ROUNDING, ROUNDING)
        )
        done()
    worst = max(changes, key=lambda name: changes[name])
    return changes[worst], worst.rpartition(".")[2]


def compare(
    fmu: LinkageFmu,
    nominal: Turns,
    plants: Turns,
    families: list[FamilyRun],
    scan: dict[float, Shape],
    rounding: tuple[float, str],
) -> Results:
    """Hold every statement against the runs.

    ``nominal`` is one fine turn and ``plants`` several turns of the published set, ``scan``
    the shapes over a whole turn of the phase difference, ``rounding`` from rounding_spread.
    """
    table = _Table()
    surface = _nominal_set(table, fmu, nominal, plants, rounding)
    _phases(table, nominal)
    by_symbol = {run.family.symbol: run for run in families}
    common = _crank_oa(table, by_symbol["L1"], surface)
    shapes = _phase_difference(table, by_symbol["theta41"], scan)
    _crank_cd(table, by_symbol["L4"], surface)
    _rocker(table, by_symbol["L7"], surface)
    _one_reading(table, by_symbol["L1"], by_symbol["L7"])
    _conclusions(table, by_symbol)
    for run in families:
        _refusals(table, run)
    return Results(table.rows, surface, common, shapes)


# --- sections 1 and 5: the published set -------------------------------------------------


def _nominal_set(table: _Table, fmu: LinkageFmu, turn: Turns, plants: Turns, rounding: tuple[float, str]) -> float:
    """Trajectory, hole and posture. Returns the ridge surface's height in machine axes, mm."""
    phi, static, dynamic = turn.phi_deg, turn.static_mm, turn.dynamic_mm
    top, bottom = measures.highest(phi, static.imag), measures.lowest(phi, static.imag)

    table.add(
        "plants_per_minute",
        source="4, 5",
        published=f"N = {PLANTS_PER_MINUTE:.0f} plants/min, one a turn",
        computed=f"{fmu.turns_per_minute:.3f} turns/min",
        holds=abs(fmu.turns_per_minute - PLANTS_PER_MINUTE) < 1e-3,
        reason="the FMU's default experiment is one turn",
        value=fmu.turns_per_minute,
        unit="1/min",
    )
    per_turn = round(360 / (plants.phi_deg[1] - plants.phi_deg[0]))
    turns = [plants.dynamic_mm[k : k + per_turn] for k in range(0, len(plants.time) - 1, per_turn)]
    spacings = np.diff([z[np.argmin(z.imag)].real for z in turns])
    table.add(
        "spacing",
        source="4, 5",
        published=f"S = {SPACING * 1e3:.0f} mm",
        computed=f"{spacings.mean():.3f} mm from hole to hole",
        holds=bool(np.all(np.abs(spacings - SPACING * 1e3) < 1e-3)),
        reason=f"machine.v = {fmu.spacing / fmu.turn_time:.5f} m/s",
        value=float(spacings.mean()),
        unit="mm",
    )
    closing = abs(static[-1] - static[0])
    table.add(
        "closing",
        source="fig. 7a",
        published="the static trajectory is a closed curve",
        computed=f"ends within {max(closing, 1e-9):.1g} mm of its start after one turn",
        holds=closing < 1e-6,
        reason=f"least assembly.margin {turn['assembly.margin'].min():.3f}",
        value=float(closing),
        unit="mm",
    )
    table.add(
        "top_angle",
        source="1, fig. 1",
        published="nozzle highest in the initial position, 0 deg",
        computed=f"tip highest at {top.phi_deg:.2f} deg",
        holds=abs(measures.angle_between(top.phi_deg, 0)) <= ABOUT_DEG,
        reason=f"tip.y = {top.value:.2f} mm",
        value=top.phi_deg,
        unit="deg",
    )
    since_top = (bottom.phi_deg - top.phi_deg) % 360
    table.add(
        "bottom_angle",
        source="1",
        published="nozzle lowest about 180 deg later",
        computed=f"tip lowest at {bottom.phi_deg:.2f} deg, {since_top:.2f} deg after highest",
        holds=abs(since_top - 180) <= ABOUT_DEG and abs(bottom.phi_deg - 180) <= ABOUT_DEG,
        reason=f"tip.y = {bottom.value:.2f} mm",
        value=bottom.phi_deg,
        unit="deg",
    )
    tall = top.value - bottom.value
    table.add(
        "height",
        source="5, fig. 7a",
        published=f"height of the static trajectory {HEIGHT_MM} mm",
        computed=f"{tall:.2f} mm",
        holds=abs(tall - HEIGHT_MM) <= rounding[0],
        reason=f"{tall - HEIGHT_MM:+.2f} mm; rounding one printed length ({rounding[1]}) by 0.5 mm "
        f"moves it by up to {rounding[0]:.1f} mm",
        value=tall,
        unit="mm",
    )
    table.add(
        "tray_height",
        source="5",
        published="trajectory height set by the seedling tray, usually about 800 mm",
        computed=f"{tall:.1f} mm",
        holds=None,
        reason="the paper says neither from where the tray's height counts nor how high the machine stands",
    )

    depth = hole_depth(dynamic)
    if depth is None:
        table.add(
            "hole_surface",
            source="5, fig. 7b",
            published=f"hole {HOLE_MM} mm",
            computed="no surface gives it",
            holds=False,
        )
        depth = 0.3 * tall
    else:
        table.add(
            "hole_surface",
            source="5, fig. 7b",
            published=f"hole {HOLE_MM} mm",
            computed=f"{HOLE_MM} mm at a ridge surface {depth:.1f} mm above the lowest point",
            holds=None,
            reason=f"the paper does not give its surface; this one lies {-(bottom.value + depth):.1f} mm below O "
            "and is used in all that follows",
            value=depth,
            unit="mm",
        )
    surface = bottom.value + depth
    heights = (25, 50, 75, 100, 125, 150)
    sizes = [_hole_size(dynamic, bottom.value + h) for h in heights]
    table.add(
        "hole_heights",
        source="4.1, fig. 7b",
        published="hole: distance of the surface's two intersections with the dynamic trajectory",
        computed=", ".join(f"{size:.1f}" for size in sizes)
        + " mm at "
        + ", ".join(map(str, heights))
        + " mm above the lowest point",
        holds=None,
        reason="the size follows the surface: no number without it",
        value=sizes[3],
        unit="mm",
    )

    dug = measures.hole(dynamic, surface)
    lowest_sample = int(np.argmin(dynamic.imag))
    if dug:
        rising, falling = dynamic[lowest_sample:], dynamic[: lowest_sample + 1]
        right = measures.wall(rising[: int(np.argmax(rising.imag > surface))])
        left = measures.wall(falling[falling.imag < surface][::-1])
        upper = rising[: int(np.argmax(rising.imag > surface))]
        upper = measures.wall(upper[upper.imag > surface - 0.75 * depth])
        table.add(
            "right_wall",
            source="5, fig. 7b",
            published="right boundary of the hole almost vertical to the ridge surface",
            computed=f"leans {right.lean_deg:+.1f} deg from vertical, upper three quarters {upper.lean_deg:+.1f} deg; "
            f"left boundary {left.lean_deg:+.1f} deg",
            holds=abs(right.lean_deg) <= VERTICAL_DEG,
            reason=f"best straight lines; + leans forward; limit {VERTICAL_DEG:.0f} deg",
            value=right.lean_deg,
            unit="deg",
        )
    angle = np.degrees(turn["tip.angle"])
    within = dynamic.imag < surface
    table.add(
        "posture",
        source="5, fig. 7",
        published="posture of the nozzle suits planting",
        computed=f"axis {angle[lowest_sample] + 90:+.1f} deg from straight down at the lowest point, "
        f"{angle[within].min() + 90:+.1f} to {angle[within].max() + 90:+.1f} deg in the soil, "
        f"{angle.min() + 90:+.1f} to {angle.max() + 90:+.1f} deg in the turn",
        holds=None,
        reason="no angle published; + points the tip forward",
        value=float(angle[lowest_sample]),
        unit="deg",
    )
    return surface


def _phases(table: _Table, turn: Turns) -> None:
    """The phases I to VI of section 5 and figure 8."""
    phi, speed, vy = turn.phi_deg, turn.speed, turn["tip.vy"]
    fastest = measures.highest(phi, speed)
    bottom = measures.lowest(phi, turn["tip.y"])
    names = list(BORDERS)

    def part(first: str) -> slice:
        """Samples from one border to the next, both included; VI runs to the end of the turn."""
        k = names.index(first)
        last = BORDERS[names[k + 1]] if k + 1 < len(names) else 360.0
        return slice(int(np.searchsorted(phi, BORDERS[first] - 1e-9)), int(np.searchsorted(phi, last + 1e-9)))

    def ends(first: str, signal: np.ndarray) -> str:
        values = signal[part(first)]
        return f"{values[0]:.2f} to {values[-1]:.2f}"

    for name, signal in BORDER_SIGNALS.items():
        near = measures.nearest(measures.extremes(phi, turn[signal]), BORDERS[name])
        off = measures.angle_between(near.phi_deg, BORDERS[name])
        kind = "maximum" if near.is_maximum else "minimum"
        unit = "m/s2" if ".a" in signal else "m/s"
        table.add(
            f"border_{name}",
            source="5, fig. 8",
            published=f"phase border {name} at {BORDERS[name]:.0f} deg",
            computed=f"{kind} of {signal} at {near.phi_deg:.1f} deg ({near.value:.2f} {unit})",
            holds=abs(off) <= ABOUT_DEG,
            reason=f"{off:+.1f} deg; the paper does not say what sets the border: the extreme that lies near",
            value=near.phi_deg,
            unit="deg",
        )

    calm, mean = speed[part("I")].max(), speed[part("I")].mean()
    table.add(
        "phase_I",
        source="5, fig. 8",
        published="I to II (0-62 deg): speed small, so that the seedling is caught",
        computed=f"at most {calm:.2f} m/s, {calm / fastest.value:.0%} of the greatest; mean {mean:.2f} m/s",
        holds=calm <= SMALL_SPEED * fastest.value,
        reason="small: up to a third of the greatest",
        value=float(calm),
        unit="m/s",
    )
    window = part("II")
    table.add(
        "phase_II",
        source="5, fig. 8",
        published="II to III (62-127 deg): descends, accelerated",
        computed=f"tip.vy < 0 throughout, speed {ends('II', speed)} m/s"
        if np.all(vy[window] < 0)
        else "does not descend throughout",
        holds=bool(np.all(vy[window] < 0) and np.all(np.diff(speed[window]) > 0)),
    )
    window = part("III")
    table.add(
        "phase_III",
        source="5, fig. 8",
        published="III to IV (127-143 deg): descends, decelerated",
        computed=f"descends; speed {ends('III', speed)} m/s, still rising until {fastest.phi_deg:.1f} deg",
        holds=bool(np.all(vy[window] < 0) and speed[window][-1] < speed[window][0]),
        reason=f"what falls is the acceleration: {ends('III', turn.acceleration)} m/s2",
    )
    window = part("IV")
    table.add(
        "phase_IV",
        source="5, fig. 8",
        published="IV to V (143-163 deg): descends, accelerated",
        computed=f"descends; speed {ends('IV', speed)} m/s, falling",
        holds=bool(np.all(vy[window] < 0) and speed[window][-1] > speed[window][0]),
        reason=f"what rises is the acceleration: {ends('IV', turn.acceleration)} m/s2",
    )
    off = min(abs(measures.angle_between(fastest.phi_deg, BORDERS[name])) for name in ("IV", "V"))
    inside = BORDERS["IV"] <= fastest.phi_deg <= BORDERS["V"]
    table.add(
        "fastest",
        source="5, fig. 8",
        published="IV to V: speed reaches its greatest value",
        computed=f"{fastest.value:.3f} m/s at {fastest.phi_deg:.1f} deg",
        holds=inside or off <= ABOUT_DEG,
        reason="within the phase" if inside else f"{off:.1f} deg outside the phase, whose borders are approximate",
        value=fastest.phi_deg,
        unit="deg",
    )
    late = bottom.phi_deg - BORDERS["V"]
    table.add(
        "lowest_in_IV",
        source="5, fig. 8",
        published="IV to V: tip reaches the lowest point of the cycle",
        computed=f"lowest at {bottom.phi_deg:.1f} deg, {late:.1f} deg after the phase's end",
        holds=BORDERS["IV"] - ABOUT_DEG <= bottom.phi_deg <= BORDERS["V"] + ABOUT_DEG,
        reason="nor would it fit the paper's own 'about 180 deg' (section 1)",
        value=bottom.phi_deg,
        unit="deg",
    )
    window = part("V")
    table.add(
        "phase_V_rises",
        source="5, fig. 8",
        published="V to VI (163-194 deg): rises",
        computed=f"descends until {bottom.phi_deg:.1f} deg, rises only then; "
        f"tip.y changes by {(turn['tip.y'][window][-1] - turn['tip.y'][window][0]) * 1e3:+.1f} mm from V to VI",
        holds=bool(np.all(vy[window] > 0)),
        reason=f"V lies {bottom.phi_deg - phi[window][0]:.1f} deg before the lowest point",
    )
    slowest_at = float(phi[window][np.argmin(speed[window])])
    table.add(
        "phase_V_slows",
        source="5, fig. 8",
        published="V to VI: speed falls quickly",
        computed=f"{speed[window][0]:.2f} m/s at V, {speed[window].min():.2f} at {slowest_at:.1f} deg, "
        f"{speed[window][-1]:.2f} at VI",
        holds=bool(np.all(np.diff(speed[window]) < 0)),
        reason="falls in the first part only, then rises again",
        value=slowest_at,
        unit="deg",
    )
    brake = measures.highest(phi, turn["tip.ay"])
    weights = brake.value / GRAVITY
    table.add(
        "thrown_out",
        source="5",
        published="V to VI: slowed down, the nozzle lets the seedling fly out by inertia",
        computed=f"descent braked by up to {brake.value:.1f} m/s2 ({weights:.1f} g) at {brake.phi_deg:.1f} deg",
        holds=None,
        reason="a sentence on the seedling, which neither the paper nor the FMU models",
        value=brake.value,
        unit="m/s2",
    )
    window = part("VI")
    top = measures.highest(phi, turn["tip.y"])
    until_top = phi[window] < top.phi_deg - 0.5
    table.add(
        "phase_VI",
        source="5, fig. 8",
        published="from VI: rises and completes the cycle",
        computed=f"rises from VI until {top.phi_deg:.1f} deg",
        holds=bool(np.all(vy[window][until_top] > 0) and abs(measures.angle_between(top.phi_deg, 0)) <= ABOUT_DEG),
    )


# --- section 4: the parameter studies ----------------------------------------------------


def _crank_oa(table: _Table, run: FamilyRun, surface: float) -> tuple[CommonPoint, CommonPoint]:
    heights, widths = run.each(height), run.each(width)
    table.add(
        "L1_height",
        source="4.1, fig. 3",
        published="L1 up: the curve's outline grows, above all its height",
        computed=f"{_over(run)}: height {_span(heights)}, width {_span(widths)} mm",
        holds=_rises(heights) and _rises(widths) and heights[-1] / heights[0] > widths[-1] / widths[0],
        reason="",
        value=heights[-1] - heights[0],
        unit="mm",
    )
    curves = [turns.static_mm[:-1] for _, turns in run.reached]
    start = run.nominal.static_mm[:-1]
    points = measures.common_points(curves, start[:: max(1, len(start) // 360)], apart_mm=width(run.nominal) / 2)
    table.add(
        "L1_common",
        source="4.1, fig. 3",
        published="L1 up: all curves pass through the same two points",
        computed=" and ".join(f"within {p.distance:.2f} mm of ({p.point.real:.1f}, {p.point.imag:.1f})" for p in points)
        + " mm",
        holds=all(p.distance <= COMMON_MM for p in points),
        reason=f"points (tip.x, tip.y); limit {COMMON_MM:.0f} mm",
        value=max(p.distance for p in points),
        unit="mm",
    )
    level = 0.5 * (points[0].point.imag + points[1].point.imag)
    middles = [measures.width_at(curve, level) for curve in curves]
    table.add(
        "L1_middle",
        source="4.1, fig. 3",
        published="L1 up: shape in the middle basically unchanged",
        computed=f"width between the two points {_span(middles)} mm",
        holds=_unchanged(middles, measures.width_at(start, level)),
    )
    _holes(table, run, surface, "L1", "4.1, fig. 3", "unchanged")
    return points


def _phase_difference(table: _Table, run: FamilyRun, scan: dict[float, Shape]) -> dict[float, Shape]:
    heights = run.each(height)
    table.add(
        "theta41_size",
        source="4.2, fig. 4",
        published="theta41 up: shape and size change very much",
        computed=f"{_over(run)}: height {min(heights):.0f} to {max(heights):.0f} mm",
        holds=not _unchanged(heights, height(run.nominal)),
        reason="all of them make a whole turn" if len(scan) * SCAN_STEP_DEG == 360 else "",
        value=max(heights) - min(heights),
        unit="mm",
    )
    shapes = {value: measures.shape(turns.static_mm[:-1]) for value, turns in run.reached}
    for value, name in SHAPES.items():
        form = shapes.get(value)
        seen = _ranges([angle for angle, s in scan.items() if s.name == name])
        table.add(
            f"theta41_{name.replace(' ', '_')}",
            source="4.2, fig. 4",
            published=f"theta41 up: shape '{name}', in this order",
            computed=f"theta41 = {value} deg: " + (f"{form}; seen at {seen} deg" if form else "no whole turn"),
            holds=form is not None and form.name == name,
            reason="the paper neither gives angles nor defines its shapes; the limits are this project's, "
            "drawn with the curves in view",
        )
    return shapes


def _crank_cd(table: _Table, run: FamilyRun, surface: float) -> None:
    heights, widths = run.each(height), run.each(width)
    table.add(
        "L4_size",
        source="4.3, fig. 5",
        published="L4 up: curve higher and wider",
        computed=f"{_over(run)}: height {_span(heights)}, width {_span(widths)} mm",
        holds=_rises(heights) and _rises(widths),
        reason="",
        value=heights[-1] - heights[0],
        unit="mm",
    )
    _holes(table, run, surface, "L4", "4.3, fig. 5", "smaller")


def _rocker(table: _Table, run: FamilyRun, surface: float) -> None:
    base = run.nominal.static_mm[:-1]
    turned = [measures.best_rotation(base, turns.static_mm[:-1]) for _, turns in run.reached]
    worst = max(t.residual / t.radius for t in turned)
    table.add(
        "L7_shape",
        source="4.4, fig. 6",
        published="L7 up: shape basically unchanged",
        computed=f"{_over(run)}: after the best rotation {max(t.residual for t in turned):.1f} mm rms remain at most, "
        f"{worst:.1%} of the curve's rms radius",
        holds=worst <= UNCHANGED,
        reason=f"{max(t.before for t in turned):.1f} mm without rotation",
        value=worst,
        unit="1",
    )
    angles = [t.angle_deg for t in turned]
    table.add(
        "L7_turned",
        source="4.4, fig. 6",
        published="L7 up: the curve is turned",
        computed=f"by {angles[0]:+.1f} to {angles[-1]:+.1f} deg against L7 = {run.nominal_value:.0f} mm",
        holds=_rises(angles) or _rises(angles[::-1]),
        reason="counter-clockwise positive",
        value=angles[-1] - angles[0],
        unit="deg",
    )
    _holes(table, run, surface, "L7", "4.4, fig. 6", "unchanged")


def _holes(table: _Table, run: FamilyRun, surface: float, symbol: str, source: str, claim: str) -> None:
    """The hole under two readings: the paper does not say how its surface lies for each curve."""
    depth = surface - run.nominal.static_mm.imag.min()
    for key, reading, sizes in (
        ("fixed_surface", "surface fixed to the machine", hole_sizes(run, surface)),
        ("fixed_depth", "same planting depth for each curve", hole_sizes(run, depth, above_lowest=True)),
    ):
        known = [s for s in sizes if np.isfinite(s)]
        if claim == "smaller":
            holds = len(known) == len(sizes) and _rises(known[::-1])
        else:
            holds = len(known) == len(sizes) and _unchanged(known, HOLE_MM)
        text = f"{symbol} up: hole " + ("becomes smaller" if claim == "smaller" else "basically unchanged")
        table.add(
            f"{symbol}_hole_{key}",
            source=source,
            published=f"{text} [{reading}]",
            computed=f"{_over(run)}: {', '.join(f'{s:.1f}' for s in sizes)} mm",
            holds=holds,
            reason=f"spread {np.ptp(known) / HOLE_MM:.0%}"
            + (f", limit {UNCHANGED:.0%}" if claim == "unchanged" else ""),
            value=float(np.ptp(known)),
            unit="mm",
        )


def _one_reading(table: _Table, first: FamilyRun, second: FamilyRun) -> None:
    """Whether any one ridge surface keeps the hole of both families: the paper says so of both."""
    bottom = float(first.nominal.static_mm.imag.min())
    best, where = np.inf, ""
    for above in (False, True):
        for depth in range(20, 221, 5):
            spreads = []
            for run in (first, second):
                sizes = hole_sizes(run, depth if above else bottom + depth, above)
                spreads.append(np.ptp(sizes) / abs(sizes[run.values.index(run.nominal_value)]))
            worse = float(np.max(spreads))  # not a number where a curve digs no hole there
            if worse < best:
                best = worse
                where = (
                    f"{depth} mm above each curve's lowest point"
                    if above
                    else f"fixed {-(bottom + depth):.0f} mm below O"
                )
    symbols = f"{first.family.symbol} and {second.family.symbol}"
    table.add(
        "one_reading",
        source="4.1, 4.4",
        published=f"{symbols} up: hole basically unchanged [one reading of the surface for both]",
        computed=f"spread {best:.0%} at best, with a surface {where}",
        holds=best <= UNCHANGED,
        reason=f"over {_over(first)} and {_over(second)}; limit {UNCHANGED:.0%}",
        value=best,
        unit="1",
    )


def hole_sizes(run: FamilyRun, surface: float, above_lowest: bool = False) -> list[float]:
    """Hole size in mm for each curve of a family; ``surface`` in machine axes or above each lowest point."""
    return run.each(
        lambda turns: _hole_size(
            turns.dynamic_mm, surface + (float(turns.dynamic_mm.imag.min()) if above_lowest else 0.0)
        )
    )


def _conclusions(table: _Table, runs: dict[str, FamilyRun]) -> None:
    """Section 6, conclusion 2: what each parameter does to height and posture."""
    slopes = {symbol: _slope(runs[symbol], height) for symbol in ("L1", "L4", "L7")}
    table.add(
        "conclusion_height",
        source="6 (2)",
        published="height: L1 and L4 have great influence, L7 little",
        computed=", ".join(f"{symbol} {slope:+.2f}" for symbol, slope in slopes.items()) + " mm per mm",
        holds=abs(slopes["L7"]) < 0.25 * min(abs(slopes["L1"]), abs(slopes["L4"])),
        reason="about the nominal value; little: less than a quarter",
        value=slopes["L7"],
        unit="1",
    )
    run = runs["L7"]
    angles = run.each(lambda turns: float(np.degrees(turns["tip.angle"][:-1].mean())))
    table.add(
        "conclusion_posture",
        source="4.4, 6 (2)",
        published="L7 acts on the angle (posture)",
        computed=f"{_over(run)}: mean nozzle angle {_span([a + 90 for a in angles])} deg from straight down",
        holds=_rises(angles) or _rises(angles[::-1]),
        reason="",
        value=angles[-1] - angles[0],
        unit="deg",
    )


def _refusals(table: _Table, run: FamilyRun) -> None:
    family = run.family
    for member in run.members:
        if member.turns is None:
            # The FMU's message carries all digits of its doubles.
            message = re.sub(r"\d+\.\d{3,}", lambda m: f"{float(m[0]):.3g}", member.refusal)
            table.add(
                f"{family.symbol}_{member.value:g}_refused",
                source=f"{family.section}, fig. {family.figure}",
                published="the values of the curves are not printed",
                computed=f"{family.symbol} = {member.value:g} {family.unit}: out of reach",
                holds=None,
                reason=f"the FMU: {message}",
            )


# --- small helpers -----------------------------------------------------------------------


def _hole_size(dynamic: np.ndarray, surface: float) -> float:
    found = measures.hole(dynamic, surface)
    return found.size if found else float("nan")


def _rises(values: list[float]) -> bool:
    return bool(np.all(np.diff(values) > 0))


def _unchanged(values: list[float], reference: float) -> bool:
    return bool(np.ptp(values) <= UNCHANGED * abs(reference))


def _slope(run: FamilyRun, measure: Callable[[Turns], float]) -> float:
    """Change of a measure per unit of the parameter, between the nominal value's neighbours."""
    values, results = run.values, run.each(measure)
    k = values.index(run.nominal_value)
    return (results[k + 1] - results[k - 1]) / (values[k + 1] - values[k - 1])


def _over(run: FamilyRun) -> str:
    return f"{run.family.symbol} {run.values[0]:g} to {run.values[-1]:g} {run.family.unit}"


def _span(values: list[float]) -> str:
    return f"{values[0]:.1f} to {values[-1]:.1f}"


def _ranges(angles: list[float]) -> str:
    """Angles on the scan's grid as ranges: '60-70, 245-280'."""
    if not angles:
        return "no"
    parts: list[list[float]] = []
    for angle in sorted(angles):
        if parts and angle - parts[-1][-1] <= SCAN_STEP_DEG:
            parts[-1].append(angle)
        else:
            parts.append([angle])
    return ", ".join(f"{p[0]:.0f}-{p[-1]:.0f}" if len(p) > 1 else f"{p[0]:.0f}" for p in parts)
