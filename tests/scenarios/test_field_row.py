"""The field row: masters, swapped FMUs, what the scene finds and writes, what it says when it cannot run."""

from __future__ import annotations

import csv
import math
import re
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from lxml import etree
from PIL import Image

from fmu_src.exporter.compiler import compile_library, host_platform
from scenarios.field_row import __main__ as field_row
from scenarios.field_row import run as row_run
from scenarios.field_row import study as row_study
from scenarios.field_row.masters import CoSimulation, controlled_steps, extrapolated, fixed_steps, jacobi
from scenarios.field_row.partners.build import build
from scenarios.field_row.run import EMPTY, MISSED, PLANTED, Record
from scenarios.field_row.system import ROW, Port, System, SystemFault, load_system
from tests.scenarios.conftest import HANG

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "build" / "fmi2" / "TransplanterLinkage.fmu"
ONE_PLANT = 2.4  # s: the first hole lies behind


@pytest.fixture(scope="module")
def system() -> System:
    if not FMU.is_file():
        pytest.fail(
            f"There is no {FMU.relative_to(ROOT)}: run `make test`, which builds it, or `make build`.", pytrace=False
        )
    build()
    return load_system()


@pytest.fixture(scope="module")
def truth(system) -> Record:
    return row_run.run(system, "extrapolated", 0.5e-3, ONE_PLANT)


def worst_error(record: Record, truth: Record) -> float:
    true = np.interp(record.time, truth.time, row_study.place(truth))
    return float(abs(row_study.place(record) - true).max())


# --- masters ------------------------------------------------------------------------------------


def test_orders_of_masters_and_of_the_energy(system, truth):
    def of(master: str, step: float) -> tuple[float, float]:
        record = row_run.run(system, master, step, ONE_PLANT)
        return worst_error(record, truth), float(abs(record.imbalance).max())

    for master, order in (("jacobi", 1), ("gauss-seidel", 1), ("extrapolated", 2)):
        (coarse, coarse_energy), (fine, fine_energy) = of(master, 4e-3), of(master, 2e-3)
        assert math.log2(coarse / fine) == pytest.approx(order, abs=0.35), master
        assert math.log2(coarse_energy / fine_energy) == pytest.approx(order, abs=0.35), master
        assert fine < {1: 2e-4, 2: 4e-5}[order], master
    assert abs(truth.imbalance).max() < 2e-3  # J, of about 10
    assert truth["drivetrain.energy.tractor"][-1] > 9


def test_masters_agree_where_steps_are_small(system, truth):
    """Jacobi at two steps, taken to the limit, comes to the same truth."""
    fine, coarse = (row_run.run(system, "jacobi", h, ONE_PLANT) for h in (1e-3, 2e-3))
    limit = 2 * row_study.place(fine)[::2] - row_study.place(coarse)
    assert abs(limit - row_study.place(truth)[::4]).max() < 6e-6


def test_controlled_steps_keep_what_they_are_told(system, truth):
    loose, tight = (row_run.run(system, "controlled", 0.0, ONE_PLANT, tolerance=t) for t in (10.0, 0.3))
    assert worst_error(loose, truth) < 5e-5 and 3 * worst_error(tight, truth) < worst_error(loose, truth)
    assert loose.steps_done < tight.steps_done
    assert len(loose.time) - 1 < loose.steps_done / 3 + 1  # each step is three
    steps = np.diff(tight.time)
    assert steps.min() < 1e-3
    assert 4e-3 < steps.max() <= 5e-3 + 1e-12
    assert loose.time[-1] == pytest.approx(ONE_PLANT, abs=1e-9)
    # the same fixed step costs as many steps, and errs more
    same = row_run.run(system, "extrapolated", round(ONE_PLANT / tight.steps_done, 4), ONE_PLANT)
    assert worst_error(same, truth) > 1.5 * worst_error(tight, truth)


def test_a_step_taken_back_leaves_nothing_behind(system):
    with CoSimulation(system, row_run.WATCHED) as row:
        for _ in fixed_steps(row, extrapolated, 1.3, 0.005):
            pass
        saved, ends = row.save(), []
        for _ in range(2):
            row.restore(saved)
            for i in range(40):
                extrapolated(row, 1.3 + i * 0.004, 0.004)
            ends.append(row.values())
        row.free(saved)
    assert ends[0] == ends[1]


