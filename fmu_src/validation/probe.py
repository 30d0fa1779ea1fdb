"""The process in which an FMU is loaded: what the FMU does to it, crash or hang, is seen from outside.

    python probe.py TRACE

Prints "ready", then reads jobs from stdin, one JSON object a line, and answers each by one line on stdout:
{"answer": ...} or {"problem": text}, with the job's "number". Where the process dies or a job outlives its "limit",
TRACE names the FMI function that it was in. Real values go as float.hex() strings: every bit counts, and not a number
equals itself.
"""

from __future__ import annotations

import base64
import copy
import ctypes
import faulthandler
import functools
import gc
import json
import math
import os
import signal
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
import numpy as np
from fmpy import fmi2, fmi3
from fmpy.model_description import ModelDescription, ModelVariable
from fmpy.simulation import instantiate_fmu

CO_SIMULATION, MODEL_EXCHANGE = "CoSimulation", "ModelExchange"
CONTINUOUS = ("Real", "Float32", "Float64")
NOT_READ = ("Binary", "Clock")  # opaque, and readable in some modes alone
MOST_EVENT_ITERATIONS = 100
BATCHES = 6  # of instances, to see memory grow
MOST_RETURNS = 1000  # of fmi3DoStep, early, within one communication step
FMI2_DISCARD, FMI2_TERMINATED = 2, 3  # a status, a kind of status
ROUNDING = 1e-9  # by which a time may be off, of the step
SPARE = 8  # places behind the end of an array that an FMU fills: what it writes there is seen, and harmless
UNTOUCHED = -7.25e217  # in such an array before the call
CLOSED = 74  # exit status of a process that can answer no more


@functools.lru_cache(maxsize=1)
def described(folder: str) -> ModelDescription:
    """A large description takes longer to be read than most jobs do."""
    return fmpy.read_model_description(folder, validate=False)


