"""Masses: torque, reflected inertia, forces and energies against 50 digits, their derivatives, and what is refused."""

from __future__ import annotations

import itertools
import math
import random
from functools import cache

import numpy as np
import pytest
from mpmath import mp, mpf

from fmu_src.interface import load_interface
from fmu_src.oracle.dynamics import Dynamics
from fmu_src.oracle.oracle import Oracle, conditioning, error
from fmu_src.twin import dynamics
from fmu_src.twin.linkage import Geometry, solve
from tests.conftest import BOTH_VERSIONS
from tests.harness.dead_points import DEAD_POINTS, beside_dead_point
from tests.harness.host import ERROR, bits
from tests.harness.masses import MASSES, PLAUSIBLE

pytestmark = BOTH_VERSIONS

INTERFACE = load_interface()
GRAVITY = INTERFACE.gravity
OTHER = {"L1": 0.053, "L4": 0.021, "L7": 0.26, "YC": -0.05, "phi4": 5.3, "theta3": 0.55, "theta9": 1.5}
OF_MASSES = ["crank.tau", "crank.inertia", "crank.tau_bias", "machine.fx", "machine.fy"]
ENERGIES = ["linkage.kinetic", "linkage.potential"]
JOINTS = "OABCDEFG"


def cases(count: int) -> list[dict[str, float]]:
    """Inputs, geometry and masses at random, of the size that they have in use."""
    draw = random.Random(12)
    found = []
    for number in range(count):
        inputs = {
            "crank.phi": draw.uniform(-7, 7),
            "crank.w": draw.uniform(-9, 9),
            "crank.a": draw.uniform(-60, 60),
            "machine.v": draw.uniform(-1, 1),
            "tip.fx": draw.uniform(-90, 90),
            "tip.fy": draw.uniform(-90, 90),
        }
        some = {name: value * draw.choice([0.0, 0.5, 1.0, 2.0]) for name, value in MASSES.items() if name[-1] in "xy"}
        some |= {name: value * draw.uniform(0.3, 2.0) for name, value in MASSES.items() if name[-1] in "mJ"}
        some |= {f"body.{body}.y": draw.uniform(-0.02, 0.02) for body in PLAUSIBLE}
        geometry = {f"geometry.{name}": value for name, value in OTHER.items()} if number % 2 else {}
        found.append(inputs | geometry | some)
    return found


def exact(case: dict[str, float]) -> dict[str, mpf]:
    geometry = {name: case.get(f"geometry.{name}", value) for name, value in INTERFACE.geometry.items()}
    masses = {name: case.get(f"body.{name}", value) for name, value in INTERFACE.masses.items()}
    at = Dynamics(Oracle(geometry), masses, case.get("gravity", GRAVITY))
    force = case["tip.fx"], case["tip.fy"]
    return at.outputs(case["crank.phi"], case["crank.w"], case["crank.a"], (case["machine.v"], 0.0), force)


@pytest.mark.parametrize("case", cases(8), ids=lambda case: f"{case['crank.phi']:.2f} rad")
def test_values_to_50_digits(new, case):
    """Within 1e-13 of the largest of what is summed up."""
    found = new().initialize(case).get(*OF_MASSES, *ENERGIES)
    right = exact(case)
    scale = {"crank.tau": 10.0, "crank.tau_bias": 10.0, "crank.inertia": 0.1, "machine.fx": 100.0, "machine.fy": 100.0}
    for name, value in zip([*OF_MASSES, *ENERGIES], found, strict=True):
        assert abs(value - right[name]) <= 1e-13 * max(abs(right[name]), scale.get(name, 1.0)), name


def asked(oracle: Oracle, phi: mpf, order: int) -> list[tuple[mpf, ...]]:
    """The outputs and, at order 1, their slopes by phi, for `conditioning`; the oracle's numbers are the whole case's.

    `conditioning` thus nudges masses and inputs as it does the geometry.
    """
    of, nudge = oracle.geometry, mpf(10) ** -20
    at = Dynamics(oracle, {name: of[f"body.{name}"] for name in INTERFACE.masses}, of["gravity"])

    def values(angle: mpf) -> tuple[mpf, ...]:
        machine, force = (of["machine.v"], mpf(0)), (of["tip.fx"], of["tip.fy"])
        found = at.outputs(angle, of["crank.w"], of["crank.a"], machine, force)
        return tuple(found[name] for name in (*OF_MASSES, *ENERGIES))

    here = values(phi)
    if order == 0:
        return [here]
    return [here, tuple((there - one) / nudge for there, one in zip(values(phi + nudge), here, strict=True))]


