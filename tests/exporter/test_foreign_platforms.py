"""Binaries for other platforms, run where wine and qemu are there: the same answers, to the bit."""

from __future__ import annotations

import re

import pytest

from fmu_src.exporter.compiler import PLATFORMS, host_platform
from tests.hosts import foreign_platforms
from tests.hosts.foreign_platforms import CannotRun, answers, compare, ordered, runner

# tests/hosts/platform_bits.c is a host for FMI 2.0; the sources of the two differ in the adaptor alone
FMI2 = pytest.mark.parametrize("fmi", [2], ids=["fmi2"], indirect=True, scope="session")


@pytest.fixture(scope="module")
def native(fmi, all_platforms, tmp_path_factory) -> list[str]:
    """What the binary for this machine answers, of each FMI version."""
    target = host_platform()
    return answers(fmi, all_platforms[target.name], target, tmp_path_factory.mktemp("native"))


@FMI2
def test_the_answers_are_many(native):
    """Steps, derivatives, states, and poses that cannot be reached, with their messages."""
    least_lines = {
        "outputs 0": 7000, "of masses 0": 7000, "step 2": 3, "message": 5, "state 0": 100, "by time 0": 500,
        "along 0": 7000, "along all 0": 500,
    }  # fmt: skip
    for begin, least in least_lines.items():
        assert sum(line.startswith(begin) for line in native) >= least, begin
    accepted = ("inputs", "changed", "masses", "enter", "slopes", "at step end")
    assert not [line for line in native if line.startswith(accepted) and not re.match("[a-z ]+ 0", line)]


@FMI2
@pytest.mark.parametrize("platform", [name for name in PLATFORMS if name != host_platform().name])
def test_other_platforms_answer_alike(native, fmi, all_platforms, tmp_path, platform):
    try:
        runner(PLATFORMS[platform])
    except CannotRun as lack:
        pytest.skip(f"this machine lacks {lack}")
    found = compare(native, answers(fmi, all_platforms[platform], PLATFORMS[platform], tmp_path))
    assert found.numbers > 100_000
    assert found.first is None, f"{found.different} numbers differ, by up to {found.ulps} ulp: {found.first}"


def test_a_difference_is_seen():
    """In a number, in what was said, in how much was said."""
    lines = ["outputs 0 3ff0000000000000 8000000000000000", "message bits 2 a", "done"]
    assert compare(lines, lines).first is None
    found = compare(lines, ["outputs 0 3ff0000000000003 8000000000000000", *lines[1:]])
    assert (found.numbers, found.different, found.ulps) == (2, 1, 3) and found.first is not None
    assert compare(lines, [lines[0], "message bits 2 b", "done"]).first == ("message bits 2 a", "message bits 2 b")
    assert compare(lines, lines[:-1]).first == ("3 lines", "2 lines")


def test_units_in_the_last_place():
    assert ordered("8000000000000000") == ordered("0000000000000000") == 0
    assert ordered("0000000000000001") - ordered("8000000000000001") == 2


def test_what_is_missing_is_named(monkeypatch):
    monkeypatch.setattr(foreign_platforms.shutil, "which", lambda _: None)
    with pytest.raises(CannotRun, match="wine"):
        runner(PLATFORMS["x86_64-windows"])
