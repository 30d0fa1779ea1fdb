"""Optimal designs: studies and their mistakes, the search, what limits a design, stopping and going on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from transplanter_linkage import Geometry, Kinematics
from transplanter_linkage.measures import GEOMETRY, KNOWNS, MASSES, MEASURES, TORQUE, Operation, Turn

from scenarios.balancing.machine import Balancing, Machine
from scenarios.common import beside, command, units, variants
from scenarios.common.masses import with_counterweight
from scenarios.common.turn import FmuSource
from scenarios.design import report, search
from scenarios.design.__main__ import main
from scenarios.design.problem import Problem, best_of
from scenarios.design.study import STUDIES, StudyError, load
from scenarios.design.tolerances import spreads
from scenarios.field_row.level import level
from scenarios.field_row.system import load_system
from scenarios.sweep.scenes import planting_cycle
from tests.conftest import PROJECT_ROOT
from tests.scenarios.conftest import HANG

SMALL = """
title = "Small"
question = "?"

[parameters]
"geometry.L1" = "2 mm"
"geometry.L4" = ["17 mm", "20 mm"]
theta41 = "5 deg"

[[objectives]]
measure = "swept"

[[constraints]]
measure = "height"
least = "330 mm"

[[constraints]]
measure = "peak_acceleration"
most = "published"

[search]
starts = 2

