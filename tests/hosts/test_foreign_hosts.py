"""The FMUs in hosts that others wrote, where these are installed; and the judge of the values.

Hosts that come from elsewhere than the Python package index are run by `make hosts` alone.
"""

from __future__ import annotations

import contextlib
import fnmatch
import math
import os
import re
import sys
import types

import psutil
import pytest

from tests.hosts import __main__ as make_hosts
from tests.hosts import foreign_platforms, table
from tests.hosts.drives import COMPARED, DRIVES, EVEN, RIPPLE, ROUNDING, STEP, STEPS
from tests.hosts.foreign import CHECKERS, HOSTS, interfaces, load
from tests.hosts.judge import judge

FMUS = [fmu for fmu in table.FMUS if fmu.exists()] or [table.FMUS[0]]
FROM_PYPI = [name for name in (*HOSTS, *CHECKERS) if load(name).PACKAGE.startswith("PyPI")]


@pytest.fixture(autouse=True)
def in_project(monkeypatch, fmu_file):
    monkeypatch.chdir(fmu_file.parents[2])


@pytest.mark.parametrize("fmu", FMUS, ids=lambda fmu: fmu.parent.name)
@pytest.mark.parametrize("name", FROM_PYPI)
def test_foreign_host(name, fmu):
    """The exact answer, within rounding or the prediction's bound; nothing reported by checkers."""
    if lack := load(name).missing():
        pytest.skip(f"this machine lacks {lack}")
    rows = (table.play if name in HOSTS else table.check)(name, fmu)
    for row in rows:
        assert row.verdict != table.DIFFERS, row.remarks


# ---- the judge: what a wrong host would return -----------------------------------------------------


@pytest.fixture(scope="module")
def right() -> dict[str, list[list[float]]]:
    """The exact answer at all points that are compared, for each drive."""
    return {key: [[p * STEP, *drive.exact(p)] for p in (0, *COMPARED)] for key, drive in DRIVES.items()}


@pytest.mark.parametrize("drive", DRIVES)
def test_right_answers_pass(right, drive):
    found = judge(DRIVES[drive], "CS", right[drive])
    assert found.wrong == "" and found.errors.position == 0


def changed(rows, point, column, by):
    return [[*row[:column], by(row[column]), *row[column + 1 :]] if row[0] == point * STEP else row for row in rows]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda rows: [[row[0], *[0.0] * 7] for row in rows], "all values are zero"),
        (lambda rows: [[row[0], *rows[0][1:]] for row in rows], "1 step too late"),
        (lambda rows: rows[:-1], r"no values at 1 s"),
        (lambda rows: [[row[0] * 1.0001, *row[1:]] for row in rows], "no values at"),
        (lambda rows: changed(rows, 500, 1, lambda x: x + 2e-9), r"at 0.5 s the position is 2e-06 mm off"),
        (lambda rows: changed(rows, 500, 3, lambda x: x + 1e-5), r"the velocity is 0.01 mm/s off"),
        (lambda rows: changed(rows, 500, 6, lambda x: x + 1e-2), r"the acceleration is 10 mm/s2 off"),
        (lambda rows: changed(rows, 500, 7, lambda x: x * 1.01), r"the travel is 2.2 mm off"),
        (lambda rows: changed(rows, 500, 2, lambda x: math.nan), r"the position is inf mm off"),
    ],
)
@pytest.mark.parametrize("drive", [EVEN, RIPPLE], ids=lambda drive: drive.key)
def test_wrong_answers_are_named(right, drive, change, said):
    assert re.search(said, judge(drive, "CS", change(right[drive.key])).wrong)


def test_model_exchange_has_no_coupling_error():
    assert RIPPLE.bound("ME").position == ROUNDING.position < RIPPLE.bound("CS").position


# ---- hosts that misbehave --------------------------------------------------------------------------


def fake_host(monkeypatch, defects=types.MappingProxyType({})):
    host = types.SimpleNamespace(
        NAME="Fake", PACKAGE="none", INTERFACES={("2.0", "CS")}, FEEDING="not at all", DEFECTS=defects,
        missing=lambda: "", version=lambda: "0",
    )  # fmt: skip
    monkeypatch.setattr(table, "load", lambda name: host)


