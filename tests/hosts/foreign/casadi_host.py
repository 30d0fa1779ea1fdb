"""CasADi: a framework of automatic differentiation and optimal control.

Its DaeBuilder takes an FMU as the functions of an ordinary differential equation, with Jacobians from fmi2- or
fmi3GetDirectionalDerivative and, in FMI 3.0, reverse mode from fmi3GetAdjointDerivative. CVODES integrates, of
SUNDIALS; the inputs are held over each step, as CasADi does with controls.

It does not know Co-Simulation, and takes fixed parameters as constants. Second derivatives are differences of first.
"""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import numpy as np

from tests.hosts.drives import INPUTS, OUTPUTS
from tests.hosts.foreign import Rows, Task, missing_package

NAME, PACKAGE = "CasADi", "PyPI casadi"
INTERFACES = {("2.0", "ME"), ("3.0", "ME")}
FEEDING = "controls, CVODES"
DEFECTS: dict = {}
STATE = "machine.s"
EXACT = {"abstol": 1e-13, "reltol": 1e-13}  # of CVODES


def missing() -> str:
    return missing_package("casadi")


def version() -> str:
    return importlib.metadata.version("casadi")


def load(fmu: Path):
    """The FMU as CasADi's DaeBuilder."""
    import casadi

    builder = casadi.DaeBuilder("linkage", str(fmu))
    assert builder.x() == [STATE], builder.x()
    return builder


def integrator(builder, times: list[float]):
    """CVODES around the FMU: states at all times but the first, from x0 and the inputs of each step."""
    import casadi

    rates = builder.create("rates", ["t", "x", "z", "p", "u"], ["ode", "alg", "quad", "zero"])
    return casadi.integrator("travel", "cvodes", rates, times[0], times[1:], EXACT)


def controls(builder, values: dict[str, float]) -> list[float]:
    """All of the builder's inputs, in its order; 0 where nothing is given."""
    return [float(values.get(name, 0.0)) for name in builder.u()]


def play(task: Task) -> Rows:
    builder = load(task.fmu)
    given = np.array([controls(builder, dict(zip(INPUTS, task.drive.inputs(t), strict=True))) for t in task.times])
    travelled = integrator(builder, task.times)(x0=0.0, u=given[:-1].T)["xf"]
    values = builder.create("values", ["x", "u"], ["y"])
    places = [builder.y().index(name) for name in OUTPUTS]
    for i, time in enumerate(task.times[1:]):
        found = values(travelled[i], given[i + 1])
        yield time, [float(found[place]) for place in places]