[tolerances]
lengths = "0.05 mm"
samples = 40
"""


@pytest.fixture(scope="module")
def source(fmu_files):
    with FmuSource(fmu_files[3]) as opened:
        yield opened


@pytest.fixture
def published(source):
    return Turn(source.set({})).measure()


@pytest.fixture
def read(tmp_path, source, published):
    def read(text=SMALL):
        path = tmp_path / "small.toml"
        path.write_text(text, encoding="utf-8")
        return load(path, source.nominal, published)

    return read


# ---- units and variants ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "unit", "value"),
    [("55mm", "m", 0.055), ("180 deg", "rad", np.pi), ("65 rpm", "rad/s", 65 * np.pi / 30), ("1.8 km/h", "m/s", 0.5),
     (" -3e1 mm ", "m", -0.03), ("0.05", "m", 0.05), (0.05, "m", 0.05), ("10 %", "1", 0.1)],
)  # fmt: skip
def test_quantities(written, unit, value):
    assert units.si(written, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("written", "said"),
    [("5 furlong", "the unit 'furlong' is not known; units are m, mm, cm"), ("5 deg", "is not a length"),
     ("mm", "not a number with a unit"), ("1e999", "not finite"), (True, "no quantity")],
)  # fmt: skip
def test_what_is_no_quantity(written, said):
    with pytest.raises(units.UnitError, match=said):
        units.si(written, "m")


def test_a_parameter_set_comes_back_to_the_bit(tmp_path):
    geometry = {name: getattr(Geometry(L1=0.1 / 3), name) for name in GEOMETRY}
    masses = {"body.OA.m": 0.3, "body.OA.J": 1e-4}
    variants.write_ssv(tmp_path / "a.ssv", "a", geometry, Operation(), masses)
    assert variants.read_ssv(tmp_path / "a.ssv").changes == geometry
    text = (tmp_path / "a.ssv").read_text().replace(f'value="{0.1 / 3!r}" unit="m"', 'value="40" unit="mm"')
    (tmp_path / "b.ssv").write_text(text.replace('name="geometry.L1"', 'name="linkage.geometry.L1"'))
    assert variants.read_ssv(tmp_path / "b.ssv").changes["L1"] == 0.04
    (tmp_path / "c.ssv").write_text(text.replace('unit="mm"', 'unit="K"'))
    with pytest.raises(variants.VariantError, match=r"c\.ssv, line \d+: geometry\.L1: .*'K' is not known"):
        variants.read_ssv(tmp_path / "c.ssv")


def test_the_phase_difference_moves_phi4_alone():
    nominal = {name: getattr(Geometry(), name) for name in GEOMETRY}
    geometry = variants.Variant("", dict([variants.changed("theta41=180deg")])).geometry(nominal)
    assert geometry == {**nominal, "phi4": nominal["phi1"] + np.pi}


# ---- studies -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(STUDIES.glob("*.toml")), ids=lambda path: path.stem)
def test_studies_that_are_shipped(path, source, published):
    study = load(path, source.nominal, published)
    assert study.question and "theta8" not in [each.name for each in study.ranges]
    assert load(path.with_suffix("").relative_to(STUDIES), source.nominal, published) == study


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("least =", "lest =", r"line 15: constraints\[0\]\.lest: there is no such key; there are measure, least, most"),
        ('"330 mm"', '"330 mmm"', r"line 15: constraints\[0\]\.least: .*the unit 'mmm' is not known; units are m, mm"),
        ('"peak_acceleration"', '"peak_acc"', r"line 18: constraints\[1\]\.measure: 'peak_acc' is no measure"),
        ('"geometry.L4"', '"geometry.L44"', r"line 7: parameters\.geometry\.L44: there is no such parameter"),
        ('["17 mm", "20 mm"]', '["20 mm", "17 mm"]', r"line 7: parameters\.geometry\.L4: the range .* is empty"),
        ("starts = 2", "starts = 0", r"line 22: search\.starts: 0 is not a whole number from 1"),
        ("[search]", "[serch]", r"line 21: serch: there is no such key"),
        ('title = "Small"', 'title = "Small', r"small\.toml: .*line 2"),
        ("[[objectives]]", "[[objective]]", r"line 10: objective: there is no such key"),
        ('least = "330 mm"', 'least = "330 mm"\nnear = "1 mm"', r"line 14: constraints\[0\]\.measure: one limit of"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line_and_key(read, before, after, said):
    with pytest.raises(StudyError, match=said):
        read(SMALL.replace(before, after))


# ---- the problem -------------------------------------------------------------------------------------


def test_gradients_of_the_problem_are_its_slopes(read, source, published):
    """Objective, unknown extremes, limits of one extreme, of two, and of a distance: all rows, by every variable."""
    near = '[[constraints]]\nmeasure = ["pickup_x", "pickup_y"]\nnear = "5 mm"\n\n[search]'
    narrow = '[[constraints]]\nmeasure = "reach"\nmost = "40 mm"\n\n[search]'
    problem = Problem(source, read(SMALL.replace("[search]", near).replace("[search]", narrow)), published)
    z = problem.start(np.array([0.31, -0.4, 0.52]))
    z[3:] += 0.01
    assert len(z) == 3 + 4  # swept and reach: greatest and least
    f, gradient, rows = problem.evaluate(z)
    assert len(rows.values) == 4 * 12 + 1 + 18 + 1 + 1
    for k in range(len(z)):
        step = np.eye(len(z))[k] * 1e-6
        (f1, _, rows1), (f0, _, rows0) = (problem.evaluate(z + side * step) for side in (1, -1))
        assert (f1 - f0) / 2e-6 == pytest.approx(gradient[k], abs=1e-7)
        np.testing.assert_allclose((rows1.values - rows0.values) / 2e-6, rows.gradients[:, k], atol=2e-6)
    assert f == pytest.approx(sum(z[3:5]))


HEAVY = """
[masses]
bodies = "plausible"

[parameters]
"counterweight.m" = ["0 kg", "2 kg"]
"counterweight.x" = ["-55 mm", "55 mm"]
"counterweight.y" = "55 mm"
"body.GF.m" = "20 %"
"geometry.L1" = "1 mm"

[[objectives]]
measure = "peak_torque"