class Driver:
    """One instance, driven alike in FMI 2.0 and 3.0, co-simulation and Model Exchange (by Euler's forward method)."""

    def __init__(self, folder: str, kind: str, token: str | None = None, **options: Any) -> None:
        """`options` are those of fmpy's instantiate_fmu."""
        self.description = described(folder)
        if token is not None:
            self.description = copy.copy(self.description)
            self.description.guid = token
        self.by_name = {variable.name: variable for variable in self.description.modelVariables}
        self.is_fmi2 = self.description.fmiVersion.startswith("2.")
        self.kind = kind
        self.messages: list[str] = []
        self.logged: set[tuple[bytes | None, bytes | None]] = set()  # categories and messages
        self.time, self.next_event = 0.0, math.inf
        self.indicators: list[bool] | None = None
        self.has_ended = False  # the FMU asked for it
        has_clocks = any(variable.type == "Clock" for variable in self.description.modelVariables)
        interface = self.description.coSimulation if kind == CO_SIMULATION else None
        self.uses_event_mode = options.setdefault(
            "event_mode_used", bool(has_clocks and interface is not None and interface.hasEventMode)
        )
        logger = self._log2 if self.is_fmi2 else self._log3
        with told(self):
            self.fmu = instantiate_fmu(folder, self.description, kind, logger=logger, **options)

    def _log2(
        self, _environment: Any, _instance: bytes | None, status: int, category: bytes | None, message: bytes | None
    ) -> None:
        self._keep(status, category, message)

    def _log3(self, _environment: Any, status: int, category: bytes | None, message: bytes | None) -> None:
        self._keep(status, category, message)

    def _keep(self, status: int, category: bytes | None, message: bytes | None) -> None:
        if len(self.logged) < 1000:
            self.logged.add((category, message))
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
        if self.kind == MODEL_EXCHANGE or self.uses_event_mode:
            self._iterate_events()
        return self

    def end(self) -> None:
        if not (self.has_ended and self.is_fmi2 and self.kind == CO_SIMULATION):  # its last step was discarded
            self.fmu.terminate()
        self.free()

    def free(self) -> None:
        self.fmu.freeInstance()

    def reset(self) -> None:
        self.fmu.reset()
        self.next_event, self.indicators, self.has_ended = math.inf, None, False

    # ---- values ----------------------------------------------------------------------------------

    def type_of(self, variable: ModelVariable) -> str:
        type_: str = variable.type
        return {"Enumeration": "Integer" if self.is_fmi2 else "Int64"}.get(type_, type_)

    def readable(self, names: list[str] | None = None) -> list[ModelVariable]:
        chosen = self.description.modelVariables if names is None else [self.by_name[name] for name in names]
        return [variable for variable in chosen if variable.type not in NOT_READ]

    def read(self, variables: list[ModelVariable]) -> list[Any]:
        """Their values in the same order; an array's as a list. One call a type."""
        found: dict[int, Any] = {}
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

    def states(self) -> list[str]:
        """The continuous states in the order of Model Exchange; arrays are left out."""
        return [unknown.variable.derivative.name for unknown in self.description.derivatives
                if not unknown.variable.shape and unknown.variable.derivative is not None]  # fmt: skip

    def set_states(self, values: list[float]) -> None:
        self.fmu.setContinuousStates((ctypes.c_double * len(values))(*values), len(values))

    # ---- steps -----------------------------------------------------------------------------------

    def go_to(self, end: float, length: float) -> None:
        """To the next communication point, `length` after the last; `has_ended` where the FMU asks for no further
        one. (Not end - time, which differs from step to step by its rounding: some FMUs take one length alone.)
        """
        if self.kind == MODEL_EXCHANGE:
            self._integrate(end)
        elif self.is_fmi2:
            self._step2(end, length)
        else:
            self._step3(end, length)

    def _step2(self, end: float, length: float) -> None:
        try:
            self.fmu.doStep(self.time, length)
        except Exception as problem:
            if not (getattr(problem, "status", None) == FMI2_DISCARD and self.fmu.getBooleanStatus(FMI2_TERMINATED)):
                raise
            self.has_ended = True
        self.time = end

    def _step3(self, end: float, length: float) -> None:
        """An FMU may return early, and where its own steps do not divide the host's it may stop a little off the
        communication point (FMI 3.0.2, section 4.2): the next step then begins where it stopped.
        """
        for _ in range(MOST_RETURNS):
            if not end > self.time:  # it is ahead
                return
            has_event = self.uses_event_mode and self.time < self.next_event < end - ROUNDING * length
            until = self.next_event if has_event else end
            left = until - self.time
            left = length if abs(left - length) <= ROUNDING * length else left
            needs_event, self.has_ended, is_early, reached = self.fmu.doStep(self.time, left)
            is_there = abs(reached - until) <= ROUNDING * length
            if not (is_there or is_early or self.has_ended) and not self.time < reached < until + length:
                raise RuntimeError(f"fmi3DoStep from {self.time:g} s stopped at {reached:g} s instead of {until:g} s")
            self.time = until if is_there else reached
            if self.has_ended:
                return
            if (needs_event and self.uses_event_mode) or (has_event and is_there):
                self.fmu.enterEventMode()
                self._iterate_events()
            if self.has_ended or not (is_early or has_event) or (is_there and not has_event):
                return
        raise RuntimeError(
            f"fmi3DoStep returned early {MOST_RETURNS} times and is at {self.time:g} s, not at {end:g} s"
        )

    def _integrate(self, end: float) -> None:
        count = self.description.numberOfContinuousStates
        while self.time < end and not self.has_ended:
            until = min(end, self.next_event) if self.next_event > self.time else end
            if count:
                states, rates = self.filled("States"), self.filled("Rates")
                moved = [x + (until - self.time) * rate for x, rate in zip(states, rates, strict=True)]
                self.fmu.setTime(until)
                self.fmu.setContinuousStates((ctypes.c_double * count)(*moved), count)
            else:
                self.fmu.setTime(until)
            self.time = until
            wants_event, self.has_ended = self.fmu.completedIntegratorStep()
            if not self.has_ended and (wants_event or self.time >= self.next_event or self._crossed()):
                self.fmu.enterEventMode()
                self._iterate_events()

    def filled(self, what: str) -> list[float]:
        """Of Model Exchange: "States", "Rates", "Nominals" or "Indicators": as many as are declared, in a larger array
        of which the FMU fills what it fills. Raises RuntimeError where that is not as many.
        """
        count = self.description.numberOfEventIndicators
        getter = {"States": "getContinuousStates", "Nominals": "getNominalsOfContinuousStates",
                  "Indicators": "getEventIndicators",
                  "Rates": "getDerivatives" if self.is_fmi2 else "getContinuousStateDerivatives"}[what]  # fmt: skip
        if what != "Indicators":
            count = self.description.numberOfContinuousStates
        array = (ctypes.c_double * (count + SPARE))(*[UNTOUCHED] * (count + SPARE))
        getattr(self.fmu, getter)(array, count)
        filled = sum(value != UNTOUCHED for value in array)
        if filled != count:
            name = f"fmi{2 if self.is_fmi2 else 3}{getter[0].upper()}{getter[1:]}"
            raise RuntimeError(f"{name} fills {filled} values where {count} are declared")
        return list(array)[:count]

    def _crossed(self) -> bool:
        """Whether an event indicator changed its sign since it was last looked at."""
        if not self.description.numberOfEventIndicators:
            return False
        signs, before = [value > 0 for value in self.filled("Indicators")], self.indicators
        self.indicators = signs
        return before is not None and signs != before

    def _iterate_events(self) -> None:
        """From Event Mode to Continuous-Time Mode, or to Step Mode."""
        update = self.fmu.newDiscreteStates if self.is_fmi2 else self.fmu.updateDiscreteStates
        for _ in range(MOST_EVENT_ITERATIONS):
            again, terminate, _, _, has_next, next_event = update()
            self.next_event = next_event if has_next else math.inf
            if terminate:
                self.has_ended = True
                return
            if not again:
                break
        else:
            raise RuntimeError(f"the event iteration at {self.time:g} s does not end")
        if self.kind == CO_SIMULATION:
            self.fmu.enterStepMode()
            return
        self.fmu.enterContinuousTimeMode()
        self.indicators = None
        self._crossed()

    # ---- states ----------------------------------------------------------------------------------

    def save(self) -> tuple[Any, list[Any]]:
        return self.fmu.getFMUState(), self.own_state()

    def own_state(self) -> list[Any]:
        """What this host has to remember beside the FMU's state."""
        return [self.time, self.next_event, self.indicators]

    def restore(self, state: Any, own: list[Any]) -> None:
        self.fmu.setFMUState(state)
        self.time, self.next_event, self.indicators = own
        self.has_ended = False


