"""The linkage in numpy against the reference tables, the oracle, the paper's figures and statics."""

import math
import shutil
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from fmu_src import interface
from fmu_src.oracle.oracle import Oracle, conditioning, error
from fmu_src.oracle.tables import rows
from fmu_src.twin import linkage
from fmu_src.twin.linkage import Geometry, UnreachablePose, solve

CRANK_SPEED = 2 * math.pi / interface.load_interface().model.turn_time  # rad/s, 65 turns a minute
WHOLE_TURN = np.radians(np.arange(0, 360, 0.01))


def tip_errors(row, tip):
    """Errors of one computed tip, by derivative and axis."""
    return np.array([[error(z.real, x), error(z.imag, y)] for z, (x, y) in zip(tip, row.exact, strict=True)])


# ---- against exact numbers -------------------------------------------------------------


def test_nominal_geometry_at_the_published_crank_speed():
    """Absolute bounds; the angles reach from -20 to 20 rad."""
    table = rows("nominal")
    solution = solve(Geometry(), np.array([row.phi for row in table]), 3)
    errors = np.array([tip_errors(row, tip) for row, tip in zip(table, np.transpose(solution.tip), strict=True)])
    worst = errors.max(axis=(0, 2)) * CRANK_SPEED ** np.arange(4)
    bounds = [1e-15, 1e-14, 2e-13, 4e-12]  # m, m/s, m/s2, m/s3
    assert np.all(worst <= bounds), f"position, velocity, acceleration, jerk: {worst}, allowed {bounds}"


@pytest.mark.parametrize("table", ["geometries", "near_singular"])
def test_tip_as_exact_as_the_inputs_allow(table):
    """At most twice what the rounding of phi and of the parameters does to the exact answer."""
    worst, where = 0.0, ""
    for row in rows(table):
        errors = tip_errors(row, solve(Geometry(**row.geometry), row.phi, 3).tip)
        ratios = errors / conditioning(row.geometry, row.phi, 3)
        if not ratios.max() <= worst:
            worst, where = ratios.max(), f"{row}: by derivative and axis {ratios.round(2).tolist()}"
    assert worst <= 2, f"worst ratio to the conditioning {worst:.2f} at {where}"