def test_a_host_that_ends_with_success_and_returns_zeros(monkeypatch, fmu_file):
    """It is the values that count; a defect known of the host does not hide what was seen."""
    zeros = {"seconds": 0.1, "found": [[i * STEP, *[0.0] * 7] for i in range(STEPS + 1)]}
    monkeypatch.setattr(table, "in_process", lambda *_: dict.fromkeys(DRIVES, zeros))
    fake_host(monkeypatch)
    (run,) = table.play("fake", fmu_file)
    assert run.verdict == table.DIFFERS and "all values are zero" in run.remarks[0]
    fake_host(monkeypatch, {("2.0", "CS"): "returns zeros"})
    (run,) = table.play("fake", fmu_file)
    assert run.verdict == table.DEFECT
    assert all("all values are zero" in remark and "host defect: returns zeros" in remark for remark in run.remarks)


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("raise RuntimeError('no such FMU')", "no such FMU"),
        ("import os; os.abort()", "ended with -6"),
        ("", "nothing was said"),
    ],
)
def test_a_host_that_crashes(monkeypatch, tmp_path, fmu_file, program, said):
    """The table goes on, and says what the process left."""
    script = tmp_path / "python"
    script.write_text(f"#!{sys.executable}\n{program}\n")
    script.chmod(0o755)
    monkeypatch.setattr(table.sys, "executable", str(script))
    fake_host(monkeypatch)
    (run,) = table.play("fake", fmu_file)
    assert run.verdict == table.DIFFERS and said in run.wrong["even"]
    assert run.cells()[4:6] == ("-", "-")
    assert [remark.partition(":")[0] for remark in run.remarks] == ["Fake, FMI 2.0 CS, even and ripple"]