[[constraints]]
measure = "rms_torque"
most = "1 N.m"
"""


def test_torque_follows_counterweight_body_and_geometry(read, source, published):
    """The problem's gradients are its slopes, and a counterweight is here what it is in scenarios/balancing."""
    study = read(HEAVY)
    problem = Problem(source, study, published | {"peak_torque": 10.0, "rms_torque": 3.0})
    z = problem.start(np.array([0.3, -0.4, 0.2, 0.5, 0.0]))
    _, _, rows = problem.evaluate(z)
    assert len(rows.values) == 36 + 1
    for k in range(len(z)):
        step = np.eye(len(z))[k] * 1e-6
        ahead, behind = (problem.evaluate(z + side * step)[2].values for side in (1, -1))
        np.testing.assert_allclose((ahead - behind) / 2e-6, rows.gradients[:, k], atol=1e-6)
    balance = Balancing(mass=1.3, x=-0.022, y=0.011)
    with Machine(command.FMU) as machine:
        other = machine.turn(balance, 7.0)
    crank, _ = with_counterweight(study.masses, balance.mass, balance.x, balance.y)
    torque, _ = source.set({}, {**study.masses, **crank}).torque(other.phi, 7.0)
    np.testing.assert_allclose(torque, other.torque, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('bodies = "plausible"', '"body.OB.m" = 1', r"masses\.body\.OB\.m: there is no such key"),
        ('bodies = "plausible"', 'bodies = "heavy"', r'masses\.bodies: may be "plausible"'),
        ('bodies = "plausible"', '"body.GF.m" = 1', r"parameters\.counterweight\.m: needs crank OA to have a mass"),
        (
            '"body.GF.m" = "20 %"',
            '"body.OA.m" = "20 %"',
            r"parameters\.counterweight\.m: body\.OA may not change as well",
        ),
        ('"2 kg"', '"2 mm"', r"parameters\.counterweight\.m: '2 mm' is not in kg"),
    ],
)
def test_a_mistake_about_masses_is_told(read, before, after, said):
    with pytest.raises(StudyError, match=said):
        read(HEAVY.replace(before, after))


def test_a_refused_pose_answers_with_bad_values(read, source, published):
    problem = Problem(source, read(SMALL.replace('"2 mm"', '["45 mm", "90 mm"]')), published)
    z = problem.start(np.array([-1.0, 0.0, 0.0]))
    good = problem.evaluate(z)[2].values
    z[0] = 1.0
    f, _, rows = problem.evaluate(z)
    assert f == 1e3 and (rows.values == -1e3).all() and len(rows.values) == len(good)


def test_a_best_design_and_what_limits_it(read, source, published):
    """Two starts find the same design; no design of a grid is better; multipliers are the slope of the optimum."""
    study = read()
    problem = Problem(source, study, published)
    found = [problem.search(problem.random(np.random.default_rng(k))) for k in range(2)]
    best = best_of(found, study)
    assert all(each.is_feasible for each in found)
    assert found[0].values["swept"] == pytest.approx(found[1].values["swept"], rel=1e-6)
    for z in np.stack(np.meshgrid(*[np.linspace(-1, 1, 6)] * 3), axis=-1).reshape(-1, 3):
        turn = problem.turn(problem.design(z))
        values = {name: turn[name].value for name in problem.measures}
        if max(problem.beyond(values).values()) <= 0:
            assert values["swept"] > best.values["swept"] - 1e-9
    by_limit, by_end, left = problem.multipliers(best.design)
    assert left < 1e-6 and (by_limit or by_end)
    for name, gain in by_end.items():
        widened = tuple(
            replace(each, low=each.low - 1e-5 * (each.high - each.low), high=each.high + 1e-5 * (each.high - each.low))
            if each.name == name
            else each
            for each in study.ranges
        )
        wider = Problem(source, replace(study, ranges=widened), published)
        by = 1e-5 * (study.ranges[problem.names.index(name)].high - study.ranges[problem.names.index(name)].low)
        again = wider.search(np.clip(wider.z_of(best.design), -1, 1))
        assert (best.values["swept"] - again.values["swept"]) / by == pytest.approx(gain, rel=0.02, abs=1e-3)


