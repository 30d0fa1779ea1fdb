"""Masses of a plausible machine: where each piece lies, what they weigh; the row planted with them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from scenarios.common.instance import UnpackedFmu
from scenarios.common.linkage import Linkage
from scenarios.common.masses import BODIES, STEEL, Piece, bar, pieces, plausible, together, tube
from scenarios.field_row import __main__ as field_row
from scenarios.field_row import mass_study
from scenarios.field_row import run as row_run
from scenarios.field_row.partners.build import build
from scenarios.field_row.system import System, SystemFault, load_system

FMU = Path(__file__).resolve().parents[2] / "build" / "fmi2" / "TransplanterLinkage.fmu"
GEOMETRY = {"L1": 0.05, "L2": 0.105, "L3": 0.105, "L4": 0.018, "L5": 0.24, "L6": 0.07, "L7": 0.25, "L8": 0.055}
GEOMETRY |= {"L9": 0.2, "theta3": math.radians(28), "theta8": math.radians(105), "theta9": math.radians(80)}


@pytest.fixture(scope="module")
def system(fmu_files) -> System:
    build()
    return load_system()


# --- sections -----------------------------------------------------------------------------------


def test_a_bar_is_as_heavy_and_inert_as_its_particles():
    """A grid of particles over its rectangle, and over the tube's wall, as seen from across."""
    piece = bar(0, 0.1j, wide=0.03, thick=0.01, density=STEEL, beyond=0.02)
    n = 400
    along, across = ((np.arange(n) + 0.5) / n - 0.5 for _ in "xy")
    expected = piece.m * np.mean((0.14 * along[:, None]) ** 2 + (0.03 * across[None, :]) ** 2)
    assert piece.m == pytest.approx(7850 * 0.14 * 0.03 * 0.01) and piece.centre == 0.05j
    assert piece.inertia == pytest.approx(expected, rel=1e-5)
    piece = tube(0, 0.2, outside=0.05, wall=0.003, density=STEEL)
    radius = np.sqrt(np.linspace(0.022**2, 0.025**2, 2 * n + 1)[1::2])  # rings of equal mass
    across = np.mean(radius**2) / 2  # of a ring: the mean of (r sin)^2
    assert piece.m == pytest.approx(7850 * 0.2 * math.pi * (0.025**2 - 0.022**2))
    assert piece.inertia == pytest.approx(piece.m * (np.mean((0.2 * along) ** 2) + across), rel=1e-5)


def test_pieces_put_together_are_steiners():
    halves = [bar(0, 0.06, wide=0.02, thick=0.01, density=STEEL, beyond=0.0),
              bar(0.06, 0.2, wide=0.02, thick=0.01, density=STEEL, beyond=0.0)]  # fmt: skip
    whole, parts = bar(0, 0.2, wide=0.02, thick=0.01, density=STEEL, beyond=0.0), together(halves)
    assert (parts.m, parts.centre, parts.inertia) == pytest.approx((whole.m, whole.centre, whole.inertia))
    assert together([Piece(1.0, 0j, 0.0), Piece(1.0, 2 + 0j, 0.0)]).inertia == 2.0


def test_the_machine_weighs_what_is_said():
    found = plausible(GEOMETRY)
    assert sum(found[f"body.{body}.m"] for body in BODIES) == pytest.approx(3.4, abs=0.05)
    assert found["body.EF.m"] == pytest.approx(1.2, abs=0.05)
    longer = plausible(GEOMETRY | {"L7": 0.3})
    assert {name for name, value in longer.items() if value != found[name]} == {"body.GF.m", "body.GF.x", "body.GF.J"}


