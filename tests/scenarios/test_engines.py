"""The field row as SSP, and in engines that are not ours."""

from __future__ import annotations

import csv
import subprocess
import sys
import zipfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd
from lxml import etree

from scenarios.field_row import engine_run, engines, ssp
from scenarios.field_row import run as row_run
from scenarios.field_row.engine_run import ENGINES
from scenarios.field_row.partners.build import build as build_partners
from scenarios.field_row.system import ROW, Component, Port, System, SystemFault, load_system
from tests.conftest import PROJECT_ROOT
from tests.scenarios.conftest import HANG


def installed(key: str) -> bool:
    try:
        return bool(version(ENGINES[key].package))
    except PackageNotFoundError:
        return False


each_engine = pytest.mark.parametrize(
    "key",
    [
        pytest.param(key, marks=pytest.mark.skipif(not installed(key), reason="offered for Linux on x86_64 alone"))
        for key in ENGINES
    ],
)


@pytest.fixture(scope="module")
def row() -> row_run.Row:
    build_partners()
    return row_run.row_of(load_system(), 2)


@pytest.fixture(scope="module")
def archive(row: row_run.Row, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ssp.write(row.system, row.stop, tmp_path_factory.mktemp("ssp") / "new" / "row.ssp")


# --- the archive ----------------------------------------------------------------------------------


def test_another_reader_finds_the_components_connections_and_fmus(row: row_run.Row, archive: Path) -> None:
    description = read_ssd(str(archive))
    components = {c.name: c for c in description.system.elements}
    assert list(components) == [c.name for c in row.system.components]
    assert {
        (f"{c.startElement}.{c.startConnector}", f"{c.endElement}.{c.endConnector}")
        for c in description.system.connections
    } == {(str(o), str(i)) for i, o in row.system.connections.items()}
    with zipfile.ZipFile(archive) as files:
        experiment = etree.fromstring(files.read("SystemStructure.ssd")).find("{*}DefaultExperiment")
        assert (experiment.get("startTime"), float(experiment.get("stopTime"))) == ("0.0", row.stop)
        for component in row.system.components:
            assert files.read(components[component.name].source) == component.fmu.read_bytes()


def test_parameters_keep_all_their_digits(row: row_run.Row, archive: Path) -> None:
    with zipfile.ZipFile(archive) as files:
        values = etree.fromstring(files.read("resources/drivetrain.ssv"))
    written = {p.get("name"): p[0].get("value") for p in values.iter("{*}Parameter")}
    assert {name: float(value) for name, value in written.items()} == {
        port.variable: value for port, value in row.system.parameters.items()
    }
    assert written["speed.cruise"] == "0.43333333333333335"


def test_the_same_system_makes_the_same_file(row: row_run.Row, archive: Path, tmp_path: Path) -> None:
    assert ssp.write(row.system, row.stop, tmp_path / "again.ssp").read_bytes() == archive.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["again.ssp"]
    with zipfile.ZipFile(archive) as files:
        assert {info.date_time for info in files.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_the_standard_s_schema_is_asked(row: row_run.Row, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ssp, "_text", lambda value: "a lot")
    with pytest.raises(SystemFault, match="'a lot' is not a valid value"):
        ssp.structure(row.system, row.stop)


def test_what_cannot_be_connected_is_said(row: row_run.Row) -> None:
    with pytest.raises(SystemFault, match=r"drivetrain: Drivetrain\.fmu has no variable 'shaft.length'"):
        ssp.structure(row.system.with_parameters({"drivetrain.shaft.length": 1.0}), 1.0)


def test_the_command_writes_the_archive_and_says_where(tmp_path: Path) -> None:
    process = subprocess.run(
        [sys.executable, "-m", "scenarios.field_row.ssp", "--output", str(tmp_path / "row.ssp")],
        cwd=PROJECT_ROOT,
        capture_output=True,
        encoding="utf-8",
        timeout=HANG,
    )
    assert (process.returncode, process.stderr) == (0, "") and process.stdout == f"{tmp_path / 'row.ssp'}\n"


# --- the engines ----------------------------------------------------------------------------------


@pytest.mark.skipif(not any(map(installed, ENGINES)), reason="offered for Linux on x86_64 alone")
def test_every_engine_runs_the_row_as_our_master_does(tmp_path: Path) -> None:
    process = subprocess.run(
        [
            sys.executable,
            "-m",
            "scenarios.field_row.engines",
            "--plants",
            "2",
            "--step",
            "5",
            "--output",
            str(tmp_path / "report"),
            "--archive",
            str(tmp_path / "row.ssp"),
        ],
        cwd=PROJECT_ROOT,
        capture_output=True,
        encoding="utf-8",
        timeout=HANG,
    )
    assert (process.returncode, process.stderr) == (0, ""), process.stdout
    count = sum(map(installed, ENGINES))
    assert process.stdout.count("the same to the last bit") == count
    assert {path.name for path in (tmp_path / "report").iterdir()} == {"engines.md", "engines.csv", "engines.png"}
    with (tmp_path / "report" / "engines.csv").open(encoding="utf-8", newline="") as file:
        _, *rows = csv.reader(file)
    assert [row[0] for row in rows] == list(row_run.WATCHED)
    assert all(float(off) <= 1e-9 for row in rows for off in row[2:]) and all(len(row) == 2 + count for row in rows)
    moved = {row[0] for row in rows if float(row[1]) > 0}
    assert {"linkage.ground.x", "linkage.crank.tau", "soil.tip.fy", "conveyor.seedlings.caught"} <= moved


def test_the_engines_take_a_system_that_the_row_takes(tmp_path: Path) -> None:
    """What it does not offer is left out of the comparison, and named; its records are in SI."""
    options = ["--plants", "1", "--step", "10", "--output", str(tmp_path), "--archive", str(tmp_path / "row.ssp")]
    engines.main(["--system", str(ROW.with_name("drive_only.toml")), *options])
    text = (tmp_path / "engines.md").read_text(encoding="utf-8")
    assert "Not offered by the FMUs, and not compared: all of conveyor, all of soil.\n" in text
    assert text.count("not run") == len(ENGINES) - sum(map(installed, ENGINES))
    if installed("libcosim"):  # Ecos differs here, and the report says so
        assert "libcosim agrees with our Jacobi master in each of 19 signals" in text


def test_ecos_without_its_library_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_run, "files", lambda package: [])
    with pytest.raises(RuntimeError, match=r"oneTBB.*pip install tbb"):
        engine_run.ecos(Path("none"), 0.01, 0.01, ())


@each_engine
def test_an_engine_that_does_something_else_is_found_out(key: str, row: row_run.Row, archive: Path) -> None:
    """The archive holds two plants' worth of parameters; ours is told of a softer shaft."""
    step, count, watched = 5e-3, 200, ("drivetrain.crank.phi", "linkage.ground.x")
    other = row.system.with_parameters({"drivetrain.shaft.k": 1500.0})
    base = engines.ours(other, watched, np.arange(count) * step, np.full(count, step), lambda: None)
    found = engines.compare(key, other, archive, watched, base, step=step, stop=count * step, done=lambda: None)
    assert found.values is not None and not found.agrees and not found.same
    said = " ".join(engines.sentences([found], count, len(watched)))
    assert "does not agree with our Jacobi master" in said and "they differ in something else, too" in said


@each_engine
def test_other_names_and_units_reach_the_engine(key: str, fmu_file: Path, tmp_path: Path) -> None:
    """A linkage that declares its speed over ground in km/h gives it to one whose input is called otherwise."""
    foreign = tmp_path / "foreign.fmu"
    with zipfile.ZipFile(fmu_file) as source, zipfile.ZipFile(foreign, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                description = etree.fromstring(content)
                unit = etree.SubElement(description.find("UnitDefinitions"), "Unit", name="km/h")
                etree.SubElement(unit, "BaseUnit", m="1", s="-1", factor=repr(1 / 3.6))
                description.find("ModelVariables/*[@name='ground.vx']/Real").set("unit", "km/h")
                speed = description.find("ModelVariables/*[@name='ground.vx']/Real")
                if "displayUnit" in speed.attrib:
                    del speed.attrib["displayUnit"]
                content = etree.tostring(description, xml_declaration=True, encoding="UTF-8")
            target.writestr(name, content)
    system = System(
        (Component("front", foreign), Component("behind", fmu_file, {"speed": "machine.v"})),
        {Port("behind", "speed"): Port("front", "ground.vx")},
        {Port("front", "machine.v"): 1.0},
        {},
    )
    archive = ssp.write(system, 1.0, tmp_path / "two.ssp")
    step, count, watched = 0.1, 10, ("front.ground.vx", "behind.machine.s", "behind.ground.x")
    base = engines.ours(system, watched, np.arange(count) * step, np.full(count, step), lambda: None)
    assert base[-1, 1] == pytest.approx(1 / 3.6, rel=1e-12)
    found = engines.compare(key, system, archive, watched, base, step=step, stop=1.0, done=lambda: None)
    assert found.agrees, (found.problem, found.off)


@each_engine
def test_what_an_engine_says_when_it_fails_is_in_the_table(key: str, row: row_run.Row, tmp_path: Path) -> None:
    (tmp_path / "broken.ssp").write_bytes(b"no archive")
    found = engines.compare(
        key,
        row.system,
        tmp_path / "broken.ssp",
        ("linkage.ground.x",),
        np.zeros((3, 1)),
        step=0.01,
        stop=0.03,
        done=lambda: None,
    )
    assert not found.agrees and not found.missing and found.problem
    assert engines.agreement([found], ("linkage.ground.x",))[0][1:3] == ("not run", found.problem)


def test_an_engine_that_is_not_installed_is_said_and_is_no_failure(
    row: row_run.Row, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def none(package: str) -> str:
        raise PackageNotFoundError(package)

    monkeypatch.setattr(engines, "version", none)
    found = engines.compare("ecos", row.system, tmp_path, (), np.zeros((1, 0)), step=0.01, stop=0.01, done=lambda: None)
    assert found.missing and "ecospy is not installed" in found.problem
