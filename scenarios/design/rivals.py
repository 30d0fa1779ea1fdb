"""Evolution and swarm on the same problem, from pymoo: what a front costs without gradients.

They see the same measures of the same FMU, of a whole turn each, and the same constraints; they are given as many times
the turns as is said, and a seed each.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable

import numpy as np

from scenarios.design.problem import REFUSED, Problem

POPULATION = 100
METHODS = ("NSGA-II", "CMOPSO")


def available() -> bool:
    """Whether pymoo is installed (the group bench)."""
    return importlib.util.find_spec("pymoo") is not None


def run(problem: Problem, method: str, turns: int, seed: int, done: Callable[[int], object]) -> np.ndarray:
    """The feasible front that a method reaches in so many turns: a row each, the objectives in SI units."""
    from pymoo.algorithms.moo.cmopso import CMOPSO
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    objectives, size = problem.study.objectives, len(problem.names)

    class Turns(ElementwiseProblem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(n_var=size, n_obj=len(objectives), n_ieq_constr=len(problem.limits), xl=-1.0, xu=1.0)

        def _evaluate(self, z: np.ndarray, out: dict, *_: object, **__: object) -> None:
            done(1)
            turn = problem._turn_at(z)
            if turn is None:
                out["F"], out["G"] = [REFUSED] * len(objectives), [REFUSED] * len(problem.limits)
                return
            values = {name: turn[name].value for name in problem.measures}
            out["F"] = [each.sign * values[each.measure] for each in objectives]
            out["G"] = list(problem.beyond(values).values())

    algorithm = {"NSGA-II": NSGA2, "CMOPSO": CMOPSO}[method](pop_size=POPULATION)
    found = minimize(Turns(), algorithm, ("n_eval", turns), seed=seed, verbose=False)
    if found.F is None:
        return np.empty((0, len(objectives)))
    return np.atleast_2d(found.F) * [each.sign for each in objectives]
