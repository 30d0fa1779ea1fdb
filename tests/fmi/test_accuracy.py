"""The FMU's outputs are exact to rounding: against 50-digit references, also at and near dead points."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from mpmath import mp, mpf

from fmu_src.oracle.oracle import Oracle, conditioning, error
from fmu_src.oracle.tables import Row, rows
from fmu_src.twin.linkage import Geometry, solve
from tests.conftest import BOTH_VERSIONS
from tests.harness.dead_points import DEAD_POINTS, beside_dead_point
from tests.harness.host import DISCARD, PLANTING_SPEED, Instance

TIP = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay")
BOUNDS = (1e-15, 1e-14, 2e-13, 4e-12)  # m, m/s, m/s2, m/s3 at 65 plants a minute
NAMES = ("position", "velocity", "acceleration", "jerk")


def jerk_and_more(instance: Instance, order: int) -> list[float]:
    """The third to the `order`-th derivative of the tip by time: x, y, x, y..."""
    return instance.get_derivatives(*[(name, n) for n in range(1, order - 1) for name in ("tip.ax", "tip.ay")])


def with_geometry(instance: Instance, geometry: dict[str, float], inputs: dict[str, float]) -> Instance:
    """Start the instance again with this geometry and these inputs."""
    instance.demand(instance.call("fmi2Reset"), "fmi2Reset")
    return instance.initialize({f"geometry.{name}": value for name, value in geometry.items()} | inputs)


def check_nominal(row: Row, found: list[float]) -> None:
    for n, name in enumerate(NAMES[: len(found) // 2]):
        for axis in (0, 1):
            with mp.workdps(50):
                exact = row.exact[n][axis] * mpf(PLANTING_SPEED) ** n
            off = error(found[2 * n + axis], exact)
            assert off <= BOUNDS[n], f"{row}: {name} {'xy'[axis]} off by {off:.3g}"


# ---- the nominal geometry at the published speed -------------------------------------------------


@BOTH_VERSIONS
def test_nominal_geometry_read_in_initialization_mode(new):
    """Outputs follow the inputs as set (FMI 2.0.4, section 4.2.4: initialization mode)."""
    instance = new().setup().enter()
    for row in rows("nominal"):
        instance.set({"crank.phi": row.phi, "crank.w": PLANTING_SPEED})
        check_nominal(row, instance.get(*TIP))


@BOTH_VERSIONS
def test_nominal_geometry_read_after_a_step(new):
    """With crank.at_step_end the outputs after a step belong to the inputs of that step."""
    instance = new().initialize({"crank.at_step_end": True, "crank.w": PLANTING_SPEED})
    for number, row in enumerate(sorted(rows("nominal"), key=lambda row: row.phi)):
        instance.step(float(number), 1.0, {"crank.phi": row.phi, "crank.w": PLANTING_SPEED})
        check_nominal(row, instance.get(*TIP) + jerk_and_more(instance, 3))


def test_nominal_geometry_with_input_derivatives(new):
    """A step over which the host's derivatives lead exactly to the angle wanted."""
    instance = new().initialize()
    for number, row in enumerate(rows("nominal")):
        instance.set({"crank.phi": row.phi - 1.0}).set_derivatives({("crank.phi", 1): 1.0})
        instance.step(float(number), 1.0)
        landed = instance.get("tip.x", "tip.y")
        with mp.workdps(50):
            exact = Oracle(row.geometry).tip((row.phi - 1.0) + 1.0, 0)[0]
        assert max(error(found, wanted) for found, wanted in zip(landed, exact, strict=True)) <= BOUNDS[0], row


# ---- any geometry: no error beyond what the rounding of the inputs does --------------------------


def check_tip(instance: Instance, geometry: dict[str, float], phi: float, order: int, exact: list) -> None:
    """At 1 rad/s derivatives by time are those by angle."""
    with_geometry(instance, geometry, {"crank.phi": phi, "crank.w": 1.0})
    found = instance.get(*TIP) + jerk_and_more(instance, order)
    allowed = conditioning(geometry, phi, order)
    for n in range(order + 1):
        for axis in (0, 1):
            ratio = error(found[2 * n + axis], exact[n][axis]) / allowed[n][axis]
            assert ratio <= 2, f"derivative {n}, {'xy'[axis]}: {ratio:.2f} times the effect of rounding the inputs"


