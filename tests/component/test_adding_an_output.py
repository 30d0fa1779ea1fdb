"""An output that somebody adds as the page on adding says: one line of interface.toml, and nothing else.

It is there then in both versions and in the twin, with its value, its Jacobian and its derivatives by time.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import fmpy
import pytest

from tests.conftest import BOTH_VERSIONS, PROJECT_ROOT, copy_project
from tests.harness.host import Fmu
from tests.harness.host3 import Fmu3

NAME = "tip.power"
LINE = (
    f'  {{ name = "{NAME}", kind = "output", unit = "1", group = "power", '
    "equation = \"0.5 tip.x'' tip.fx + tip.y' crank.w^2 - machine.s\", "
    'depends = ["crank.phi", "crank.w", "tip.fx", "machine.s:constant"], initially = ["tip"], '
    'text = "No quantity that anybody needs, with factors of every kind" },\n'
)
BUILD = (
    "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); from fmu_src import cli;"
    "from fmu_src.exporter import build; cli.main(['generate']);"
    "[build.build_fmu(version, Path('out'), [build.compiler.host_platform()]) for version in (2, 3)];"
    "build.build_twin(Path('out'))"
)
GENERATED = {"component/interface.h", "component/interface.c", "documentation/interface.md"}


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources with one line more, built beside."""
    folder = tmp_path_factory.mktemp("added")
    copy = copy_project(folder)
    declared = copy / "fmu_src" / "interface.toml"
    text = declared.read_text(encoding="utf-8")
    assert text.count("]\n\n[model]") == 1
    declared.write_text(text.replace("]\n\n[model]", LINE + "]\n\n[model]"), encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", BUILD, copy], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return copy


def changed_lines(copy: Path) -> Iterator[tuple[str, int]]:
    """Files that differ from this project's, and by how many lines."""
    for file in sorted(copy.joinpath("fmu_src").rglob("*")):
        name = file.relative_to(copy / "fmu_src").as_posix()
        mine = PROJECT_ROOT / "fmu_src" / name
        if file.is_file() and "__pycache__" not in name and file.read_bytes() != mine.read_bytes():
            yield name, len(file.read_text().splitlines()) - len(mine.read_text().splitlines())


def test_one_place_had_to_be_touched(copy):
    """Declaration and equation are one line; what differs besides was generated from it."""
    changed = dict(changed_lines(copy))
    assert changed.pop("interface.toml") == 1
    assert set(changed) <= GENERATED, "a file that `linkage-fmu generate` does not write"


@BOTH_VERSIONS
def test_value_jacobian_and_derivatives_by_time(copy, tmp_path, fmus, version):
    file = copy.parent / "out" / f"fmi{version}" / "TransplanterLinkage.fmu"
    fmpy.extract(str(file), str(tmp_path / "unpacked"))
    phi, w, fx, fy = 1.0, 2.0, 30.0, 40.0
    with (Fmu3 if version == 3 else Fmu)(file, tmp_path / "unpacked", fmus[2].callbacks).instance() as instance:
        instance.initialize({"crank.phi": phi, "crank.w": w, "tip.fx": fx, "tip.fy": fy, "machine.s": 0.7})
        # the tip's derivatives by phi, from what the others say at w = 1
        ax, vx, vy, s, power = instance.get("tip.ax", "tip.vx", "tip.vy", "machine.s", NAME)
        assert power == pytest.approx(0.5 * ax / w**2 * fx + vy / w * w**2 - s, rel=1e-14)
        assert instance.sensitivity([NAME], {"tip.fx": 1.0}) == [pytest.approx(0.5 * ax / w**2, rel=1e-14)]
        assert instance.sensitivity([NAME], {"crank.w": 1.0}) == [pytest.approx(2 * vy, rel=1e-14)]
        assert instance.sensitivity([NAME], {"machine.s": 1.0, "tip.fy": 1.0}) == [-1.0]
        by_phi, ay_by_w = instance.sensitivity([NAME, "tip.vy"], {"crank.phi": 1.0})
        (jerk,) = instance.get_derivatives(("tip.ax", 1))  # r''' w^3, as crank.a is 0
        assert by_phi == pytest.approx(0.5 * jerk / w**3 * fx + ay_by_w / w * w**2, rel=1e-12)
        assert instance.get_derivatives((NAME, 1)) == [pytest.approx(by_phi * w, rel=1e-12)]
        if version == 3:
            assert instance.adjoint({NAME: 2.0}, ["crank.phi", "crank.w"]) == pytest.approx([2 * by_phi, 4 * vy])
        assert vx != 0.0


def test_the_twin_has_it(copy):
    """In a process of its own: PythonFMU finds a slave by its module's name, and there may be another twin in this."""
    code = (
        "import sys, fmpy; print(*(repr(float(fmpy.simulate_fmu(file, start_values={'crank.phi': 1.0, 'crank.w': 2.0, "
        "'tip.fx': 30.0}, output=sys.argv[1:2], stop_time=1e-3, step_size=1e-3)[sys.argv[1]][-1])) "
        "for file in sys.argv[2:]))"
    )
    files = [
        copy.parent / "out" / name for name in ("fmi2/TransplanterLinkage.fmu", "twin/TransplanterLinkageTwin.fmu")
    ]
    done = subprocess.run([sys.executable, "-c", code, NAME, *files], capture_output=True, text=True, check=True)
    native, twin = map(float, done.stdout.split())
    assert native == pytest.approx(twin, rel=1e-13) and native != 0.0
