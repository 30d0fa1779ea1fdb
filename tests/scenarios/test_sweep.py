"""Parameter studies: what is run, kept, refused, and gone on with after the worst."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from scenarios.common.instance import starts
from scenarios.field_row.partners.build import build as build_partners
from scenarios.field_row.scene import planted_row
from scenarios.sweep import __main__ as sweep
from scenarios.sweep.__main__ import Results, Study, front, main
from scenarios.sweep.figure import left_out
from scenarios.sweep.scenes import MEASURED, planting_cycle, run_point
from tests.conftest import PROJECT_ROOT
from tests.scenarios.conftest import HANG

RANGES = ("--parameter", "geometry.L1=0.045:0.055", "--parameter", "geometry.L4=0.016:0.020")
HERE = "tests.scenarios.test_sweep"
Run = Callable[..., subprocess.CompletedProcess[str]]


# --- scenes for these tests, run in Dask's workers ------------------------------------------------


def slow_and_counted(fmu: Path, parameters: Mapping[str, float], *, pause: float = 0.0) -> dict[str, float]:
    """Leaves a line for each run that it finishes, and gives what tells any two runs apart."""
    time.sleep(0.05)
    with Path(os.environ["SWEEP_TEST_LOG"]).open("a") as log:
        log.write(f"{parameters['geometry.L1']!r}\n")
    return {"by": os.getpid(), "at": time.time_ns()}


def sometimes_fatal(fmu: Path, parameters: Mapping[str, float]) -> dict[str, float]:
    """Ends its whole process, as an FMU that crashes does, for an L1 of 50 mm; raises for small ones."""
    if abs(parameters["geometry.L1"] - 0.05) < 1e-6:
        os.kill(os.getpid(), signal.SIGKILL)
    if parameters["geometry.L1"] < 0.046:
        raise ValueError("too small for this scene")
    return {"value": parameters["geometry.L1"]}


def sometimes_endless(fmu: Path, parameters: Mapping[str, float]) -> dict[str, float]:
    """Never returns, as an FMU that hangs does, for an L1 of 50 mm."""
    if abs(parameters["geometry.L1"] - 0.05) < 1e-6:
        ctypes.CDLL(None).pause()
    return {"value": parameters["geometry.L1"]}


def rows(output: Path) -> list[dict[str, object]]:
    """Every row in the files, repeated ones too."""
    return sorted(
        (row for path in (output / "results").glob("*.parquet") for row in pq.read_table(path).to_pylist()),
        key=lambda row: row["point"],
    )


# --- what is run ----------------------------------------------------------------------------------


def test_a_latin_hypercube_has_one_value_in_each_layer_and_is_the_same_again() -> None:
    study = Study("", "", {"a": (1.0, 3.0), "b": (-10.0, 10.0)}, 0, 50, 7)
    points = study.points()
    assert np.array_equal(points, study.points())
    for column, (low, high) in zip(points.T, study.ranges.values(), strict=True):
        assert sorted(np.floor((column - low) / (high - low) * 50).astype(int)) == list(range(50))
    assert not np.array_equal(points, Study("", "", study.ranges, 0, 50, 8).points())


def test_a_grid_has_every_combination_with_both_ends() -> None:
    points = Study("", "", {"a": (1.0, 3.0), "b": (0.0, 1.0)}, 3, 0, 1).points()
    assert sorted(map(tuple, points)) == [(a, b) for a in (1, 2, 3) for b in (0, 0.5, 1)]


def test_front_keeps_what_nothing_beats() -> None:
    values = np.array([[1, 5], [2, 2], [5, 1], [3, 3], [2, 2], [1, 6]], dtype=float)
    assert front(values).tolist() == [True, True, True, False, True, False]


def test_published_set_in_the_default_scene(fmu_file: Path) -> None:
    found = planting_cycle(fmu_file, {})
    assert found["hole"] == pytest.approx(0.0467, abs=1e-4) and found["height"] == pytest.approx(0.33465, abs=1e-4)
    assert found["lean"] == pytest.approx(np.radians(-4.72), abs=1e-3) and found["margin"] > 0.1
    assert found["swept"] == pytest.approx(0.0748, abs=1e-4)
    assert planting_cycle(fmu_file, {}, spacing=0.5)["hole"] > found["hole"] + 0.02
    assert planting_cycle(fmu_file, {}) == found


def test_the_field_row_is_a_scene_too(fmu_file: Path) -> None:
    build_partners()
    found = planted_row(fmu_file, {})
    wider = planted_row(fmu_file, {}, spacing=0.45)
    assert 0.03 < found["hole"] < 0.07 and wider["hole"] > found["hole"] + 0.01
    assert wider["depth"] == pytest.approx(found["depth"], abs=2e-3) and found["work"] > 0
    row = run_point("scenarios.field_row.scene:planted_row", fmu_file.read_bytes(), 7, {"geometry.L1": 0.065})
    assert (row["point"], row["status"]) == (7, "refused") and "mm too long for the two links" in row["message"]


def test_the_phase_difference_moves_phi4(fmu_file: Path) -> None:
    """Beside phi1 where that is varied as well; what is kept is what was asked for."""
    content, scene = fmu_file.read_bytes(), sweep.SCENE
    for phi1 in ({}, {"geometry.phi1": 1.5}):
        at = phi1.get("geometry.phi1", starts(fmu_file)["geometry.phi1"])
        row = run_point(scene, content, 0, {**phi1, "theta41": 3.3})
        direct = run_point(scene, content, 0, {**phi1, "geometry.phi4": at + 3.3})
        assert row["status"] == "done" and row["theta41"] == 3.3 and "geometry.phi4" not in row
        assert all(row[name] == direct[name] for name in MEASURED)


def test_the_picture_says_which_runs_it_lacks_and_why() -> None:
    statuses = ["done", "refused", "done", "failed", "refused", "refused", "done"]
    messages = ["", "dyad ABD at crank.phi = 1", "", "no end", "dyad ABD at crank.phi = 2", "impossible", None]
    assert left_out(statuses, np.array([0.05, *[np.nan] * 5, 0.04]), messages) == (
        "Not drawn: 2 make no whole turn (dyad ABD cannot close), 1 have a tip that does not rise to the surface, "
        "1 failed, 1 were refused by the FMU."
    )
    assert left_out(["done"], np.array([0.05]), [""]) == ""


# --- what is kept ---------------------------------------------------------------------------------


def test_rows_are_merged_without_loss_and_once_each_after_a_merge_that_was_cut_off(tmp_path: Path) -> None:
    results = Results(tmp_path)
    for key in range(600):
        results.add({"point": key, "value": key / 7, "message": ""} if key % 3 else {"point": key, "message": "no"})
    assert len(list(tmp_path.iterdir())) < 256
    kept = {path: path.read_bytes() for path in tmp_path.iterdir()}
    results.merge()
    for path, content in kept.items():
        path.write_bytes(content)  # as if the process had been killed before it deleted these
    (tmp_path / "torn.writing").write_bytes(b"PAR1 and no more")
    table = Results(tmp_path).table()
    assert table["point"].to_pylist() == list(range(600))
    assert table["value"].to_pylist() == [key / 7 if key % 3 else None for key in range(600)]
    assert not list(tmp_path.glob("*.writing"))


def test_killed_and_started_again_it_loses_nothing_and_repeats_nothing(
    fmu_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output, log, samples, workers = tmp_path / "sweep", tmp_path / "log", 60, 2
    line = [
        sys.executable,
        "-m",
        "scenarios.sweep",
        "--fmu",
        str(fmu_file),
        "--output",
        str(output),
        *RANGES,
        "--samples",
        str(samples),
        "--workers",
        str(workers),
        "--scene",
        f"{HERE}:slow_and_counted",
    ]
    environment = {**os.environ, "SWEEP_TEST_LOG": str(log)}

    def started(until: int) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            line,
            cwd=PROJECT_ROOT,
            env=environment,
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 - the tests have no threads
        )
        deadline = time.monotonic() + HANG
        while len(rows(output)) < until and time.monotonic() < deadline:
            time.sleep(0.01)
        return process

    killed = started(until=samples // 3)
    killed.send_signal(signal.SIGKILL)
    assert killed.wait() == -signal.SIGKILL
    time.sleep(1)  # for its workers to notice and end
    before, begun = rows(output), log.read_text().splitlines()
    assert samples // 3 <= len(before) < samples

    interrupted = started(until=len(before) + 5)
    os.killpg(interrupted.pid, signal.SIGINT)  # as a terminal does: to the workers, too
    said = interrupted.communicate(timeout=HANG)
    assert (interrupted.returncode, said[0]) == (130, "")
    assert said[1] == "Stopped. What was done is kept: the same command goes on from there.\n"
    stopped = len(rows(output))
    assert len(before) + 5 <= stopped < samples

    again = subprocess.run(line, cwd=PROJECT_ROOT, env=environment, capture_output=True, encoding="utf-8", timeout=HANG)
    assert (again.returncode, again.stderr) == (0, "")
    assert f"{samples} runs: {stopped} from before, {samples - stopped} now. {samples} done." in again.stdout
    after = rows(output)
    assert [row["point"] for row in after] == list(range(samples))
    assert all(after[row["point"]] == row for row in before)  # with the time and process that they had
    # Nothing that had been kept ran again; what ran twice are the few that were under way or not yet kept.
    finished = log.read_text().splitlines()
    kept = {repr(row["geometry.L1"]) for row in before}
    assert not kept & set(finished[len(begun) :])
    assert len(finished) - samples <= 2 * 16 * workers and len(set(finished)) == samples

    assert main(line[3:]) == 0 and f"{samples} from before, 0 now" in capsys.readouterr().out
    assert log.read_text().splitlines() == finished
    assert main([*line[3:], "--seed", "2"]) == 1 and "another study (seed differ" in capsys.readouterr().err
    assert rows(output) == after


def test_a_refused_geometry_is_a_row_with_the_fmu_s_message(run_scene: Run, tmp_path: Path) -> None:
    process = run_scene(
        "sweep",
        "--output",
        tmp_path,
        "--workers",
        1,
        "--grid",
        2,
        "--parameter",
        "geometry.L1=50mm:65mm",
        "--parameter",
        "scene.spacing=0.3:0.5",
    )
    assert (process.returncode, process.stderr) == (0, "")
    assert "4 runs: 0 from before, 4 now. 2 done, 2 refused." in process.stdout
    assert {path.name for path in tmp_path.iterdir()} >= {"results", "front.csv", "sweep.png", "study.json"}
    for row in rows(tmp_path):
        if row["geometry.L1"] == 0.065:
            assert row["status"] == "refused" and row["hole"] is None
            assert "dyad ABD at crank.phi = " in row["message"] and "mm too long for the two links" in row["message"]
        else:
            expected = {0.3: 0.0187, 0.5: 0.0747}[row["scene.spacing"]]
            assert row["status"] == "done" and row["hole"] == pytest.approx(expected, abs=2e-4)


def test_a_run_that_ends_its_process_is_a_row_and_not_the_end(run_scene: Run, tmp_path: Path) -> None:
    process = run_scene(
        "sweep",
        "--output",
        tmp_path,
        "--workers",
        1,
        "--grid",
        3,
        "--scene",
        f"{HERE}:sometimes_fatal",
        "--parameter",
        "geometry.L1=0.045:0.055",
    )
    assert process.returncode == 0, process.stderr
    small, middle, large = rows(tmp_path)
    assert (small["status"], small["message"]) == ("failed", "ValueError: too small for this scene")
    assert middle["status"] == "failed" and "the process that ran it ended" in middle["message"]
    assert (large["status"], large["value"]) == ("done", 0.055)  # though it waited in the process that ended


def test_a_run_that_does_not_end_costs_its_row_alone(run_scene: Run, tmp_path: Path) -> None:
    process = run_scene(
        "sweep", "--output", tmp_path, "--workers", 1, "--grid", 3, "--limit", 5,
        "--scene", f"{HERE}:sometimes_endless", "--parameter", "geometry.L1=0.045:0.055",
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    small, middle, large = rows(tmp_path)
    assert (middle["status"], middle["message"]) == ("failed", "no end within 5 s: its process was ended")
    assert [(row["status"], row["value"]) for row in (small, large)] == [("done", 0.045), ("done", 0.055)]


def test_on_a_cluster_whose_workers_know_neither_the_project_nor_the_file(run_scene: Run, tmp_path: Path) -> None:
    away, address = tmp_path / "away", tmp_path / "scheduler.json"
    away.mkdir()
    (away / "sitecustomize.py").write_text(
        f"import sys\nsys.path = [p for p in sys.path if p and p != {str(PROJECT_ROOT)!r}]\n"
    )
    (away / "prove.py").write_text("import scenarios\n")
    cli = [sys.executable, "-m"]
    common = {
        "cwd": away,
        "env": {**os.environ, "PYTHONPATH": str(away)},
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
    }
    assert subprocess.run([sys.executable, "prove.py"], **common).returncode != 0
    scheduler = subprocess.Popen(
        [
            *cli,
            "distributed.cli.dask_scheduler",
            "--port",
            "0",
            "--no-dashboard",
            "--scheduler-file",
            str(address),
            "--host",
            "127.0.0.1",
        ],
        **common,
    )
    worker = subprocess.Popen(
        [
            *cli,
            "distributed.cli.dask_worker",
            "--scheduler-file",
            str(address),
            "--no-dashboard",
            "--nthreads",
            "1",
            "--no-nanny",
            "--local-directory",
            str(away),
        ],
        **common,
    )
    try:
        deadline = time.monotonic() + HANG
        while not address.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        process = run_scene(
            "sweep",
            "--output",
            tmp_path / "sweep",
            "--samples",
            6,
            *RANGES,
            "--scheduler",
            json.loads(address.read_text())["address"],
        )
        assert "6 runs: 0 from before, 6 now. 6 done." in process.stdout, process.stderr
    finally:
        for each in (worker, scheduler):
            each.terminate()
            each.wait()


# --- what cannot be run ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--parameter", "geometry.L11=1:2"), "real parameter geometry.L11; they have body.AB.J, body.AB.m, "),
        (("--parameter", "scene.speed=1:2"), "real parameter scene.speed; they have"),
        (("--parameter", "theta41=1:2", "--parameter", "geometry.phi4=1:2"), "phi4 and theta41 cannot both be varied"),
        (("--parameter", "theta41=1mm:2mm"), "theta41: '1mm' is not an angle; units are rad, deg"),
        (("--parameter", "geometry.L1=1deg:2deg"), "geometry.L1: '1deg' is not a length; units are m, mm, cm"),
        (("--parameter", "geometry.L1=2:1"), "'geometry.L1=2:1' is not NAME=LOW:HIGH with LOW below HIGH"),
        (("--scene", "scenarios.sweep.scenes:none"), "There is no scene 'scenarios.sweep.scenes:none'"),
        (("--limit", "0"), "'0' is not a time in s above 0"),
        (("--samples", "0"), "'0' is not a whole number from 1"),
        (("--scheduler", "tcp://127.0.0.1:9"), "There is no Dask scheduler at tcp://127.0.0.1:9"),
    ],
)
def test_what_cannot_be_run_is_said_in_a_line(
    fmu_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    said: str,
) -> None:
    monkeypatch.setattr(sweep, "PATIENCE", "1s")
    try:
        status = main(["--fmu", str(fmu_file), "--output", str(tmp_path), *arguments])
    except SystemExit as end:  # argparse
        status = end.code
    assert status != 0 and said in capsys.readouterr().err
    assert not (tmp_path / "results").exists() or not list((tmp_path / "results").iterdir())
