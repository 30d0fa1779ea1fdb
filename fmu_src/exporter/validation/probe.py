"""The process in which an FMU is loaded: what the FMU does to it, crash or hang, is seen from outside.

    python probe.py TRACE

Prints "ready", then reads jobs from stdin, one JSON object a line, and answers each by one line on stdout:
{"answer": ...} or {"problem": text}. Where the process dies or a job outlives its limit, TRACE names the FMI
function that it was in. Real values go as float.hex() strings: every bit counts, and not a number equals itself.
"""

from __future__ import annotations

import base64
import ctypes
import faulthandler
import json
import math
import os
import sys
from pathlib import Path

import fmpy
import numpy as np
from fmpy import fmi2, fmi3
from fmpy.model_description import ModelVariable
from fmpy.simulation import instantiate_fmu

CO_SIMULATION, MODEL_EXCHANGE = "CoSimulation", "ModelExchange"
CONTINUOUS = ("Real", "Float32", "Float64")
NOT_READ = ("Binary", "Clock")  # opaque, and readable in some modes alone
MOST_EVENT_ITERATIONS = 100


class Driver:
    """One instance, driven alike in FMI 2.0 and 3.0, co-simulation and Model Exchange (by Euler's forward method)."""

    def __init__(self, folder: str, kind: str, token: str | None = None) -> None:
        self.description = fmpy.read_model_description(folder, validate=False)
        if token is not None:
            self.description.guid = token
        self.by_name = {variable.name: variable for variable in self.description.modelVariables}
        self.is_fmi2 = self.description.fmiVersion.startswith("2.")
        self.kind = kind
        self.messages: list[str] = []
        self.time, self.next_event, self.indicators = 0.0, math.inf, None
        logger = self._log2 if self.is_fmi2 else self._log3
        with told(self):
            self.fmu = instantiate_fmu(folder, self.description, kind, logger=logger)

    def _log2(self, _environment, _instance, status, _category, message) -> None:
        self._keep(status, message)

    def _log3(self, _environment, status, _category, message) -> None:
        self._keep(status, message)

    def _keep(self, status: int, message: bytes | None) -> None:
        if status and len(self.messages) < 20:
            self.messages.append((message or b"").decode("utf-8", "replace").strip())

    # ---- modes -----------------------------------------------------------------------------------

    def enter(self, start: float, stop: float) -> Driver:
        """From the instance to Initialization Mode."""
        self.time = start
        if self.is_fmi2:
            self.fmu.setupExperiment(startTime=start, stopTime=stop)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start, stopTime=stop)
        return self

    def begin(self) -> Driver:
        """To the first step."""
        self.fmu.exitInitializationMode()
        if self.kind == MODEL_EXCHANGE:
            self._iterate_events()
        return self

    def end(self) -> None:
        self.fmu.terminate()
        self.free()

    def free(self) -> None:
        self.fmu.freeInstance()

    def reset(self) -> None:
        self.fmu.reset()
        self.next_event, self.indicators = math.inf, None

    # ---- values ----------------------------------------------------------------------------------

    def type_of(self, variable: ModelVariable) -> str:
        return {"Enumeration": "Integer" if self.is_fmi2 else "Int64"}.get(variable.type, variable.type)

    def readable(self, names: list[str] | None = None) -> list[ModelVariable]:
        chosen = self.description.modelVariables if names is None else [self.by_name[name] for name in names]
        return [variable for variable in chosen if variable.type not in NOT_READ]

    def read(self, variables: list[ModelVariable]) -> list:
        """Their values in the same order; an array's as a list. One call a type."""
        found: dict[int, list] = {}
        for type_ in {self.type_of(variable) for variable in variables}:
            chosen = [variable for variable in variables if self.type_of(variable) == type_]
            sizes = [math.prod(variable.shape or ()) for variable in chosen]
            getter = getattr(self.fmu, f"get{type_}")
            references = [variable.valueReference for variable in chosen]
            values = getter(references) if self.is_fmi2 else getter(references, nValues=sum(sizes))
            ends = np.cumsum(sizes)
            for variable, size, end in zip(chosen, sizes, ends, strict=True):
                part = [exact(value) for value in values[end - size : end]]
                found[id(variable)] = part if variable.shape else part[0]
        return [found[id(variable)] for variable in variables]

    def set(self, values: dict[str, float]) -> None:
        for name, value in values.items():
            variable = self.by_name[name]
            getattr(self.fmu, f"set{self.type_of(variable)}")([variable.valueReference], [value])

    # ---- steps -----------------------------------------------------------------------------------

    def step(self, step: float) -> None:
        """One communication step, or one of Euler's."""
        end = self.time + step
        if self.kind == MODEL_EXCHANGE:
            self._integrate(end)
        elif self.is_fmi2:
            self.fmu.doStep(self.time, step)
        else:
            _, _, _, reached = self.fmu.doStep(self.time, step)
            if not abs(reached - end) <= 1e-6 * step:
                raise RuntimeError(f"fmi3DoStep from {self.time:g} s stopped at {reached:g} s instead of {end:g} s")
        self.time = end

    def _integrate(self, end: float) -> None:
        while self.time < end:
            until = min(end, self.next_event) if self.next_event > self.time else end
            count = self.description.numberOfContinuousStates
            if count:
                states, rates = (ctypes.c_double * count)(), (ctypes.c_double * count)()
                self.fmu.getContinuousStates(states, count)
                derivatives = self.fmu.getDerivatives if self.is_fmi2 else self.fmu.getContinuousStateDerivatives
                derivatives(rates, count)
                moved = [x + (until - self.time) * rate for x, rate in zip(states, rates, strict=True)]
                self.fmu.setTime(until)
                self.fmu.setContinuousStates((ctypes.c_double * count)(*moved), count)
            else:
                self.fmu.setTime(until)
            self.time = until
            wants_event, terminate = self.fmu.completedIntegratorStep()
            if terminate:
                raise RuntimeError(f"the FMU ended the simulation at {self.time:g} s")
            if wants_event or self.time >= self.next_event or self._crossed():
                self.fmu.enterEventMode()
                self._iterate_events()

    def _crossed(self) -> bool:
        """Whether an event indicator changed its sign since it was last looked at."""
        count = self.description.numberOfEventIndicators
        if not count:
            return False
        values = (ctypes.c_double * count)()
        self.fmu.getEventIndicators(values, count)
        signs, before = [value > 0 for value in values], self.indicators
        self.indicators = signs
        return before is not None and signs != before

    def _iterate_events(self) -> None:
        update = self.fmu.newDiscreteStates if self.is_fmi2 else self.fmu.updateDiscreteStates
        for _ in range(MOST_EVENT_ITERATIONS):
            again, terminate, _, _, has_next, next_event = update()
            if terminate:
                raise RuntimeError(f"the FMU ended the simulation at {self.time:g} s")
            self.next_event = next_event if has_next else math.inf
            if not again:
                break
        else:
            raise RuntimeError(f"the event iteration at {self.time:g} s does not end")
        self.fmu.enterContinuousTimeMode()
        self.indicators = None
        self._crossed()

    # ---- states ----------------------------------------------------------------------------------

    def save(self):
        return self.fmu.getFMUState(), self.own_state()

    def own_state(self) -> list:
        """What this host has to remember beside the FMU's state."""
        return [self.time, self.next_event, self.indicators]

    def restore(self, state, own: list) -> None:
        self.fmu.setFMUState(state)
        self.time, self.next_event, self.indicators = own


