"""FMUs that a developer has, Modelica's Reference-FMUs for instance: none has an error.

    LINKAGE_FMU_OTHERS=~/Reference-FMUs/build/fmus python -m pytest tests/validation/test_fmus_of_others.py

The variable names a folder; every FMU of FMI 2.0 and 3.0 in it and below is validated.
"""

from __future__ import annotations

import os
from pathlib import Path

import fmpy
import pytest

from fmu_src.validation.subject import Options
from fmu_src.validation.table import validate

FOLDER = os.environ.get("LINKAGE_FMU_OTHERS")
FMUS = sorted(Path(FOLDER).expanduser().rglob("*.fmu")) if FOLDER else []


@pytest.mark.skipif(not FOLDER, reason="LINKAGE_FMU_OTHERS names no folder of FMUs")
@pytest.mark.parametrize("fmu", FMUS or [None], ids=str)
def test_it_has_no_error(fmu: Path | None):
    assert fmu is not None, f"{FOLDER} has no FMU"
    if fmpy.read_model_description(str(fmu), validate=False).fmiVersion.startswith("1."):
        pytest.skip("FMI 1.0 is not judged")
    errors = {result.title: result.problems for result in validate(fmu, Options()) if result.problems}
    assert errors == {}
