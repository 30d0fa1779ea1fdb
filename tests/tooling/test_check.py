"""`make check` runs the tests of what differs, and says so where git cannot compare."""

from __future__ import annotations

import re

import pytest

from tests.check import ROOMS, ROOT, changed, main, selected
from tests.conftest import LONGEST


@pytest.mark.parametrize(
    ("files", "tests"),
    [
        (["fmu_src/linkage/linkage.c"], ROOMS["fmu_src/linkage"]),
        (["fmu_src/interface.toml"], ROOMS["fmu_src/interface"]),
        (["tests/fmi/test_time.py"], []),  # was deleted
        (["tests/soak/soak.c", "LICENSE", "scenarios/__init__.py"], []),
        (["tests/harness/host.py"], ROOMS["tests/harness"]),
        (["fmu_src/oracle/oracle.py", "fmu_src/explorer/page.html"], ["tests/oracle"]),  # the room of its name
        (["tests/documentation/test_readme.py", "README.md"], ["tests/documentation"]),
        (["scenarios/sweep.py", "scenarios/sweep/study.py"], ["tests/scenarios/test_sweep.py"]),
        (["scenarios/paper_cycle/figures.py"], ["tests/scenarios/paper_cycle"]),
    ],
)
def test_what_is_selected(tmp_path, files, tests):
    """In a project that has these tests; a folder stands for all that lies in it."""
    for folder in ("fmi", "documentation", "oracle", "harness", "scenarios/paper_cycle"):
        (tmp_path / "tests" / folder).mkdir(parents=True)
    for file in ("documentation/test_readme.py", "scenarios/test_sweep.py", "harness/host.py"):
        (tmp_path / "tests" / file).touch()
    assert selected(files, tmp_path) == sorted(tests)


def test_every_test_that_it_names_is_there():
    missing = [test for tests in ROOMS.values() for test in tests if not (ROOT / test).exists()]
    assert not missing
    assert not [room for room in ROOMS if not any(ROOT.glob(f"{room}*"))]


def test_contributors_are_told_where_each_behaviour_is_tested():
    """The table of CONTRIBUTING.md names files that are there, and every file of tests/component and tests/fmi."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text.partition("## Where each behaviour is tested\n")[2].partition("\n## ")[0]
    named = set()
    for row in table.splitlines():
        for room, names in re.findall(r"`(tests/\w+/)` ([^|;]*)", row):
            named |= {f"{room}test_{name}.py" for name in re.findall(r"\w+", names)}
    assert named and not [name for name in named if not (ROOT / name).is_file()]
    there = {
        file.relative_to(ROOT).as_posix()
        for room in ("component", "fmi")
        for file in (ROOT / "tests" / room).glob("test_*.py")
    }
    assert not there - named


def test_an_unknown_revision(capsys):
    with pytest.raises(ValueError, match="no-such-revision"):
        changed("no-such-revision")
    with pytest.raises(SystemExit) as ended:
        main(["--base", "no-such-revision"])
    assert ended.value.code == 2 and "no-such-revision" in capsys.readouterr().err


def test_a_new_file_is_seen(tmp_path_factory):
    new = ROOT / "tests" / "tooling" / "test_added_by_a_test.py"
    try:
        new.touch()
        assert f"tests/tooling/{new.name}" in changed("HEAD")
    finally:
        new.unlink()


def test_the_files_to_begin_with_are_there():
    assert all((ROOT / "tests" / name).is_file() for name in LONGEST)