def test_the_nozzle_is_where_the_linkage_has_it(fmu_files):
    """Its ends I and J, as the pieces are drawn, are those of the FMU."""
    _, holder, nozzle = pieces(GEOMETRY)["EF"]
    with UnpackedFmu(FMU) as fmu, Linkage(fmu, "linkage") as linkage:
        linkage.setup().enter().set({"crank.phi": 0.7})
        e, f, h, i, j = (complex(*linkage.get(f"joint.{p}.x", f"joint.{p}.y")) for p in "EFHIJ")
    along = (f - e) / abs(f - e)
    assert (h + i) / 2 - e == pytest.approx(holder.centre * along, abs=1e-15)
    assert (i + j) / 2 - e == pytest.approx(nozzle.centre * along, abs=1e-15)


def test_the_plate_is_where_the_linkage_has_it(fmu_files):
    _, arm = pieces(GEOMETRY)["DE"]
    with UnpackedFmu(FMU) as fmu, Linkage(fmu, "linkage") as linkage:
        linkage.setup().enter().set({"crank.phi": 0.7})
        b, d, e = (complex(*linkage.get(f"joint.{p}.x", f"joint.{p}.y")) for p in "BDE")
    assert (b + d) / 2 - d == pytest.approx(arm.centre * (e - d) / abs(e - d), abs=1e-15)


# --- the row ------------------------------------------------------------------------------------


def test_energy_is_accounted_for_with_masses(system):
    """At 2 ms to 0.1 % of the tractor's work, and of order 2."""
    heavy = system.with_parameters(field_row.masses_of(system))
    row = row_run.row_of(heavy, 3)
    off = {}
    for step in (2e-3, 4e-3):
        record = row_run.run(row.system, "extrapolated", step, row.stop)
        off[step] = abs(record.imbalance).max() / record["drivetrain.energy.tractor"][-1]
        assert record.has_masses and 2.5 < record.links.max() < 3.5
        assert record.links.max() > 20 * abs(record.imbalance).max()  # so that leaving it out would show
    assert off[2e-3] < 1e-3
    assert math.log2(off[4e-3] / off[2e-3]) == pytest.approx(2, abs=0.6)


def test_masses_follow_the_geometry_that_is_set(system):
    nominal = field_row.masses_of(system)
    assert nominal["linkage.body.GF.x"] == pytest.approx(0.125)
    assert field_row.masses_of(system, {"linkage.geometry.L7": 0.3})["linkage.body.GF.x"] == pytest.approx(0.15)
    assert field_row.masses_of(system.with_parameters({"linkage.geometry.L7": 0.2}))["linkage.body.GF.x"] == 0.1
    with pytest.raises(SystemFault, match=r"^--masses: the system has no component 'linkage'"):
        field_row.masses_of(System((), {}, {}, {}))


def test_the_scene_with_masses(system, tmp_path, capsys):
    """What is set goes before what is assumed."""
    arguments = ["--masses", "--set", "linkage.body.EF.m=2", "--plants", "1", "--no-study", "--step", "5"]
    assert field_row.main([*arguments, "--output", str(tmp_path)]) == 0
    text = (tmp_path / "field_row.md").read_text(encoding="utf-8")
    assert "| stored in the links |" in text
    assert field_row.main([*arguments[1:], "--output", str(tmp_path / "without")]) == 0
    alone = (tmp_path / "without" / "field_row.md").read_text(encoding="utf-8")
    assert "force of the linkage on the machine" in text and text != alone


# --- what the drive is handed over --------------------------------------------------------------


@pytest.fixture(scope="module")
def light(system) -> tuple[System, dict, np.ndarray, np.ndarray]:
    """The system, its masses, and times and true angles of the soft, light drive over a turn."""
    masses = field_row.masses_of(system)
    stop = mass_study.turned(system, 1.0)[1]
    times = np.arange(round(stop / 1e-3) + 1) * 1e-3
    return system, masses, times, mass_study.truth(system, masses, times)[0]


