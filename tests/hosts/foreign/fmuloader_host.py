"""fmuloader: the functions of FMI from Python and nothing else, not even the description. The loops are ours: steps of
Co-Simulation, Euler's method around Model Exchange.

Its own allocateMemory of FMI 2.0 cuts addresses to 32 bits (0.1.2rc0: calloc by ctypes without a type of its result),
which ends the process in fmi2Instantiate; so it is told to give none.
"""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable, Sequence

from tests.hosts.drives import INPUTS, OUTPUTS, STEP
from tests.hosts.foreign import Rows, Task, missing_package

NAME, PACKAGE = "fmuloader", "PyPI fmuloader"
INTERFACES = {("2.0", "CS"), ("3.0", "CS"), ("2.0", "ME"), ("3.0", "ME")}
FEEDING = "set at each step"
DEFECTS: dict = {}


def missing() -> str:
    return missing_package("fmuloader")


def version() -> str:
    return importlib.metadata.version("fmuloader")


def play(task: Task) -> Rows:
    slave, set_values, get_values = instantiate(task)
    inputs, outputs = task.references(INPUTS), task.references(OUTPUTS)
    for i, time in enumerate(task.times):
        if i and task.interface == "CS":
            slave.do_step(task.times[i - 1], STEP)
        elif i:
            (travel,) = slave.get_continuous_states(1)
            (speed,) = slave.get_derivatives(1) if task.edition == "2.0" else slave.get_continuous_state_derivatives(1)
            slave.set_time(time)
            slave.set_continuous_states([travel + STEP * speed])
        if task.interface == "ME":
            set_values(inputs, list(map(float, task.drive.inputs(time))))
        if i:
            yield time, get_values(outputs)
        if task.interface == "CS":
            set_values(inputs, list(map(float, task.drive.inputs(time))))
    slave.terminate()
    slave.free_instance()


def instantiate(task: Task) -> tuple[object, Callable[..., object], Callable[..., Sequence[float]]]:
    """An instance, initialized with the inputs of the start; what sets its reals, and what gets them."""
    from fmuloader.fmi2 import Fmi2Slave, Fmi2Type
    from fmuloader.fmi3 import Fmi3Slave

    description = task.description
    start = task.references(INPUTS), list(map(float, task.drive.inputs(0.0)))
    if task.edition == "2.0":
        slave = Fmi2Slave(str(task.fmu), model_identifier=description.modelName)
        kind = Fmi2Type.CO_SIMULATION if task.interface == "CS" else Fmi2Type.MODEL_EXCHANGE
        slave.instantiate("linkage", kind, guid=description.guid, cannot_use_memory_management_functions=True)
        set_values, get_values = slave.set_real, slave.get_real
        slave.setup_experiment(start_time=0.0)
        slave.enter_initialization_mode()
    else:
        slave = Fmi3Slave(str(task.fmu), model_identifier=description.modelName)
        if task.interface == "CS":
            slave.instantiate_co_simulation("linkage", instantiation_token=description.guid)
        else:
            slave.instantiate_model_exchange("linkage", instantiation_token=description.guid)
        set_values, get_values = slave.set_float64, slave.get_float64
        slave.enter_initialization_mode(start_time=0.0)
    set_values(*start)
    slave.exit_initialization_mode()
    if task.interface == "ME":
        slave.new_discrete_states() if task.edition == "2.0" else slave.update_discrete_states()
        slave.enter_continuous_time_mode()
    return slave, set_values, get_values
