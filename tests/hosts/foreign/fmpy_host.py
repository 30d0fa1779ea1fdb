"""FMPy: the host that most FMU authors try first; Python over the FMU's functions, CVode or Euler around ME."""

from __future__ import annotations

import fmpy
import numpy as np

from tests.hosts.drives import INPUTS, OUTPUTS, STEP, STEPS
from tests.hosts.foreign import LONG_NAMES, Rows, Task

NAME, PACKAGE = "FMPy", "PyPI fmpy"
INTERFACES = {("2.0", "CS"), ("3.0", "CS"), ("2.0", "ME"), ("3.0", "ME")}
FEEDING = "table of inputs"
# Seen in fmpy/simulation.py: CVode's maxStep is a fiftieth of the run, and it is called with CV_NORMAL.
AHEAD = "its CVode steps up to a fiftieth of the run ahead, with the inputs held: the travel integrates an old speed"
DEFECTS = {(edition, "ME"): AHEAD for edition in ("2.0", "3.0")}


def missing() -> str:
    return ""


def version() -> str:
    return fmpy.__version__


def play(task: Task, solver: str = "CVode") -> Rows:
    inputs = np.array(
        [(t, *task.drive.inputs(t)) for t in task.times], dtype=[(name, float) for name in ("time", *INPUTS)]
    )
    result = fmpy.simulate_fmu(
        str(task.fmu), fmi_type=LONG_NAMES[task.interface], stop_time=STEPS * STEP, output_interval=STEP,
        input=inputs, output=OUTPUTS, solver=solver,
    )  # fmt: skip
    for row in result:
        yield row["time"], [row[name] for name in OUTPUTS]