def test_rates_bring_the_linkages_own_error_below_the_rest(system, truth):
    """With angle, speed and acceleration connected, Jacobi steps of 5 ms: ten times below the rest of the system."""
    with row_study.UnpackedFmu(FMU) as folder, row_study.Linkage(folder, "true") as linkage:
        found = {}
        for way in row_study.LINKAGE:
            record = row_run.run(way.of(system), "jacobi", 5e-3, ONE_PLANT)
            exact = row_study.true_place(linkage, record)
            true = np.interp(record.time, truth.time, row_study.place(truth))
            found[way.key] = abs(row_study.place(record) - exact).max(), abs(exact - true).max()
    own, rest = found["rates"]
    assert rest > 10 * own
    assert found["held"][0] > 8e-3 > 100 * own
    assert own <= found["angle_speed"][0] * 1.001 < found["angle"][0]


# --- systems ------------------------------------------------------------------------------------

FOREIGN_XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="ForeignDrive" guid="{{foreign}}">
  <CoSimulation modelIdentifier="ForeignDrive" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions>
    <Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit><Unit name="m"><BaseUnit m="1"/></Unit>
    <Unit name="rad"><BaseUnit rad="1"/></Unit><Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit>
    <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="N.cm"><BaseUnit kg="1" m="2" s="-2" factor="0.01"/></Unit>
    <Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit>
    <Unit name="rpm"><BaseUnit rad="1" s="-1" factor="0.10471975511965977"/></Unit>
    <Unit name="km/h"><BaseUnit m="1" s="-1" factor="0.2777777777777778"/></Unit>
    <Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit><Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <ModelVariables>{variables}</ModelVariables>
  <ModelStructure><Outputs><Unknown index="2"/><Unknown index="3"/><Unknown index="4"/></Outputs></ModelStructure>
