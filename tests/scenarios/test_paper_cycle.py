"""The published planting cycle: what it computes, writes and says when it cannot run."""

from __future__ import annotations

import csv
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description

from scenarios.common.instance import Refused
from scenarios.common.linkage import LinkageFmu
from scenarios.paper_cycle import __main__ as paper_cycle
from tests.scenarios.conftest import HANG

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "build" / "fmi2" / "TransplanterLinkage.fmu"
FIGURES = [f"figure_{name}.png" for name in ("3", "4", "4_shapes", "5", "6", "7", "8")]
TABLES = ["cycle.csv", "families.csv", "table.csv", "table.md"]


@pytest.fixture(scope="session")
def fmu() -> Path:
    if not FMU.is_file():
        pytest.fail(
            f"There is no {FMU.relative_to(ROOT)}: run `make test`, which builds it, or `make build`.", pytrace=False
        )
    return FMU


@dataclass
class Finished:
    """One run as a user starts it, coarser than usual."""

    output: Path
    stdout: str
    stderr: str
    rows: dict[str, dict[str, str]]

    def value(self, key: str) -> float:
        return float(self.rows[key]["value"])


@pytest.fixture(scope="session")
def finished(fmu: Path, tmp_path_factory: pytest.TempPathFactory) -> Finished:
    output = tmp_path_factory.mktemp("reports") / "new" / "paper_cycle"
    process = subprocess.run(
        [sys.executable, "-m", "scenarios.paper_cycle", "--step", "0.5", "--fmu", str(fmu), "--output", str(output)],
        cwd=ROOT,
        capture_output=True,
        encoding="utf-8",
        timeout=HANG,
    )
    assert process.returncode == 0, process.stderr
    with (output / "table.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["key"]: row for row in csv.DictReader(file)}
    return Finished(output, process.stdout, process.stderr, rows)


@pytest.fixture(scope="session")
def linkage(fmu: Path) -> Iterator[LinkageFmu]:
    with LinkageFmu(fmu, spacing=0.4) as loaded:
        yield loaded


# --- what comes out ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "expected", "tolerance"),
    [
        ("plants_per_minute", 65.0, 1e-9),
        ("spacing", 400.0, 1e-6),
        ("closing", 0.0, 1e-9),
        ("top_angle", 357.86, 0.05),  # deg
        ("bottom_angle", 177.42, 0.05),
        ("height", 334.65, 0.05),  # mm
        ("hole_surface", 103.2, 0.1),
        ("right_wall", -7.3, 0.2),  # deg from vertical
        ("border_II", 61.3, 0.1),
        ("border_III", 124.5, 0.1),
        ("border_IV", 141.0, 0.1),
        ("border_V", 162.4, 0.1),
        ("border_VI", 196.7, 0.1),
        ("fastest", 141.66, 0.1),
    ],
)
def test_number_of_the_published_set(finished: Finished, key: str, expected: float, tolerance: float) -> None:
    assert finished.value(key) == pytest.approx(expected, abs=tolerance)


def test_greatest_speed(finished: Finished) -> None:
    assert finished.rows["fastest"]["computed"].startswith("1.773 m/s")


def test_the_table_says_where_the_model_contradicts_the_paper(finished: Finished) -> None:
    differing = {key for key, row in finished.rows.items() if row["verdict"] == "differs"}
    assert differing == {
        "phase_III",  # still faster, not slower
        "phase_IV",  # slower, not faster
        "lowest_in_IV",  # only at 177 deg
        "phase_V_rises",  # only its second half
        "phase_V_slows",  # only its first part
        "L1_hole_fixed_depth",  # under the other reading it agrees
        "L7_hole_fixed_surface",
        "one_reading",
    }


def test_what_the_paper_leaves_open_is_not_called_an_agreement(finished: Finished) -> None:
    left_open = {key for key, row in finished.rows.items() if row["verdict"] == "not determined"}
    assert {"hole_surface", "tray_height", "posture", "L1_65_refused", "L4_36_refused", "L7_270_refused"} <= left_open