def exact(value) -> str:
    """A value as text that keeps every bit."""
    if isinstance(value, float):
        return value.hex()
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else repr(value)


# ---- jobs: each takes the fields of its JSON object ----------------------------------------------


def load(folder: str, kind: str) -> dict:
    """Load the binary and ask for its version, without an instance."""
    description = fmpy.read_model_description(folder, validate=False)
    is_fmi2 = description.fmiVersion.startswith("2.")
    classes = {
        (True, CO_SIMULATION): fmi2.FMU2Slave,
        (True, MODEL_EXCHANGE): fmi2.FMU2Model,
        (False, CO_SIMULATION): fmi3.FMU3Slave,
        (False, MODEL_EXCHANGE): fmi3.FMU3Model,
    }
    interface = description.coSimulation if kind == CO_SIMULATION else description.modelExchange
    fmu = classes[is_fmi2, kind](
        guid=description.guid, modelIdentifier=interface.modelIdentifier, unzipDirectory=folder, instanceName="probe"
    )
    answer = {"version": fmu.getVersion(), "platform": fmu.getTypesPlatform() if is_fmi2 else None}
    fmu.freeLibrary()
    return answer


def instance(folder: str, kind: str) -> None:
    """Make an instance with the token of the description, and free it."""
    Driver(folder, kind).free()


def token(folder: str, kind: str, wrong: str) -> bool:
    """Whether an instance is had with a wrong token."""
    try:
        Driver(folder, kind, wrong).free()
    except Exception:  # what fmpy raises where the FMU returns NULL
        return False
    return True


