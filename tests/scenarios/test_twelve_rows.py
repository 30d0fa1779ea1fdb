"""One row among twelve: what twelve instances on one crank give, write and cost."""

from __future__ import annotations

import csv
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from scenarios.common.instance import UnpackedFmu
from scenarios.common.linkage import LinkageFmu
from scenarios.common.operating_point import TURN
from scenarios.twelve_rows.__main__ import COUNTS, OUTPUTS, ROWS, STEPS, WEIGHT, Machine, cost_findings, cost_table


@pytest.fixture(scope="module")
def output(
    run_scene: Callable[..., subprocess.CompletedProcess[str]], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    folder = tmp_path_factory.mktemp("reports") / "new" / "twelve_rows"
    process = run_scene("twelve_rows", "--rounds", 3, "--output", folder)
    assert (process.returncode, process.stderr) == (0, "")
    assert "All 12 instances run from one loaded binary" in process.stdout
    return folder


@pytest.fixture(scope="module")
def turn(output: Path) -> np.ndarray:
    """rows x steps x (row, crank.phi, OUTPUTS) of the evenly mounted machine."""
    with (output / "turn.csv").open(encoding="utf-8", newline="") as file:
        headings, *rows = csv.reader(file)
    assert headings == ["row", "crank.phi", *OUTPUTS]
    return np.array(rows, dtype=float).reshape(ROWS, STEPS, -1)


def test_each_row_is_one_linkage_driven_alone_ahead_by_its_offset(turn: np.ndarray, fmu_file: Path) -> None:
    with LinkageFmu(fmu_file, spacing=0.4) as linkage:
        alone = linkage.run(360 / STEPS)
    for k, row in enumerate(turn):
        ahead = round((1 + np.arange(STEPS) + k * STEPS / ROWS)[0])
        for column, name in ((2, "tip.x"), (3, "tip.y")):
            expected = np.roll(alone[name][:-1], -ahead)
            assert np.abs(row[:, column] - expected).max() < 1e-11  # 12 digits are written


def test_a_weight_takes_no_work_over_a_turn_and_a_shaft_of_even_rows_hardly_swings(turn: np.ndarray) -> None:
    torque = turn[:, :, 5]
    lifted = np.ptp(turn[0, :, 3]) * WEIGHT
    work = torque.mean(axis=1) * TURN
    assert np.abs(work).max() < 1e-4 * lifted
    assert np.trapezoid(np.maximum(torque[0], 0), dx=TURN / STEPS) == pytest.approx(lifted, rel=1e-3)
    assert np.ptp(torque.sum(axis=0)) < 0.002 * ROWS * np.ptp(torque[0])


def test_cost_of_each_number_of_instances_is_written(output: Path) -> None:
    with (output / "cost.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    assert [int(row[0]) for row in rows] == list(COUNTS)
    assert all(np.isfinite(float(cell)) and float(cell) > 0 for row in rows for cell in row[:3])
    assert {path.name for path in output.iterdir()} == {"twelve_rows.md", "turn.csv", "cost.csv", "twelve_rows.png"}


def test_rows_do_not_share_anything(fmu_file: Path) -> None:
    with UnpackedFmu(fmu_file) as fmu, Machine(fmu, 2) as machine:
        machine.start((0.0, 0.25))
        both = machine.turn(8, 8)
        machine.start((0.25, 0.0))
        swapped = machine.turn(8, 8)
    assert np.array_equal(both[::-1], swapped)
    assert not np.allclose(both[0], both[1])


def taken(*each: list[float]) -> np.ndarray:
    """Times of a step: a row a round, of one instance 1 s, of so many more what each of them takes is given."""
    return np.column_stack(
        [np.ones(len(each[0])), *(np.array(times) * count for times, count in zip(each, (2, 4), strict=True))]
    )


def test_what_an_instance_costs_among_others_is_said_only_where_the_scatter_carries_it() -> None:
    noisy, dearer, cheaper = [0.9, 1.1, 1.6] * 3, [1.29, 1.3, 1.31] * 3, [0.79, 0.8, 0.81] * 3
    said = cost_findings(taken(noisy, dearer), (1, 2, 4))
    assert said[0] == "A step costs an instance more than alone among 4 (1.30 times)."
    assert said[1].startswith(
        "Among 2 no difference from one alone is seen beyond the scatter, whose upper quartile is"
    )
    assert cost_findings(taken(noisy, cheaper), (1, 2, 4))[0].startswith("A step costs an instance less than alone")
    # ratios that drift across one from third to third, though the middle half of all lies above it
    drifting = cost_findings(taken([0.9] * 2 + [1.3] * 10, [0.9, 1.1, 1.6] * 4), (1, 2, 4))
    assert drifting[0].startswith("Among 2, 4 no difference")
    assert [row[-1] for row in cost_table(taken(noisy, dearer), (1, 2, 4))] == ["", "no difference seen", "dearer"]


def test_without_an_fmu_it_says_what_to_do(
    run_scene: Callable[..., subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    process = run_scene("twelve_rows", "--output", tmp_path, fmu=tmp_path / "none.fmu")
    assert process.returncode == 1 and "run `make build`" in process.stderr and "Traceback" not in process.stderr
