"""The oracle against the reference tables, and against what must hold of any mechanism."""

import math

import pytest
from mpmath import mp, mpf

from fmu_src.interface import load_interface
from fmu_src.oracle.oracle import Oracle, _central_difference, conditioning
from fmu_src.oracle.tables import DIGITS, rows

NOMINAL = load_interface().geometry


@pytest.mark.parametrize(("table", "poses"), [("nominal", 200), ("geometries", 60), ("near_singular", 42)])
def test_every_printed_digit_of_the_tables(table, poses):
    assert len(rows(table)) == poses
    for row in rows(table):
        answer = Oracle(row.geometry).tip(row.phi, 3)
        for n in range(4):
            for axis in range(2):
                with mp.workdps(DIGITS + 5):
                    off = abs(answer[n][axis] / row.exact[n][axis] - 1)
                assert off < 10 ** (1 - DIGITS), f"{row}, derivative {n}, axis {axis}: off by {mp.nstr(off, 3)}"


def test_central_differences_know_their_powers():
    """The n-th central difference of k^n is n!, of lower powers and of the next higher one it is 0."""
    for n in range(6):
        for power in range(n + 2):
            value = {k: mpf(k) ** power for k in range(-3, 4)}
            assert _central_difference(value, n) == (math.factorial(n) if power == n else 0), (n, power)


def test_fourth_derivatives_are_those_of_the_third():
    """The tables end at the third."""
    oracle, step = Oracle(NOMINAL), mpf(2) ** -60
    for phi in (0.0, 1.5, 2.47, -20.0):
        for question in (oracle.tip, oracle.nozzle_angle, oracle.margin):
            with mp.workdps(50):
                fourth, after, before = question(phi, 4)[4], question(phi + step, 3)[3], question(phi - step, 3)[3]
                if question == oracle.tip:
                    fourth, after, before = mp.mpc(*fourth), mp.mpc(*after), mp.mpc(*before)
                slope = (after - before) / (2 * step)
                assert abs(fourth - slope) < abs(fourth) * mpf(10) ** -30, (question, phi)


@pytest.mark.parametrize("row", rows("geometries")[::6], ids=str)
def test_the_links_fit(row):
    """Lengths and angles of every part, sides of both branches, and the answers read off the joints."""
    g, oracle = {name: mpf(value) for name, value in row.geometry.items()}, Oracle(row.geometry)
    with mp.workdps(50):
        p = oracle.pose(row.phi)
        lengths = {"L1": p.A, "L2": p.B - p.A, "L3": p.B - p.D, "L4": p.D - mp.mpc(g["XC"], g["YC"])}
        lengths |= {"L5": p.E - p.D, "L6": p.F - p.E, "L7": p.F - p.G, "L8": p.I - p.H, "L9": p.J - p.I}
        turns = {
            "theta3": (p.B - p.D) / (p.E - p.D),  # from DE to DB
            "theta8": -(p.I - p.H) / (p.F - p.E),
            "theta9": (p.J - p.I) / (p.I - p.H),
        }
        assert max(abs(abs(vector) - g[name]) for name, vector in lengths.items()) < 1e-45
        assert max(abs(turn / abs(turn) - mp.expj(g[name])) for name, turn in turns.items()) < 1e-45
        assert abs(p.A / g["L1"] - mp.expj(g["phi1"] - row.phi)) < 1e-45, "crank OA turns clockwise"
        assert ((p.B - p.A) / (p.D - p.A)).imag < 0, "B is on the right of A to D"
        assert ((p.F - p.E) / (p.G - p.E)).imag < 0, "F is on the right of E to G"

        sines = [
            abs(((a - b) * mp.conj(c - b)).imag) / abs(a - b) / abs(c - b)
            for a, b, c in ((p.A, p.B, p.D), (p.E, p.F, p.G))
        ]
        assert abs(oracle.margin(row.phi, 0)[0] - min(sines)) < 1e-45
        nozzle = mp.expj(oracle.nozzle_angle(row.phi, 0)[0])
        assert abs(nozzle - (p.J - p.I) / g["L9"]) < 1e-45


def test_the_nozzle_angle_stays_within_half_a_turn_of_straight_down():
    values = [Oracle(NOMINAL | {"theta9": 0.1 + k}).nozzle_angle(1.0, 0)[0] for k in range(-14, 14)]
    assert -3 * mp.pi / 2 < min(values) < -4 and 1 < max(values) <= mp.pi / 2


def test_the_margin_vanishes_with_the_root_of_the_gap():
    """As the area of a triangle does when its longest side reaches the sum of the others."""
    closest = {(row.case, row.gap): row for row in reversed(rows("near_singular"))}  # each geometry's first row
    ratios = {}
    for (case, gap), row in closest.items():
        ratios.setdefault(case, []).append(float(Oracle(row.geometry).margin(row.phi, 0)[0]) / math.sqrt(gap))
    assert set(ratios) == {"ABD stretched", "ABD folded", "EFG stretched"}
    for case, found in ratios.items():
        assert 1 < max(found) < 1.02 * min(found), f"{case}: {found}"


def test_angles_are_differentiated_across_their_jump():
    """Exactly where the direction from D to B passes from 180 to -180 degrees, within a step of the differences."""
    oracle = Oracle(NOMINAL)
    with mp.workdps(55):
        jump = mp.findroot(lambda phi: (oracle.pose(phi).B - oracle.pose(phi).D).imag, (1.5, 1.55), solver="anderson")
        q, q_rate = oracle.derivatives(lambda pose: pose.B - pose.D, jump, 1)
        angle, rate = oracle.angle(lambda pose: mp.arg(pose.B - pose.D), jump, 1)
        assert abs(abs(angle) - mp.pi) < 1e-45
        assert abs(rate - (q_rate / q).imag) < 1e-45


def test_a_pose_that_cannot_close_is_refused():
    with pytest.raises(ValueError, match="ABD cannot close"):
        Oracle(NOMINAL | {"L2": 0.05}).tip(0.0, 0)
    with pytest.raises(ValueError, match="EFG cannot close"):
        Oracle(NOMINAL | {"L7": 0.1}).tip(0.0, 0)


@pytest.mark.parametrize("of", [Oracle.tip, Oracle.nozzle_angle, Oracle.margin])
def test_conditioning_is_what_one_unit_in_the_last_place_does(of):
    """The definition taken literally, without a derivative."""
    row, order = rows("geometries")[0], 2

    def answer(geometry, phi):
        found = of(Oracle(geometry), phi, order)
        return [value if isinstance(value, tuple) else (value,) for value in found]

    exact = answer(row.geometry, row.phi)
    changed = [answer(row.geometry, math.nextafter(row.phi, math.inf))]
    for name, value in row.geometry.items():
        changed.append(answer(row.geometry | {name: math.nextafter(value, math.copysign(math.inf, value))}, row.phi))
    for n, effects in enumerate(conditioning(row.geometry, row.phi, order, of)):
        for axis, effect in enumerate(effects):
            with mp.workdps(40):
                literal = float(sum(abs(other[n][axis] - exact[n][axis]) for other in changed))
            assert effect == pytest.approx(literal, rel=1e-9, abs=0)
