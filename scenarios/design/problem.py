"""A study as a smooth problem, solved by sequential quadratic programming (scipy's SLSQP) with exact gradients.

An extreme is no smooth function of the design. Here each that is to be small becomes an unknown of its own, kept above
the extremes of all windows of the turn (measures.Part), which are smooth; a measure with two of them, greatest less
least, has two. A pose that the FMU refuses answers with values so bad that the line search steps back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize, nnls
from transplanter_linkage.measures import GEOMETRY, KNOWNS, MASSES, MEASURES, Found, NoMeasure, Operation, Turn

from scenarios.common.instance import Refused
from scenarios.common.masses import with_counterweight
from scenarios.common.turn import FmuSource
from scenarios.common.variants import PHASE, Variant
from scenarios.design.study import COUNTERWEIGHT, Constraint, Study

FEASIBLE = 1e-6  # of a constraint's scale: how far beyond its limit a design may be
REFUSED = 1e3  # scaled value of everything where there is no design
TRIALS = 2000  # random designs drawn until one makes a whole turn
ROUNDS, STEPS = 5, 150  # SLSQP anew from where it ended; its iterations
DENSE = 7200  # angles a turn, at which a result is checked


@dataclass(frozen=True)
class Design:
    """A point of a study: its parameters by name, SI units."""

    x: dict[str, float]

    def variant(self, name: str, nominal: dict[str, float]) -> Variant:
        """As the other scenarios take it: what differs from the published geometry."""
        changes = {key: value for key, value in self.x.items() if key in (*GEOMETRY, PHASE)}
        whole = Variant(name, changes).geometry(nominal)
        return Variant(name, {key: value for key, value in whole.items() if value != nominal[key]})


@dataclass(frozen=True)
class Outcome:
    """What a search ended with. ``values``: the measures that the study names, SI; ``beyond``: the worst violation of a
    constraint, scaled; ``turns``: whole turns computed on the way.
    """

    design: Design
    values: dict[str, float]
    beyond: float
    turns: int
    note: str = ""

    @property
    def is_feasible(self) -> bool:
        return self.beyond <= FEASIBLE


@dataclass(frozen=True)
class Rows:
    """Inequalities >= 0, scaled, and their gradients by z; ``of``: the number of the study's limit, -1: of none."""

    values: np.ndarray
    gradients: np.ndarray
    of: np.ndarray


@dataclass(frozen=True)
class Limit:
    """One side of a constraint: sense * measure <= bound."""

    constraint: int
    sense: int
    bound: float