def exact(value: Any) -> str:
    """A value as text that keeps every bit."""
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, bytes):  # text of FMI 2.0; that of 3.0 comes decoded
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else repr(value)


# ---- jobs: each takes the fields of its JSON object ----------------------------------------------


def load(folder: str, kind: str) -> dict[str, Any]:
    """Load the binary and ask for its version, without an instance."""
    description = described(folder)
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
    except Exception:  # noqa: BLE001 what fmpy raises where the FMU returns NULL
        return False
    return True


def starts(folder: str, kind: str, names: list[str], start: float, stop: float) -> list[Any]:
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

    def step(self, driver: Driver, index: int) -> list[Any]:
        """Set the inputs of time `index`, step to the next one; what is watched there."""
        begin = self.start + index * self.length
        if abs(driver.time - begin) <= ROUNDING * self.length:  # else the FMU stopped elsewhere
            driver.time = begin
        driver.set(self.at(index))
        driver.go_to(begin + self.length, self.length)
        return driver.read(driver.readable(self.names))

    def go(self, driver: Driver, first: int = 0, times: list[float] | None = None) -> list[list[Any]]:
        """What is watched after each step from `first` on, to the last or to that at which the FMU ends."""
        rows = []
        for index in range(first, self.count):
            if driver.has_ended:
                break
            rows.append(self.step(driver, index))
            if times is not None:
                times.append(driver.time)
        return rows


def run(folder: str, kind: str, course: Course) -> dict[str, Any]:
    """One whole run."""
    driver = Driver(folder, kind)
    times: list[float] = []
    with told(driver):
        rows = course.go(course.begin(driver), times=times)
        driver.end()
    return {"rows": rows, "times": times, "has_ended": driver.has_ended}


