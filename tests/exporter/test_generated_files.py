"""Tracked files that are made from interface.toml agree with it, and the check sees where they do not."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_src.exporter.compiler import CompileError, compile_library, host_platform
from fmu_src.exporter.generate import generate, generated_files
from fmu_src.interface import load_interface
from tests.conftest import PROJECT_ROOT


def test_nothing_is_stale(interface):
    stale = generate(interface, write=False)
    assert not stale, f"run linkage-fmu generate: {[str(path.relative_to(PROJECT_ROOT)) for path in stale]}"


def test_what_is_generated(interface):
    names = {path.relative_to(PROJECT_ROOT).as_posix() for path in generated_files(interface)}
    assert names >= {
        "fmu_src/component/interface.h",
        "fmu_src/component/interface.c",
        "fmu_src/documentation/interface.md",
    }


def linkage_fmu(project: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command as it is in this copy of the project."""
    script = "import sys; sys.path.insert(0, '.'); from fmu_src.cli import main; sys.exit(main(sys.argv[1:]))"
    return subprocess.run([sys.executable, "-c", script, *arguments], cwd=project, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("file", "old", "new", "stale"),
    [
        ("fmu_src/component/interface.h", "VARIABLE_TIP_X = 8", "VARIABLE_TIP_X = 9", {"interface.h"}),
        ("fmu_src/component/interface.c", "0.105", "0.106", {"interface.c"}),
        ("fmu_src/documentation/interface.md", "| 24 | `geometry.L1` ", "| 24 | `geometry.L_1` ", {"interface.md"}),
        ("fmu_src/interface.toml", "start = 0.24", "start = 0.25", {"interface.h", "interface.c", "interface.md"}),
        ("fmu_src/interface.toml", "Simulation time", "The time", {"interface.h", "interface.md"}),
    ],
)
def test_the_check_sees_what_is_stale(project_copy, file, old, new, stale):
    """It names the files, changes nothing and fails; writing them again mends them."""
    path = project_copy / file
    content = path.read_text(encoding="utf-8")
    assert content.count(old) >= 1
    changed = content.replace(old, new, 1)
    path.write_text(changed, encoding="utf-8")

    done = linkage_fmu(project_copy, "generate", "--check")
    named = set(re.findall(r"([\w.]+): stale", done.stdout.replace("\n", "")))
    assert done.returncode == 1 and named >= stale and "linkage-fmu generate" in done.stdout, done.stdout + done.stderr
    assert path.read_text(encoding="utf-8") == changed

    assert linkage_fmu(project_copy, "generate").returncode == 0
    assert linkage_fmu(project_copy, "generate", "--check").returncode == 0
    if not file.endswith(".toml"):
        assert path.read_text(encoding="utf-8") == content


def test_the_token_changes_with_anything_a_host_can_see(interface, tmp_path):
    """A name, unit, start, text, order, display unit, dependency or fact of the model: another interface."""
    toml = (PROJECT_ROOT / "fmu_src" / "interface.toml").read_text(encoding="utf-8")
    tokens = {interface.token}
    changes = [
        ("geometry.theta9", "geometry.theta_9"), ("start = 0.24,", "start = 0.2400000001,"),
        ("Simulation time", "The time"), ('"mm", 1000.0', '"cm", 100.0'), ("machine.v:constant", "machine.v"),
        ("step_size = 1e-3", "step_size = 2e-3"), ("range = [1e-6, 1e6]", "range = [1e-6, 1e5]"),
        ('name = "TransplanterLinkage"', 'name = "Linkage"'),
    ]  # fmt: skip
    path = tmp_path / "interface.toml"
    for old, new in changes:
        path.write_text(toml.replace(old, new), encoding="utf-8")
        tokens.add(load_interface(path).token)
    only_comments = sum(old in toml for old, _ in changes)
    assert len(tokens) >= only_comments
    path.write_text("# a comment\n" + toml, encoding="utf-8")
    assert load_interface(path).token == interface.token


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("double L1, L2,", "double L2, L1,", "L1_is_in_place"),
        ("double XC, YC,", "double YC, XC,", "XC_is_in_place"),
        ("double phi1, phi4,", "double phi4, phi1,", "phi1_is_in_place"),
        ("theta8, theta9;", "theta8, theta9, theta10;", "geometry_is_complete"),
    ],
)
def test_members_of_the_geometry_that_stand_elsewhere(tmp_path, old, new, said):
    """The compiler refuses an order that is not that of interface.toml, and names the member."""
    for folder in ("linkage", "component"):
        shutil.copytree(PROJECT_ROOT / "fmu_src" / folder, tmp_path / folder)
    header, library = tmp_path / "linkage" / "linkage.h", tmp_path / f"out{host_platform().suffix}"
    sources = (tmp_path / "component" / "interface.c",)
    compile_library(sources, library, host_platform())
    right = header.read_text(encoding="utf-8")
    assert right.count(old) == 1
    header.write_text(right.replace(old, new), encoding="utf-8")
    with pytest.raises(CompileError, match=said):
        compile_library(sources, library, host_platform())