class Problem:
    """The functions of a study over z: the parameters, each from -1 to 1, then the unknown extremes."""

    def __init__(self, source: FmuSource, study: Study, published: dict[str, float]) -> None:
        self.source, self.study = source, study
        self.turns = 0
        self.names = [each.name for each in study.ranges]
        self.middle = np.array([(each.high + each.low) / 2 for each in study.ranges])
        self.half = np.array([(each.high - each.low) / 2 for each in study.ranges])
        self.measures = list(
            dict.fromkeys(
                [each.measure for each in study.objectives] + [m for each in study.constraints for m in each.measures]
            )
        )
        # What a measure is divided by: its published value, or one of the units that it is shown in.
        self.scale = {
            name: max(
                abs(published[name]) if math.isfinite(published[name]) else 0.0,
                0.1 if MEASURES[name].unit == "1" else 1 / MEASURES[name].scale,
            )
            for name in self.measures
        }
        self.limits = [
            Limit(number, sense, bound)
            for number, each in enumerate(study.constraints)
            for sense, bound in ((1, each.most), (-1, None if each.least is None else -each.least))
            if bound is not None
        ]
        self._slacks: list[tuple[str, int, int]] | None = None  # (measure, part, sense)
        self._at: tuple[bytes, Turn | None] | None = None
        self._last: tuple[float, np.ndarray, Rows] | None = None

    def _chain(self, z: np.ndarray) -> np.ndarray:
        """The derivative of KNOWNS by z."""
        chain = np.zeros((len(KNOWNS), len(self.names)))
        x = self.design(z).x
        for k, name in enumerate(self.names):
            if name in COUNTERWEIGHT:
                crank, by = self._crank(x)
                chain[[KNOWNS.index(each) for each in crank], k] = by[:, COUNTERWEIGHT.index(name)] * self.half[k]
                continue
            chain[KNOWNS.index("phi4" if name == PHASE else name), k] = self.half[k]
            if name == "phi1" and PHASE in self.names:
                chain[KNOWNS.index("phi4"), k] = self.half[k]
        return chain

    # ---- designs ------------------------------------------------------------------------------------

    def design(self, z: np.ndarray) -> Design:
        """The parameters at z."""
        x = self.middle + self.half * z[: len(self.names)]
        return Design(dict(zip(self.names, map(float, x), strict=True)))

    def z_of(self, design: Design) -> np.ndarray:
        """The parameters' part of z."""
        return (np.array([design.x[name] for name in self.names]) - self.middle) / self.half

    def operation(self, design: Design) -> Operation:
        """With the spacing of the design."""
        return replace(self.study.operation, spacing=design.x.get("spacing", self.study.operation.spacing))

    def masses(self, design: Design) -> dict[str, float]:
        """Of the bodies of the design."""
        varied = {name: value for name, value in design.x.items() if name in MASSES}
        crank = self._crank(design.x)[0] if set(design.x) & set(COUNTERWEIGHT) else {}
        return {**self.study.masses, **varied, **crank}

    def _crank(self, x: Mapping[str, float]) -> tuple[dict[str, float], np.ndarray]:
        """Crank OA with its counterweight."""
        return with_counterweight(self.study.masses, *(x.get(name, 0.0) for name in COUNTERWEIGHT))

    def turn(self, design: Design, nodes: int = 360) -> Turn:
        """Raises Refused."""
        self.turns += 1
        self.source.set(design.variant("", self.source.nominal).geometry(self.source.nominal), self.masses(design))
        return Turn(self.source, self.operation(design), nodes)

    def random(self, chance: np.random.Generator) -> np.ndarray:
        """A z of a design that makes a whole turn and has all measures; raises Refused after TRIALS without one."""
        for _ in range(TRIALS):
            z = chance.uniform(-1, 1, len(self.names))
            if self._turn_at(z) is not None:
                return z
        raise Refused(f"none of {TRIALS} random designs makes a whole turn that reaches the ridge")

    # ---- functions ----------------------------------------------------------------------------------

    def _turn_at(self, z: np.ndarray) -> Turn | None:
        """None where there is none, or where it lacks a measure of the study."""
        key = z[: len(self.names)].tobytes()
        if self._at is None or self._at[0] != key:
            try:
                turn = self.turn(self.design(z))
                if not all(math.isfinite(turn[name].value) for name in self.measures):
                    turn = None
            except (Refused, NoMeasure):
                turn = None
            self._at = key, turn
        return self._at[1]

    def unknown_extremes(self, turn: Turn) -> list[tuple[str, int, int]]:
        """Which parts of which measures have an unknown of their own; the same for all designs."""
        if self._slacks is None:
            wanted = [(each.measure, each.sign) for each in self.study.objectives[:1]]
            for limit in self.limits:
                names = self.study.constraints[limit.constraint].measures
                if len(names) == 1 and len(_extremes(turn[names[0]], limit.sense)) > 1:
                    wanted.append((names[0], limit.sense))
            found = [(name, k, sense) for name, sense in wanted for k in _extremes(turn[name], sense)]
            self._slacks = list(dict.fromkeys(found))
        return self._slacks

    def start(self, z: np.ndarray) -> np.ndarray | None:
        """z with its unknown extremes, at what they are there; None where there is no turn."""
        turn = self._turn_at(z)
        if turn is None:
            return None
        slacks = []
        for name, k, sense in self.unknown_extremes(turn):
            factor, part = turn[name].parts[k]
            slacks.append(sense * factor * part.values[part.at] / self.scale[name])
        return np.append(z[: len(self.names)], slacks)

    def evaluate(self, z: np.ndarray) -> tuple[float, np.ndarray, Rows]:
        """The first objective, its gradient, and all inequalities, scaled."""
        turn = self._turn_at(z)
        if turn is None:
            assert self._last is not None, "a search starts where there is a turn"
            _, gradient, rows = self._last
            return REFUSED, gradient, Rows(np.full_like(rows.values, -REFUSED), rows.gradients, rows.of)
        objective = self.study.objectives[0]
        f, gradient = self._expression(turn, objective.measure, objective.sign, z)
        blocks = [self._epigraph(turn, z, slack) for slack in self.unknown_extremes(turn)]
        blocks += [self._limit(turn, z, number) for number in range(len(self.limits))]
        rows = Rows(*(np.concatenate(each) for each in zip(*blocks, strict=True))) if blocks else _no_rows(len(z))
        self._last = f, gradient, rows
        return self._last

    def _by_z(self, rows: np.ndarray, z: np.ndarray) -> np.ndarray:
        by_z = np.zeros((*rows.shape[:-1], len(z)))
        by_z[..., : len(self.names)] = rows @ self._chain(z)
        return by_z

    def _expression(self, turn: Turn, name: str, sense: int, z: np.ndarray) -> tuple[float, np.ndarray]:
        """sense * measure, scaled, its extremes by their unknowns where they have some."""
        value, gradient = 0.0, np.zeros(len(z))
        for k, (factor, part) in enumerate(turn[name].parts):
            if (name, k, sense) in (self._slacks or ()):
                slot = len(self.names) + self._slacks.index((name, k, sense))
                value += z[slot]
                gradient[slot] += 1.0
            else:
                value += sense * factor * float(part.values[part.at]) / self.scale[name]
                gradient += sense * factor * self._by_z(part.gradients[part.at], z) / self.scale[name]
        return value, gradient

    def _epigraph(self, turn: Turn, z: np.ndarray, slack: tuple[str, int, int]) -> tuple[np.ndarray, ...]:
        """The unknown is at least each window's extreme."""
        name, k, sense = slack
        factor, part = turn[name].parts[k]
        slot = len(self.names) + self.unknown_extremes(turn).index(slack)
        values = z[slot] - sense * factor * part.values / self.scale[name]
        gradients = -sense * factor * self._by_z(part.gradients, z) / self.scale[name]
        gradients[:, slot] += 1.0
        return values, gradients, np.full(len(values), -1)

    def _limit(self, turn: Turn, z: np.ndarray, number: int) -> tuple[np.ndarray, ...]:
        """A limit of the study, of each window where its measure is one extreme."""
        limit = self.limits[number]
        constraint = self.study.constraints[limit.constraint]
        if constraint.near and len(constraint.measures) > 1:
            return self._near(turn, z, number, constraint)
        name = constraint.measures[0]
        bound, parts = limit.bound / self.scale[name], turn[name].parts
        extremes = _extremes(turn[name], limit.sense)
        if len(extremes) == 1 and len(parts) == 1:
            factor, part = parts[0]
            values = bound - limit.sense * factor * part.values / self.scale[name]
            gradients = -limit.sense * factor * self._by_z(part.gradients, z) / self.scale[name]
            return values, gradients, np.full(len(values), number)
        value, gradient = self._expression(turn, name, limit.sense, z)
        return np.array([bound - value]), -gradient[None], np.array([number])

    def _near(self, turn: Turn, z: np.ndarray, number: int, constraint: Constraint) -> tuple[np.ndarray, ...]:
        """radius^2 - distance^2, over twice the radius: as steep at the limit as the distance itself."""
        radius = self.limits[number].bound
        value, gradient = radius / 2, np.zeros((1, len(z)))
        for name, place in zip(constraint.measures, constraint.near, strict=True):
            found = turn[name]
            value -= (found.value - place) ** 2 / (2 * radius)
            gradient -= (found.value - place) / radius * self._by_z(found.gradient[None], z)
        return np.array([value / radius]), gradient / radius, np.array([number])

    # ---- search -------------------------------------------------------------------------------------

    def search(self, z: np.ndarray) -> Outcome:
        """From the parameters' part of a z to a best design nearby. Raises Refused where that makes no turn."""
        turns = self.turns
        best = self.start(z)
        if best is None:
            raise Refused("the design that the search is to start from makes no whole turn")
        outcome, note = self.outcome(best), ""
        for number in range(ROUNDS):
            found, note = self._slsqp(best, elastic=False)
            now = self.outcome(found)
            better = _better(now, outcome, self.study.objectives[0].measure, self.study.objectives[0].sign)
            gain = _gain(now, outcome, self)
            if better:
                best, outcome = found, now
            if not outcome.is_feasible:
                relaxed = self.outcome(self._slsqp(best, elastic=True)[0])
                if relaxed.beyond < outcome.beyond:
                    start = self.start(self.z_of(relaxed.design))
                    best, outcome, gain = best if start is None else start, relaxed, math.inf
            if number > 0 and gain < 1e-5:
                break
        return replace(outcome, turns=self.turns - turns, note=note)

    def _slsqp(self, z: np.ndarray, elastic: bool) -> tuple[np.ndarray, str]:
        """Where SLSQP ends, and what it says. elastic: all inequalities may be missed by one unknown, made small."""
        size = len(z) + elastic
        first = np.append(z, max(0.0, -float(self.evaluate(z)[2].values.min(initial=0.0)))) if elastic else z
        bounds = [(-1.0, 1.0)] * len(self.names) + [(None, None)] * (len(z) - len(self.names)) + [(0.0, None)] * elastic

        def objective(z: np.ndarray) -> tuple[float, np.ndarray]:
            if elastic:
                return float(z[-1]), np.eye(size)[-1]
            f, gradient, _ = self.evaluate(z)
            return f, gradient

        def values(z: np.ndarray) -> np.ndarray:
            rows = self.evaluate(z[: size - elastic])[2]
            return rows.values + z[-1] if elastic else rows.values

        def gradients(z: np.ndarray) -> np.ndarray:
            rows = self.evaluate(z[: size - elastic])[2].gradients
            return np.hstack([rows, np.ones((len(rows), 1))]) if elastic else rows

        found = minimize(
            objective,
            first,
            jac=True,
            method="SLSQP",
            bounds=bounds,
            constraints=[{"type": "ineq", "fun": values, "jac": gradients}],
            options={"maxiter": STEPS, "ftol": 1e-9},
        )
        end = np.clip(found.x[: len(self.names)], -1, 1)
        started = self.start(end) if np.all(np.isfinite(end)) else None
        return (z if started is None else started), str(found.message)

    def outcome(self, z: np.ndarray) -> Outcome:
        """What is reached at z, its extremes as they are."""
        turn = self._turn_at(z)
        assert turn is not None, "a search ends where there is a turn"
        values = {name: turn[name].value for name in self.measures}
        return Outcome(self.design(z), values, max([0.0, *(self.beyond(values).values())]), 0)

    def beyond(self, values: dict[str, float]) -> dict[int, float]:
        """By how much, scaled, each limit is missed; below 0 where it is kept."""
        found = {}
        for number, limit in enumerate(self.limits):
            constraint = self.study.constraints[limit.constraint]
            if constraint.near:
                far = math.dist([values[name] for name in constraint.measures], constraint.near)
                found[number] = (far - limit.bound) / limit.bound
            else:
                name = constraint.measures[0]
                found[number] = (limit.sense * values[name] - limit.bound) / self.scale[name]
        return found

    def missed(self, values: dict[str, float]) -> list[str]:
        """A sentence for each limit that is not kept."""
        said = []
        for number, scaled in self.beyond(values).items():
            if scaled > FEASIBLE:
                constraint = self.study.constraints[self.limits[number].constraint]
                measure = MEASURES[constraint.measures[0]]
                by = scaled * (self.limits[number].bound if constraint.near else self.scale[constraint.measures[0]])
                unit = "" if measure.unit == "1" else f" {measure.unit}"
                said.append(f"{constraint.text} is missed by {measure.shown(by):.4g}{unit}")
        return said

    # ---- what limits a design -----------------------------------------------------------------------

    def multipliers(self, design: Design) -> tuple[dict[int, float], dict[str, float], float]:
        """At a best design: what the objective would gain for each unit by which a limit, or the end of a parameter's
        range, gave way, SI units; and the part of the objective's gradient that they leave over, 0 at an optimum.
        """
        z = self.start(self.z_of(design))
        assert z is not None
        _, gradient, rows = self.evaluate(z)
        active = np.flatnonzero(rows.values < 1e-5)
        ends = [k for k in range(len(self.names)) if abs(z[k]) > 1 - 1e-7]
        columns = [rows.gradients[k] for k in active]
        columns += [-np.sign(z[k]) * np.eye(len(z))[k] for k in ends]
        if not columns:
            return {}, {}, float(np.linalg.norm(gradient))
        force, left = nnls(np.array(columns).T, gradient)
        per = self.scale[self.study.objectives[0].measure]
        by_limit: dict[int, float] = {}
        for k, value in zip(active, force, strict=False):
            number = int(rows.of[k])
            if number >= 0 and value > 0:
                constraint = self.study.constraints[self.limits[number].constraint]
                scale = self.limits[number].bound if constraint.near else self.scale[constraint.measures[0]]
                by_limit[number] = by_limit.get(number, 0.0) + value * per / scale
        by_end = {
            self.names[k]: value * per / self.half[k] for k, value in zip(ends, force[len(active) :], strict=True)
        }
        return by_limit, by_end, float(left)