def run_beside(folder: str, kind: str, course: Course) -> dict[str, Any]:
    """The same run, with a second instance that is stepped in between with other inputs."""
    other = Course(course.names, course.start, course.length, course.count, {})
    driver, second = Driver(folder, kind), Driver(folder, kind)
    with told(driver):
        course.begin(driver)
        other.begin(second)
        rows = []
        for index in range(course.count):
            if driver.has_ended:
                break
            rows.append(course.step(driver, index))
            if not second.has_ended:
                other.step(second, index)
        second.free()
        driver.end()
    return {"rows": rows}


def run_after_reset(folder: str, kind: str, course: Course) -> dict[str, Any]:
    """The same run on an instance that has run before and was reset."""
    driver = Driver(folder, kind)
    with told(driver):
        course.go(course.begin(driver))
        if not driver.has_ended:
            driver.fmu.terminate()
        driver.reset()
        rows = course.go(course.begin(driver))
        driver.end()
    return {"rows": rows}


def replay(folder: str, kind: str, course: Course, half: int) -> dict[str, Any]:
    """Save after `half` steps, run to the end, restore, run to the end again."""
    driver = Driver(folder, kind)
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


def serialize(folder: str, kind: str, course: Course, half: int) -> dict[str, Any]:
    """The state after `half` steps as bytes, and how this instance goes on."""
    driver = Driver(folder, kind)
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


def resume(folder: str, kind: str, course: Course, half: int, serialized: str, own: list[Any]) -> dict[str, Any]:
    """Go on from a serialized state in a new instance."""
    driver = Driver(folder, kind)
    with told(driver):
        state = driver.fmu.deserializeFMUState(base64.b64decode(serialized))
        driver.restore(state, own)
        driver.fmu.freeFMUState(state)
        rows = course.go(driver, half)
        driver.free()
    return {"rows": rows}


def slopes(  # noqa: PLR0917 fields of a job, all given by name
    folder: str, kind: str, start: float, stop: float, inputs: dict[str, float], pairs: list[list[str]], adjoint: bool
) -> list[list[float]]:
    """For each (unknown, known): the directional derivative, or else the adjoint one, and what two central differences
    with the widths h and 2 h give. In Initialization Mode, where outputs follow inputs.
    """
    driver = Driver(folder, kind).enter(start, stop)
    with told(driver):
        driver.set(inputs)
        answers = []
        for unknown, known in pairs:
            references = [driver.by_name[name].valueReference for name in (unknown, known)]
            if adjoint:
                given = driver.fmu.getAdjointDerivative([references[0]], [references[1]], [1.0], 1)[0]
            else:
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
        driver.free()  # from here: with these inputs the FMU need not be able to begin
    return answers


def influence(  # noqa: PLR0917 fields of a job, all given by name
    folder: str,
    kind: str,
    start: float,
    stop: float,
    unknowns: list[str],
    points: list[dict[str, list[Any]]],
    continuous: bool,
    seconds: float,
) -> list[dict[str, Any] | None]:
    """How unknowns follow knowns. A point is {known: [value, changed value, ...]}; two changes of numbers are by d and
    2 d. First all knowns get their values, then each is changed alone. Per point {known: {unknown: [before, after one
    change, after the other]}} for what changed at all; None where the FMU refuses the point or
    `seconds` are over. In Initialization Mode
    or, `continuous`, in Continuous-Time Mode, where states are set as such.
    """
    answers: list[dict[str, Any] | None] = []
    driver, until = None, time.monotonic() + seconds
    for point in points:
        try:
            if driver is None:
                driver = Driver(folder, kind).enter(start, stop)
                if continuous:
                    driver.begin()
            answers.append(influence_at(driver, unknowns, point, continuous, until))
        except Exception:  # noqa: BLE001 no point at which this model can be; its instance is of no use from here
            answers.append(None)
            if driver is not None:
                driver.free()
            driver = None
    if driver is not None:
        driver.free()
    return answers