def starts(folder: str, kind: str, names: list[str], start: float, stop: float) -> list:
    """What the variables hold in Initialization Mode, nothing set."""
    driver = Driver(folder, kind).enter(start, stop)
    values = driver.read(driver.readable(names))
    driver.begin().end()
    return values


class Course:
    """A run: times and step, inputs for each time, the variables to watch."""

    def __init__(self, names: list[str], start: float, step: float, count: int, inputs: dict[str, list[float]]) -> None:
        self.names, self.start, self.length, self.count, self.inputs = names, start, step, count, inputs

    def begin(self, driver: Driver) -> Driver:
        driver.enter(self.start, self.start + self.length * self.count)
        driver.set(self.at(0))
        return driver.begin()

    def at(self, index: int) -> dict[str, float]:
        return {name: values[index] for name, values in self.inputs.items()}

    def step(self, driver: Driver, index: int) -> list:
        """Set the inputs of time `index`, step to the next one; what is watched there."""
        driver.time = self.start + index * self.length
        driver.set(self.at(index))
        driver.step(self.length)
        return driver.read(driver.readable(self.names))

    def go(self, driver: Driver, first: int = 0) -> list[list]:
        """What is watched after each step from `first` on."""
        return [self.step(driver, index) for index in range(first, self.count)]


def run(folder: str, kind: str, course: dict) -> dict:
    """One whole run."""
    driver, course = Driver(folder, kind), Course(**course)
    with told(driver):
        rows = course.go(course.begin(driver))
        driver.end()
    return {"rows": rows, "messages": driver.messages}


def run_beside(folder: str, kind: str, course: dict) -> dict:
    """The same run, with a second instance that is stepped in between with other inputs."""
    course, other = Course(**course), Course(**(course | {"inputs": {}}))
    driver, second = Driver(folder, kind), Driver(folder, kind)
    with told(driver):
        course.begin(driver)
        other.begin(second)
        rows = []
        for index in range(course.count):
            rows.append(course.step(driver, index))
            other.step(second, index)
        second.free()
        driver.end()
    return {"rows": rows}


def run_after_reset(folder: str, kind: str, course: dict) -> dict:
    """The same run on an instance that has run before and was reset."""
    driver, course = Driver(folder, kind), Course(**course)
    with told(driver):
        course.go(course.begin(driver))
        driver.fmu.terminate()
        driver.reset()
        rows = course.go(course.begin(driver))
        driver.end()
    return {"rows": rows}


def replay(folder: str, kind: str, course: dict, half: int) -> dict:
    """Save after `half` steps, run to the end, restore, run to the end again."""
    driver, course = Driver(folder, kind), Course(**course)
    with told(driver):
        course.begin(driver)
        for index in range(half):
            course.step(driver, index)
        state, own = driver.save()
        first = course.go(driver, half)
        driver.restore(state, own)
        second = course.go(driver, half)
        driver.fmu.freeFMUState(state)
        driver.end()
    return {"first": first, "second": second}


def serialize(folder: str, kind: str, course: dict, half: int) -> dict:
    """The state after `half` steps as bytes, and how this instance goes on."""
    driver, course = Driver(folder, kind), Course(**course)
    with told(driver):
        course.begin(driver)
        for index in range(half):
            course.step(driver, index)
        state, own = driver.save()
        serialized = base64.b64encode(driver.fmu.serializeFMUState(state)).decode()
        driver.fmu.freeFMUState(state)
        rows = course.go(driver, half)
        driver.end()
    return {"serialized": serialized, "own": own, "rows": rows}


def resume(folder: str, kind: str, course: dict, half: int, serialized: str, own: list) -> dict:
    """Go on from a serialized state in a new instance."""
    driver, course = Driver(folder, kind), Course(**course)
    with told(driver):
        state = driver.fmu.deserializeFMUState(base64.b64decode(serialized))
        driver.restore(state, own)
        driver.fmu.freeFMUState(state)
        rows = course.go(driver, half)
        driver.free()
    return {"rows": rows}


def slopes(
    folder: str, kind: str, start: float, stop: float, inputs: dict[str, float], pairs: list[list[str]]
) -> list[list[float]]:
    """For each (unknown, known): the directional derivative, and what two central differences with the widths h and
    2 h give. In Initialization Mode, where outputs follow inputs."""
    driver = Driver(folder, kind).enter(start, stop)
    with told(driver):
        driver.set(inputs)
        answers = []
        for unknown, known in pairs:
            references = [driver.by_name[name].valueReference for name in (unknown, known)]
            given = driver.fmu.getDirectionalDerivative([references[0]], [references[1]], [1.0])[0]
            variable, centre = driver.by_name[unknown], inputs[known]
            width = 1e-4 * max(abs(centre), 1.0)
            value = {}
            for steps in (-2, -1, 1, 2):
                driver.set({known: centre + steps * width})
                value[steps] = float.fromhex(driver.read([variable])[0])
            driver.set({known: centre})
            near = (value[1] - value[-1]) / (2 * width)
            far = (value[2] - value[-2]) / (4 * width)
            answers.append([given, near, far, max(map(abs, value.values())) / width])
        driver.begin().end()
    return answers