@cache
def beside(kind: str, gap: float) -> tuple[dict[str, float], dict[str, mpf], tuple[float, ...]]:
    """Masses, inputs and a geometry `gap` metres from a dead point; what is right there, and its conditioning."""
    geometry, phi = beside_dead_point(kind, gap)
    some = cases(len(DEAD_POINTS))[list(DEAD_POINTS).index(kind)] | {"crank.phi": phi}
    case = some | {f"geometry.{name}": value for name, value in geometry.items()}
    known = {f"body.{name}": value for name, value in INTERFACE.masses.items()} | {"gravity": GRAVITY}
    known |= {name.removeprefix("geometry."): value for name, value in case.items() if name != "crank.phi"}
    (units,) = conditioning(known, phi, 0, asked)
    return case, exact(case), units


@pytest.mark.parametrize("gap", [1e-4, 1e-7, 1e-11])
@pytest.mark.parametrize("kind", DEAD_POINTS)
def test_beside_every_kind_of_dead_point(new, kind, gap):
    """Off by no more than four times what half a unit in the last place of each input and parameter does."""
    case, right, units = beside(kind, gap)
    names = [*OF_MASSES, *ENERGIES]
    found = new().initialize(case).get(*names)
    ratios = {
        name: error(value, right[name]) / (unit / 2) for name, value, unit in zip(names, found, units, strict=True)
    }
    assert max(ratios.values()) <= 4, ratios


def test_inertia_and_bias_make_the_torque(new):
    for case in cases(4):
        tau, inertia, bias = new().initialize(case).get(*OF_MASSES[:3])
        assert tau == pytest.approx(inertia * case["crank.a"] + bias, rel=1e-14)


def test_without_masses_only_the_soil_is_felt(new):
    case = {name: value for name, value in cases(1)[0].items() if not name.startswith("body.")}
    instance = new().initialize(case)
    tau, inertia, bias, fx, fy = instance.get(*OF_MASSES)
    assert (inertia, fx, fy) == (0.0, case["tip.fx"], case["tip.fy"]) and tau == bias != 0.0
    assert instance.get(*ENERGIES) == [0.0, 0.0]
    assert instance.sensitivity(["crank.tau", "crank.inertia"], {"crank.a": 1.0}) == [0.0, 0.0]


def test_masses_change_no_motion(new):
    names = [v.name for v in INTERFACE.of_kind("output") if v.name.startswith(("tip.", "ground.", "assembly."))]
    case = cases(1)[0]
    without = {name: value for name, value in case.items() if not name.startswith("body.")}
    assert bits(new().initialize(case).get(*names)) == bits(new().initialize(without).get(*names))


def test_power_balances(new):
    """tau w = d/dt (T + V) - F . v_ground + fx v, to rounding, over a turn of a crank that turns unevenly, in a machine
    that gains speed: the energies that are read against Gauss's quadrature of the powers that are read.

    In each piece the acceleration of the crank is constant, so that the powers are smooth there.
    """
    nodes, weights = np.polynomial.legendre.leggauss(6)
    pieces, h, gain = 160, math.tau / 6.8 / 160, 0.5
    phi, w, fx, fy = 0.3, 6.8, -20.0, 55.0
    instance = new().initialize(
        {"crank.at_step_end": True, "crank.phi": phi, "crank.w": w, "machine.v": 0.4, "tip.fx": fx, "tip.fy": fy}
        | MASSES
    )
    last, work, felt, gained = 0.0, 0.0, 0.0, None
    for k in range(-2, pieces):  # the first two tell how fast the machine gains speed
        a = 60.0 * math.sin(0.9 * k)
        for at, weight in zip((*nodes, 1.0), (*weights, 0.0), strict=True):
            since = (at + 1) / 2 * h
            time = (k + 2) * h + since
            now = {"crank.phi": phi + w * since + a * since**2 / 2, "crank.w": w + a * since, "crank.a": a}
            instance.step(last, time - last, now | {"machine.v": 0.4 + gain * time})
            last = time
            tau, force, vx, vy = instance.get("crank.tau", "machine.fx", "ground.vx", "ground.vy")
            if k >= 0:
                power = tau * now["crank.w"] + fx * vx + fy * vy - force * (0.4 + gain * time)
                work += weight * h / 2 * power
                felt += weight * h / 2 * abs(power)
        phi, w = phi + w * h + a * h * h / 2, w + a * h
        if k == -1:
            gained = -sum(instance.get(*ENERGIES))
    gained += sum(instance.get(*ENERGIES))
    assert abs(work - gained) < 1e-12 * felt
    assert felt > 5 and abs(gained) > 0.1


