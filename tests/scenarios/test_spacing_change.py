"""Changing the plant spacing while driving: the drive, the plants, and what the report says."""

from __future__ import annotations

import csv
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from scenarios.spacing_change.__main__ import HEADINGS, PLANTS, SPACINGS, STEP, drive

V = 0.4 * 65 / 60  # m/s


@pytest.fixture(scope="module")
def finished(
    run_scene: Callable[..., subprocess.CompletedProcess[str]], tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, list[dict[str, str]]]:
    folder = tmp_path_factory.mktemp("reports") / "new" / "spacing_change"
    process = run_scene("spacing_change", "--output", folder)
    assert (process.returncode, process.stderr) == (0, "")
    assert {path.name for path in folder.iterdir()} == {"spacing_change.md", "plants.csv", "spacing_change.png"}
    with (folder / "plants.csv").open(encoding="utf-8", newline="") as file:
        return " ".join(process.stdout.split()), list(csv.DictReader(file))


def test_the_drive_turns_once_a_spacing_and_knows_its_own_rates() -> None:
    given, spacing = drive(V)
    phi, w, a = (given[name] for name in ("crank.phi", "crank.w", "crank.a"))
    assert phi[-1] / (2 * np.pi) == pytest.approx(sum(PLANTS), abs=V * STEP / SPACINGS[1])
    assert (spacing[0], spacing[-1]) == pytest.approx(SPACINGS) and np.all(np.diff(spacing) >= 0)
    assert np.abs(np.gradient(phi, STEP)[1:-1] - w[1:-1]).max() < 1e-3  # at the two bends; 1e-7 between
    assert np.median(np.abs(np.gradient(phi, STEP)[1:-1] - w[1:-1])) < 1e-7
    assert np.median(np.abs(np.gradient(w, STEP)[1:-1] - a[1:-1])) < 1e-6


def test_every_plant_of_the_way_is_found_at_its_spacing(finished: tuple[str, list[dict[str, str]]]) -> None:
    rows = finished[1]
    assert len(rows) == sum(PLANTS) and list(rows[0]) == list(HEADINGS)
    spacing = np.array([float(row["S / mm"]) for row in rows])
    apart = np.array([float(row["apart / mm"]) for row in rows[1:]])
    # From one plant to the next the machine drives what the spacings at both amount to, but at the two bends.
    off = np.abs(apart - 0.5 * (spacing[1:] + spacing[:-1]))
    assert np.median(off) < 0.3 and off.max() < 1
    assert (spacing[0], spacing[-1]) == (300, 500) and apart[-1] == 500


def test_the_hole_grows_with_the_spacing_and_is_the_published_one_at_400_mm(
    finished: tuple[str, list[dict[str, str]]],
) -> None:
    rows = finished[1]
    spacing, hole, steady = (
        np.array([float(row[name]) for row in rows]) for name in ("S / mm", "hole / mm", "steady / mm")
    )
    assert np.interp(400, spacing, hole) == pytest.approx(46.7, abs=0.15)
    assert np.abs(hole - steady).max() <= 0.15
    assert np.all(np.diff(hole) >= 0) and np.ptp(hole) > 50


def test_the_nozzle_s_angle_is_that_of_the_machine_and_the_tip_s_speed_is_not(
    finished: tuple[str, list[dict[str, str]]],
) -> None:
    printed, rows = finished
    for name, angle in (("nozzle in / deg", 5.7), ("lowest / deg", -4.7), ("out / deg", -19.3)):
        assert {float(row[name]) for row in rows} == {angle}
    speed = [float(row["tip lowest / m/s"]) for row in rows]
    assert speed[0] < 0 < speed[-1] and "it stands still over ground at S = 338 mm" in printed


def test_another_fmu_is_named_in_one_line(
    run_scene: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    wrong = tmp_path / "wrong.fmu"
    wrong.write_text("no zip")
    process = run_scene("spacing_change", "--output", tmp_path, fmu=wrong)
    assert process.returncode == 1 and len(process.stderr.splitlines()) == 1 and "wrong.fmu" in process.stderr