</fmiModelDescription>"""
FOREIGN_VARIABLES = (  # name, causality, its unit and start, those of its twin in SI
    ("load.torque", "input", "N.cm", 0, "N.m", 0),
    ("shaft.angle", "output", "deg", None, "rad", None),
    ("shaft.speed", "output", "rpm", None, "rad/s", None),
    ("way.speed", "output", "km/h", None, "m/s", None),
    ("turns.per_minute", "parameter", "rpm", 65, "rad/s", 65 * math.tau / 60),
    ("plants.apart", "parameter", "mm", 400, "m", 0.4),
    ("breaks.at", "parameter", "s", 1e9, "s", 1e9),
    ("shaft.torque", "output", "N.cm", None, "N.m", None),
)
FOREIGN_ROW = """
[components.drivetrain.names]
"crank.tau" = "load.torque"
"crank.phi" = "shaft.angle"
"crank.w" = "shaft.speed"
"machine.v" = "way.speed"
"shaft.tau" = "shaft.torque"
"plant.spacing" = "plants.apart"
"""


TORQUE = '"drivetrain.crank.tau" = "linkage.crank.tau"'  # in place of inertia and bias


def make_drive(folder: Path, si: bool) -> Path:
    """A drive in C, with names, units and abilities of its own; or its twin in SI."""
    platform = host_platform()
    source = folder / "drive.c"
    original = Path(__file__).with_name("foreign_drive.c").as_posix()
    source.write_text(f'{"#define SI" if si else ""}\n#include "{original}"\n', encoding="utf-8")
    library = folder / f"ForeignDrive{platform.suffix}"
    compile_library((source,), library, platform)
    variables = "".join(
        f'<ScalarVariable name="{name}" valueReference="{i}" causality="{kind}"'
        f"{' variability=' + chr(34) + 'fixed' + chr(34) if kind == 'parameter' else ''}>"
        f'<Real unit="{units[2 * si]}"'
        f"{'' if units[2 * si + 1] is None else f' start={chr(34)}{units[2 * si + 1]!r}{chr(34)}'}/></ScalarVariable>"
        for i, (name, kind, *units) in enumerate(FOREIGN_VARIABLES)
    )
    fmu = folder / "ForeignDrive.fmu"
    with zipfile.ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", FOREIGN_XML.format(variables=variables))
        archive.write(library, f"binaries/{platform.folder}/{library.name}")
    return fmu


def row_with(drive: Path, file: Path, more: str = "") -> Path:
    """The row's file with the drive swapped: its FMU, its names, what it does not have."""
    lines = ROW.read_text(encoding="utf-8").replace("build/partners/Drivetrain.fmu", drive.as_posix())
    lines = lines.replace('"drivetrain.crank.tau_bias" = "linkage.crank.tau_bias"', TORQUE)
    lacking = ('"drivetrain.crank.inertia"', '"drivetrain.machine.fx"', '"linkage.crank.a"', '"drivetrain.speed')
    kept = [line for line in lines.splitlines() if not line.startswith(lacking)]
    file.write_text("\n".join(kept).replace("[connections]", FOREIGN_ROW + more + "\n[connections]"), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def foreign_drive(tmp_path_factory) -> Path:
    return make_drive(tmp_path_factory.mktemp("foreign"), si=False)


@pytest.fixture(scope="module")
def foreign_row(foreign_drive, tmp_path_factory) -> Path:
    return row_with(foreign_drive, tmp_path_factory.mktemp("row") / "mine.toml")


def without_units(fmu: Path, changed: Path, *wanted: str) -> Path:
    """The FMU, silent about the units of these variables."""
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(changed, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                root = etree.fromstring(content)
                for variable in root.iter("ScalarVariable"):
                    if variable.get("name") in wanted:
                        del variable[0].attrib["unit"]
                content = etree.tostring(root)
            target.writestr(name, content)
    return changed


def test_a_foreign_drive_plants_by_a_mapping_in_one_place(system, foreign_row):
    mine = load_system(foreign_row)
    record = row_run.run(mine, "jacobi", 5e-3, 4.0)
    turns = 65 / 60
    assert record["drivetrain.crank.phi"] == pytest.approx(math.tau * (turns * record.time - 0.25), abs=1e-9)
    assert record["drivetrain.crank.w"] == pytest.approx(math.tau * turns, rel=1e-12)
    assert record["drivetrain.shaft.tau"][1:] == pytest.approx(record["linkage.crank.tau"][:-1] + 0.5, abs=1e-9)
    assert record["linkage.machine.s"] == pytest.approx(0.4 * turns * record.time, abs=1e-12)  # converted
    places = [hole.plant_x for hole in record.holes]
    assert len(places) == 4
    assert np.diff(places) == pytest.approx(0.4, abs=1e-6)
    # at constant speed our own drivetrain, stiff and undisturbed, plants at the same places from some turn on
    assert "drivetrain.energy.tractor" in record.not_offered
    assert "drivetrain.crank.w" not in record.not_offered


def test_the_scene_runs_with_a_foreign_drive(foreign_row, tmp_path, capsys):
    assert field_row.main(["--system", str(foreign_row), "--plants", "2", "--output", str(tmp_path)]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "Not offered by the FMUs, and left out: drivetrain.machine.s" in " ".join(said.out.split())
    assert not (tmp_path / "errors.csv").exists()  # the study needs what this drive does not offer
    assert not (tmp_path / "energy.png").exists()
    text = (tmp_path / "field_row.md").read_text(encoding="utf-8")
    assert "nan" not in text.lower()
    assert "The error against the communication step is left out: it needs drivetrain.machine.s, " in text
    assert "energy.png are left out: they need drivetrain.energy.tractor, " in text and "(energy.png)" not in text
    assert "slip" not in text and "asked for" not in text and "2 plants" not in text
    assert "the drivetrain is not told when to stop" in text
    assert "PythonFMU slaves conveyor, soil:" in text and "drivetrain (`ForeignDrive.fmu`)" in text


def test_a_drive_in_other_units_gives_the_report_of_its_twin_in_si(foreign_drive, tmp_path):
    """Degrees, rpm, km/h, mm and N.cm; its parameters, set in SI, among them."""
    (tmp_path / "si").mkdir()
    drives = {"other": foreign_drive, "si": make_drive(tmp_path / "si", si=True)}
    reports, signals = {}, {}
    for name, drive in drives.items():
        file, output = row_with(drive, tmp_path / "mine.toml"), tmp_path / f"report_{name}"
        settings = "drivetrain.plant.spacing=0.3", "drivetrain.turns.per_minute=6.2"
        arguments = [word for setting in settings for word in ("--set", setting)]
        assert field_row.main(["--system", str(file), *arguments, "--plants", "3", "--output", str(output)]) == 0
        reports[name] = [(output / report).read_text(encoding="utf-8") for report in ("field_row.md", "plants.csv")]
        with (output / "signals.csv").open(encoding="utf-8", newline="") as lines:
            heading, *rows = csv.reader(lines)
        signals[name] = heading, np.array(rows, dtype=float)
    assert reports["other"] == reports["si"]
    assert "| spacing of the holes, mean | 300.00 mm | set: 300 mm |" in reports["si"][0]
    assert signals["other"][0] == signals["si"][0]
    assert {"time / s", "drivetrain.crank.w / rad/s", "drivetrain.shaft.tau / N.m"} <= set(signals["si"][0])
    np.testing.assert_allclose(signals["other"][1], signals["si"][1], rtol=1e-8, atol=1e-9)
    speed = signals["other"][0].index("drivetrain.machine.v / m/s")
    assert signals["other"][1][:, speed] == pytest.approx(0.3 * 6.2 / math.tau, rel=1e-8)


OTHER_UNITS = {  # for an SI unit: another, and how much of the SI unit it is
    "rad": ("deg", math.pi / 180),
    "rad/s": ("rpm", math.pi / 30),
    "m": ("mm", 1e-3),
    "m/s": ("km/h", 1 / 3.6),
    "N": ("kN", 1e3),
    "N.m": ("N.cm", 1e-2),
    "J": ("kJ", 1e3),
}


def in_other_units(partner: Path, changed: Path) -> Path:
    """A partner of this project that says, takes and gives its values in OTHER_UNITS."""
    factors = f"FACTORS = { {unit: factor for unit, (_, factor) in OTHER_UNITS.items()} }\n"
    with zipfile.ZipFile(partner) as source, zipfile.ZipFile(changed, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                root = etree.fromstring(content)
                definitions = root.find("UnitDefinitions")
                for unit in list(definitions):
                    if unit.get("name") in OTHER_UNITS:
                        other, factor = OTHER_UNITS[unit.get("name")]
                        base = {**unit[0].attrib, "factor": repr(factor)}
                        etree.SubElement(etree.SubElement(definitions, "Unit", name=other), "BaseUnit", base)
                for real in root.findall("ModelVariables/ScalarVariable/Real"):
                    if real.get("unit") in OTHER_UNITS:
                        other, factor = OTHER_UNITS[real.get("unit")]
                        real.set("unit", other)
                        if real.get("start") is not None:
                            real.set("start", repr(float(real.get("start")) / factor))
                content = etree.tostring(root)
            elif name == "resources/planting_partner.py":
                text = content.decode()
                other = "FACTORS[unit] if more and unit in FACTORS"
                getter, setter = "getter=lambda: self.value[name]", "self.value.__setitem__(name, value)"
                for old, new in (
                    (getter, f"getter=lambda: self.value[name] / {other} else self.value[name]"),
                    (setter, f"self.value.__setitem__(name, value * {other} else value)"),
                    ("def get_real(", "def not_by_getters("),  # so that PythonFMU's are in force, which ask the above
                    ("def set_real(", "def not_by_setters("),
                ):
                    assert text.count(old) == 1
                    text = text.replace(old, new)
                content = (text + factors).encode()
            target.writestr(name, content)
    return changed


def pixels(picture: Path) -> np.ndarray:
    with Image.open(picture) as image:
        return np.asarray(image.convert("L"), dtype=float)


def test_the_whole_report_is_that_of_the_twins_in_si(system, tmp_path, monkeypatch):
    """Every partner in degrees, rpm, mm, km/h, kN, N.cm and kJ, with the study of errors: sentences, tables, pictures.

    Forces that are given with their slopes and allowed errors of the controlled master among them.
    """
    few = {"STEPS_MS": (5.0, 10.0), "TRUTH_MS": 1.0, "LIMIT_MS": 2.0, "TOLERANCES": (10.0,), "PLANTS": 1}
    for name, value in few.items():
        monkeypatch.setattr(row_study, name, value)
    written = {}
    for key, change in (("si", shutil.copy), ("other", in_other_units)):
        folder, output = tmp_path / key, tmp_path / f"report_{key}"
        folder.mkdir()
        for name in ("Drivetrain", "Conveyor", "Soil"):
            change(ROOT / "build" / "partners" / f"{name}.fmu", folder / f"{name}.fmu")
        file = tmp_path / "mine.toml"  # the report names it
        text = ROW.read_text(encoding="utf-8").replace("build/partners", folder.as_posix())
        file.write_text(text, encoding="utf-8")
        arguments = ["--plants", "2", "--step", "5", "--set", "drivetrain.plant.spacing=0.3", "--output", str(output)]
        assert field_row.main(["--system", str(file), *arguments]) == 0
        written[key] = output
    si, other = written["si"], written["other"]
    names = sorted(path.name for path in si.iterdir())
    assert names == sorted(path.name for path in other.iterdir())
    assert {"errors.png", "energy.png", "turn.png", "row.png", "field_row.md", "signals.csv"} < set(names)
    assert (si / "field_row.md").read_text(encoding="utf-8") == (other / "field_row.md").read_text(encoding="utf-8")
    for name in names:
        if name.endswith(".csv"):
            (heading, *rows), (same, *others) = (
                list(csv.reader((folder / name).open(encoding="utf-8", newline=""))) for folder in (si, other)
            )
            assert heading == same and len(rows) == len(others) > 1
            for row, twin in zip(rows, others, strict=True):
                for column, one, two in zip(heading, row, twin, strict=True):
                    assert one == two or float(one) == pytest.approx(float(two), rel=1e-6, abs=1e-8), (name, column)
        elif name.endswith(".png"):
            assert abs(pixels(si / name) - pixels(other / name)).mean() < 0.02, name  # of 255


def test_an_allowed_error_is_that_of_the_unit(foreign_row):
    """step_control is in SI: an angle in degrees may err by as many radians."""
    mine = load_system(foreign_row)
    allowed = mine.tolerance(mine.port("drivetrain.crank.phi"))
    assert allowed == pytest.approx(math.degrees(mine.step_control["rad"]), rel=1e-12)


def test_a_value_without_a_unit_is_refused_until_it_is_told(foreign_drive, tmp_path):
    """Recorded, set or connected: each is named, and the row runs once the file says the units."""
    silent = without_units(foreign_drive, tmp_path / "ForeignDrive.fmu", "shaft.angle", "shaft.torque", "plants.apart")
    with pytest.raises(SystemFault) as fault:
        row_run.row_of(load_system(row_with(silent, tmp_path / "mine.toml")), 2)
    named = {line.split(":")[0] for line in str(fault.value).splitlines()}
    assert named == {f"drivetrain.{name}" for name in ("crank.phi", "shaft.tau", "plant.spacing")}
    assert "its unit cannot be told: ForeignDrive.fmu declares none" in str(fault.value)
    told = """[components.drivetrain.units]
"crank.phi" = {rad = 1, factor = 0.017453292519943295}
"shaft.tau" = {kg = 1, m = 2, s = -2, factor = 0.01}
"plant.spacing" = {m = 1, factor = 0.001}
"""
    row = row_run.row_of(load_system(row_with(silent, tmp_path / "mine.toml", told)), 2)
    assert row.spacing == 0.4
    record = row_run.run(row.system, "jacobi", 5e-3, 1.0)
    assert record["drivetrain.crank.phi"][-1] == pytest.approx(math.tau * (65 / 60 - 0.25), abs=1e-9)


def test_a_record_of_another_dimension_is_refused(foreign_drive, tmp_path):
    file = row_with(foreign_drive, tmp_path / "mine.toml")
    text = file.read_text(encoding="utf-8").replace('"shaft.tau" = "shaft.torque"', '"shaft.tau" = "way.speed"')
    file.write_text(text, encoding="utf-8")
    with pytest.raises(
        SystemFault, match=r"^drivetrain.shaft.tau is recorded in N.m, to which km/h cannot be converted"
    ):
        row_run.row_of(load_system(file), 2)


def test_all_that_is_missing_is_said_in_one_run(foreign_drive, tmp_path, capsys):
    """A file, variables of connections and parameters, names, components and keys."""
    file = row_with(foreign_drive, tmp_path / "mine.toml")
    text = file.read_text(encoding="utf-8")
    for old, new in (
        ("build/partners/Soil.fmu", "gone/Soil.fmu"),
        ('"crank.phi" = "shaft.angle"', '"crank.phi" = "shaft.angel"'),
        ('"drivetrain.plant.spacing" = 0.4', '"drivetrain.wheel.radius" = 0.4\n"drivetrian.x" = 1'),
        ('"linkage.machine.v" =', '"linkage.machine.speed" ='),
        ('at_step_end = "crank.at_step_end"', 'at_step_end = "crank.at_end"\ncolour = "red"'),
        ('"m" = 1e-5', '"m" = 1e-5\n"furlong" = 1'),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    file.write_text(text, encoding="utf-8")
    assert field_row.main(["--system", str(file), "--output", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    for message in (
        "gone/Soil.fmu. Paths are relative to the system's file",
        "no variable 'shaft.angel'; did you mean shaft.angle",
        "no variable 'wheel.radius'",
        "'drivetrian.x' is not component.variable",
        "no variable 'machine.speed'; did you mean machine.s",
        "linkage has colour",
    ):
        assert said.count(message) == 1, (message, said)


def test_a_copy_of_the_row_anywhere_finds_its_partners(system, tmp_path):
    copied = tmp_path / "deep" / "copy.toml"
    copied.parent.mkdir()
    shutil.copy(ROW, copied)
    assert load_system(copied) == system
    (tmp_path / "deep" / "build" / "partners").mkdir(parents=True)
    own = tmp_path / "deep" / "build" / "partners" / "Soil.fmu"  # what lies beside the file comes first
    shutil.copy(system.component("soil").fmu, own)
    assert load_system(copied).component("soil").fmu == own


def test_the_least_system_runs(system, tmp_path):
    """A drive and the linkage: what is not there is left out with a sentence, and no picture claims it."""
    drive_only = ROW.with_name("drive_only.toml")
    assert field_row.main(["--system", str(drive_only), "--plants", "2", "--output", str(tmp_path)]) == 0
    text = (tmp_path / "field_row.md").read_text(encoding="utf-8")
    assert "nan" not in text.lower() and "nothing in this system offers soil.hole.count" in text
    assert "Not offered by the FMUs, and left out: all of conveyor, all of soil.\n" in text
    assert "energy.png are left out: they need soil.energy.soil." in text and "## Energy" not in text  # no part of it
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "field_row.md",
        "plants.csv",
        "row.png",
        "signals.csv",
        "turn.png",
    ]


def test_the_page_on_replacing_a_partner_is_followed(foreign_drive, tmp_path, monkeypatch):
    """Its blocks, as she would paste them, over the least system, in a folder of her own."""
    page = (ROOT / "fmu_src/documentation/replacing_a_partner.md").read_text(encoding="utf-8")
    blocks = [block.replace("\n   ", "\n") for block in re.findall(r"```toml\n(.*?)```", page, re.DOTALL)]
    (replaced,) = [block for block in blocks if "MyDrive.fmu" in block]
    (units,) = [block for block in blocks if "drivetrain.units" in block]
    (torque,) = [block.strip() for block in blocks if "linkage.crank.tau" in block]
    text = ROW.with_name("drive_only.toml").read_text(encoding="utf-8")
    text = text.replace('[components.drivetrain]\nfmu = "build/partners/Drivetrain.fmu"', replaced)
    inertia_and_bias = "".join(
        f'"drivetrain.crank.{name}" = "linkage.crank.{name}"\n' for name in ("inertia", "tau_bias")
    )
    assert inertia_and_bias in text
    text = text.replace(inertia_and_bias, torque + "\n")
    file = tmp_path / "mine.toml"
    file.write_text(text, encoding="utf-8")
    shutil.copy(foreign_drive, tmp_path / "MyDrive.fmu")
    with pytest.raises(SystemFault, match=r"^drivetrain: MyDrive.fmu has no variable 'crank.a'[^\n]*$"):
        row_run.row_of(load_system(file), 2)
    text = "".join(line for line in text.splitlines(keepends=True) if "drivetrain.crank.a" not in line)
    silent = "load.torque", "shaft.angle", "shaft.speed"
    for fmu, more in ((foreign_drive, ""), (foreign_drive, units)):
        if more:
            without_units(fmu, tmp_path / "MyDrive.fmu", *silent)
        file.write_text(text + more, encoding="utf-8")
        row = row_run.row_of(load_system(file), 2)
        record = row_run.run(row.system, "jacobi", 5e-3, 1.0)
        assert record["drivetrain.crank.w"] == pytest.approx(65 * math.tau / 60, rel=1e-12)
        assert record["linkage.machine.s"][-1] == pytest.approx(0.4 * 65 / 60, rel=1e-9)


def test_sizing_figures_are_those_of_the_signals(system, tmp_path):
    arguments = ["--plants", "1", "--no-study", "--step", "5", "--output", str(tmp_path)]
    assert field_row.main(arguments) == 0
    with (tmp_path / "signals.csv").open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    tau, w = (
        np.array([float(row[name]) for row in rows])
        for name in ("linkage.crank.tau / N.m", "drivetrain.crank.w / rad/s")
    )
    text = (tmp_path / "field_row.md").read_text(encoding="utf-8")
    power = tau * w
    rms = math.sqrt(np.mean((power[1:] ** 2 + power[:-1] ** 2) / 2))  # even steps
    assert f"| {abs(power).max():.3g} W | {power.min():.3g} W | {power.max():.3g} W | {rms:.3g} W |" in text
    assert f"| torque of the linkage on the crank | {abs(tau).max():.3g} N·m |" in text


def test_what_cannot_go_back_is_named(foreign_row):
    with (
        pytest.raises(SystemFault, match=r"every FMU offers its state.*not so: drivetrain"),
        CoSimulation(load_system(foreign_row)) as row,
    ):
        next(controlled_steps(row, jacobi, 1.0, 5e-3))


def test_an_fmu_that_fails_in_mid_run_says_when_and_why(foreign_row):
    mine = load_system(foreign_row).with_parameters({"drivetrain.breaks.at": 0.73})
    with pytest.raises(SystemFault, match=r"^drivetrain failed at t = 0.7200 s, .* 20 ms: the shear pin is broken$"):
        row_run.run(mine, "jacobi", 0.02, 2.0)


def test_the_linkage_that_cannot_close_says_so(system):
    with pytest.raises(SystemFault, match=r"^linkage failed .*cannot be closed: dyad ABD.*73.9\d* mm"):
        row_run.run(system.with_parameters({"linkage.geometry.L2": 0.01}), "jacobi", 0.01, 1.0)


def test_python_partners_say_what_python_said(system, monkeypatch):
    """And what ended fatally is not touched again: PythonFMU would free it twice."""
    freed, free = [], FMU2Slave.freeInstance
    monkeypatch.setattr(FMU2Slave, "freeInstance", lambda self: (freed.append(self.modelIdentifier), free(self)))
    with pytest.raises(SystemFault, match=r"^soil failed to initialize: ValueError\('tip.width is 0: .* positive'\)$"):
        row_run.run(system.with_parameters({"soil.tip.width": 0.0}), "jacobi", 0.01, 1.0)
    assert sorted(freed) == ["Conveyor", "Drivetrain", "TransplanterLinkage"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.with_parameters({"soil.tip.widht": 1.0}), r"Soil.fmu has no variable 'tip.widht'; did you mean"),
        (lambda s: s.with_parameters({"soyl.tip": 1.0}), r"'soyl.tip' is not component.variable; components are"),
        (
            lambda s: s.with_parameters({"conveyor.cups.count": 2.5}),
            r"count cannot be set to 2.5: it is of type Integer",
        ),
        (lambda s: s.with_parameters({"soil.soil.n": True}), r"soil.n cannot be set to True: it is of type Real"),
        (
            lambda s: s.with_parameters({"soil.tip.depth": 1.0}),
            r"soil.tip.depth cannot be set: it is of causality output",
        ),
        (lambda s: s.with_parameters({"soil.ground.x": 1.0}), r"cannot be set: it is connected to linkage.ground.x"),
        (lambda s: connected(s, "linkage.tip.fx", "conveyor.cups.opened"), None),  # a count to a Real
        (
            lambda s: s.with_parameters(
                {"soil.soil.n": 1, "conveyor.cups.count": np.int64(6), "soil.soil.c": np.float64(900)}
            ),
            None,
        ),
        (lambda s: connected(s, "soil.seedling.in_nozzle", "linkage.tip.x"), r"a Real cannot be given to a Boolean"),
        (
            lambda s: connected(s, "linkage.tip.fx", "linkage.tip.x"),
            r"tip.fx = linkage.tip.x: m cannot be converted to N",
        ),
        (lambda s: connected(s, "linkage.tip.x", "soil.tip.fx"), r"tip.x must be an input and tip.fx an output"),
        (
            lambda s: replace(s, components=(replace(s.components[0], fmu=Path("gone.fmu")), *s.components[1:])),
            r"^drivetrain: there is no FMU at gone.fmu. Paths are relative to the system's file",
        ),
        (
            lambda s: replace(s, components=(replace(s.components[0], fmu=ROOT / "Makefile"), *s.components[1:])),
            r"^drivetrain: .*Makefile cannot be read as an FMU: ",
        ),
        (
            lambda s: replace(s, components=(*s.components[:3], replace(s.components[3], slopes=("ground.x",)))),
            r"^soil takes no slopes of inputs: Soil.fmu says canInterpolateInputs = false",
        ),
    ],
)
def test_a_system_that_cannot_be_is_named_in_one_line(system, change, message):
    if message is None:  # this may be
        row_run.run(change(system), "jacobi", 0.01, 0.05)
        return
    with pytest.raises(SystemFault, match=message) as fault:
        row_run.run(change(system), "jacobi", 0.01, 0.05)
    assert "\n" not in str(fault.value)


def connected(system: System, target: str, source: str) -> System:
    return replace(system, connections={**system.connections, system.port(target): system.port(source)})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[connections]", "[conections]", "'connections' is missing"),
        ("at_step_end", "at_end", "linkage has at_end, which mean nothing here"),
        ('"soil.tip.angle" =', '"sol.tip.angle" =', "'sol.tip.angle' is not component.variable"),
        ("[parameters]", "[[parameters]", "(at line"),
        ("[step_control]", "[control]", "the file has control"),
    ],
)
def test_a_bad_file_is_named(tmp_path, old, new, message):
    text = ROW.read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "bad.toml"
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SystemFault) as fault:
        load_system(file)
    assert str(fault.value).startswith(f"{file}: ") and message in str(fault.value), fault.value


def test_the_row_is_complete(system):
    """Every input of every FMU is connected, and nothing else."""
    for component in system.components:
        inputs = {v.name for v in component.variables.values() if v.causality == "input"}
        assert {port.variable for port in system.connections if port.component == component.name} == inputs


def test_units_agree_throughout(system):
    with CoSimulation(system) as row:
        assert set(row.conversions.values()) == {(1.0, 0.0)}


# --- the row ------------------------------------------------------------------------------------


def test_the_row_keeps_its_spacing_and_counts_its_seedlings(system):
    row = row_run.row_of(
        system.with_parameters(
            {"conveyor.cups.empty_rate": 0.3, "conveyor.flap.scatter": 0.02, "drivetrain.plant.spacing": 0.3}
        ),
        8,
    )
    record = row_run.run(row.system, "jacobi", 5e-3, row.stop)
    holes, fates = record.holes, [hole.seedling for hole in record.holes]
    assert len(holes) == 8
    assert np.diff([h.plant_x for h in holes]) == pytest.approx(0.3, abs=1e-3)
    assert fates.count(PLANTED) == record["soil.plant.count"][-1] > 0
    assert fates.count(EMPTY) == record["conveyor.cups.empty"][-1] > 0
    assert fates.count(MISSED) == record["conveyor.seedlings.missed"][-1] > 0
    assert len(fates) == fates.count(PLANTED) + fates.count(EMPTY) + fates.count(MISSED)
    assert record["drivetrain.machine.v"][-1] == 0
    assert record["drivetrain.machine.s"][-1] == pytest.approx(8 * 0.3, abs=0.01)


def test_the_published_hole_comes_out(system):
    """46.7 mm at the ridge whose surface the published cycle found, on level ground."""
    row = row_run.row_of(system.with_parameters({"soil.ridge.wave": 0.0}), 2)
    record = row_run.run(row.system, "extrapolated", 2e-3, row.stop)
    assert [h.length for h in record.holes] == pytest.approx([46.7e-3] * 2, abs=2e-4)
    assert [h.depth for h in record.holes] == pytest.approx([0.10316] * 2, abs=5e-5)


def test_the_scene_writes_what_it_says(system, tmp_path):
    output = tmp_path / "new" / "row"
    process = subprocess.run(
        [
            sys.executable,
            "-m",
            "scenarios.field_row",
            "--plants",
            "3",
            "--no-study",
            "--master",
            "controlled",
            "--output",
            str(output),
        ],
        cwd=ROOT,
        capture_output=True,
        encoding="utf-8",
        timeout=HANG,
    )
    assert process.returncode == 0, process.stderr
    assert process.stderr == ""  # no bar and no warning where nobody looks
    listed = [line.strip() for line in process.stdout.split("Tables and figures:")[1].splitlines()[1:]]
    assert (
        listed
        == sorted(p.name for p in output.iterdir())
        == ["energy.png", "field_row.md", "plants.csv", "row.png", "signals.csv", "turn.png"]
    )
    with (output / "plants.csv").open(encoding="utf-8", newline="") as file:
        plants = list(csv.DictReader(file))
    assert [p["hole"] for p in plants] == ["1", "2", "3"]
    assert float(plants[2]["plant at / m"]) - float(plants[1]["plant at / m"]) == pytest.approx(0.4, abs=1e-3)
    text = (output / "field_row.md").read_text(encoding="utf-8")
    assert "| holes | 3 | asked for: 3 |" in text
    for picture in ("row.png", "turn.png", "energy.png"):
        assert f"({picture})" in text and (output / picture).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--set", "soil.tip.widht=0.1"), "soil: Soil.fmu has no variable 'tip.widht'; did you mean tip.width"),
        (("--system", "gone.toml"), "gone.toml cannot be read: No such file"),
        (("--set", "soil.tip.width=0"), "soil failed to initialize: ValueError('tip.width is 0: it must be positive')"),
    ],
)
def test_the_scene_says_in_one_line_why_not(system, tmp_path, capsys, arguments, message):
    assert field_row.main([*arguments, "--no-study", "--plants", "1", "--output", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert said.startswith(message) and said.count("\n") == 1, said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--plants", "0"), "from 1 to 10000"),
        (("--step", "0"), "from 0.1 to 20 ms"),
        (("--set", "soil.x=much"), "=number"),
    ],
)
def test_bad_arguments_are_refused(capsys, arguments, message):
    with pytest.raises(SystemExit) as stop:
        field_row.main(list(arguments))
    assert stop.value.code == 2 and message in capsys.readouterr().err


