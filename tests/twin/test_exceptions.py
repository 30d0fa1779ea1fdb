"""An exception in a PythonFMU slave leaves its host whole: the instance works on, is reset and freed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from fmu_src.exporter.compiler import host_platform
from fmu_src.exporter.python_fmu import mend_fmu
from tests.soak import heap_at_exit
from tests.soak.heap_at_exit import PARTNERS, TWIN, run, unmended

SOAK = Path(heap_at_exit.__file__).parent
MEMORY = {"PYTHONMALLOC": "debug", "MALLOC_PERTURB_": "85"}  # what was freed is overwritten, by Python and by glibc
ROUNDS = "4"
# One after the other: a parameter that it refuses in initialization; a reset, or a new instance.
REFUSED = """import gc, sys
import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.simulation import instantiate_fmu
file, folder, name, value = sys.argv[1:]
description = fmpy.read_model_description(file)
(reference,) = (v.valueReference for v in description.modelVariables if v.name == name)
refused = 0
for made in range(4):
    fmu = instantiate_fmu(folder, description, "CoSimulation")
    for _ in range(10):
        fmu.setupExperiment(startTime=0.0)
        fmu.setReal([reference], [float(value)])
        try:
            fmu.enterInitializationMode()
            fmu.exitInitializationMode()
        except FMICallException:
            refused += 1
        gc.collect()
        fmu.getReal([reference])
        fmu.reset()
    fmu.fmi2FreeInstance(fmu.component)
    gc.collect()
sys.exit(f"{refused} of 40 were refused" if refused != 40 else 0)"""
BAD = {
    "TransplanterLinkageTwin": ("geometry.L2", 0.001), "Drivetrain": ("speed.ramp", 0.0),
    "Conveyor": ("mouth.radius", 0.0), "Soil": ("soil.n", 0.0),
}  # fmt: skip

on_windows_or_linux = pytest.mark.skipif(
    host_platform().name not in ("x86_64-linux", "x86_64-windows"), reason="PythonFMU has no library for this system"
)


@pytest.fixture(scope="module")
def raising(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU of a slave that raises wherever it is asked to, as PythonFMU builds it."""
    folder = tmp_path_factory.mktemp("raising")
    options = ["--handle-state", "--serialize-state"]
    command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(SOAK / "raising.py"), "-d", str(folder), *options]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / "Raising.fmu"


def mended_copy(fmu: Path, folder: Path) -> Path:
    copy = Path(shutil.copy(fmu, folder))
    assert mend_fmu(copy)
    return copy


def unpacked(fmu: Path, folder: Path) -> str:
    return str(fmpy.extract(str(fmu), str(folder / "unpacked")))


def command(folder: str, rounds: str = ROUNDS) -> list[str]:
    return [sys.executable, "-B", "-m", "tests.soak.exceptions", folder, rounds]


@on_windows_or_linux
def test_each_call_may_raise(raising: Path, tmp_path: Path):
    folder = unpacked(mended_copy(raising, tmp_path), tmp_path)
    done = run(command(folder), tmp_path, **MEMORY)
    assert done.returncode == 0, done.stderr


@on_windows_or_linux
def test_with_pythonfmus_own_library_the_process_dies(raising: Path, tmp_path: Path):
    """Else the test above could not fail."""
    done = run(command(unpacked(raising, tmp_path)), tmp_path, **MEMORY)
    assert done.returncode not in (0, 1), done.stderr  # 1: the host found a wrong answer


@on_windows_or_linux
@pytest.mark.parametrize("fmu", [TWIN, *PARTNERS], ids=lambda fmu: fmu.stem)
def test_what_ships_refuses_and_lives(fmu: Path, tmp_path: Path):
    name, value = BAD[fmu.stem]
    arguments = [str(fmu), unpacked(fmu, tmp_path), name, str(value)]
    done = run([sys.executable, "-B", "-c", REFUSED, *arguments], tmp_path, **MEMORY)
    assert done.returncode == 0, done.stderr


@on_windows_or_linux
def test_the_unmended_twin_does_not(tmp_path: Path):
    fmu = unmended(TWIN, tmp_path)
    name, value = BAD[TWIN.stem]
    arguments = [str(fmu), unpacked(fmu, tmp_path), name, str(value)]
    done = run([sys.executable, "-B", "-c", REFUSED, *arguments], tmp_path, **MEMORY)
    assert done.returncode not in (0, 1), done.stderr


def under_valgrind(folder: str, scratch: Path) -> str:
    log = scratch / "valgrind.log"
    valgrind = [
        "valgrind", "--undef-value-errors=no", f"--suppressions={SOAK / 'interpreter.supp'}", f"--log-file={log}",
    ]  # fmt: skip
    run([*valgrind, *command(folder, "2")], scratch, PYTHONMALLOC="malloc")  # each object its own block
    return log.read_text()


valgrind = pytest.mark.skipif(
    shutil.which("valgrind") is None or host_platform().name != "x86_64-linux", reason="valgrind is not installed"
)


@valgrind
def test_valgrind_finds_no_invalid_access(raising: Path, tmp_path: Path):
    said = under_valgrind(unpacked(mended_copy(raising, tmp_path), tmp_path), tmp_path)
    assert "ERROR SUMMARY: 0 errors" in said, said


@valgrind
def test_valgrind_finds_that_of_pythonfmus_own_library(raising: Path, tmp_path: Path):
    said = under_valgrind(unpacked(raising, tmp_path), tmp_path)
    assert "PySlaveInstance" in said and "Invalid read" in said and "free'd" in said
