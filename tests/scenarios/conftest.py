"""What the tests of the scenes share."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import PROJECT_ROOT

HANG = 1200  # s: who waits so long waits for ever, on the busiest machine too


@pytest.fixture(scope="session")
def run_scene(fmu_file: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs a module of scenarios as a user would, on the built FMU unless told otherwise."""

    def run(
        module: str, *arguments: object, fmu: Path = fmu_file, timeout: float = HANG
    ) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", f"scenarios.{module}", "--fmu", str(fmu), *map(str, arguments)],
            cwd=PROJECT_ROOT,
            capture_output=True,
            encoding="utf-8",
            timeout=timeout,
        )

    return run
