"""What README.md quotes is what comes out."""

from __future__ import annotations

import csv
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import PROJECT_ROOT
from tests.documentation.conftest import block_with

README = (PROJECT_ROOT / "README.md").read_text(encoding="utf-8")


def test_published_cycle_prints_what_is_quoted(beside_the_build: Path):
    run = subprocess.run(
        [sys.executable, "-m", "scenarios.paper_cycle", "--output", "reports"],
        cwd=beside_the_build, capture_output=True, text=True, check=True,
        env={name: value for name, value in os.environ.items() if name != "COLUMNS"},  # as wide as it likes
    )  # fmt: skip
    assert block_with(README, "334.65") in run.stdout
    (summary,) = re.findall(r"`(\d+ agree, \d+ differ, \d+ not determined by the paper)`", README)
    assert f"\n{summary}\n" in run.stdout
    columns = ("paper section", "published", "computed", "verdict", "reason")  # the others have all digits
    made, kept = (
        [[row[name] for name in columns] for row in csv.DictReader(path.open(newline="", encoding="utf-8"))]
        for path in (beside_the_build / "reports" / "table.csv", PROJECT_ROOT / "fmu_src/documentation/published.csv")
    )
    assert made == kept, "stale: copy build/reports/paper_cycle/table.csv there and run linkage-fmu generate"


def test_command_line_of_fmpy_runs(beside_the_build: Path):
    command = shlex.split(block_with(README, "fmpy simulate").replace("\\\n", " "))
    assert command[0] == ".venv/bin/fmpy"
    command[0] = str(Path(sys.executable).with_name("fmpy"))
    run = subprocess.run(command, cwd=beside_the_build, capture_output=True, text=True, check=True)
    assert run.stdout + run.stderr == "", "no warnings"
    with (beside_the_build / "tip.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) > 900 and float(rows[0]["tip.x"]) == pytest.approx(float(rows[-1]["tip.x"]), abs=1e-12)


def test_it_is_read_in_a_screen_and_a_half():
    assert len(README.splitlines()) <= 150


def test_targets_that_it_names_are_in_the_makefile():
    makefile = (PROJECT_ROOT / "Makefile").read_text()
    targets = set(re.findall(r"(?:^|`)make ([a-z]+)", README, re.MULTILINE))
    assert {"run", "test", "cycle"} <= targets
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
