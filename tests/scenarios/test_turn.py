"""The loop over a turn of the built FMU: in both FMI versions the numbers of the solver, and clear refusals."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from transplanter_linkage import Geometry, Kinematics
from transplanter_linkage.measures import MEASURES, Operation, Turn

from scenarios.common.instance import FmuError, Refused
from scenarios.common.turn import FmuSource

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
    for name in MEASURES:
        assert mine[name].value == pytest.approx(other[name].value, rel=1e-9)
        np.testing.assert_allclose(mine[name].gradient, other[name].gradient, rtol=1e-9, atol=1e-10)


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


def test_another_fmu_is_no_linkage(tmp_path, fmu_files):
    with pytest.raises(FmuError, match="There is no FMU"):
        FmuSource(tmp_path / "none.fmu")
