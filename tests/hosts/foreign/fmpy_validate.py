"""fmpy validate: the XML schema and the rules beyond it."""

from __future__ import annotations

from pathlib import Path

import fmpy
from fmpy.validation import validate_fmu

NAME, PACKAGE = "fmpy validate", "PyPI fmpy"
EDITIONS = {"2.0", "3.0"}


def missing() -> str:
    return ""


def version() -> str:
    return fmpy.__version__


def check(fmu: Path) -> list[str]:
    return [str(problem) for problem in validate_fmu(str(fmu))]