def test_common_points_of_crank_oa(finished: Finished) -> None:
    assert finished.value("L1_common") < 0.3  # mm


@pytest.mark.parametrize("shape", ["kidney", "figure_8", "dolphin", "loaf", "crescent"])
def test_shapes_of_the_phase_difference(finished: Finished, shape: str) -> None:
    assert finished.rows[f"theta41_{shape}"]["verdict"] == "agrees"


def test_unreachable_values_are_reported_in_the_words_of_the_fmu(finished: Finished) -> None:
    assert "dyad ABD" in finished.rows["L1_65_refused"]["reason"]
    assert "dyad EFG" in finished.rows["L7_270_refused"]["reason"]
    assert "too short" in finished.rows["L7_270_refused"]["reason"]


def test_every_row_has_a_source_and_a_known_verdict(finished: Finished) -> None:
    for row in finished.rows.values():
        assert row["paper section"] and row["published"] and row["computed"]
        assert row["verdict"] in {"agrees", "differs", "not determined"}
        assert "nan" not in row["computed"]


# --- what is written and printed ---------------------------------------------------------


def test_all_files_are_written_and_listed(finished: Finished) -> None:
    assert sorted(path.name for path in finished.output.iterdir()) == sorted(FIGURES + TABLES)
    for name in FIGURES + TABLES:
        assert name in finished.stdout
    assert str(finished.output) in finished.stdout


@pytest.mark.parametrize("name", FIGURES)
def test_figures_are_sharp_enough_to_print(finished: Finished, name: str) -> None:
    data = (finished.output / name).read_bytes()
    width, _ = struct.unpack(">II", data[16:24])
    at = data.index(b"pHYs") + 4
    dots_per_metre, _ = struct.unpack(">II", data[at : at + 8])
    assert width >= 1400
    assert dots_per_metre * 0.0254 >= 149.9


def test_plain_output_is_ascii_without_colour_and_not_wide(finished: Finished) -> None:
    assert finished.stdout.isascii()
    assert "\x1b" not in finished.stdout
    assert max(len(line) for line in finished.stdout.splitlines() if line.startswith("|")) <= 120
    assert finished.stderr == ""  # no progress bar, no warnings


def test_the_terminal_the_markdown_and_the_csv_hold_the_same_table(finished: Finished) -> None:
    markdown = (finished.output / "table.md").read_text(encoding="utf-8")
    for row in finished.rows.values():
        assert f"| {row['published']} | {row['computed']} | {row['verdict']} |" in markdown
        assert row["computed"].split()[0] in finished.stdout
    verdicts = [row["verdict"] for row in finished.rows.values()]
    counts = [verdicts.count(verdict) for verdict in ("agrees", "differs", "not determined")]
    summary = "{} agree, {} differ, {} not determined by the paper".format(*counts)
    assert summary in finished.stdout
    assert summary in markdown


def test_cycle_csv_holds_time_angle_and_every_output(finished: Finished, fmu: Path) -> None:
    outputs = [v.name for v in read_model_description(str(fmu)).modelVariables if v.causality == "output"]
    lines = (finished.output / "cycle.csv").read_text().splitlines()
    assert lines[0].split(",") == ["time", "crank.phi", *outputs]
    samples = dict(zip(lines[0].split(","), np.loadtxt(lines[1:], delimiter=",").T, strict=True))
    assert len(samples["time"]) == 721
    assert samples["crank.phi"][-1] == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(samples["crank.phi"], samples["time"] * 65 / 60 * 2 * np.pi, atol=1e-10)
    np.testing.assert_allclose(samples["ground.x"] - samples["tip.x"], samples["time"] * 0.4 * 65 / 60, atol=1e-10)
    np.testing.assert_allclose(samples["ground.y"], samples["tip.y"], atol=1e-12)


def test_samples_belong_to_their_own_angle(linkage: LinkageFmu) -> None:
    """Were outputs one step late, runs with different steps would disagree by a step's travel."""
    coarse, fine = linkage.run(2.0), linkage.run(0.5)
    np.testing.assert_allclose(coarse["tip.x"], fine["tip.x"][::4], atol=1e-9)
    np.testing.assert_allclose(coarse["ground.y"], fine["ground.y"][::4], atol=1e-9)


