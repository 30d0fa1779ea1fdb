"""Derivatives of every output by the geometry, where the standard has them: in initialization mode.

There parameters may change, and outputs depend on them as ModelStructure's InitialUnknowns say (FMI 2.0.4, sections
2.1.9 and 2.2.8; FMI 3.0, section 2.2, "Getting Partial Derivatives"). In all other modes they are fixed: knowns are the
inputs and the state machine.s.
"""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from mpmath import mp, mpf

from fmu_src.interface import load_interface
from fmu_src.oracle.oracle import Oracle, conditioning, error
from fmu_src.oracle.tables import Row, rows
from tests.conftest import BOTH_VERSIONS
from tests.harness.host import ERROR, Instance, bits

INTERFACE = load_interface()
NAMES = list(INTERFACE.geometry)
PARAMETERS = [f"geometry.{name}" for name in NAMES]
INPUTS = [v.name for v in INTERFACE.of_kind("input")]
KNOWNS = [*INPUTS, "machine.s", *PARAMETERS]
UNKNOWNS = [v.name for v in INTERFACE.unknowns]
POINTS = [
    {"crank.phi": 0.7, "crank.w": 6.8, "crank.a": -12.0, "machine.v": 0.43, "tip.fx": 15.0, "tip.fy": -80.0},
    {"crank.phi": 3.5, "crank.w": -3.0, "crank.a": 40.0, "machine.v": -0.2, "tip.fx": -35.0, "tip.fy": 60.0},
]


def initializing(instance: Instance, geometry: dict[str, float], inputs: dict[str, float]) -> Instance:
    return instance.setup().enter().set({f"geometry.{name}": value for name, value in geometry.items()} | inputs)


# ---- against exact numbers -----------------------------------------------------------------------


def by_parameter(name: str, of: Callable[[Oracle, float, int], list]) -> Callable[[Oracle, float, int], list]:
    """The derivative of an oracle's answers by one parameter, by a difference that is right to more than 40 digits."""

    def derivative(oracle: Oracle, phi: float, order: int) -> list[tuple[mpf, ...]]:
        digits, step = 80, mpf(10) ** -25
        with mp.workdps(digits):
            sides = []
            for side in (step, -step):
                changed = Oracle(oracle.geometry | {name: oracle.geometry[name] + side}, digits)
                sides.append([v if isinstance(v, tuple) else (v,) for v in of(changed, phi, order)])
            return [
                tuple((a - b) / (2 * step) for a, b in zip(*pair, strict=True)) for pair in zip(*sides, strict=True)
            ]

    return derivative


def check(instance: Instance, row: Row, name: str, of: Callable, outputs: list[str], order: int) -> None:
    """At 1 rad/s and no acceleration, derivatives by time are those by angle; outputs[n] are those of order n."""
    exact = by_parameter(name, of)
    allowed = conditioning(row.geometry, row.phi, order, exact)
    found = iter(instance.sensitivity(outputs, {f"geometry.{name}": 1.0}))
    for n, components in enumerate(exact(Oracle(row.geometry), row.phi, order)):
        length = float(mp.sqrt(sum(component**2 for component in components)))
        for component, bound in zip(components, allowed[n], strict=True):
            off = error(next(found), component)
            # the second: a unit vector's components where the angle hardly moves them
            assert off <= 4 * bound + 4e-16 * length, f"{name}, derivative {n}: {off / bound:.2f} times the rounding"


TIP = ["tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay"]
ROWS = [*rows("nominal")[::67], *rows("geometries")[::12], *rows("near_singular")[::9]]


@pytest.mark.parametrize("row", ROWS, ids=str)
def test_against_fifty_digits(new, row):
    """No error beyond what the rounding of the inputs does to the derivative, in any geometry, near dead points too."""
    instance = initializing(new(), row.geometry, {"crank.phi": row.phi, "crank.w": 1.0})
    for name in random.Random(row.line).sample(NAMES, 3):
        check(instance, row, name, Oracle.tip, TIP, 2)
    name = NAMES[row.line % len(NAMES)]
    check(instance, row, name, Oracle.nozzle_angle, ["tip.angle"], 0)
    check(instance, row, name, Oracle.margin, ["assembly.margin"], 0)


@pytest.mark.parametrize("name", NAMES)
def test_every_parameter_against_fifty_digits(new, name):
    row = rows("nominal")[50]
    instance = initializing(new(), row.geometry, {"crank.phi": row.phi, "crank.w": 1.0})
    check(instance, row, name, Oracle.tip, TIP, 2)
    check(instance, row, name, Oracle.nozzle_angle, ["tip.angle"], 0)
    check(instance, row, name, Oracle.margin, ["assembly.margin"], 0)


# ---- against differences, and the two ways against each other -------------------------------------

SIXTH_ORDER = {-3: -1 / 60, -2: 3 / 20, -1: -3 / 4, 1: 3 / 4, 2: -3 / 20, 3: 1 / 60}


