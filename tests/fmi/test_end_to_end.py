"""The FMU in fmpy, as its users run it: simulate_fmu, the command line, folders with names of all kinds."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv

from fmu_src.twin.linkage import Geometry, solve
from tests.conftest import BOTH_VERSIONS
from tests.harness.host import MACHINE_SPEED, PLANTING_SPEED

pytestmark = BOTH_VERSIONS

OUTPUTS = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay", "ground.x", "ground.vx", "machine.s")


@pytest.fixture
def fmu_file(fmu_files: dict[int, Path], version: int) -> Path:
    return fmu_files[version]


@pytest.fixture(scope="session")
def one_turn(fmu_files: dict[int, Path]) -> Path:
    """The example input table that the build writes beside the FMU of FMI 2.0."""
    path = fmu_files[2].with_name("one_turn.csv")
    if not path.exists():
        pytest.fail("build/fmi2/one_turn.csv is missing: run make build", pytrace=False)
    return path


def check_one_turn(result: np.ndarray) -> None:
    """One turn at even speed, exact to what the interpolation of the input table rounds."""
    time = result["time"]
    exact = solve(Geometry(), PLANTING_SPEED * time, 2)
    assert time[0] == 0 and time[-1] == pytest.approx(60 / 65, abs=1.1e-3) and len(time) > 900
    for n, names in enumerate((("tip.x", "tip.y"), ("tip.vx", "tip.vy"), ("tip.ax", "tip.ay"))):
        if names[0] in result.dtype.names:
            off = result[names[0]] + 1j * result[names[1]] - exact.tip[n] * PLANTING_SPEED**n
            assert np.abs(off).max() <= (2e-15, 2e-14, 1e-12)[n]
    assert np.abs(result["machine.s"] - MACHINE_SPEED * time).max() <= 1e-15
    assert np.abs(result["ground.x"] - result["tip.x"] - result["machine.s"]).max() <= 1e-15


def test_one_turn(fmu_file, one_turn):
    result = fmpy.simulate_fmu(
        str(fmu_file), input=read_csv(str(one_turn)), output_interval=1e-3, output=OUTPUTS, validate=True
    )
    check_one_turn(result)


def test_any_default_experiment_runs(fmu_file, one_turn):
    """Without any option: times and step of modelDescription.xml."""
    result = fmpy.simulate_fmu(str(fmu_file), input=read_csv(str(one_turn)))
    assert result["time"][-1] == pytest.approx(60 / 65, abs=1e-2)
    assert set(result.dtype.names) == {"time", *fmpy_outputs(fmu_file)}


def fmpy_outputs(fmu_file: Path) -> list[str]:
    description = fmpy.read_model_description(str(fmu_file))
    return [variable.name for variable in description.modelVariables if variable.causality == "output"]


def test_with_nothing_connected_it_stands_still(fmu_file):
    result = fmpy.simulate_fmu(str(fmu_file), output_interval=0.01, stop_time=0.1, output=["tip.x", "tip.vx"])
    assert set(result["tip.x"]) == {result["tip.x"][0]} and set(result["tip.vx"]) == {0.0}


def test_start_values(fmu_file):
    """Parameters by name, in SI units; the initial travel."""
    start = {"geometry.L1": 0.051, "machine.s": 2.0, "crank.phi": 1.0, "crank.at_step_end": True}
    result = fmpy.simulate_fmu(str(fmu_file), start_values=start, output_interval=0.01, stop_time=0.02, output=OUTPUTS)
    tip = solve(Geometry(L1=0.051), 1.0, 0).tip[0]
    assert result["tip.x"][-1] == pytest.approx(tip.real, abs=1e-15)
    assert result["machine.s"].tolist() == [2.0, 2.0, 2.0]


def test_starting_late(fmu_file):
    result = fmpy.simulate_fmu(str(fmu_file), start_time=1e3, stop_time=1e3 + 1, output_interval=0.1, output=["tip.x"])
    assert len(result) == 11


# ---- where it lies, how it is called -------------------------------------------------------------


@pytest.mark.parametrize("folder", ["spä ce", "100% & (more)", "種", "a" * 120])
def test_folders_of_all_names(fmu_file, one_turn, tmp_path, folder):
    """Loaded from there, and unpacked there."""
    place = tmp_path / folder
    place.mkdir()
    copy = place / fmu_file.name
    shutil.copy(fmu_file, copy)
    table = read_csv(str(one_turn))
    check_one_turn(fmpy.simulate_fmu(str(copy), input=table, output_interval=1e-3, output=OUTPUTS))
    unpacked = place / "unpacked"
    fmpy.extract(str(copy), str(unpacked))
    check_one_turn(fmpy.simulate_fmu(str(unpacked), input=table, output_interval=1e-3, output=OUTPUTS))


def run_fmpy(*arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [Path(sys.executable).with_name("fmpy"), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_fmpy_on_the_command_line(fmu_file, one_turn, tmp_path):
    place = tmp_path / "spä ce"
    place.mkdir()
    for file in (fmu_file, one_turn):
        shutil.copy(file, place)
    done = run_fmpy(
        "simulate", fmu_file.name, "--input-file", one_turn.name, "--output-interval", "0.001",
        "--output-file", "result.csv", folder=place,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    check_tip(read_csv(str(place / "result.csv")))


def check_tip(result: np.ndarray) -> None:
    off = result["tip.x"] - solve(Geometry(), PLANTING_SPEED * result["time"], 0).tip[0].real
    assert len(off) > 900 and np.abs(off).max() <= 1e-15


def test_fmpy_validates_it(fmu_file, tmp_path):
    done = run_fmpy("validate", fmu_file, folder=tmp_path)
    assert (done.returncode, done.stdout.strip()) == (0, "No problems found."), done.stderr


def test_fmpy_logs_no_problem(fmu_file, one_turn):
    """With debug logging on: not a word from the FMU in an ordinary run."""
    logged = []
    fmpy.simulate_fmu(
        str(fmu_file), input=read_csv(str(one_turn)), output_interval=1e-3, debug_logging=True,
        logger=lambda component, instance, status, category, message: logged.append(message),
    )  # fmt: skip
    assert logged == []
