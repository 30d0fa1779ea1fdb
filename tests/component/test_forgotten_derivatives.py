"""An output that somebody adds without saying what its derivatives are: values, and a clear refusal of all else."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from tests.conftest import BOTH_VERSIONS
from tests.harness.host import ERROR, Fmu
from tests.harness.host3 import Fmu3

pytestmark = BOTH_VERSIONS

NAME = "tip.radius"
BUILD = (
    "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); from fmu_src import cli;"
    "from fmu_src.exporter import build; cli.main(['generate']);"
    "[build.build_fmu(version, Path('out'), [build.compiler.host_platform()]) for version in (2, 3)]"
)


def change(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{file.name}: {old}"
    file.write_text(text.replace(old, new), encoding="utf-8")


@pytest.fixture
def fmu_with_another_output(project_copy, tmp_path, fmus, version) -> Fmu:
    """The distance of the tip from O, computed with the position; of its derivatives nothing is said."""
    declared = (
        f'  {{ name = "{NAME}", kind = "output", unit = "m", computed_by = "position", depends = ["crank.phi"], '
        'initially = ["tip"], text = "Distance of the tip from O" },\n]\n\n[model]'
    )
    change(project_copy / "fmu_src" / "interface.toml", "]\n\n[model]", declared)
    place = "    real[VARIABLE_GROUND_Y] = y;\n"
    computed = f"{place}    real[VARIABLE_TIP_RADIUS] = sqrt(x * x + y * y);\n"
    change(project_copy / "fmu_src" / "component" / "outputs.c", place, computed)
    command = [sys.executable, "-c", BUILD, project_copy]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    file = tmp_path / "out" / f"fmi{version}" / "TransplanterLinkage.fmu"
    fmpy.extract(str(file), str(tmp_path / "unpacked"))
    return (Fmu3 if version == 3 else Fmu)(file, tmp_path / "unpacked", fmus[2].callbacks)


def test_its_derivatives_are_refused(fmu_with_another_output, version):
    with fmu_with_another_output.instance() as instance:
        instance.initialize({"crank.phi": 1.0, "crank.w": 2.0})
        x, y, radius = instance.get("tip.x", "tip.y", NAME)
        assert radius == pytest.approx((x * x + y * y) ** 0.5, rel=1e-15)
        seed = {"crank.phi": 1.0}
        refused = [
            instance.try_sensitivity([NAME], seed),
            instance.try_sensitivity(["tip.x", NAME], seed),
            instance.try_get_derivatives((NAME, 1)),
        ]
        if version == 3:
            refused += [instance.try_adjoint({NAME: 1.0}, list(seed)), instance.try_adjoint({NAME: 0.0}, list(seed))]
        for status, values in refused:
            assert status == ERROR and all(map(math.isnan, values)), "nothing is written"
        assert len(instance.messages) == len(refused)
        assert all(f"{NAME}: its derivatives are not known" in message.text for message in instance.messages)
        assert instance.sensitivity(["tip.x", "tip.y"], seed) != [0.0, 0.0], "the others go on"
