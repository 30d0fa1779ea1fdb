"""fmi2GetRealOutputDerivatives (FMI 2.0.4, section 4.2.1): orders 1 and 2 of every output at the end of the step."""

from __future__ import annotations

import pytest
from mpmath import mp, mpf

from fmu_src.interface import load_interface
from fmu_src.oracle.oracle import Oracle
from tests.conftest import BOTH_VERSIONS
from tests.harness.drive import angle_and_speed, angle_only, angle_speed_acceleration, two_derivatives, uneven
from tests.harness.host import ERROR, Instance

NOMINAL = load_interface().geometry
# but those of masses alone, which test_dynamics.py has
OUTPUTS = [v.name for v in load_interface().of_kind("output") if not v.equation[-1].has_masses or v.name == "crank.tau"]
COUNT = len(load_interface().variables)
# Of each of the tip's coordinates: relative to what, whether it is the forward one, and its order by time.
COORDINATES = {
    f"{frame}.{rate}{axis}": (frame, axis == "x", order)
    for frame in ("tip", "ground")
    for order, rate in enumerate(("", "v", "a"))
    for axis in ("x", "y")
}


# ---- against exact numbers -----------------------------------------------------------------------


def exact_derivatives(name: str, phi: float, w: float, a: float, travel: tuple, force: tuple) -> list[float]:
    """Derivatives 0 to 2 by time of an output, from poses alone, while the crank does phi + w t + a t^2 / 2.

    travel: coefficients of machine.s by powers of t; force: of tip.fx and of tip.fy.
    """
    oracle = Oracle(NOMINAL, 250)  # mp.diff takes fourth differences: five times the digits wanted

    def angle(t: mpf) -> mpf:
        return phi + w * t + mpf(a) / 2 * t * t

    def polynomial(coefficients: tuple, t: mpf) -> mpf:
        return sum(mpf(c) * t**k for k, c in enumerate(coefficients))

    def torque(t: mpf) -> mpf:
        _, (dx, dy) = oracle.tip(angle(t), 1)
        return -(polynomial(force[0], t) * dx + polynomial(force[1], t) * dy)

    def coordinate(t: mpf) -> mpf:
        tip = oracle.pose(angle(t)).J
        frame, is_forward, _ = COORDINATES[name]
        travelled = polynomial(travel, t) if frame == "ground" else 0
        return tip.real + travelled if is_forward else tip.imag

    others = {
        "machine.s": (lambda t: polynomial(travel, t), 0),
        "crank.tau": (torque, 0),
        "tip.angle": (lambda t: oracle.nozzle_angle(angle(t), 0)[0], 0),
        "assembly.margin": (lambda t: oracle.margin(angle(t), 0)[0], 0),
    }
    if name not in others and name not in COORDINATES:
        pytest.fail(f"{name} is new: say here what it is, as a function of time", pytrace=False)
    of, first = others.get(name) or (coordinate, COORDINATES[name][2])
    with mp.workdps(40):
        return [float(mp.diff(of, 0, first + n)) for n in range(3)]


@pytest.mark.parametrize("phi", [0.4, 2.5])
@pytest.mark.parametrize("name", OUTPUTS)
def test_against_poses_of_fifty_digits(new, name, phi):
    """Every output in a motion that the host's input derivatives describe completely."""
    w, a, step = 5.0, -30.0, 1 / 64
    instance = new().initialize({"machine.s": 3.0})
    instance.set({"crank.phi": phi, "machine.v": 0.5, "tip.fx": 20.0, "tip.fy": -70.0})
    instance.set_derivatives(
        {
            ("crank.phi", 1): w, ("crank.phi", 2): a, ("machine.v", 1): 4.0, ("machine.v", 2): -3.0,
            ("tip.fx", 1): 100.0, ("tip.fy", 1): -300.0, ("tip.fy", 2): 1000.0,
        }
    )  # fmt: skip
    instance.step(0.0, step)
    at_end = {
        "phi": phi + w * step + a / 2 * step**2,
        "w": w + a * step,
        "a": a,
        "travel": (
            3 + 0.5 * step + 2 * step**2 - 0.5 * step**3,
            0.5 + 4 * step - 1.5 * step**2,
            2 - 1.5 * step,
            -0.5,
        ),
        "force": ((20 + 100 * step, 100.0), (-70 - 300 * step + 500 * step**2, -300 + 1000 * step, 500.0)),
    }
    exact = exact_derivatives(name, **at_end)
    found = instance.get(name) + instance.get_derivatives((name, 1), (name, 2))
    for n in range(3):
        assert found[n] == pytest.approx(exact[n], rel=1e-13, abs=1e-13), f"derivative {n}"


