"""The loop over a turn of the built FMU: in both FMI versions the numbers of the solver, and clear refusals."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from mpmath import mp, mpf
from transplanter_linkage import Geometry, Kinematics
from transplanter_linkage.measures import GEOMETRY, KNOWNS, MASSES, MEASURES, TORQUE, NoMeasure, Operation, Turn

from fmu_src.oracle.dynamics import Dynamics
from fmu_src.oracle.oracle import Oracle
from scenarios.common.instance import FmuError, Refused
from scenarios.common.masses import plausible
from scenarios.common.turn import FmuSource

DIGITS, ROUND, GRAVITY = 90, 60, 9.80665
OTHER = {"L1": 0.047, "L7": 0.253, "theta3": 0.5}


@pytest.fixture(scope="module", params=[2, 3])
def source(request, fmu_files):
    with FmuSource(fmu_files[request.param]) as opened:
        yield opened


def test_poses_and_gradients_are_those_of_the_solver(source):
    source.set(OTHER)
    solver, phi = Kinematics(Geometry(**OTHER)), np.linspace(-7, 7, 41)
    weights = np.random.default_rng(1).normal(size=(41, 8))
    for mine, other in zip(source.sample(phi), solver.sample(phi), strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(source.gradient(phi, weights), solver.gradient(phi, weights), rtol=1e-11, atol=1e-13)
    np.testing.assert_array_equal(  # the same angle again is not set again
        source.gradient(np.repeat(phi[:2], 2), np.repeat(weights[:2], 2, axis=0))[::2],
        source.gradient(phi, weights)[:2],
    )


def test_measures_and_their_gradients_are_those_of_the_solver(source):
    operation = Operation(spacing=0.38, body=0.02)
    mine = Turn(source.set(OTHER), operation)
    other = Turn(Kinematics(Geometry(**OTHER)), operation)
    for name in set(MEASURES) - set(TORQUE):
        assert mine[name].value == pytest.approx(other[name].value, rel=1e-9)
        np.testing.assert_allclose(mine[name].gradient, other[name].gradient, rtol=1e-9, atol=1e-10)


def exact_torque(values, w, name, near):
    """To 50 digits, of geometry and masses in the order of KNOWNS without the operation: by Lagrange's equation."""
    masses = {key.removeprefix("body."): each for key, each in zip(MASSES, values[len(GEOMETRY) :], strict=True)}
    oracle = Oracle(dict(zip(GEOMETRY, values, strict=False)), DIGITS)
    dynamics = Dynamics(oracle, masses, GRAVITY)

    def torque(phi):
        return dynamics.outputs(phi, w, 0, (0, 0), (0, 0))["crank.tau"]

    if name == "rms_torque":
        return mp.sqrt(sum(torque(2 * mp.pi * k / ROUND) ** 2 for k in range(ROUND)) / ROUND)
    step = mpf(10) ** -15
    slope = (torque(near + step) - torque(near - step)) / (2 * step)
    curve = (torque(near + step) - 2 * torque(near) + torque(near - step)) / step**2
    return abs(torque(near - slope / curve))  # the code's angle is good to 1e-9: one step of Newton is exact


@pytest.mark.parametrize("name", TORQUE)
def test_torque_and_its_gradient_by_geometry_masses_and_speed_against_50_digits(source, name):
    """Along a random direction in all of them at once; 1e-9 is asked for."""
    bodies, w = plausible(source.nominal), 7.1
    geometry = source.nominal | OTHER
    turn = Turn(source.set(geometry, bodies), Operation(w=w), nodes=ROUND * 6)
    found = turn[name]
    at = [geometry[key] for key in GEOMETRY] + [bodies[key] for key in MASSES]
    columns = [KNOWNS.index(key) for key in (*GEOMETRY, *MASSES)]
    gradient = found.gradient[columns]
    assert not found.gradient[[KNOWNS.index(key) for key in ("spacing", "depth", "body", "seedling")]].any()
    direction = np.random.default_rng(3).normal(size=len(at)) * np.maximum(np.abs(at), 1e-4)
    by_speed = found.gradient[KNOWNS.index("w")]
    with mp.workdps(DIGITS):
        small, near = mpf(10) ** -14, mpf(found.phi[0]) if name == "peak_torque" else None
        assert found.value == pytest.approx(float(exact_torque(at, w, name, near)), rel=1e-11)
        moved = [
            exact_torque([mpf(a) + side * small * mpf(d) for a, d in zip(at, direction, strict=True)],
                         w + side * small, name, near)
            for side in (1, -1)
        ]  # fmt: skip
        slope = float((moved[0] - moved[1]) / (2 * small))
    whole = np.abs(gradient * direction).sum() + abs(by_speed)
    assert abs(slope - (gradient @ direction + by_speed)) < 1e-9 * whole


def test_torque_is_none_without_masses_and_leaves_the_motion_alone(source):
    source.set({})
    with pytest.raises(NoMeasure, match="no body has a mass"):
        Turn(source)["rms_torque"]
    before = Turn(source).measure()
    source.bodies = plausible(source.nominal)
    try:
        with_masses = Turn(source.set({})).measure()
        assert with_masses["peak_torque"] > with_masses["rms_torque"] > 0
        assert all(with_masses[name] == before[name] for name in set(MEASURES) - set(TORQUE))
    finally:
        source.bodies = {}
    assert np.isnan(Turn(source.set({})).measure("peak_torque")["peak_torque"])


def test_what_is_not_named_is_nominal_again(source):
    first = Turn(source.set({}))["height"].value
    assert Turn(source.set({"L1": 0.047}))["height"].value != first
    assert Turn(source.set({}))["height"].value == first == pytest.approx(0.33465, abs=1e-5)


def test_a_refusal_names_dyad_angle_and_gap_and_the_source_goes_on(source):
    with pytest.raises(Refused, match=r"dyad ABD at crank\.phi = .* mm too long for the two links"):
        Turn(source.set({"L1": 0.065}))
    with pytest.raises((Refused, FMICallException), match=r"geometry\.L2"):
        Turn(source.set({"L2": -1.0}))
    assert Turn(source.set({}))["margin"].value == pytest.approx(0.5449, abs=1e-4)


def test_a_closed_source_says_so(fmu_files):
    with FmuSource(fmu_files[3]) as closed:
        turn = Turn(closed)
        lacking = turn.measure("peak_torque")
    np.testing.assert_equal(turn.measure("peak_torque"), lacking)  # not asked again
    for ask in (lambda: turn["height"], lambda: closed.set({}), lambda: closed.torque(turn.phi, 1.0)):
        with pytest.raises(FmuError, match="after it was closed"):
            ask()


def test_another_fmu_is_no_linkage(tmp_path, fmu_files):
    with pytest.raises(FmuError, match="There is no FMU"):
        FmuSource(tmp_path / "none.fmu")
