"""What README.md quotes is what comes out."""

from __future__ import annotations

import csv
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT_ROOT = Path(__file__).resolve().parents[2]
README = (PROJECT_ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str = "") -> list[str]:
    """The code blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


def block_with(word: str, language: str = "") -> str:
    (found,) = [block for block in blocks(language) if word in block]
    return found


@pytest.fixture
def beside_the_build(tmp_path: Path) -> Path:
    """A folder from which `build/` and the commands are found as from the project's own."""
    (tmp_path / "build").symlink_to(PROJECT_ROOT / "build")
    return tmp_path


def test_published_cycle_prints_what_is_quoted(beside_the_build: Path):
    run = subprocess.run(
        [sys.executable, "-m", "scenarios.paper_cycle", "--output", "reports"],
        cwd=beside_the_build, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert block_with("334.65") in run.stdout
    (summary,) = re.findall(r"`(\d+ agree, \d+ differ, \d+ not determined by the paper)`", README)
    assert f"\n{summary}\n" in run.stdout
    columns = ("paper section", "published", "computed", "verdict", "reason")  # the others have all digits
    made, kept = (
        [[row[name] for name in columns] for row in csv.DictReader(path.open(newline="", encoding="utf-8"))]
        for path in (beside_the_build / "reports" / "table.csv", PROJECT_ROOT / "fmu_src/documentation/published.csv")
    )
    assert made == kept, "stale in the FMU's documentation: copy build/reports/paper_cycle/table.csv there"


def test_command_line_of_fmpy_runs(beside_the_build: Path):
    command = shlex.split(block_with("fmpy simulate").replace("\\\n", " "))
    assert command[0] == ".venv/bin/fmpy"
    command[0] = str(Path(sys.executable).with_name("fmpy"))
    run = subprocess.run(command, cwd=beside_the_build, capture_output=True, text=True, check=True)
    assert run.stdout + run.stderr == "", "no warnings"
    with (beside_the_build / "tip.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 900 and float(rows[0]["tip.x"]) == pytest.approx(float(rows[-1]["tip.x"]), abs=1e-12)


def test_python_example_runs_without_a_word(beside_the_build: Path):
    program = block_with("simulate_fmu", "python") + "\nassert abs(result['ground.x'][-1] - 0.1669) < 1e-4\n"
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=beside_the_build, capture_output=True, text=True, check=True
    )
    assert run.stdout + run.stderr == ""


def test_files_that_it_names_are_there():
    named = set(re.findall(r"`((?:fmu_src|scenarios|tests)/[\w./]+)`", README)) | set(
        re.findall(r"\]\(((?!https?:)[\w./]+)\)", README)
    )
    assert len(named) > 5
    missing = [name for name in named if not (PROJECT_ROOT / name).exists()]
    assert not missing


def test_targets_that_it_names_are_in_the_makefile():
    makefile = (PROJECT_ROOT / "Makefile").read_text()
    targets = set(re.findall(r"`?make ([a-z]+)`?", README)) - {"test"} | {"test"}
    assert {"run", "test", "build", "bench"} <= targets
    for target in targets & {"run", "test", "build", "bench", "hosts", "soak"}:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