def influence_at(
    driver: Driver, unknowns: list[str], point: dict[str, list[Any]], continuous: bool, until: float
) -> dict[str, Any]:
    variables = driver.readable(unknowns)
    states = driver.states() if continuous else []
    centre = {known: values[0] for known, values in point.items()}

    def put(changed: dict[str, Any]) -> None:
        if any(name in states for name in changed):
            driver.set_states([(centre | changed)[name] for name in states])
        driver.set({name: value for name, value in changed.items() if name not in states})

    put(centre)
    before = driver.read(variables)
    found: dict[str, dict[str, Any]] = {}
    for known, (_, *changes) in point.items():
        if time.monotonic() > until:
            raise TimeoutError
        after = []
        for value in changes:
            put({known: value})
            after.append(driver.read(variables))
        put({known: centre[known]})
        found[known] = {
            name: [before[place], *(row[place] for row in after)]
            for place, name in enumerate(unknowns)
            if any(row[place] != before[place] for row in after)
        }
    return found


def states(folder: str, kind: str, start: float, step: float) -> dict[str, Any]:
    """What Model Exchange says of its states by its own functions, and by the variables."""
    driver = Driver(folder, kind).enter(start, start + step).begin()
    with told(driver):
        names = driver.states()
        rates = [unknown.variable.name for unknown in driver.description.derivatives if not unknown.variable.shape]
        answer: dict[str, Any] = {"names": names, "rates": rates, "counts": None}
        if not driver.is_fmi2:
            answer["counts"] = [driver.fmu.getNumberOfContinuousStates(), driver.fmu.getNumberOfEventIndicators()]
        answer["nominals"] = driver.filled("Nominals") if driver.description.numberOfContinuousStates else []
        if driver.description.numberOfEventIndicators:
            driver.filled("Indicators")
        if len(names) == driver.description.numberOfContinuousStates and names:
            held = driver.filled("States")
            answer["held"] = held
            answer["as variables"] = driver.read(driver.readable(names))
            answer["held rates"] = list(map(exact, driver.filled("Rates")))
            answer["rates as variables"] = driver.read(driver.readable(rates))
            answer["set"] = [value + 1e-3 * max(abs(value), 1.0) for value in held]
            try:
                driver.fmu.setTime(start + step)
                driver.set_states(answer["set"])
                rates_after = list(map(exact, driver.filled("Rates")))
            except Exception:  # noqa: BLE001 no point at which this model can be
                del answer["set"]
            else:
                answer["got"] = driver.filled("States")
                answer["got as variables"] = driver.read(driver.readable(names))
                answer["rates after"] = rates_after
                answer["rates after as variables"] = driver.read(driver.readable(rates))
        driver.free()
    return answer


def own_indicators(folder: str, kind: str, start: float, step: float) -> bool:
    """Whether an FMU that declares no event indicator fills some when asked for none."""
    driver = Driver(folder, kind).enter(start, start + step).begin()
    try:
        driver.filled("Indicators")
    except RuntimeError as problem:
        return "fills" in str(problem)
    return False


def input_derivatives(folder: str, kind: str, course: Course) -> dict[str, Any]:
    """A run as it is, one in which the first derivatives of the inputs are set, and one in which the inputs differ:
    what is watched at the end of each.
    """
    ends = {}
    for how in ("held", "sloped", "other"):
        driver = Driver(folder, kind)
        with told(driver):
            course.begin(driver)
            rows = []
            for index in range(course.count):
                inputs = course.at(index)
                driver.set({name: value + 0.1 * (how == "other") for name, value in inputs.items()})
                if how == "sloped":
                    references = [driver.by_name[name].valueReference for name in inputs]
                    driver.fmu.setRealInputDerivatives(references, [1] * len(references), [1.0] * len(references))
                driver.go_to(course.start + (index + 1) * course.length, course.length)
                if driver.has_ended:
                    break
                rows.append(driver.read(driver.readable(course.names)))
            driver.free()
        ends[how] = rows
    return ends