def _no_rows(size: int) -> Rows:
    return Rows(np.zeros(0), np.zeros((0, size)), np.zeros(0, dtype=int))


def _extremes(found: Found, sense: int) -> list[int]:
    """The parts that are greatest of several where sense * measure is to be small."""
    return [k for k, (factor, part) in enumerate(found.parts) if sense * factor * part.sign > 0]


def _better(one: Outcome, other: Outcome, measure: str, sign: int) -> bool:
    if one.is_feasible != other.is_feasible:
        return one.is_feasible
    if not one.is_feasible:
        return one.beyond < other.beyond
    return sign * one.values[measure] < sign * other.values[measure]


def _gain(one: Outcome, other: Outcome, problem: Problem) -> float:
    """How much better, scaled; infinite where one is feasible and the other not."""
    if one.is_feasible != other.is_feasible:
        return math.inf
    if not one.is_feasible:
        return other.beyond - one.beyond
    objective = problem.study.objectives[0]
    name = objective.measure
    return objective.sign * (other.values[name] - one.values[name]) / problem.scale[name]


def best_of(outcomes: Sequence[Outcome], study: Study) -> Outcome:
    """The best feasible one, else the one that misses its constraints the least."""
    best = outcomes[0]
    for each in outcomes[1:]:
        if _better(each, best, study.objectives[0].measure, study.objectives[0].sign):
            best = each
    return best