@BOTH_VERSIONS
@pytest.mark.parametrize("point", POINTS, ids=lambda point: f"phi={point['crank.phi']}")
@pytest.mark.parametrize("name", [*PARAMETERS, "machine.s"])
def test_against_differences_of_the_outputs(new, name, point):
    """Every unknown, with speed, acceleration and force."""
    instance, apart = new().setup().enter().set(point), 1e-4
    (here,) = instance.get(name)
    differences = [0.0] * len(UNKNOWNS)
    for k, weight in SIXTH_ORDER.items():
        values = instance.set({name: here + k * apart}).get(*UNKNOWNS)
        differences = [sum_ + weight * value / apart for sum_, value in zip(differences, values, strict=True)]
    found = instance.set({name: here}).sensitivity(UNKNOWNS, {name: 1.0})
    for unknown, value, difference in zip(UNKNOWNS, found, differences, strict=True):
        assert value == pytest.approx(difference, rel=1e-8, abs=1e-8), unknown


@pytest.mark.parametrize("point", POINTS, ids=lambda point: f"phi={point['crank.phi']}")
@pytest.mark.parametrize("unknown", UNKNOWNS)
@pytest.mark.parametrize("version", [3])
def test_adjoint_of_each_unknown(new, unknown, point):
    """A row of the Jacobian at once, the same as its entries one by one."""
    instance = new().setup().enter().set(point)
    entries = [instance.sensitivity([unknown], {known: 1.0})[0] for known in KNOWNS]
    assert instance.adjoint({unknown: 1.0}, KNOWNS) == pytest.approx(entries, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("version", [3])
def test_adjoint_and_directional_derivative_are_transposes(new, seed):
    """weights . (J v) = (J' weights) . v, in any geometry and for any choice of unknowns and knowns."""
    chance = random.Random(seed)
    row = chance.choice(rows("geometries"))
    inputs = {name: chance.uniform(-3, 3) for name in INPUTS} | {"crank.phi": row.phi}
    instance = initializing(new(), row.geometry, inputs)
    weights = {name: chance.uniform(-1, 1) for name in chance.sample(UNKNOWNS, chance.randint(1, len(UNKNOWNS)))}
    direction = {name: chance.uniform(-1, 1) for name in chance.sample(KNOWNS, chance.randint(1, len(KNOWNS)))}
    forward = [w * s for w, s in zip(weights.values(), instance.sensitivity(weights, direction), strict=True)]
    backward = [s * v for s, v in zip(instance.adjoint(weights, direction), direction.values(), strict=True)]
    scale = sum(map(abs, forward)) + sum(map(abs, backward))
    assert sum(forward) == pytest.approx(sum(backward), abs=1e-13 * scale)


@pytest.mark.parametrize("version", [3])
def test_each_known_for_itself(new):
    """In any number and order the same bits; one named twice is answered twice, weights named twice add up."""
    instance = new().setup().enter().set(POINTS[0])
    together = instance.adjoint({"tip.vx": 1.0, "tip.y": -2.0}, KNOWNS)
    assert bits(instance.adjoint({"tip.vx": 1.0, "tip.y": -2.0}, KNOWNS[::-1])) == bits(together[::-1])
    assert bits(instance.adjoint({"tip.vx": 1.0, "tip.y": -2.0}, ["geometry.L1"] * 2)) == bits(
        [together[KNOWNS.index("geometry.L1")]] * 2
    )
    twice = instance._derivative("fmi3GetAdjointDerivative", ["tip.x", "tip.x"], ["crank.phi"], [1.0, 2.0])[1]
    assert twice == pytest.approx(instance.adjoint({"tip.x": 3.0}, ["crank.phi"]))


# ---- where they are, and where not ----------------------------------------------------------------


@BOTH_VERSIONS
@pytest.mark.parametrize("name", PARAMETERS)
def test_only_in_initialization_mode(new, name):
    instance = new().setup().enter().set(POINTS[0])
    assert instance.try_sensitivity(["tip.x"], {name: 1.0})[0] == 0
    instance.exit()
    assert instance.try_sensitivity(["tip.x"], {"crank.phi": 1.0, name: 1.0})[0] == ERROR
    assert name in instance.last_message.text and "initialization mode" in instance.last_message.text
    if instance.fmu.description.fmiVersion.startswith("3"):
        assert instance.try_adjoint({"tip.x": 1.0}, [name])[0] == ERROR
        assert name in instance.last_message.text


@BOTH_VERSIONS
@pytest.mark.parametrize("known", ["crank.at_step_end", "tip.x", "der(machine.s)", 0, len(KNOWNS) + 100])
def test_what_is_no_known(new, known):
    instance = new().setup().enter()
    assert instance.try_sensitivity(["tip.x"], {known: 1.0})[0] == ERROR
    assert str(known) in instance.last_message.text


@pytest.mark.parametrize("version", [3])
def test_weights_must_be_numbers(new):
    instance = new().setup().enter()
    status, values = instance.try_adjoint({"tip.x": 1.0, "tip.vy": float("nan")}, ["geometry.L1"])
    assert status == ERROR and "tip.vy" in instance.last_message.text and values[0] != values[0]


@BOTH_VERSIONS
def test_arms_of_no_length_have_derivatives(new):
    """L1 = 0 is a point, but it can grow: the derivative by it is that of the limit."""
    for name in ("L8", "L9", "L5"):
        at_zero = initializing(new(), {name: 0.0}, POINTS[0])
        beside = initializing(new(), {name: 1e-6}, POINTS[0])
        if beside.try_get(["tip.x"])[0]:
            continue  # the linkage does not close without this arm
        found = [i.sensitivity(TIP[:4], {f"geometry.{name}": 1.0}) for i in (at_zero, beside)]
        assert found[0] == pytest.approx(found[1], rel=1e-3, abs=1e-4)