def output_derivatives(folder: str, kind: str, course: Course, orders: int) -> dict[str, Any]:
    """The derivatives of what is watched by time after each step, per order, beside the values."""
    driver = Driver(folder, kind)
    references = [driver.by_name[name].valueReference for name in course.names]
    get = driver.fmu.getRealOutputDerivatives if driver.is_fmi2 else driver.fmu.getOutputDerivatives
    rows, given = [], []
    with told(driver):
        course.begin(driver)
        for index in range(course.count):
            rows.append(course.step(driver, index))
            if driver.has_ended:
                break
            given.append(
                [list(map(exact, get(references, [order] * len(references)))) for order in range(1, orders + 1)]
            )
        driver.free()
    return {"rows": rows[: len(given)], "given": given}


def event_mode(folder: str, kind: str, course: Course) -> dict[str, Any]:
    """A run whose host enters Event Mode after every step."""
    driver = Driver(folder, kind, event_mode_used=True)
    rows = []
    with told(driver):
        course.begin(driver)
        for index in range(course.count):
            if driver.has_ended:
                break
            rows.append(course.step(driver, index))
            if not driver.has_ended:
                driver.fmu.enterEventMode()
                driver._iterate_events()
        driver.end()
    return {"rows": rows}


def intermediate_update(folder: str, kind: str, course: Course, early: bool) -> dict[str, Any]:
    """How often the FMU called back in a run, with times within the step or not; where it may return early, whether
    it did when it was asked to.
    """
    seen: dict[str, Any] = {"calls": 0, "outside": [], "unreadable": "", "asked": 0, "returned": 0}
    now: dict[str, Any] = {"begin": course.start, "end": course.start, "asks": True, "return": None}

    def update(
        _environment: Any, time: float, _set_requested: bool, get_allowed: bool, _finished: bool, can_return: bool,
        requested: Any, return_time: Any,
    ) -> None:  # fmt: skip
        seen["calls"] += 1
        slack = ROUNDING * course.length
        if not now["begin"] - slack <= time <= now["end"] + slack and len(seen["outside"]) < 3:
            seen["outside"].append([time, now["begin"], now["end"]])
        requested[0] = False
        if get_allowed and readable:
            try:
                driver.read(readable)
            except Exception as problem:  # noqa: BLE001 of fmpy
                seen["unreadable"] = str(problem)
        if early and can_return and now["asks"] and time < now["end"] - 1e-6 * course.length:
            if now["return"] is None:  # from here on it asks until the step is over
                now["return"] = (time + now["end"]) / 2
                seen["asked"] += 1
            requested[0], return_time[0] = True, max(now["return"], time)

    readable = []
    description = described(folder)
    required = [
        variable for variable in description.modelVariables
        if variable.intermediateUpdate and variable.causality == "output" and not variable.shape
        and variable.type == "Float64" and not variable.clocks
    ]  # fmt: skip
    driver = Driver(folder, kind, early_return_allowed=early, intermediate_update=update,
                    required_intermediate_variables=[variable.valueReference for variable in required])  # fmt: skip
    readable = [driver.by_name[variable.name] for variable in required]
    with told(driver):
        course.begin(driver)
        for index in range(course.count):
            begin, end = course.start + index * course.length, course.start + (index + 1) * course.length
            driver.set(course.at(index))
            driver.time, now["asks"], now["return"] = begin, True, None
            for _ in range(MOST_RETURNS):
                now.update(begin=driver.time, end=end)
                _, driver.has_ended, is_early, reached = driver.fmu.doStep(driver.time, end - driver.time)
                seen["returned"] += is_early and now["asks"] and now["return"] is not None
                now["asks"] = False
                if not is_early and not driver.has_ended and not reached > driver.time:
                    raise RuntimeError(f"fmi3DoStep from {driver.time:g} s to {end:g} s stopped at {reached:g} s")
                driver.time = max(driver.time, reached) if is_early else end
                if driver.has_ended or driver.time >= end - ROUNDING * course.length:
                    break
            else:
                raise RuntimeError(f"fmi3DoStep returned early {MOST_RETURNS} times and is at {driver.time:g} s")
            driver.time = end
            if driver.has_ended:
                break
        driver.end()
    return seen


def variable_steps(folder: str, kind: str, course: Course, lengths: list[float]) -> dict[str, Any]:
    """A run of steps of other lengths."""
    driver = Driver(folder, kind)
    rows, times = [], []
    with told(driver):
        course.begin(driver)
        end = course.start
        for length in lengths:
            end += length
            driver.go_to(end, length)
            rows.append(driver.read(driver.readable(course.names)))
            times.append(driver.time)
            if driver.has_ended:
                break
        driver.end()
    return {"rows": rows, "times": times}


