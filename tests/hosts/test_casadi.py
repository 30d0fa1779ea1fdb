"""What CasADi takes from the FMU besides values: Jacobians, reverse mode, integration with sensitivities.

tests/hosts/foreign/casadi_host.py says how CasADi sees an FMU; test_foreign_hosts.py runs the drives through it.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.conftest import BOTH_VERSIONS
from tests.harness.host import MACHINE_SPEED, PLANTING_SPEED
from tests.hosts.foreign import casadi_host

casadi = pytest.importorskip("casadi")
pytestmark = BOTH_VERSIONS

POINTS = [
    {"crank.phi": 1.3, "crank.w": 5.0, "crank.a": -20.0, "machine.v": 0.4, "tip.fx": 20.0, "tip.fy": -70.0},
    {"crank.phi": -14.0, "crank.w": -6.8, "crank.a": 3.0, "machine.v": -0.1, "tip.fx": -5.0, "tip.fy": 60.0},
]
ARGUMENTS, RESULTS = ["t", "x", "u"], ["ode", "y"]


@pytest.fixture
def builder(fmu_files, version):
    return casadi_host.load(fmu_files[version])


def arguments(builder, point: dict[str, float], travel: float) -> tuple:
    return 2.0, travel, casadi_host.controls(builder, point)


def expected(new, point: dict[str, float], travel: float):
    """The same FMU, driven as the tests drive it."""
    return new(model_exchange=True).setup().enter().set(point | {"machine.s": travel})


@pytest.mark.parametrize("point", POINTS)
def test_rates_and_outputs(builder, new, point):
    """To the bit; the state is set by fmi2SetReal or fmi3SetFloat64."""
    function = builder.create("f", ARGUMENTS, RESULTS)
    for travel in (0.0, 0.25, -7.0):
        rate, outputs = function(*arguments(builder, point, travel))
        names = builder.y()
        assert float(rate) == point["machine.v"]
        assert outputs.full().ravel().tolist() == expected(new, point, travel).get(*names)


@pytest.mark.parametrize("point", POINTS)
def test_jacobians(builder, new, point):
    """By time, state and inputs: what fmi2- or fmi3GetDirectionalDerivative says, structural zeros left out."""
    function = builder.create("f", ARGUMENTS, RESULTS)
    found = function.jacobian()(*arguments(builder, point, 0.25), 0, np.zeros(len(builder.y())))
    instance = expected(new, point, 0.25)
    knowns = [["time"], ["machine.s"], builder.u()]
    unknowns = [["der(machine.s)"], builder.y()]
    for place, block in enumerate(found):
        rows, columns = unknowns[place // 3], knowns[place % 3]
        right = [instance.sensitivity(rows, {name: 1.0}) for name in columns]
        assert block.full().T.tolist() == right, (rows, columns)
    assert found[5].nnz() == 45, "as many as modelDescription.xml lists dependencies of outputs on inputs"


@pytest.mark.parametrize("point", POINTS)
def test_reverse_mode(builder, version, point):
    """The transpose of the Jacobian: in FMI 3.0 by fmi3GetAdjointDerivative, in FMI 2.0, which has none, by columns."""
    function = builder.create("f", ["x", "u"], RESULTS, {"uses_adjoint_derivatives": version == 3})
    at, count = arguments(builder, point, 0.25)[1:], len(builder.y())
    weights = np.linspace(-1.0, 2.0, count)
    rate_by_x, rate_by_u, y_by_x, y_by_u = (block.full() for block in function.jacobian()(*at, 0, np.zeros(count)))
    by_x, by_u = function.reverse(1)(*at, 0, np.zeros(count), 3.0, weights)
    assert by_x.full().ravel() == pytest.approx((3.0 * rate_by_x + weights @ y_by_x).ravel(), rel=1e-13)
    assert by_u.full().ravel() == pytest.approx((3.0 * rate_by_u + weights @ y_by_u).ravel(), rel=1e-13)


def test_a_solver_on_exact_jacobians(builder):
    """Newton's method for the lowest point of the planting stroke, where tip.vy is 0: published at 177.4 deg."""
    function = builder.create("f", ["x", "u"], ["y"])
    phi = casadi.MX.sym("phi")
    inputs = casadi.vertcat(*[phi if name == "crank.phi" else float(name == "crank.w") for name in builder.u()])
    height_rate = function(0.0, inputs)[builder.y().index("tip.vy")]
    solve = casadi.rootfinder("lowest", "newton", {"x": phi, "g": height_rate}, {"abstol": 1e-14})
    assert math.degrees(float(solve(x0=3.0)["x"])) == pytest.approx(177.4, abs=0.05)


def test_cvodes_and_its_sensitivities(builder):
    """The travel of a planted row, and its derivatives by its start and by the speed of every step."""
    turn, steps = 2 * math.pi / PLANTING_SPEED, 10
    times = np.linspace(0.0, turn, steps + 1).tolist()
    speeds = MACHINE_SPEED * (1 + 0.1 * np.arange(steps))
    place = builder.u().index("machine.v")
    inputs = np.zeros((len(builder.u()), steps))
    inputs[place] = speeds
    integrate = casadi_host.integrator(builder, times)
    found = integrate(x0=1.5, u=inputs)["xf"].full().ravel()
    assert found == pytest.approx(1.5 + np.cumsum(speeds) * turn / steps, abs=1e-11)
    by = integrate.jacobian()(x0=1.5, u=inputs)
    assert by["jac_xf_x0"].full().ravel() == pytest.approx(np.ones(steps), abs=1e-11)
    by_speed = by["jac_xf_u"].full()[:, place :: len(builder.u())]
    assert by_speed == pytest.approx(np.tril(np.full((steps, steps), turn / steps)), abs=1e-11)


def test_what_it_does_not_know(builder, version):
    """Fixed parameters are constants to it: set before a function is made of the FMU, and not derived by."""
    assert builder.p() == [] and set(builder.c()) >= {"geometry.L1", "crank.at_step_end"}
    before = builder.create("f", ["x", "u"], ["y"])
    builder.set("geometry.L1", 0.051)
    after = builder.create("f", ["x", "u"], ["y"])
    at = arguments(builder, POINTS[0], 0.0)[1:]
    assert before(*at).full().tolist() != after(*at).full().tolist()
    if version == 2:
        with pytest.raises(RuntimeError, match="adjoint"):
            builder.create("f", ["x", "u"], ["y"], {"uses_adjoint_derivatives": True})
