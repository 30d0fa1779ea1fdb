"""Run an SSP archive in an engine that is not ours, in a process of its own.

    python -m scenarios.field_row.engine_run ENGINE ARCHIVE STEP STOP VARIABLES RESULT

ENGINE is one of ENGINES, STEP and STOP are in s, VARIABLES is a JSON list of component.variable, RESULT
the .npz file to write: ``time`` and ``values``, a line after each step, ``version``.

The engines are used as Python packages. PythonFMU's slaves need the symbols of Python in the process that
loads them; this one has them.
"""

from __future__ import annotations

import ctypes
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files, version
from pathlib import Path

import numpy as np

from scenarios.field_row.ssp import PARAMETER_SET


def ecos(archive: Path, step: float, stop: float, variables: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Ecos: fixed steps of all components in parallel, then all connections."""
    # Its library asks for oneTBB, which the package tbb brings where the loader does not look.
    try:
        tbb = next(file for file in files("tbb") or () if file.name.startswith("libtbb.so.12"))
        ctypes.CDLL(str(tbb.locate()), mode=ctypes.RTLD_GLOBAL)
    except (PackageNotFoundError, StopIteration, OSError) as error:
        raise RuntimeError("Ecos needs oneTBB (libtbb.so.12), which the package tbb brings: pip install tbb") from error
    from ecospy import EcosLib, EcosSimulation

    EcosLib.set_log_level("warn")
    names = [name.replace(".", "::", 1) for name in variables]
    with EcosSimulation(step_size=step, ssp_path=str(archive)) as simulation:
        simulation.init(parameter_set=PARAMETER_SET)

        def reader(name: str) -> Callable[[str], float]:
            for read in (simulation.get_real, simulation.get_integer, simulation.get_bool):
                try:
                    read(name)
                except Exception:  # noqa: BLE001 - ecospy has no finer one for a variable of another type
                    continue
                return read
            raise KeyError(f"Ecos knows no variable {name}")

        readers = [(reader(name), name) for name in names]
        times, samples = [], []
        for _ in range(round(stop / step)):
            simulation.step()
            times.append(simulation.get_time())
            samples.append([read(name) for read, name in readers])
        simulation.terminate()
    return np.array(times), np.array(samples, dtype=float)


def libcosim(archive: Path, step: float, stop: float, variables: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """libcosim: fixed steps of all components in parallel, then all connections. Its times are whole nanoseconds."""
    from libcosimpy._internal import get_last_error_message
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.FATAL)
    try:
        execution = CosimExecution.from_ssp_file(str(archive), round(step * 1e9))
    except AssertionError as error:
        raise RuntimeError(get_last_error_message()) from error
    slaves = {info.name.decode(): info.index for info in execution.slave_infos()}
    known = {
        f"{name}.{variable.name.decode()}": (index, variable.reference, CosimVariableType(variable.type))
        for name, index in slaves.items()
        for variable in execution.slave_variables(index)
    }
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    kinds = {
        CosimVariableType.REAL: observer.last_real_values,
        CosimVariableType.INTEGER: observer.last_integer_values,
        CosimVariableType.BOOLEAN: observer.last_boolean_values,
    }
    groups: dict[tuple[int, CosimVariableType], list[tuple[int, int]]] = {}
    for place, name in enumerate(variables):
        index, reference, kind = known[name]
        groups.setdefault((index, kind), []).append((place, reference))
    times, samples = [], np.empty((round(stop / step), len(variables)))
    for sample in samples:
        if not execution.step():
            raise RuntimeError(get_last_error_message())
        times.append(execution.status().current_time * 1e-9)
        for (index, kind), members in groups.items():
            sample[[place for place, _ in members]] = kinds[kind](index, [reference for _, reference in members])
    return np.array(times), samples


def summed(count: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Begin and length of each step where a master adds the step up."""
    return np.concatenate([[0.0], np.cumsum(np.full(count - 1, step))]), np.full(count, step)


def whole_nanoseconds(count: int, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Begin and length of each step where a master counts nanoseconds and gives the difference as the length."""
    times = np.arange(count + 1) * round(step * 1e9) / 1e9
    return times[:-1], np.diff(times)


@dataclass(frozen=True)
class Engine:
    """``run`` takes the archive, step, stop and variables; ``clock`` gives the begin and length of its steps."""

    title: str
    package: str
    clock_text: str
    run: Callable[[Path, float, float, Sequence[str]], tuple[np.ndarray, np.ndarray]]
    clock: Callable[[int, float], tuple[np.ndarray, np.ndarray]]


ENGINES = {
    "ecos": Engine("Ecos", "ecospy", "adds the step up", ecos, summed),
    "libcosim": Engine(
        "libcosim",
        "libcosimpy",
        "counts nanoseconds; a step's length is the difference of two times",
        libcosim,
        whole_nanoseconds,
    ),
}


def main(arguments: Sequence[str]) -> int:
    """Run and write the result; an error is one line, with exit status 1."""
    engine, archive, step, stop, variables, result = arguments
    try:
        time, values = ENGINES[engine].run(Path(archive), float(step), float(stop), json.loads(variables))
    except Exception as error:  # noqa: BLE001 - the engines raise all kinds
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return 1
    np.savez(result, time=time, values=values, version=version(ENGINES[engine].package))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