def test_torque_diverges_where_inertia_and_bias_keep_their_order(light):
    system, masses, _, phi = light
    inertia, held, torque, torque_held = mass_study.HANDS

    def worst(hand: mass_study.Hand, step: float) -> float | None:
        record = mass_study.stepped(mass_study.soft(system, masses, hand=hand), step, 1.0)
        if record is None:
            return None
        return float(abs(record["drivetrain.crank.phi"] - phi[:: round(step / 1e-3)]).max())

    for hand, order, most in ((inertia, 2, 3e-4), (held, 1, 5e-3)):
        coarse, fine = worst(hand, 4e-3), worst(hand, 2e-3)
        assert math.log2(coarse / fine) == pytest.approx(order, abs=0.3), hand.key
        assert fine < most, hand.key
    for hand in (torque, torque_held):
        assert worst(hand, 1e-3) is worst(hand, 2e-3) is None, hand.key


def test_a_drive_heavier_than_the_linkage_may_be_given_the_torque(system):
    """So it is the inertia that makes it diverge, and without masses nothing does."""
    masses, held = field_row.masses_of(system), mass_study.HANDS[3]
    largest = mass_study.largest(system, masses)
    assert largest == pytest.approx(0.1136, abs=1e-3)
    for inertia, is_bounded in ((1.2 * largest, True), (0.5 * largest, False)):
        record = mass_study.stepped(mass_study.soft(system, masses, inertia, held), 2e-3, 1.0)
        assert (record is not None) == is_bounded, inertia
    assert mass_study.stepped(mass_study.soft(system, {}, mass_study.LIGHT, held), 2e-3, 1.0) is not None


def test_the_truth_knows_nothing_of_steps(light):
    """Asked for at other times it says the same, and the drive runs as unevenly as it does in small steps."""
    system, masses, times, phi = light
    again, _ = mass_study.truth(system, masses, times[::50])
    assert again == pytest.approx(phi[::50], abs=1e-8)
    record = mass_study.stepped(mass_study.soft(system, masses), 0.5e-3, 1.0)
    assert abs(record["drivetrain.crank.phi"][::2] - phi).max() < 3e-5


def test_the_shares_are_the_torque(system):
    """All causes, each asked for alone, make what the row recorded, on uneven ground speed too."""
    heavy = system.with_parameters(field_row.masses_of(system) | {"drivetrain.disturbance.f": 3.0})
    row = row_run.row_of(heavy, 2)
    record = row_run.run(row.system, "extrapolated", 1e-3, row.stop, watched=mass_study.WATCHED)
    _, shares = mass_study.split(row.system, record)
    part = mass_study.middle_turn(record)[2]
    away = record["soil.tip.depth"][part] < 0  # in the soil, the force of the step's end is predicted
    for name, most in (("inertia", 4.0), ("weight", 4.0), ("machine", 0.02)):
        assert abs(shares[name]).max() > most, name
    recorded = record["linkage.crank.tau"][part]
    assert sum(shares.values())[away] == pytest.approx(recorded[away], abs=8e-3)
    assert sum(shares.values()) == pytest.approx(recorded, abs=0.3)
    assert abs(sum(shares.values()) - shares["machine"] - recorded)[away].max() > 0.02


def test_the_report_shows_what_masses_do(system, tmp_path, monkeypatch, capsys):
    """With the study; few runs."""
    row_study = field_row.row_study
    few = {"STEPS_MS": (5.0, 10.0), "TRUTH_MS": 1.0, "LIMIT_MS": 2.0, "TOLERANCES": (10.0,), "PLANTS": 1}
    for name, value in few.items():
        monkeypatch.setattr(row_study, name, value)
    for name, value in (("STEPS_MS", (5.0, 10.0)), ("HALVINGS", 2), ("PLANTS", 1), ("STEP", 5e-3)):
        monkeypatch.setattr(mass_study, name, value)
    assert field_row.main(["--masses", "--plants", "1", "--step", "5", "--output", str(tmp_path)]) == 0
    text = (tmp_path / "field_row.md").read_text(encoding="utf-8")
    part = text[text.index("## Masses") :]
    assert "nan" not in part.lower() and "diverges" in part
    for picture in ("masses.png", "drive.png"):
        assert f"({picture})" in text and (tmp_path / picture).read_bytes().startswith(b"\x89PNG")
    assert "What masses do" in capsys.readouterr().out