def experiment(
    folder: str, kind: str, start_values: dict, inputs: dict[str, list] | None, names: list[str], settings: dict
) -> dict[str, list[float]]:
    """A run in fmpy's own simulation; inputs and what comes out as columns, "time" among them."""
    result = fmpy.simulate_fmu(
        folder, validate=False, fmi_type=kind, start_values=start_values, input=inputs and table(inputs), output=names,
        **settings,
    )  # fmt: skip
    return {name: [float(value) for value in result[name]] for name in ("time", *names)}


def table(columns: dict[str, list[float]]) -> np.ndarray:
    """As fmpy takes it."""
    rows = list(zip(*columns.values(), strict=True))
    return np.array(rows, dtype=[(name, float) for name in columns])


def inspect(file: str) -> dict:
    """What a binary is, exports and needs."""
    import lief

    lief.logging.disable()
    binary = lief.parse(file)
    if isinstance(binary, lief.ELF.Binary):
        tags = (lief.ELF.DynamicEntry.TAG.RPATH, lief.ELF.DynamicEntry.TAG.RUNPATH)
        paths = [path for entry in binary.dynamic_entries if entry.tag in tags for path in entry.paths]
        versions = [
            version.name for needed in binary.symbols_version_requirement for version in needed.get_auxiliary_symbols()
        ]
        exports = [symbol.name for symbol in binary.exported_symbols]
        return about("ELF", [binary.header.machine_type.name], exports, binary.libraries, paths, versions)
    if isinstance(binary, lief.PE.Binary):
        exported = binary.get_export()
        exports = [entry.name for entry in exported.entries if entry.name] if exported else []
        return about("PE", [binary.header.machine.name], exports, binary.libraries)
    fat = lief.MachO.parse(file) if lief.is_macho(file) else None
    if fat is None or not fat.size:
        raise ValueError("neither an ELF, a PE nor a Mach-O binary")
    parts = [fat.at(index) for index in range(fat.size)]
    exports = [{symbol.name.removeprefix("_") for symbol in part.exported_symbols} for part in parts]
    if odd := set.union(*exports) - set.intersection(*exports):
        raise ValueError(f"its parts for several processors do not all export {', '.join(sorted(odd)[:4])}")
    own = lief.MachO.LoadCommand.TYPE.ID_DYLIB
    needed = {library.name for part in parts for library in part.libraries if library.command != own}
    return about("Mach-O", [part.header.cpu_type.name for part in parts], exports[0], sorted(needed))


def about(format_: str, machines, exports, needed, paths=(), versions=()) -> dict:
    return {"format": format_, "machines": machines, "exports": sorted(set(map(str, exports))),
            "needed": list(map(str, needed)), "paths": list(paths), "versions": sorted(set(versions))}  # fmt: skip


class told:
    """Adds what the FMU's own logger said last to what went wrong."""

    def __init__(self, driver: Driver) -> None:
        self.driver = driver

    def __enter__(self) -> None: ...

    def __exit__(self, kind, problem, traceback) -> None:
        if problem is not None:
            place = f" at {self.driver.time:g} s" if "DoStep" in str(problem) else ""
            said = f'; the FMU said: "{self.driver.messages[-1]}"' if self.driver.messages else ""
            raise RuntimeError(f"{str(problem).rstrip('.')}{place}{said}") from problem


JOBS = {
    job.__name__: job
    for job in (load, instance, token, starts, run, run_beside, run_after_reset, replay, serialize, resume, slopes,
                experiment, inspect)
}  # fmt: skip


def main(trace_file: str) -> None:
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what an FMU prints is no answer
    with Path(trace_file).open("w") as trace:
        faulthandler.enable(trace)
        print("ready", file=answers, flush=True)
        for line in sys.stdin:
            job = json.loads(line)
            faulthandler.dump_traceback_later(job.pop("limit"), exit=True, file=trace)
            try:
                answer = {"answer": JOBS[job.pop("do")](**job)}
            except Exception as problem:
                answer = {"problem": str(problem) or type(problem).__name__}
            faulthandler.cancel_dump_traceback_later()
            print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