# ---- against the outputs themselves --------------------------------------------------------------

SIXTH_ORDER = {  # central differences: value by point, for the first and the second derivative
    1: {-3: -1 / 60, -2: 3 / 20, -1: -3 / 4, 1: 3 / 4, 2: -3 / 20, 3: 1 / 60},
    2: {-3: 1 / 90, -2: -3 / 20, -1: 3 / 2, 0: -49 / 18, 1: 3 / 2, 2: -3 / 20, 3: 1 / 90},
}


def driven(instance: Instance, giving) -> None:
    """Six steps and the inputs of a seventh."""
    step, rotation = 0.02, uneven()
    for i in range(7):
        values, derivatives = giving(rotation, i * step)
        instance.set({**values, "machine.v": 0.4 + (i * step) ** 2, "tip.fx": 30.0, "tip.fy": -40.0})
        if derivatives:
            instance.set_derivatives(derivatives)
        if i < 6:
            instance.step(i * step, step)


@pytest.mark.parametrize("giving", [angle_only, angle_and_speed, angle_speed_acceleration, two_derivatives])
def test_against_steps_a_little_shorter_and_longer(new, giving):
    """From one state, steps that end at neighbouring instants: their outputs have these derivatives there."""
    instance, apart = new().initialize(), 2e-3
    driven(instance, giving)
    state, values = instance.save(), {}
    for k in (-3, -2, -1, 1, 2, 3, 0):
        instance.restore(state).step(0.12, 0.02 + k * apart)
        values[k] = instance.outputs()
    for order, weights in SIXTH_ORDER.items():
        found = instance.get_derivatives(*[(name, order) for name in OUTPUTS])
        for i, name in enumerate(OUTPUTS):
            difference = sum(weight * values[k][i] for k, weight in weights.items()) / apart**order
            assert found[i] == pytest.approx(difference, rel=1e-7, abs=1e-7), f"{name}, order {order}"


@BOTH_VERSIONS
def test_before_the_first_step_they_are_those_of_the_inputs(new):
    instance = new().initialize({"crank.phi": 1.0, "crank.w": 3.0, "crank.a": 7.0, "machine.v": 0.5})
    first = instance.get_derivatives(("tip.x", 1), ("tip.vx", 1), ("machine.s", 1), ("ground.x", 1))
    tip_vx, tip_ax, ground_vx = instance.get("tip.vx", "tip.ax", "ground.vx")
    assert first == [tip_vx, tip_ax, 0.5, ground_vx]


@BOTH_VERSIONS
def test_outputs_that_are_derivatives_of_others(new):
    """tip.x has tip.vx as its derivative, to the last bit, and so on."""
    instance = new().initialize()
    driven(instance, angle_and_speed)
    instance.step(0.12, 0.02)
    for frame in ("tip", "ground"):
        for axis in ("x", "y"):
            v, a = instance.get(f"{frame}.v{axis}", f"{frame}.a{axis}")
            assert instance.get_derivatives((f"{frame}.{axis}", 1), (f"{frame}.{axis}", 2)) == [v, a]
            assert instance.get_derivatives((f"{frame}.v{axis}", 1)) == [a]


# ---- what does not exist -------------------------------------------------------------------------


@BOTH_VERSIONS
@pytest.mark.parametrize("order", [0, 3, -1, 2**31 - 1, -(2**31)])
def test_other_orders(new, order):
    instance = new().initialize()
    status, _ = instance.try_get_derivatives(("tip.x", 1), ("tip.y", order))
    assert status == ERROR
    assert "tip.y" in instance.last_message.text and str(order)[:5] in instance.last_message.text


@BOTH_VERSIONS
@pytest.mark.parametrize("name", ["crank.phi", "geometry.L1", "time", "crank.at_step_end", 0, COUNT + 1, 2**32 - 1])
def test_other_variables(new, name):
    instance = new().initialize()
    assert instance.try_get_derivatives(("tip.x", 1), (name, 1))[0] == ERROR
    assert str(name) in instance.last_message.text