def test_partners_are_built_anew_when_a_source_is_newer(tmp_path, monkeypatch):
    from scenarios.field_row.partners import build as builder

    sources = tmp_path / "sources"
    shutil.copytree(builder.SOURCES, sources, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(builder, "SOURCES", sources)
    monkeypatch.setattr(builder, "SHARED", sources / "planting_partner.py")
    fmus = builder.build(tmp_path / "fmus")
    made = [fmu.stat().st_mtime_ns for fmu in fmus]
    assert [fmu.stat().st_mtime_ns for fmu in builder.build(tmp_path / "fmus")] == made
    (sources / "soil.py").touch()
    anew = [fmu.stat().st_mtime_ns for fmu in builder.build(tmp_path / "fmus")]
    assert anew[:2] == made[:2] and anew[2] > made[2]
    (sources / "soil.py").write_text("import nothing_of_the_kind\n", encoding="utf-8")
    with pytest.raises(builder.PartnerError, match=r"soil.py does not load:[\s\S]*nothing_of_the_kind"):
        builder.build(tmp_path / "fmus")
    assert fmus[2].stat().st_mtime_ns == anew[2]  # what was there still is


def test_ports_read_as_they_are_written():
    assert str(Port("soil", "tip.fx")) == "soil.tip.fx"
