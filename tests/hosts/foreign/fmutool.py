"""fmutool -check, of the FMU Manipulation Toolbox."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.hosts.foreign import run
from tests.hosts.foreign.container import PACKAGE, missing, version  # noqa: F401 - of this host too

NAME = "fmutool -check"
EDITIONS = {"2.0", "3.0"}
COMMAND = "import sys; sys.stderr = sys.stdout; from fmu_manipulation_toolbox.cli.fmutool import fmutool; fmutool()"


def check(fmu: Path) -> list[str]:
    """Its lines of a level above INFO; it ends with 0 whatever it found."""
    lines = run(sys.executable, "-c", COMMAND, "-input", fmu, "-check").splitlines()
    if not any("compliant" in line for line in lines):
        return lines
    return [line for line in lines if not line.startswith("INFO")]
