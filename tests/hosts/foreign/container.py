"""The FMU container of the FMU Manipulation Toolbox: a master that is itself an FMU, in C; FMPy steps it.

Inside, the crank drive and the linkage are stepped side by side: each gets the other's outputs of the step's start.
"""

from __future__ import annotations

import importlib.metadata
import json
import shutil
import sys

import fmpy

from tests.hosts.drives import AT_STEP_END, INPUTS, OUTPUTS, STEP, STEPS
from tests.hosts.foreign import Rows, Task, missing_package, run
from tests.hosts.foreign.partner import build_partner

NAME, PACKAGE = "FMU container", "PyPI fmu-manipulation-toolbox"
INTERFACES = {("2.0", "CS"), ("3.0", "CS")}
FEEDING = "partner FMU, parallel"
DEFECTS: dict = {}
COMMAND = "from fmu_manipulation_toolbox.cli.fmucontainer import fmucontainer; fmucontainer()"


def missing() -> str:
    return missing_package("fmu-manipulation-toolbox")


def version() -> str:
    return importlib.metadata.version("fmu-manipulation-toolbox")


def play(task: Task, sequential: bool = False) -> Rows:
    drive, linkage = "drive.fmu", "linkage.fmu"
    build_partner(task.drive, task.folder / drive)
    shutil.copyfile(task.fmu, task.folder / linkage)
    layout = {
        "name": "container.fmu",
        "step_size": STEP,
        "sequential": sequential,
        "fmu": [drive, linkage],
        "link": [[drive, name, linkage, name] for name in INPUTS],
        "output": [[linkage, name, name] for name in OUTPUTS],
        "start": [[linkage, AT_STEP_END, sequential]],
    }
    (task.folder / "container.json").write_text(json.dumps(layout))
    run(sys.executable, "-c", COMMAND, "-fmu-directory", task.folder, "-container", "container.json",
        "-fmi", task.edition[0])  # fmt: skip
    container = task.folder / "container.fmu"
    result = fmpy.simulate_fmu(str(container), stop_time=STEPS * STEP, output_interval=STEP, output=OUTPUTS)
    for row in result:
        yield row["time"], [row[name] for name in OUTPUTS]