def test_joint_forces_close_newtons_and_eulers_equations(new):
    """For each body, with accelerations of its centre as the readable edition has them."""
    for case in cases(4):
        geometry = {name: case.get(f"geometry.{name}", value) for name, value in INTERFACE.geometry.items()}
        instance = new().initialize(case)
        force = {j: complex(*instance.get(f"joint.{j}.fx", f"joint.{j}.fy")) for j in JOINTS}
        point = {j: complex(*instance.get(f"joint.{j}.x", f"joint.{j}.y")) for j in "ABCDEFGHIJ"} | {"O": 0j}
        on_oa, on_cd, tau = instance.get("crank.OA.tau", "crank.CD.tau", "crank.tau")
        assert on_oa + on_cd == pytest.approx(tau, rel=1e-12, abs=1e-12)
        solution = solve(Geometry(**geometry), case["crank.phi"])
        bodies = dynamics.bodies_of(dict.fromkeys(MASSES, 0.0) | case)
        moving = dynamics.move(Geometry(**geometry), solution, bodies)
        w, a, soil = case["crank.w"], case["crank.a"], complex(case["tip.fx"], case["tip.fy"])
        acting = {
            "OA": [(force["O"], "O"), (-force["A"], "A")],
            "CD": [(force["C"], "C"), (-force["D"], "D")],
            "AB": [(force["A"], "A"), (force["B"], "B")],
            "DE": [(force["D"], "D"), (-force["B"], "B"), (-force["E"], "E")],
            "EF": [(force["E"], "E"), (force["F"], "F"), (soil, "J")],
            "GF": [(force["G"], "G"), (-force["F"], "F")],
        }
        for name, body in moving.items():
            c, (t1, t2) = body.centre, body.angle
            demanded = body.body.m * (c[2] * w**2 + c[1] * a + 1j * GRAVITY)
            assert abs(sum(f for f, _ in acting[name]) - demanded) < 1e-11, name
            moment = sum(np.imag(np.conj(point[j] - c[0]) * f) for f, j in acting[name])
            moment -= {"OA": on_oa, "CD": on_cd}.get(name, 0.0)  # in the working direction, clockwise
            assert moment == pytest.approx(body.body.J * (t2 * w**2 + t1 * a), abs=1e-12), name
        machine = complex(*instance.get("machine.fx", "machine.fy"))
        assert abs(machine + force["O"] + force["C"] + force["G"]) < 1e-11


PARAMETERS = [v.name for v in INTERFACE.of_kind("parameter") if v.name.startswith(("geometry.", "body."))] + ["gravity"]


def in_initialization(new, case):
    """Where derivatives by parameters are."""
    return new().setup().enter().set(case)


@pytest.mark.parametrize("number", [0, 1])
def test_gradients_to_50_digits(new, version, number):
    """By geometry, masses and gravity, forward and in reverse."""
    case = cases(2)[number]
    instance = in_initialization(new, case)
    step = mpf(10) ** -20
    full = {name: case.get(name, INTERFACE[name].start) for name in PARAMETERS}
    for parameter in PARAMETERS[number::2]:
        with mp.workdps(50):
            above, below = (exact(case | {parameter: mpf(full[parameter]) + sign * step}) for sign in (1, -1))
            right = [float((above[name] - below[name]) / (2 * step)) for name in OF_MASSES]
        found = instance.sensitivity(OF_MASSES, {parameter: 1.0})
        scale = max(1e-3, *map(abs, right))
        assert found == pytest.approx(right, rel=1e-9, abs=1e-11 * scale), parameter
    if version == 3:
        for output in OF_MASSES:
            adjoint = instance.adjoint({output: 1.0}, PARAMETERS)
            forward = [instance.sensitivity([output], {name: 1.0})[0] for name in PARAMETERS]
            assert adjoint == pytest.approx(forward, rel=1e-11, abs=1e-11), output