def log(folder: str, kind: str, course: Course) -> dict[str, Any]:
    """Categories and messages of a run with all that the FMU logs; bytes as in Latin-1."""
    driver = Driver(folder, kind, debug_logging=True)
    with told(driver):
        categories = [category.name for category in driver.description.logCategories]
        if categories:
            driver.fmu.setDebugLogging(True, categories)
        course.go(course.begin(driver))
        driver.end()
    return {"logged": [[part and part.decode("latin-1") for part in pair] for pair in driver.logged]}


def memory(  # noqa: PLR0917 fields of a job, all given by name
    folder: str, kind: str, start: float, stop: float, most: int, seconds: float, longest: float
) -> list[list[int]]:
    """[instances, bytes of the C library's heap, bytes of the process] after each of some batches of instances that are
    made, initialized and freed, in about `seconds`; none where the fewest would take longer than `longest`.
    """
    driver = Driver(folder, kind)
    free = driver.fmu.fmi2FreeInstance if driver.is_fmi2 else driver.fmu.fmi3FreeInstance
    arguments: dict[str, Any] = (
        {"callbacks": driver.fmu.callbacks} if driver.is_fmi2 else {"logMessage": lambda *_: None}
    )
    if driver.uses_event_mode:
        arguments["eventModeUsed"] = True

    def cycle(count: int) -> None:
        for _ in range(count):
            driver.enter(start, stop)
            driver.fmu.exitInitializationMode()
            free(driver.fmu.component)
            driver.fmu.instantiate(**arguments)

    cycle(1)  # what is made once and kept
    begin = time.perf_counter()
    cycle(1)
    each = time.perf_counter() - begin
    if 2 * BATCHES * each > longest:
        driver.free()
        return []
    batch = max(2, min(most, int(seconds / max(each, 1e-6)) // BATCHES))
    found = []
    for _ in range(BATCHES):
        cycle(batch)
        gc.collect()
        found.append([batch, heap_size(), resident_size()])
    driver.free()
    return found


def heap_size() -> int:
    """Bytes that malloc has given out; 0 where the C library does not tell."""
    try:
        tell = ctypes.CDLL(None).mallinfo2
    except (AttributeError, OSError):
        return 0
    tell.restype = MallInfo
    info = tell()
    return int(info.uordblks + info.hblkhd)


class MallInfo(ctypes.Structure):
    """glibc's struct mallinfo2."""

    _fields_ = [(name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks",
                                                     "fsmblks", "uordblks", "fordblks", "keepcost")]  # fmt: skip


def resident_size() -> int:
    """Bytes of this process in memory; 0 where the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0


def experiment(
    folder: str,
    kind: str,
    start_values: dict[str, Any],
    inputs: dict[str, list[Any]] | None,
    names: list[str],
    settings: dict[str, Any],
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


def inspect(file: str) -> dict[str, Any]:
    """What a binary is, exports and needs."""
    import lief

    lief.logging.disable()
    binary = lief.parse(file)
    if isinstance(binary, lief.ELF.Binary):
        looked_in = (lief.ELF.DynamicEntryRpath, lief.ELF.DynamicEntryRunPath)
        paths = [path for entry in binary.dynamic_entries if isinstance(entry, looked_in) for path in entry.paths]
        versions = [
            str(version.name)
            for needed in binary.symbols_version_requirement
            for version in needed.get_auxiliary_symbols()
        ]
        exports = [symbol.name for symbol in binary.exported_symbols]
        found = about("ELF", [binary.header.machine_type.name], exports, binary.libraries, paths, versions)
        return found | {"destructors": destructors(binary)}
    if isinstance(binary, lief.PE.Binary):
        exported = binary.get_export()
        exports = [entry.name for entry in exported.entries if entry.name] if exported else []
        return about("PE", [binary.header.machine.name], exports, binary.libraries)
    fat = lief.MachO.parse(file) if lief.is_macho(file) else None
    if fat is None or not fat.size:
        raise ValueError("neither an ELF, a PE nor a Mach-O binary")
    parts = [part for index in range(fat.size) if (part := fat.at(index)) is not None]
    exported_by = [{str(symbol.name).removeprefix("_") for symbol in part.exported_symbols} for part in parts]
    if odd := {name for names in exported_by for name in names if not all(name in other for other in exported_by)}:
        raise ValueError(f"its parts for several processors do not all export {', '.join(sorted(odd)[:4])}")
    own = lief.MachO.LoadCommand.TYPE.ID_DYLIB
    needed = {library.name for part in parts for library in part.libraries if library.command != own}
    return about("Mach-O", [part.header.cpu_type.name for part in parts], exported_by[0], sorted(needed))


def destructors(binary: Any) -> list[str]:
    """Names of the functions of an ELF library's .fini_array, in its order; "" where its symbols do not tell."""
    import lief

    tags = lief.ELF.DynamicEntry.TAG
    array, size = (
        next((entry.value for entry in binary.dynamic_entries if entry.tag == tag), 0)
        for tag in (tags.FINI_ARRAY, tags.FINI_ARRAYSZ)
    )
    names = {symbol.value: str(symbol.name) for symbol in binary.symbols if symbol.value}
    functions = {entry.address: entry.addend for entry in binary.dynamic_relocations
                 if array <= entry.address < array + size}  # fmt: skip
    return [names.get(functions[address], "") for address in sorted(functions)]


def about(
    format_: str, machines: Iterable[str], exports: Iterable[object], needed: Iterable[object],
    paths: Iterable[str] = (), versions: Iterable[str] = (),
) -> dict[str, Any]:  # fmt: skip
    return {"format": format_, "machines": list(machines), "exports": sorted(set(map(str, exports))),
            "needed": list(map(str, needed)), "paths": list(paths), "versions": sorted(set(versions))}  # fmt: skip


class told:
    """Adds what the FMU's own logger said last to what went wrong."""

    def __init__(self, driver: Driver) -> None:
        self.driver = driver

    def __enter__(self) -> None: ...

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if problem is not None:
            place = f" at {self.driver.time:g} s" if "DoStep" in str(problem) else ""
            said = f'; the FMU said: "{self.driver.messages[-1]}"' if self.driver.messages else ""
            raise RuntimeError(f"{str(problem).rstrip('.')}{place}{said}") from problem


JOBS: dict[str, Callable[..., Any]] = {
    job.__name__: job
    for job in (load, instance, token, starts, run, run_beside, run_after_reset, replay, serialize, resume, slopes,
                influence, states, own_indicators, input_derivatives, output_derivatives, event_mode,
                intermediate_update, variable_steps, log, memory, experiment, inspect)
}  # fmt: skip


def main(trace_file: str) -> None:
    jobs, answers = os.fdopen(os.dup(0), encoding="utf-8"), os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what an FMU prints is no answer
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)  # what an FMU reads is no job
    os.close(nothing)
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # what an FMU sends itself ends it, by that name
    with Path(trace_file).open("w") as trace:
        faulthandler.enable(trace)
        print("ready", file=answers, flush=True)
        for line in jobs:
            job = json.loads(line)
            number = job.pop("number")
            if "course" in job:
                job["course"] = Course(**job["course"])
            faulthandler.dump_traceback_later(job.pop("limit"), exit=True, file=trace)
            try:
                answer = {"answer": JOBS[job.pop("do")](**job)}
            except Exception as problem:  # noqa: BLE001 whatever it is, it is the answer
                answer = {"problem": str(problem) or type(problem).__name__}
            faulthandler.cancel_dump_traceback_later()
            print(json.dumps(answer | {"number": number}), file=answers, flush=True)


if __name__ == "__main__":
    status = 0
    try:
        main(sys.argv[1])
    except OSError:  # the FMU has closed what jobs and answers go through
        status = CLOSED
    # Not sys.exit: how the libraries that an FMU has loaded take an end of the process is not what is checked here,
    # and some that were made elsewhere (PythonFMU 0.7.0) corrupt the heap in their destructors.
    os._exit(status)
