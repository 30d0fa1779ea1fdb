"""libcosim, of the Open Simulation Platform: C++ on the FMI Library (FMIL), through libcosimpy. FMI 2.0 alone."""

from __future__ import annotations

import importlib.metadata

from tests.hosts.drives import INPUTS, OUTPUTS, STEP, STEPS
from tests.hosts.foreign import HostError, Rows, Task, missing_package

NAME, PACKAGE = "libcosim", "PyPI libcosimpy"
INTERFACES = {("2.0", "CS")}
FEEDING = "override at each step"
DEFECTS: dict = {}
NANOSECONDS = 1e9


def missing() -> str:
    return missing_package("libcosimpy")  # it has no wheel for Python 3.10


def version() -> str:
    return importlib.metadata.version("libcosimpy")


def play(task: Task) -> Rows:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.FATAL)
    execution = CosimExecution.from_step_size(round(STEP * NANOSECONDS))
    slave = CosimLocalSlave(fmu_path=str(task.fmu), instance_name="linkage")
    index = execution.add_local_slave(slave)
    setter, reader = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(setter)
    execution.add_observer(reader)
    inputs, outputs = task.references(INPUTS), task.references(OUTPUTS)
    for i in range(STEPS):
        setter.slave_real_values(index, inputs, [float(value) for value in task.drive.inputs(i * STEP)])
        if not execution.step():
            raise HostError(f"step {i} failed")
        yield execution.status().current_time / NANOSECONDS, reader.last_real_values(index, outputs)
