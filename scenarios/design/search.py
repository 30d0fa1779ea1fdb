"""The searches of a study, job by job: whatever was finished survives the process, and is not done again.

One objective: a search from each random start. Two: the best of each alone, then between them points of the front, each
the best in the second objective with the first no worse than a bound (epsilon-constraint). The bound is put where most
is undecided, between the two neighbours that leave the largest rectangle open; the search starts from either of them,
for they may lie in different valleys.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from scenarios.common.instance import Refused
from scenarios.common.turn import FmuSource
from scenarios.design.problem import Design, Outcome, Problem, best_of
from scenarios.design.study import Constraint, Objective, Study


class Store:
    """Finished jobs in a folder, a JSON file each, written under another name first: never half of one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.glob("*.writing"):
            left.unlink()
        self.known = self.done = 0  # jobs from before, jobs now

    def job(self, name: str, run: Callable[[], Outcome]) -> Outcome:
        """What a job of this name gave, now or before."""
        path = self.folder / f"{name}.json"
        if path.is_file():
            kept = json.loads(path.read_text(encoding="utf-8"))
            self.known += 1
            return Outcome(**{**kept, "design": Design(**kept["design"])})
        found = run()
        writing = path.with_suffix(".writing")
        with writing.open("w", encoding="utf-8") as file:
            json.dump(asdict(found), file, indent=1)
            file.flush()
            os.fsync(file.fileno())
        writing.replace(path)
        self.done += 1
        return found


@dataclass(frozen=True)
class Result:
    """What a study ended with. ``best``: of one objective, or the end of the front in the first; ``front``: by the
    first objective.
    """

    starts: tuple[Outcome, ...]
    best: Outcome
    front: tuple[Outcome, ...]
    turns: int


def jobs(study: Study) -> int:
    """How many a study has."""
    return study.starts if len(study.objectives) == 1 else 2 * study.starts + study.points - 2


def run(
    source: FmuSource, study: Study, published: dict[str, float], store: Store, done: Callable[[], object]
) -> Result:
    """Do what is missing of a study. Raises Refused where no start makes a turn."""

    def from_starts(of: Study, label: str) -> tuple[Outcome, ...]:
        found = []
        for number in range(study.starts):

            def search(number: int = number) -> Outcome:
                problem = Problem(source, of, published)
                outcome = problem.search(problem.random(np.random.default_rng([study.seed, number])))
                return replace(outcome, turns=problem.turns)

            found.append(store.job(f"{label}-{number + 1}", search))
            done()
        return tuple(found)

    if len(study.objectives) == 1:
        starts = from_starts(study, "start")
        return Result(starts, best_of(starts, study), (), sum(each.turns for each in starts))

    ends = [from_starts(alone(study, k), name) for k, name in enumerate(("first", "second"))]
    narrow, wide = (best_of(each, alone(study, k)) for k, each in enumerate(ends))
    every = [*ends[0], *ends[1]]
    if not (narrow.is_feasible and wide.is_feasible):
        return Result(tuple(every), narrow, (), sum(each.turns for each in every))
    front = _not_beaten([narrow, wide], study)
    for number in range(2, study.points):

        def search(front: tuple[Outcome, ...] = front) -> Outcome:
            return _between(source, study, published, front)

        found = store.job(f"point-{number + 1}", search)
        done()
        every.append(found)
        front = _not_beaten([*front, found], study)
    return Result(tuple(ends[0]), narrow, front, sum(each.turns for each in every))


def _between(source: FmuSource, study: Study, published: dict[str, float], front: tuple[Outcome, ...]) -> Outcome:
    """A point of the front where most is undecided; its bound is in the middle of the gap."""
    first, second = study.objectives
    places = [[outcome.values[each.measure] for each in (first, second)] for outcome in front]
    gaps = [abs((b[0] - a[0]) * (b[1] - a[1])) for a, b in pairwise(places)]
    if not gaps:
        return replace(front[0], turns=0)
    k = int(np.argmax(gaps))
    within = bounded(study, (places[k][0] + places[k + 1][0]) / 2)
    problem, found = Problem(source, within, published), []
    for near in front[k : k + 2]:
        with contextlib.suppress(Refused):
            found.append(problem.search(problem.z_of(near.design)))
    return replace(best_of(found or [front[k]], within), turns=problem.turns)


def _limit(objective: Objective, bound: float) -> Constraint:
    return Constraint((objective.measure,), *((None, bound) if objective.sign > 0 else (bound, None)))


def alone(study: Study, number: int) -> Study:
    """One objective alone, the other no worse than the reference of the front."""
    other = 1 - number
    more = (_limit(study.objectives[other], study.reference[other]),) if study.reference else ()
    return replace(study, objectives=(study.objectives[number],), constraints=(*study.constraints, *more))


def bounded(study: Study, bound: float) -> Study:
    """The second objective alone, the first no worse than a bound."""
    first, second = study.objectives
    return replace(study, objectives=(second,), constraints=(*study.constraints, _limit(first, bound)))


def _not_beaten(outcomes: list[Outcome], study: Study) -> tuple[Outcome, ...]:
    """Those feasible that no other is as good as in both and better in one, by the first objective."""

    def key(outcome: Outcome) -> tuple[float, ...]:
        return tuple(each.sign * outcome.values[each.measure] for each in study.objectives)

    kept: list[Outcome] = []
    for each in sorted((each for each in outcomes if each.is_feasible), key=key):
        if not kept or key(each)[1] < key(kept[-1])[1] - 1e-9:
            kept.append(each)
    return tuple(kept)


def hypervolume(points: np.ndarray, reference: tuple[float, ...]) -> float:
    """The area that points (two columns, small is good) beat, up to a reference."""
    area, height = 0.0, reference[1]
    for x, y in sorted(map(tuple, points)):
        if x < reference[0] and y < height:
            area += (reference[0] - x) * (height - y)
            height = y
    return area