def test_a_host_that_is_missing_is_named(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(load("ecos"), "missing", lambda: "libtbb.so.12")
    assert table.main(["--host", "Ecos", "--output", str(tmp_path)]) == 0
    assert "skipped: Ecos: this machine lacks libtbb.so.12" in capsys.readouterr().out
    assert "skipped: Ecos" in (tmp_path / "hosts.md").read_text()


def fake_tools(monkeypatch, prepare):
    """Two hosts of one tool, which has to be built, and a third that needs nothing."""

    def fake(name: str, **more) -> types.SimpleNamespace:
        return types.SimpleNamespace(NAME=name, missing=lambda: "", **more)

    built = {"PREPARED": "cargo builds it", "is_prepared": lambda: False}
    modules = {"one": fake("Tool", **built), "two": fake("Tool", **built), "three": fake("Plain")}
    monkeypatch.setattr(table, "HOSTS", tuple(modules))
    monkeypatch.setattr(table, "CHECKERS", ())
    monkeypatch.setattr(table, "load", modules.__getitem__)
    monkeypatch.setattr(table, "in_process", prepare)
    monkeypatch.setattr(table, "write", lambda *_: None)
    monkeypatch.setattr(table, "show", lambda *_: None)


def test_it_says_what_it_builds_and_builds_each_tool_once(monkeypatch, capsys):
    """Before all runs, and with a limit of its own."""
    done = []

    def prepare(verb, name, *_, limit, beat):
        assert "first, into build/hosts: cargo builds it" in capsys.readouterr().out
        assert verb == "prepare" and limit > table.TIME_LIMIT
        done.append(name)
        beat()

    fake_tools(monkeypatch, prepare)
    monkeypatch.setattr(table, "play", lambda name, _: done.append(name) or [])
    assert table.main([]) == 0
    fmus = len([fmu for fmu in table.FMUS if fmu.exists()])
    assert done == ["one"] + [name for name in ("one", "two", "three") for _ in range(fmus)]
    assert "  Tool: 0 s" in capsys.readouterr().out


def test_all_is_said_before_anything_is_done(monkeypatch, capsys):
    """Hosts, other platforms and what this machine lacks for them; then the FMUs are built."""
    fake_tools(monkeypatch, lambda *_, **__: None)
    monkeypatch.setattr(foreign_platforms.shutil, "which", lambda _: None)
    done = []

    def build(arguments):
        said = capsys.readouterr().out
        assert "hosts and checkers: Tool, Plain" in said and "platforms: " in said
        assert said.count("lacks wine") == 1 and said.count("cargo builds it") == 1
        done.append(arguments)
        return 1

    monkeypatch.setattr(make_hosts, "linkage_fmu", build)
    monkeypatch.setattr(table, "play", lambda *_: pytest.fail("without FMUs"))
    monkeypatch.setattr(foreign_platforms, "main", lambda: pytest.fail("without FMUs"))
    assert make_hosts.main([]) == 1
    assert done == [["build"]]


@pytest.mark.parametrize(
    ("library", "serves"),
    [
        ("usr/lib/llvm-14/lib/libclang.so.1", True),
        ("usr/lib/x86_64-linux-gnu/libclang-14.so.14", True),
        ("usr/lib64/libclang.so", True),
        ("usr/lib/x86_64-linux-gnu/libclang-cpp.so.14", False),  # without the other, cargo fails after minutes
    ],
)
def test_the_library_that_fmi_sim_is_built_with(library, serves):
    assert any(fnmatch.fnmatch(library, pattern) for pattern in load("fmi_sim").LIBCLANG) == serves


def test_a_tool_that_cannot_be_had_costs_one_line(monkeypatch, capsys):
    def prepare(*_, **__):
        raise table.Failed("cargo ended with 101: no network")

    fake_tools(monkeypatch, prepare)
    played = []
    monkeypatch.setattr(table, "play", lambda name, _: played.append(name) or [])
    assert table.main([]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line for line in said if line.startswith("skipped")] == ["skipped: Tool: cargo ended with 101: no network"]
    assert set(played) == {"three"}


def test_only_what_was_asked_for(monkeypatch, capsys):
    """By the names of the table; another name is answered with these."""

    def prepare(*_, **__):
        raise AssertionError("nobody asked for it")

    fake_tools(monkeypatch, prepare)
    played = []
    monkeypatch.setattr(table, "play", lambda name, _: played.append(name) or [])
    assert table.main(["--host", "plain"]) == 0 and set(played) == {"three"}
    with pytest.raises(SystemExit):
        table.main(["--host", "fmi_sim"])
    assert "no host or checker is called fmi_sim; there are Tool, Plain" in capsys.readouterr().err


def test_a_preparation_beyond_its_limit_ends_with_all_that_it_started(monkeypatch, tmp_path):
    script, left = tmp_path / "python", tmp_path / "left"
    script.write_text(f"#!/bin/sh\nsleep 60 &\necho $! > '{left}'\nwait\n")
    script.chmod(0o755)
    monkeypatch.setattr(table.sys, "executable", str(script))
    monkeypatch.setattr(table, "HEARTBEAT", 0.2)
    beats = []
    with pytest.raises(table.Failed, match="not done after 3 s"):
        table.in_process("prepare", "fmi_sim", limit=3, beat=lambda: beats.append(1))
    assert beats
    with contextlib.suppress(psutil.NoSuchProcess):  # gone, or dead and not yet collected
        assert psutil.Process(int(left.read_text())).status() == psutil.STATUS_ZOMBIE


def test_the_tables(tmp_path, capsys):
    """Runs by FMPy, which is always there, ME by Euler too: what is printed and written."""
    fmu = FMUS[0]
    hosts = ("--host", "FMPy", "--host", "fmpy validate")
    assert table.main(["--fmu", str(fmu), *hosts, "--output", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "FMPy" in shown and "agrees" in shown and "nothing reported" in shown and "constant speed" in shown
    lines = (tmp_path / "hosts.csv").read_text().splitlines()
    assert len(lines) == 1 + (len(interfaces(fmu)) + 1) * len(DRIVES) and lines[1].startswith("FMPy,PyPI fmpy,")
    assert len((tmp_path / "checkers.csv").read_text().splitlines()) == 2


def test_a_missing_fmu(capsys):
    assert table.main(["--fmu", f"no{os.sep}such.fmu"]) == 1
    assert "such.fmu is missing" in capsys.readouterr().err
