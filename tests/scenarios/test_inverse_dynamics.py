"""Inverse dynamics beside its peers: the question, each way that is there, and what is written."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from scenarios.speed_vs_error.dynamics import peers, report, task
from scenarios.speed_vs_error.dynamics.task import ORDER, TORQUES
from scenarios.speed_vs_error.solving import measure, way
from scenarios.speed_vs_error.solving.in_c import Library
from scenarios.speed_vs_error.solving.way import CORE, SPEED, Way

PHI = way.angles(24)
EXACT = (1e-13, 1e-15, 1e-13)  # N m, kg m2, N m
PEERS = {"CasADi": "casadi", "numba": "numba"}  # by the module that each needs


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return task.truth(PHI)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("dynamics")


@pytest.fixture(scope="module")
def library(folder: Path) -> Library:
    return Library(folder)


def check(one: Way, exact: np.ndarray) -> None:
    errors, why = measure.verify(one, ORDER, PHI, exact, TORQUES)
    assert not why, f"{one.title}: {why}"
    assert all(error <= bound for error, bound in zip(errors, EXACT, strict=True)), (one.title, errors)
    assert one.nanoseconds(PHI, ORDER) > 0


def test_the_question_has_inertia_weight_and_soil_in_it(exact):
    """No share is so small that a way could leave it out."""
    torque, inertia, bias = exact[:, :, 0].T
    assert torque == pytest.approx(inertia * task.ACCELERATION + bias, rel=1e-14, abs=1e-14)
    assert np.ptp(inertia) > 0.05 and np.ptp(bias) > 5
    assert all(task.MASSES[f"body.{body}.m"] > 0 for body in ("OA", "CD", "AB", "DE", "EF", "GF")) and SPEED > 6


def test_ours(library, fmu_file, exact):
    for one in report.ways_in_c(library, fmu_file):
        check(one, exact)


@pytest.mark.parametrize("body", ["OA", "CD", "AB", "DE", "EF", "GF"])
def test_a_body_left_out_is_seen(library, exact, body):
    masses = {name: 0.0 if name.startswith(f"body.{body}.") else value for name, value in task.MASSES.items()}
    library.give_masses(list(masses.values()), task.LOAD)
    one = library.way(CORE, "core", way.OURS, c_name="core_dynamics", question=TORQUES)
    errors, _ = measure.verify(one, ORDER, PHI, exact, TORQUES)
    assert min(errors) > 1e3 * max(EXACT)


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_that_is_installed_gives_right_answers(name, library, folder, exact):
    pytest.importorskip(PEERS[name], reason="only make bench installs it")
    for one in peers.builders(library, folder)[name]():
        check(one, exact)


def test_a_wrong_torque_is_reported_and_not_timed(exact):
    def never(phi: np.ndarray, order: int) -> float:
        raise AssertionError("timed though wrong")

    bad = Way("bad", "bad", way.PEER, lambda phi, _: exact[:, :, 0] * [0.5, 1, 1], never)
    errors, why = measure.verify(bad, ORDER, PHI, exact, TORQUES)
    assert why.startswith("wrong: torque off by") and why.split(", where")[0].endswith("N m") and errors[1] < 1e-15


def test_what_is_written(tmp_path, fmu_file):
    section, files = report.perform(tmp_path, fmu_file, 3, 24, with_peers=False)
    assert section.startswith("## Inverse dynamics\n") and "Measured on: " in section
    assert "| exact core, C | 1.00 |" in section and "| peers | missing |" in section
    assert [path.name for path in files] == ["dynamics.csv"]
    with files[0].open(newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [row["key"] for row in table] == [CORE, "fmu_in_c", ""]
    assert float(table[1]["of_core"]) > 1 and float(table[1]["torque_error_N_m"]) < EXACT[0]
    assert table[2]["remark"] == "missing: left out"