def test_velocity_is_the_slope_of_the_position(linkage: LinkageFmu) -> None:
    turn = linkage.run(0.25)
    for position, velocity in (("tip.x", "tip.vx"), ("ground.x", "ground.vx"), ("tip.vy", "tip.ay")):
        slope = np.gradient(turn[position], turn.time)[1:-1]
        np.testing.assert_allclose(slope, turn[velocity][1:-1], atol=2e-3 * np.abs(turn[velocity]).max())


def test_a_refused_run_does_not_spoil_the_next(linkage: LinkageFmu) -> None:
    before = linkage.run(1.0)
    for length in (0.065, 0.080):  # fails during the turn, and at its start
        with pytest.raises(Refused, match="dyad ABD"):
            linkage.run(1.0, {"geometry.L1": length})
    after = linkage.run(1.0)
    assert np.array_equal(before["tip.x"], after["tip.x"])


# --- user's mistakes ---------------------------------------------------------------------


def edited(
    source: Path, target: Path, edit: Callable[[str], str], keep: Callable[[str], bool] = lambda name: True
) -> Path:
    """A copy of an FMU with another modelDescription.xml, or without some files."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in filter(keep, old.namelist()):
            data = old.read(name)
            new.writestr(name, edit(data.decode()).encode() if name == "modelDescription.xml" else data)
    return target


def failure(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """The message on stderr of a run that must end with exit status 1."""
    assert paper_cycle.main([str(argument) for argument in arguments]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "Traceback" not in captured.err
    return captured.err


def test_missing_fmu(tmp_path: Path) -> None:
    missing = tmp_path / "none.fmu"
    process = subprocess.run(
        [sys.executable, "-m", "scenarios.paper_cycle", "--fmu", str(missing), "--output", str(tmp_path / "out")],
        cwd=ROOT,
        capture_output=True,
        encoding="utf-8",
        timeout=HANG,
    )
    assert process.returncode == 1
    assert str(missing) in process.stderr and "make build" in process.stderr
    assert "Traceback" not in process.stderr
    assert not (tmp_path / "out").exists()


def test_file_that_is_no_fmu(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = tmp_path / "text.fmu"
    text.write_text("not a zip file")
    assert f"{text} cannot be read as an FMU" in failure(capsys, "--fmu", text, "--output", tmp_path / "out")


def test_archive_without_a_model_description(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    archive = tmp_path / "archive.fmu"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("readme.txt", "nothing here")
    assert f"{archive} cannot be read as an FMU" in failure(capsys, "--fmu", archive, "--output", tmp_path / "out")


def test_fmu_of_something_else(fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = edited(fmu, tmp_path / "other.fmu", lambda xml: xml.replace('name="tip.x"', 'name="hand.x"'))
    message = failure(capsys, "--fmu", other, "--output", tmp_path / "out")
    assert "is not the linkage" in message and "output tip.x" in message


def test_fmu_with_another_parameter_set(fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = edited(fmu, tmp_path / "other.fmu", lambda xml: xml.replace('start="0.018"', 'start="0.019"'))
    message = failure(capsys, "--fmu", other, "--output", tmp_path / "out")
    assert "does not start with the published set: its L4 is 19 mm" in message


def test_fmu_without_a_binary_for_this_platform(fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = edited(fmu, tmp_path / "other.fmu", lambda xml: xml, lambda name: not name.startswith("binaries/"))
    assert "cannot be loaded on this platform" in failure(capsys, "--fmu", other, "--output", tmp_path / "out")


def test_output_that_cannot_be_written(fmu: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    message = failure(capsys, "--fmu", fmu, "--output", blocked)
    assert f"cannot be written to {blocked}" in message


@pytest.mark.parametrize("step", ["0", "-1", "5", "nan", "fine"])
def test_step_out_of_range(step: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        paper_cycle.main([f"--step={step}"])
    assert ended.value.code == 2
    assert "from 0.001 to 1 degree" in capsys.readouterr().err
