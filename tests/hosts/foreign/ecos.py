"""Ecos: a C++ co-simulation framework with a Python interface.

Its library needs libtbb.so.12: Debian's libtbb12, or the PyPI package tbb, which puts it where no loader looks.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import sys
from pathlib import Path

from tests.hosts.drives import INPUTS, OUTPUTS, STEP, STEPS
from tests.hosts.foreign import HostError, Rows, Task, missing_package

NAME, PACKAGE = "Ecos", "PyPI ecospy"
INTERFACES = {("2.0", "CS"), ("3.0", "CS")}
FEEDING = "set at each step"
DEFECTS: dict = {}
TBB = "libtbb.so.12"


def load_tbb() -> bool:
    for library in (Path(sys.prefix) / "lib" / TBB, TBB):
        try:
            ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
            return True
        except OSError:
            pass
    return False


def missing() -> str:
    return missing_package("ecospy") or ("" if load_tbb() else f"{TBB} (Debian libtbb12, PyPI tbb)")


def version() -> str:
    return importlib.metadata.version("ecospy")


def play(task: Task) -> Rows:
    load_tbb()
    from ecospy import EcosSimulation, EcosSimulationStructure

    def set_inputs(time: float) -> None:
        for name, value in zip(INPUTS, task.drive.inputs(time), strict=True):
            simulation.set_real(f"linkage::{name}", float(value))

    with EcosSimulationStructure() as structure:
        structure.add_model("linkage", str(task.fmu))
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            set_inputs(0.0)
            if not simulation.init():
                raise HostError("the simulation does not initialize")
            for i in range(STEPS):
                set_inputs(i * STEP)
                simulation.step()
                yield simulation.get_time(), [simulation.get_real(f"linkage::{name}") for name in OUTPUTS]
            simulation.terminate()