@pytest.mark.parametrize("base", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("phi", [0.5, 2.0, 4.0])
def test_short_bases(phi, base):
    """Where G comes near E the triangle EFG is a needle, which only Heron's formula in factors measures.

    To the second order: at the third, two terms of the size of the links' squares cancel.
    """
    E = solve(Geometry(), phi, 0).joints["E"]
    G = E + base * np.exp(2j)
    geometry = Geometry(XG=float(G.real), YG=float(G.imag), L6=0.25 + 0.9 * base)
    exact, allowed = Oracle(asdict(geometry)).tip(phi, 2), conditioning(asdict(geometry), phi, 2)
    for n, tip in enumerate(solve(geometry, phi, 2).tip):
        ratios = [error(tip.real, exact[n][0]) / allowed[n][0], error(tip.imag, exact[n][1]) / allowed[n][1]]
        assert max(ratios) <= 2, f"derivative {n}: error over conditioning {ratios}"


def test_nozzle_angle_and_margin_beside_dead_points():
    worst, where = 0.0, ""
    for row in rows("near_singular"):
        oracle, solution = Oracle(row.geometry), solve(Geometry(**row.geometry), row.phi, 3)
        computed = [*solution.angle, solution.margin]
        exact = [*oracle.nozzle_angle(row.phi, 3), *oracle.margin(row.phi, 0)]
        allowed = conditioning(row.geometry, row.phi, 3, Oracle.nozzle_angle)
        allowed += conditioning(row.geometry, row.phi, 0, Oracle.margin)
        ratios = np.array([error(c, e) / a for c, e, (a,) in zip(computed, exact, allowed, strict=True)])
        if not ratios.max() <= worst:
            worst, where = ratios.max(), f"{row}: angle by derivative, then margin {ratios.round(2).tolist()}"
    assert worst <= 2, f"worst ratio to the conditioning {worst:.2f} at {where}"


def test_nozzle_angle_and_margin_of_the_nominal_geometry():
    oracle, table = Oracle(asdict(Geometry())), rows("nominal")[::4]
    for row in table:
        solution = solve(Geometry(), row.phi, 3)
        errors = [error(c, e) for c, e in zip(solution.angle, oracle.nozzle_angle(row.phi, 3), strict=True)]
        assert np.all(np.array(errors) <= [4e-15, 4e-15, 1e-14, 4e-14]), f"{row}: {errors}"
        assert error(solution.margin, oracle.margin(row.phi, 0)[0]) <= 4e-15, row


def test_nozzle_angle_within_half_a_turn_of_straight_down_whatever_its_mounting():
    found = []
    for theta9 in np.arange(0.0, 6.3, 0.1):
        geometry = Geometry(theta9=float(theta9))
        found.append(float(solve(geometry, 1.0, 0).angle[0]))
        assert error(found[-1], Oracle(asdict(geometry)).nozzle_angle(1.0, 0)[0]) < 4e-15
    assert -3 * math.pi / 2 <= min(found) < -4.6 and 1.5 < max(found) <= math.pi / 2


def test_nozzle_angle_does_not_jump_within_a_turn():
    assert np.abs(np.diff(solve(Geometry(), WHOLE_TURN, 0).angle[0])).max() < 1e-3


@pytest.mark.parametrize("phi", [1e6 + 0.25, -1e9 - 0.5, 3e15])
def test_a_season_of_turns_costs_no_digit(phi):
    tip, exact = solve(Geometry(), phi, 0).tip[0], Oracle(asdict(Geometry())).tip(phi, 0)[0]
    assert max(error(tip.real, exact[0]), error(tip.imag, exact[1])) <= 1e-15


# ---- against the paper -----------------------------------------------------------------


def test_published_figures():
    """Section 5 gives 334.9 mm; section 1: highest at the start, lowest about 180 degrees later."""
    height = solve(Geometry(), WHOLE_TURN, 0).tip[0].imag
    assert np.ptp(height) * 1e3 == pytest.approx(334.65, abs=0.005)
    assert np.degrees(WHOLE_TURN[height.argmax()]) == pytest.approx(357.9, abs=0.05)
    assert np.degrees(WHOLE_TURN[height.argmin()]) == pytest.approx(177.4, abs=0.05)


# ---- against mechanics -----------------------------------------------------------------


@pytest.mark.parametrize("row", rows("geometries")[::3], ids=str)
def test_the_loop_closes(row):
    """Every length and fixed angle is there in the joints, and both dyads bend to their side."""
    g = Geometry(**row.geometry)
    j = solve(g, row.phi, 0).joints
    assert j["J"] == solve(g, row.phi, 0).tip[0]
    lengths = {"OA": g.L1, "AB": g.L2, "DB": g.L3, "CD": g.L4, "DE": g.L5}
    lengths |= {"EF": g.L6, "GF": g.L7, "HI": g.L8, "IJ": g.L9}
    for (start, end), length in lengths.items():
        assert abs(j[end] - j[start]) == pytest.approx(length, abs=1e-15), start + end
    corners = {
        "theta3": (j["B"] - j["D"]) / (j["E"] - j["D"]),
        "theta8": (j["H"] - j["I"]) / (j["F"] - j["E"]),
        "theta9": (j["J"] - j["I"]) / (j["I"] - j["H"]),
    }
    for name, corner in corners.items():
        assert abs(corner / abs(corner) - np.exp(1j * getattr(g, name))) < 1e-14, name
    assert abs(j["A"] - g.L1 * np.exp(1j * (g.phi1 - row.phi))) < 1e-15
    assert abs(j["D"] - j["C"] - g.L4 * np.exp(1j * (g.phi4 - row.phi))) < 1e-15
    assert (j["O"], j["C"], j["G"]) == (0, g.XC + 1j * g.YC, g.XG + 1j * g.YG)
    assert abs(j["H"] - (j["E"] + j["F"]) / 2) < 1e-16
    assert ((j["B"] - j["A"]) / (j["D"] - j["A"])).imag < 0, "B is on the right of A to D"
    assert ((j["F"] - j["E"]) / (j["G"] - j["E"])).imag < 0, "F is on the right of E to G"


def test_power_balance():
    """The drive's torque from the equilibrium of every part is -(F . dr/dphi), which knows no force but F."""

    def moment(arm, force):
        return (np.conj(arm) * force).imag

    rng = np.random.default_rng(1)
    phi, force = rng.uniform(0, 2 * np.pi, 100), rng.normal(size=100) + 1j * rng.normal(size=100)
    solution = solve(Geometry(), phi, 1)
    A, B, C, D, E, F, G, J = (solution.joints[name] for name in "ABCDEFGJ")
    # the nozzle's body: F at J, the rocker pushes along GF, the rest comes from DE at E; moments around E
    push_GF = -moment(J - E, force) / moment(F - E, F - G) * (F - G)
    at_E = -force - push_GF
    # the body BDE: the reaction of at_E, AB pushes along AB, the rest comes from the crank at D; around D
    push_AB = moment(E - D, at_E) / moment(B - D, B - A) * (B - A)
    at_D = at_E - push_AB
    # the cranks carry the reactions, clockwise is positive
    torque = moment(A, -push_AB) + moment(D - C, -at_D)
    virtual = -(np.conj(force) * solution.tip[1]).real
    np.testing.assert_allclose(torque, virtual, rtol=0, atol=1e-14)
    assert np.abs(virtual).max() > 0.1, "the torques compared are not all small"


def test_time_enters_through_the_crank():
    """Velocity and acceleration in time, by differences, of cranks that do not turn evenly."""
    speed, acceleration, h = 6.8, 30.0, 1e-4
    before, now, after = (solve(Geometry(), 2.0 + speed * t + acceleration * t * t / 2) for t in (-h, 0, h))
    difference = (after.tip[0] - before.tip[0]) / (2 * h)
    second_difference = (after.tip[0] - 2 * now.tip[0] + before.tip[0]) / h**2
    assert abs(now.velocity(speed) - difference) < 1e-5
    assert abs(now.acceleration(speed, acceleration) - second_difference) < 1e-3
    assert abs(acceleration * now.tip[1]) > 0.1, "the crank's acceleration matters here"


# ---- how it may be called --------------------------------------------------------------


def test_arrays_of_any_shape_and_single_angles():
    phi = np.linspace(-7, 7, 24).reshape(2, 3, 4)
    whole = solve(Geometry(), phi, 3)
    single = [solve(Geometry(), float(angle), 3) for angle in phi.flat]
    assert single[0].tip[0].shape == single[0].angle[0].shape == single[0].joints["C"].shape == ()
    for n in range(4):
        for field in ("tip", "angle"):
            array, singles = getattr(whole, field)[n], np.array([getattr(one, field)[n] for one in single])
            assert array.shape == phi.shape
            np.testing.assert_allclose(array, singles.reshape(phi.shape), rtol=0, atol=1e-14 * np.abs(singles).max())
    np.testing.assert_allclose(whole.margin.ravel(), [one.margin for one in single], rtol=1e-14)
    assert list(whole.joints) == list("OABCDEFGHIJ")
    assert all(joint.shape == phi.shape for joint in whole.joints.values())


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_only_the_orders_asked_for_are_computed(order, monkeypatch):
    every, known, links_turned = solve(Geometry(), 1.0, 3), linkage._known, []
    monkeypatch.setattr(linkage, "_known", lambda rates: links_turned.append(len(rates)) or known(rates))
    some = solve(Geometry(), 1.0, order)
    assert some.tip == every.tip[: order + 1] and some.angle == every.angle[: order + 1]
    assert len(links_turned) == 4 * order, "two links of two dyads at each order"


@pytest.mark.parametrize("order", [-1, 4, 1.5])
def test_orders_that_are_not_there(order):
    with pytest.raises(ValueError, match="order"):
        solve(Geometry(), 0.0, order)


def test_defaults_are_the_interface():
    assert asdict(Geometry()) == interface.load_interface().geometry


@pytest.mark.parametrize(
    ("change", "message"),
    [({"L3": 0.0}, "L3 = 0.0: .* longer than 0"), ({"L7": -1.0}, "L7"), ({"theta8": math.nan}, "theta8 = nan is not")],
)
def test_impossible_geometries(change, message):
    with pytest.raises(ValueError, match=message):
        Geometry(**change)


@pytest.mark.parametrize("phi", [math.nan, [0.0, math.inf]])
def test_angles_that_are_no_numbers(phi):
    with pytest.raises(ValueError, match=r"phi = .* is not finite"):
        solve(Geometry(), phi)


@pytest.mark.parametrize(
    ("change", "dyad", "start", "end", "reach", "words"),
    [
        ({"L2": 0.05}, "ABD", "A", "D", 0.155, "too far apart"),
        ({"L2": 0.35}, "ABD", "A", "D", 0.245, "too near each other"),
        ({"L7": 0.1}, "EFG", "E", "G", 0.17, "too far apart"),
        ({"L7": 0.45}, "EFG", "E", "G", 0.38, "too near each other"),
    ],
)
def test_a_pose_that_cannot_be_reached(change, dyad, start, end, reach, words):
    """The ends that the error speaks of do not depend on the lengths that keep the dyad open."""
    phi = math.radians(400)
    closing = solve(Geometry(), phi, 0).joints
    miss = abs(closing[end] - closing[start]) - reach
    with pytest.raises(UnreachablePose) as refused:
        solve(Geometry(**change), phi)
    assert (refused.value.dyad, refused.value.phi) == (dyad, phi)
    assert refused.value.miss == pytest.approx(miss, abs=1e-15)
    for part in (f"dyad {dyad} cannot close", "6.981317008 rad (40.0000 deg", f"{abs(miss) * 1e3:.4g} mm {words}"):
        assert part in str(refused.value)


def test_the_first_angle_of_an_array_that_cannot_be_reached():
    """With AB shortened to 90 mm the linkage closes at the start, turning backwards, but not all the way round."""
    geometry, phi = Geometry(L2=0.09), np.linspace(2 * np.pi, 0, 721)
    with pytest.raises(UnreachablePose) as refused:
        solve(geometry, phi.reshape(7, 103))
    first = int(np.flatnonzero(phi == refused.value.phi)[0])
    assert first > 0
    solve(geometry, phi[:first])
    with pytest.raises(UnreachablePose):
        solve(geometry, phi[first])


def test_exactly_at_a_dead_point():
    """OA and CD along x, with AB and DB just long enough: nothing is rounded here."""
    geometry = Geometry(L1=0.0625, L2=0.0625, L3=0.0625, L4=0.0625, XC=0.125, YC=0.0, phi1=0.0, phi4=0.0)
    with pytest.raises(UnreachablePose, match=r"ABD .* its dead point exactly") as refused:
        solve(geometry, 0.0, 1)
    assert refused.value.miss == 0


def test_plain_import_where_the_files_lie_side_by_side(tmp_path):
    """As inside the FMU: nothing of the package is needed, or taken where it happens to be installed."""
    (tmp_path / "parts").mkdir()
    for file in (Path(linkage.__file__), Path(interface.__file__), interface.INTERFACE_FILE):
        shutil.copy(file, tmp_path / "parts")
    program = f"""if True:
        import sys
        sys.path.insert(0, {str(tmp_path)!r})
        from parts import linkage
        assert not any(name.startswith("fmu_src") for name in sys.modules)
        print(linkage.solve(linkage.Geometry(), 1.0, 0).tip[0])
    """
    run = subprocess.run([sys.executable, "-I", "-c", program], capture_output=True, text=True, check=True)
    assert complex(run.stdout) == solve(Geometry(), 1.0, 0).tip[0]