def test_a_front_and_its_area(read, source, published, tmp_path):
    two = '[[objectives]]\nmeasure = "peak_acceleration"\n\n[[constraints]]\nmeasure = "height"'
    text = SMALL.replace('[[constraints]]\nmeasure = "height"', two, 1)
    text = text.replace('[[constraints]]\nmeasure = "peak_acceleration"\nmost = "published"\n', "")
    study = read(text.replace("starts = 2", 'starts = 1\npoints = 6\nreference = ["100 mm", "40 m/s2"]'))
    store = search.Store(tmp_path / "jobs")
    result = search.run(source, study, published, store, lambda: None)
    points = np.array([[each.values[m] for m in ("swept", "peak_acceleration")] for each in result.front])
    assert len(points) >= 5 and (np.diff(points[:, 0]) > 0).all() and (np.diff(points[:, 1]) < 0).all()
    again = search.run(source, study, published, search.Store(tmp_path / "jobs"), lambda: None)
    assert again == result and store.done == 6
    names, far = ["swept", "peak_acceleration"], (0.1, 40.0)
    few = replace(result, front=result.front[:2], turns=7)
    rival = [np.array([0.001, 1.0]) + points[:1], np.array([0.002, 1.0]) + points[:1], np.empty((0, 2))]
    found = SimpleNamespace(fronts=[result, few], rivals={"NSGA-II": rival}, rival_turns=90)
    mine, other = report.volumes(found, names, far)
    whole, part = (search.hypervolume(p * [1e3, 1.0], (100.0, 40.0)) for p in (points, points[:2]))
    assert mine[1:4] == (f"{part:.0f}", f"{(whole + part) / 2:.0f}", f"{whole:.0f}, {part:.0f}") and part < whole
    assert other[1] == "0" and other[3].endswith(", 0") and mine[4] == f"{result.turns}, 7" and other[4] == "90 each"


def test_hypervolume():
    points = np.array([[1.0, 3.0], [2.0, 1.0], [2.5, 2.0], [9.0, 0.0]])
    assert search.hypervolume(points, (4.0, 4.0)) == 3 * 1 + 2 * 2


def test_tolerances_by_gradient_and_by_samples(source):
    source.set({})
    found, refused = spreads(source, source.nominal, Operation(), dict.fromkeys(GEOMETRY, 5e-05), 500, lambda: None)
    assert refused == 0
    for each in found:
        assert abs(each.off) < 0.1 and sum(each.share.values()) == pytest.approx(1)
    height = next(each for each in found if each.measure == "height")
    gradient = Turn(Kinematics())["height"].gradient[: len(GEOMETRY)]
    assert height.by_gradient == pytest.approx(5e-5 * np.linalg.norm(gradient), rel=0.01)
    assert max(height.share, key=height.share.get) == GEOMETRY[int(np.argmax(np.abs(gradient)))]


# ---- the scenario ------------------------------------------------------------------------------------


def test_the_report(read, tmp_path, capsys, fmu_files):
    read()
    output = tmp_path / "out"
    assert main(["--fmu", str(fmu_files[3]), "--output", str(output), str(tmp_path / "small.toml")]) == 0
    said = capsys.readouterr().out
    assert "0 jobs from before, 2 now" in said and "On a grid of 7200 angles: every constraint kept" in said
    assert "2 of 2 random starts kept every constraint" in said and "fresh fmi2/TransplanterLinkage.fmu" in said
    kept = json.loads((output / "design.json").read_text())
    assert kept["feasible"] and set(kept["measures"]) == set(MEASURES)
    geometry = variants.read_ssv(output / "design.ssv").changes
    for name, value in (("w", "crank.w"), ("spacing", "plant.spacing"), ("depth", "ridge.depth")):
        said = f"{kept['operation'][name]!r}"
        assert f'<value name="{value}">{said}</value>' in (output / "design.ssv").read_text()
        assert f"{value}={said}" in kept["fragment"].split("&")
    assert geometry == kept["geometry"]
    operation = Operation(**kept["operation"])
    fresh = Turn(Kinematics(Geometry(**geometry)), operation)
    assert fresh["swept"].value == pytest.approx(kept["measures"]["swept"], rel=1e-9)
    assert {"report.md", "designs.png"} <= {path.name for path in output.iterdir()}
    assert main(["--fmu", str(fmu_files[3]), "--output", str(output), str(tmp_path / "small.toml")]) == 0
    assert "2 jobs from before, 0 now" in capsys.readouterr().out


