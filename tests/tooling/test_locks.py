"""The lock files agree, and what `make run` installs is little; other files agree on the version."""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys

import pytest

from fmu_src.interface import read_toml
from tests.conftest import PROJECT_ROOT

PIN = re.compile(r"^([a-z0-9._-]+)==(\S+)(?: ; (.*?))? \\$", re.MULTILINE)
PROJECT = read_toml(PROJECT_ROOT / "pyproject.toml")["project"]


def pins(name: str) -> set[tuple[str, str, str]]:
    """(package, version, marker) of a lock file."""
    return set(PIN.findall((PROJECT_ROOT / f"{name}.lock").read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    "name", ["requirements-run", "requirements-compiler", "requirements-lint", "requirements-bench"]
)
def test_the_same_version_wherever_a_package_is_pinned(name):
    everything = {}
    for package, version, _ in pins("requirements"):
        everything.setdefault(package, set()).add(version)
    other = {(p, version) for p, version, _ in pins(name) if p in everything and version not in everything[p]}
    assert pins(name) and not other, "make lock"


def test_what_runs_is_part_of_what_is_tested():
    run, everything = pins("requirements-run") | pins("requirements-compiler"), pins("requirements")
    assert {pin[:2] for pin in run} <= {pin[:2] for pin in everything}


def test_make_run_installs_no_more_than_it_runs_with():
    heavy = {"cmake", "dask", "distributed", "pyarrow", "scipy", "pytest", "ecospy", "libcosimpy", "mypy", "mpmath"}
    assert not heavy & {package for package, _, _ in pins("requirements-run")}


def test_make_run_installs_what_it_runs_with():
    """What its programs load, in a process of their own, is of packages that its lock files pin."""
    programs = [
        "fmu_src.cli", "scenarios.field_row.partners.build", "scenarios.field_row.ssp",
        "scenarios.__main__", "scenarios.paper_cycle.__main__", "scenarios.field_row.__main__",
    ]  # fmt: skip
    code = f"import {', '.join(programs)}, sys; print(*{{name.partition('.')[0] for name in sys.modules}})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PROJECT_ROOT)
    packages = importlib.metadata.packages_distributions()
    found = {package.lower() for name in loaded.stdout.split() for package in packages.get(name, ())}
    pinned = {package for name in ("requirements-run", "requirements-compiler") for package, _, _ in pins(name)}
    assert {"numpy", "matplotlib"} <= found
    assert not found - pinned - {PROJECT["name"], "setuptools"}, "setuptools: of the environment itself"


def test_every_package_has_hashes():
    for lock in PROJECT_ROOT.glob("requirements*.lock"):
        blocks = re.split(r"^(?=[a-z0-9])", lock.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
        assert blocks and all("--hash=sha256:" in block for block in blocks), lock.name


def test_the_version_is_the_same_everywhere():
    citation = (PROJECT_ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changelog = (PROJECT_ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.MULTILINE) == [PROJECT["version"]]
    assert re.findall(r"^## \[(\d.+?)\]", changelog, re.MULTILINE)[0] == PROJECT["version"]


def test_links_of_the_documents_lead_somewhere():
    for name in ("CONTRIBUTING.md", "CHANGELOG.md"):
        text = (PROJECT_ROOT / name).read_text(encoding="utf-8")
        links = re.findall(r"\]\(((?!https?:)[\w./]+)\)", text) + re.findall(r"`((?:fmu_src|tests)/[\w./]+)`", text)
        missing = [link for link in links if not (PROJECT_ROOT / link).exists()]
        assert not missing, name