def test_derivatives_by_inputs(new, version):
    """d crank.tau / d crank.a is the reflected inertia."""
    for case in cases(3):
        instance = new().initialize(case)
        (inertia,) = instance.get("crank.inertia")
        assert instance.sensitivity(["crank.tau", "crank.tau_bias"], {"crank.a": 1.0}) == [inertia, 0.0]
        for known, step in (("crank.phi", 1e-5), ("crank.w", 1e-4)):
            found = instance.sensitivity(OF_MASSES, {known: 1.0})
            ends = [exact(case | {known: case[known] + sign * step}) for sign in (1, -1)]
            right = [float((ends[0][name] - ends[1][name]) / (2 * step)) for name in OF_MASSES]
            assert found == pytest.approx(right, rel=1e-6, abs=1e-5)
        if version == 3:
            knowns = ["crank.phi", "crank.w", "crank.a", "tip.fx", "tip.fy"]
            for output in OF_MASSES:
                forward = [instance.sensitivity([output], {name: 1.0})[0] for name in knowns]
                assert instance.adjoint({output: 1.0}, knowns) == pytest.approx(forward, rel=1e-12, abs=1e-12)


def test_derivatives_by_time(new):
    """Orders 1 and 2 against the values along the motion that the component continues: an even acceleration."""
    case = cases(3)[2] | {"machine.v": 0.0}
    phi, w, a = (case[name] for name in ("crank.phi", "crank.w", "crank.a"))
    instance = new().initialize(case | {"crank.at_step_end": True})
    h = 1e-4
    for k in (1, 2, 3):
        t = k * h
        instance.step((k - 1) * h, h, {"crank.phi": phi + w * t + a * t * t / 2, "crank.w": w + a * t, "crank.a": a})
    t = 3 * h

    def at(time: float) -> list[float]:
        there = {"crank.phi": phi + w * time + a * time**2 / 2, "crank.w": w + a * time, "crank.a": a}
        return new().initialize(case | there).get(*OF_MASSES)

    step = 1e-4
    before, here, after = (np.array(at(t + k * step)) for k in (-1, 0, 1))
    first = instance.get_derivatives(*((name, 1) for name in OF_MASSES))
    second = instance.get_derivatives(*((name, 2) for name in OF_MASSES))
    assert first == pytest.approx((after - before) / (2 * step), rel=1e-5, abs=1e-4)
    assert second == pytest.approx((after - 2 * here + before) / step**2, rel=1e-3, abs=1.0)


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"body.EF.m": -0.1}, "body.EF.m = -0.1"),
        ({"body.GF.J": -1e-3}, "body.GF.J = -0.001"),
        ({"gravity": math.nan}, "gravity"),
        ({"gravity": math.inf}, "gravity"),
    ],
)
def test_what_cannot_be_is_refused(new, values, named):
    instance = new().setup()
    assert instance.try_set(values) == ERROR
    assert named in instance.last_message.text


def test_inertia_without_mass(new, version):
    instance = new().setup().enter().set({"body.AB.J": 1e-3})
    assert instance.call(f"fmi{version}ExitInitializationMode") == ERROR
    assert "body.AB.J = 0.001 kg.m2, but body.AB.m = 0" in instance.last_message.text
    instance.set({"body.AB.J": 0.0, "body.OA.J": 1e-3})  # a wheel that the machine bears
    instance.exit()
    assert instance.get("crank.inertia") == [1e-3]


def test_what_is_read_is_computed_whatever_was_read_before(new):
    """The order of reading changes no bit."""
    case, names = cases(1)[0], [*OF_MASSES, *ENERGIES, "tip.ax", "joint.F.fx", "joint.B.x"]
    once = bits(new().initialize(case).get(*names))
    for order in itertools.islice(itertools.permutations(range(len(names)), 3), 0, None, 67):
        instance = new().initialize(case)
        for k in order:
            instance.get(names[k])
        assert bits(instance.get(*names)) == once


def test_masses_are_seen_by_whatever_is_read_first(new):
    """In initialization mode, where they were just set, and where a state of another instance brought them."""
    case = cases(1)[0]
    right = dict(zip(OF_MASSES, new().initialize(case).get(*OF_MASSES), strict=True))
    kept = new().initialize(case)
    serialized = kept.serialize()
    rates = [kept.get_derivatives((name, 1))[0] for name in OF_MASSES]
    for name, rate in zip(OF_MASSES, rates, strict=True):
        assert in_initialization(new, case).get(name) == [right[name]], name
        for read in ("value", "rate"):
            other = new().initialize({})
            other.deserialize(serialized)
            if read == "value":
                assert other.get(name) == [right[name]], name
            else:
                assert other.get_derivatives((name, 1)) == [rate], name