def check_scalar(instance: Instance, name: str, of: Callable, geometry: dict[str, float], phi: float) -> None:
    with_geometry(instance, geometry, {"crank.phi": phi, "crank.w": 1.0})
    found = instance.get(name) + instance.get_derivatives((name, 1), (name, 2))
    allowed = conditioning(geometry, phi, 2, of)
    for n, exact in enumerate(of(Oracle(geometry), phi, 2)):
        ratio = error(found[n], exact) / allowed[n][0]
        assert ratio <= 2, f"{name}, derivative {n}: {ratio:.2f} times the effect of rounding the inputs"


@pytest.mark.parametrize("row", rows("near_singular") + rows("geometries")[::3], ids=str)
def test_tables(new, row):
    check_tip(new(), row.geometry, row.phi, 3, row.exact)


@pytest.mark.parametrize("row", rows("near_singular")[::6] + rows("geometries")[1::12], ids=str)
def test_tables_nozzle_angle_and_margin(new, row):
    check_scalar(new(), "tip.angle", Oracle.nozzle_angle, row.geometry, row.phi)
    check_scalar(new(), "assembly.margin", Oracle.margin, row.geometry, row.phi)


@pytest.mark.parametrize("gap", [1e-4, 1e-7, 1e-11])
@pytest.mark.parametrize("case", DEAD_POINTS)
def test_beside_every_kind_of_dead_point(new, case, gap):
    geometry, phi = beside_dead_point(case, gap)
    check_tip(new(), geometry, phi, 4, Oracle(geometry).tip(phi, 4))
    check_scalar(new(), "assembly.margin", Oracle.margin, geometry, phi)


@pytest.mark.parametrize("case", DEAD_POINTS)
def test_the_margin_tells_of_each_dead_point(new, case):
    """assembly.margin falls with the root of the gap to it; beyond it there is no pose."""
    found = []
    for gap in (1e-4, 1e-6, 1e-8):
        geometry, phi = beside_dead_point(case, gap)
        found += with_geometry(new(), geometry, {"crank.phi": phi}).get("assembly.margin")
    assert found[0] < 0.2
    assert found[0] / found[1] == pytest.approx(10, rel=0.01)
    assert found[1] / found[2] == pytest.approx(10, rel=0.01)

    geometry, phi = beside_dead_point(case, -1e-8)
    instance = new().setup().enter()
    instance.set({f"geometry.{name}": value for name, value in geometry.items()} | {"crank.phi": phi})
    assert instance.try_get(["assembly.margin"])[0] == DISCARD


# ---- the twin ------------------------------------------------------------------------------------


def test_twin_and_fmu_agree(new):
    """Two codes without a common line, over a whole turn: as close as each is to the reference."""
    phi = np.radians(np.arange(0, 360, 0.5))
    twin = solve(Geometry(), phi, 3)
    instance = new().setup().enter()
    worst = np.zeros(4)
    for k, angle in enumerate(phi):
        instance.set({"crank.phi": float(angle), "crank.w": PLANTING_SPEED})
        x, y, vx, vy, ax, ay, nozzle, margin = instance.get(*TIP, "tip.angle", "assembly.margin")
        found = [complex(x, y), complex(vx, vy), complex(ax, ay)]
        for n, z in enumerate(found):
            difference = z - twin.tip[n][k] * PLANTING_SPEED**n
            worst[n] = max(worst[n], abs(difference.real), abs(difference.imag))
        worst[3] = max(worst[3], abs(nozzle - twin.angle[0][k]), abs(margin - twin.margin[k]))
    assert worst[0] <= BOUNDS[0] and worst[1] <= BOUNDS[1] and worst[2] <= BOUNDS[2], worst
    assert worst[3] <= 1e-14, "nozzle angle, margin"


def test_the_nozzle_angle_does_not_jump_in_a_turn(new):
    """Its principal value is taken around straight down."""
    instance = new().setup().enter()
    angles = []
    for degree in range(0, 361, 2):
        instance.set({"crank.phi": math.radians(degree)})
        angles += instance.get("tip.angle")
    assert max(abs(b - a) for a, b in itertools.pairwise(angles)) < 0.2
    assert -3 * math.pi / 2 < min(angles) and max(angles) <= math.pi / 2
    assert angles[0] == pytest.approx(angles[-1], abs=1e-14)