def test_a_design_has_the_same_figures_in_cycle_row_sweep_and_study(tmp_path, source, fmu_file):
    """Those of the linkage on level ground; the row's own holes, in its wavy ridge, are others."""
    whole = source.nominal | {"L1": 0.0485, "L4": 0.0187, "theta3": 0.47}
    variants.write_ssv(tmp_path / "design.ssv", "design", whole, Operation())
    design = variants.read_ssv(tmp_path / "design.ssv")
    depth = source.published_depth()
    study = Turn(source.set(design.geometry(source.nominal)), Operation(depth=depth)).measure()
    cycle = beside.turns(source, [design], Operation(depth=depth))["design"].measure()
    swept = planting_cycle(fmu_file, design.parameters(source.nominal))
    row = level(
        load_system().with_parameters({f"linkage.{k}": v for k, v in design.parameters(source.nominal).items()})
    )
    for name in MEASURES:
        for other in (cycle, row, swept):
            if name in other and name not in TORQUE:
                assert other[name] == pytest.approx(study[name], rel=1e-9), name
    assert swept.keys() < study.keys() == row.keys()


def test_an_infeasible_study_says_what_is_missed_and_by_how_much(read, tmp_path, capsys, fmu_files):
    read(SMALL.replace('"330 mm"', '"400 mm"').replace("[tolerances]\nlengths", "#").split("samples")[0])
    assert main(["--fmu", str(fmu_files[3]), "--output", str(tmp_path / "out"), str(tmp_path / "small.toml")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "No design was found that keeps every constraint" in said
    assert "400 mm <= height is missed by " in said


def test_killed_and_started_again_it_goes_on(read, tmp_path, fmu_files):
    read(SMALL.replace("starts = 2", "starts = 40"))
    output = tmp_path / "out"
    line = [sys.executable, "-m", "scenarios.design", str(tmp_path / "small.toml"), "--fmu", str(fmu_files[3])]
    line += ["--output", str(output)]
    process = subprocess.Popen(line, cwd=PROJECT_ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + HANG
    while len(list((output / "jobs").glob("*.json"))) < 3 and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = {path: path.read_bytes() for path in (output / "jobs").glob("*.json")}
    assert 3 <= len(kept) < 40
    again = subprocess.run(
        line, cwd=PROJECT_ROOT, capture_output=True, encoding="utf-8", timeout=HANG, env={**os.environ}
    )
    assert again.returncode == 0, again.stderr
    assert f"{len(kept)} jobs from before, {40 - len(kept)} now" in again.stdout
    assert all(path.read_bytes() == content for path, content in kept.items())


@pytest.mark.parametrize(
    ("study", "said"),
    [("nothing.toml", "studies that are shipped: balance, front, practical"), ("practical", "There is no FMU")],
)
def test_what_cannot_be_run_is_said_in_a_line(study, said, tmp_path, capsys, fmu_files):
    fmu = tmp_path / "none.fmu" if study == "practical" else fmu_files[3]
    assert main(["--fmu", str(fmu), "--output", str(tmp_path / "out"), study]) == 1
    assert said in capsys.readouterr().err


def test_the_published_depth(source):
    assert source.published_depth() * 1e3 == pytest.approx(103.2, abs=0.05)
    assert Turn(source, Operation(depth=source.published_depth()))["hole"].value * 1e3 == pytest.approx(46.7, abs=1e-9)


def test_knowns_are_what_gradients_are_by():
    assert KNOWNS[:18] == GEOMETRY and KNOWNS[18:23] == ("spacing", "w", "depth", "body", "seedling")
    assert KNOWNS[23:] == MASSES
