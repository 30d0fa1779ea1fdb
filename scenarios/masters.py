"""Masters: how FMUs for co-simulation (FMI 2.0) are stepped together, over fmpy's FMU objects.

    jacobi         every FMU gets the outputs of the step's begin, all step; of order 1 where outputs are held
    extrapolated   jacobi, and the slopes of some inputs besides, for FMUs that take them (`slopes` in the system)
    gauss_seidel   one after the other: each gets what those before it gave for the step's end
    controlled     jacobi, each step done once and again in two halves; their difference says how long the next
                   may be, or that this one must be taken back (Schierz, Arnold and Clauss 2012, Co-simulation with
                   communication step size control in an FMI compatible master algorithm). Needs the FMUs' states.

    with CoSimulation(load_system(), start_values) as row:
        for time in fixed_steps(row, jacobi, stop=10.0, step=0.005): ...
"""

from __future__ import annotations

import difflib
import numbers
import shutil
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from types import TracebackType

from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Boolean, fmi2Integer, fmi2Real, fmi2ValueReference
from fmpy.model_description import ModelDescription, ModelVariable
from fmpy.simulation import instantiate_fmu

from scenarios.cycle import first_line
from scenarios.system import Component, Port, System, SystemFault, Value

C_TYPES = {"Real": fmi2Real, "Integer": fmi2Integer, "Enumeration": fmi2Integer, "Boolean": fmi2Boolean}
SMALLEST_STEP = 1e-4  # s, of the controlled master
WARNING, FATAL = 1, 4  # FMI status


class NoRollback(SystemFault):
    """An FMU of the system does not offer what controlled steps need."""


class Slave:
    """One FMU in its place: loaded, and addressed by the names of the system.

    ``messages`` is shared: fmpy hands the messages of all FMUs to the logger that was given last.
    """

    def __init__(self, component: Component, messages: deque[str]) -> None:
        self.name, self.component, self._messages = component.name, component, messages
        if not component.fmu.is_file():
            raise SystemFault(f"{component.name}: there is no FMU at {component.fmu}: run `make build`, "
                              "or name another in the system's file.")
        self._folder: str | None = None
        self._lost = False  # after fmi2Fatal no function may be called, not even to free (FMI 2.0.4, section 2.1.3)
        try:
            self.description: ModelDescription = read_model_description(str(component.fmu))
            if self.description.fmiVersion != "2.0" or self.description.coSimulation is None:
                raise SystemFault(f"{component.name}: {component.fmu} is not an FMI 2.0 FMU for co-simulation.")
            self._folder = extract(str(component.fmu))
            self.fmu = instantiate_fmu(self._folder, self.description, "CoSimulation", logger=self._log,
                                       debug_logging=True)  # its messages say why it fails
        except SystemFault:
            raise
        except Exception as error:  # zip, XML and loader errors have no common base
            self._delete()
            raise SystemFault(f"{component.name}: {component.fmu} cannot be loaded: {first_line(error)}") from error
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.units = {unit.name: unit.baseUnit for unit in self.description.unitDefinitions}

    def _log(self, _environment: object, _instance: object, status: int, _category: object, message: bytes) -> None:
        if status >= WARNING and message:
            self._messages.append(message.decode("utf-8", "replace"))

    def variable(self, name: str) -> ModelVariable:
        """The FMU's variable for a name of the system; raises SystemFault, with likely names, where there is none."""
        own = self.component.names.get(name, name)
        if own not in self.variables:
            near = difflib.get_close_matches(own, self.variables, n=3, cutoff=0.5)
            raise SystemFault(f"{self.name}: {self.component.fmu.name} has no variable {own!r}"
                              + (f"; did you mean {' or '.join(near)}?" if near else "."))
        return self.variables[own]

    def call(self, what: str, function: Callable, *arguments: object) -> object:
        """Raises SystemFault with the FMU's own words where it refuses."""
        self._messages.clear()
        try:
            return function(*arguments)
        except FMICallException as error:
            self._lost = error.status == FATAL
            said = self._messages[0].splitlines() if self._messages else [first_line(error)]
            if said[0].startswith("Fatal py exception"):  # of PythonFMU: what Python said comes last
                said = said[-1:]
            said = " ".join(said)
            raise SystemFault(f"{self.name} failed {what}: {said}") from error

    def set(self, name: str, value: Value) -> None:
        """A parameter, or the start of an input."""
        variable = self.variable(name)
        if variable.causality not in ("parameter", "input") and variable.start is None:
            raise SystemFault(f"{self.name}.{name} cannot be set: it is of causality {variable.causality}.")
        fitting = {"Real": numbers.Real, "Integer": numbers.Integral, "Boolean": bool}.get(_kind(variable), ())
        if not isinstance(value, fitting) or (isinstance(value, bool) and fitting is not bool):
            raise SystemFault(f"{self.name}.{name} cannot be set to {value!r}: it is of type {variable.type}.")
        write = getattr(self.fmu, f"set{_kind(variable)}")
        self.call(f"to take {name} = {value:g}", write, [variable.valueReference], [value])

    def free(self) -> None:
        if not self._lost:
            self.fmu.freeInstance()
        self._delete()

    def _delete(self) -> None:
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)


def _kind(variable: ModelVariable) -> str:
    return "Integer" if variable.type == "Enumeration" else variable.type


class Values:
    """Variables of one type of one FMU that are read or written together; ``places``: where in the signals."""

    def __init__(self, slave: Slave, kind: str, variables: Sequence[ModelVariable], places: Sequence[int],
                 scales: Sequence[tuple[float, float]] = ()) -> None:
        count = len(variables)
        self.slave, self.places, self.scales = slave, places, scales
        self._buffer = (C_TYPES[kind] * count)()
        self._call = (slave.fmu.component, (fmi2ValueReference * count)(*[v.valueReference for v in variables]), count,
                      self._buffer)
        self._get, self._set = getattr(slave.fmu, f"fmi2Get{kind}"), getattr(slave.fmu, f"fmi2Set{kind}")

    def read(self, signals: list[float]) -> None:
        self._get(*self._call)
        for place, value in zip(self.places, self._buffer):
            signals[place] = value

    def write(self, signals: Sequence[float]) -> None:
        for i, (place, (factor, offset)) in enumerate(zip(self.places, self.scales)):
            value = signals[place]
            self._buffer[i] = value if factor == 1.0 and not offset else value * factor + offset
        self._set(*self._call)


class CoSimulation:
    """The FMUs of a system, loaded, connected and initialized; a context manager.

    ``watched`` outputs are read by `values`. Those that a swapped FMU lacks are left out and
    listed in ``not_offered``. With ``at_step_end`` the FMUs after the first are told that the
    inputs which they get belong to the end of the step. ``steps_done`` counts the steps of all
    FMUs, taken back or not.
    """

    def __init__(self, system: System, watched: Sequence[str] = (), at_step_end: bool = False,
                 start: float = 0.0) -> None:
        self.system, self.start = system, start
        self.steps_done = 0
        self.slaves: list[Slave] = []
        messages: deque[str] = deque(maxlen=20)
        try:
            for component in system.components:
                self.slaves.append(Slave(component, messages))
            self._connect(watched)
            self._initialize(at_step_end)
        except BaseException:
            self.close()
            raise

    def _slave(self, port: Port) -> Slave:
        return next(slave for slave in self.slaves if slave.name == port.component)

    def _connect(self, watched: Sequence[str]) -> None:
        connections, sources = self.system.connections, sorted(set(self.system.connections.values()))
        self.signals: list[float] = [0.0] * len(sources)
        variables = {port: self._slave(port).variable(port.variable) for port in [*connections, *sources]}
        for target, source in connections.items():
            if variables[target].causality != "input" or variables[source].causality != "output":
                raise SystemFault(f"{target} = {source}: {variables[target].name} must be an input and "
                                  f"{variables[source].name} an output; they are {variables[target].causality} "
                                  f"and {variables[source].causality}.")
            if _kind(variables[target]) != "Real" and _kind(variables[target]) != _kind(variables[source]):
                raise SystemFault(f"{target} = {source}: a {_kind(variables[source])} cannot be given to "
                                  f"a {_kind(variables[target])}.")
        place = {source: i for i, source in enumerate(sources)}
        scales = {target: self._conversion(target, source, variables) for target, source in connections.items()}
        self.conversions = scales  # by input: factor and offset

        def grouped(ports: Sequence[Port], places: Callable[[Port], int], scaled: bool = False) -> list[Values]:
            groups: dict[tuple[str, str], list[Port]] = {}
            for port in ports:
                groups.setdefault((port.component, _kind(variables[port])), []).append(port)
            return [Values(self._slave(group[0]), kind, [variables[p] for p in group], [places(p) for p in group],
                           [scales[p] for p in group] if scaled else ()) for (_, kind), group in groups.items()]

        outputs = grouped(sources, place.__getitem__)
        inputs = grouped(list(connections), lambda port: place[connections[port]], scaled=True)
        self.outputs = {slave.name: [v for v in outputs if v.slave is slave] for slave in self.slaves}
        self.inputs = {slave.name: [v for v in inputs if v.slave is slave] for slave in self.slaves}
        self.slopes, self.sampled = [], None
        for slave in self.slaves:
            ports = [port for port in map(partial(Port, slave.name), slave.component.slopes) if port in connections]
            if ports and not slave.description.coSimulation.canInterpolateInputs:
                raise SystemFault(f"{slave.name} takes no slopes of inputs: {slave.component.fmu.name} says "
                                  "canInterpolateInputs = false.")
            references = (fmi2ValueReference * len(ports))(*[variables[port].valueReference for port in ports])
            if ports:
                self.slopes.append((slave, references, [place[connections[port]] for port in ports],
                                    [scales[port][0] for port in ports]))
        self.tolerances = [self.system.step_control.get(variables[source].unit) for source in sources]

        self.watched, self.not_offered, ports = [], [], []
        for name in watched:
            port = self.system.port(name)
            try:
                variables[port] = self._slave(port).variable(port.variable)
            except SystemFault:
                self.not_offered.append(name)
                continue
            self.watched.append(name)
            ports.append(port)
        self._watched = grouped(ports, {port: i for i, port in enumerate(ports)}.__getitem__)

    def _conversion(self, target: Port, source: Port, variables: dict[Port, ModelVariable]) -> tuple[float, float]:
        """Factor and offset from the unit of an output to that of an input, by what the FMUs say of their units."""
        units = [variables[port].unit for port in (source, target)]
        if None in units or units[0] == units[1]:
            return 1.0, 0.0
        theirs, ours = (self._slave(port).units.get(unit) for port, unit in zip((source, target), units))
        exponents = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
        if not theirs or not ours:
            return 1.0, 0.0
        if [getattr(theirs, e) for e in exponents] != [getattr(ours, e) for e in exponents]:
            raise SystemFault(f"{target} = {source}: {units[0]} cannot be converted to {units[1]}.")
        return theirs.factor / ours.factor, (theirs.offset - ours.offset) / ours.factor

    def _initialize(self, at_step_end: bool) -> None:
        for slave in self.slaves:
            slave.call("to be set up", slave.fmu.setupExperiment, None, self.start)
        for port, value in self.system.parameters.items():
            if port in self.system.connections:
                raise SystemFault(f"{port} cannot be set: it is connected to {self.system.connections[port]}.")
            self._slave(port).set(port.variable, value)
        for slave in self.slaves[1:]:
            if at_step_end and slave.component.at_step_end:
                slave.set(slave.component.at_step_end, True)
        for slave in self.slaves:
            slave.call("to initialize", slave.fmu.enterInitializationMode)
        for _ in self.slaves:  # so often that what the first gives reaches the last
            self.read()
            self.write()
        for slave in self.slaves:
            slave.call("to initialize", slave.fmu.exitInitializationMode)
        self.read()

    def read(self, slave: Slave | None = None) -> None:
        """Outputs into the signals, of one FMU or of all."""
        for one in [slave] if slave else self.slaves:
            for values in self.outputs[one.name]:
                one.call("to give outputs", values.read, self.signals)

    def write(self, slave: Slave | None = None) -> None:
        """Signals to the inputs, of one FMU or of all."""
        for one in [slave] if slave else self.slaves:
            for values in self.inputs[one.name]:
                one.call("to take inputs", values.write, self.signals)

    def write_slopes(self, time: float) -> None:
        """fmi2SetRealInputDerivatives, order 1, for the inputs in `slopes`; needs two calls at different times."""
        before, self.sampled = self.sampled, (time, list(self.signals))
        for slave, references, places, factors in self.slopes if before and before[0] < time else ():
            count, since = len(places), time - before[0]
            slopes = [factor * (self.signals[i] - before[1][i]) / since for i, factor in zip(places, factors)]
            slave.call("to take slopes", slave.fmu.fmi2SetRealInputDerivatives, slave.fmu.component, references, count,
                       (fmi2Integer * count)(*[1] * count), (fmi2Real * count)(*slopes))

    def step(self, slave: Slave, time: float, step: float) -> None:
        self.steps_done += 1
        slave.call(f"at t = {time:.4f} s, in a step of {1e3 * step:g} ms", slave.fmu.doStep, time, step)

    def values(self) -> list[float]:
        """The watched outputs, in the order of ``watched``."""
        found = [0.0] * len(self.watched)
        for values in self._watched:
            values.slave.call("to give outputs", values.read, found)
        return found

    def save(self) -> tuple:
        """The states of all FMUs, to be restored once or more and then freed."""
        states = [slave.call("to save its state", slave.fmu.getFMUstate) for slave in self.slaves]
        return states, list(self.signals), self.sampled

    def restore(self, saved: tuple) -> None:
        for slave, state in zip(self.slaves, saved[0]):
            slave.call("to restore its state", slave.fmu.setFMUstate, state)
        self.signals, self.sampled = list(saved[1]), saved[2]

    def free(self, saved: tuple) -> None:
        for slave, state in zip(self.slaves, saved[0]):
            slave.fmu.freeFMUstate(state)

    def close(self) -> None:
        for slave in self.slaves:
            slave.free()
        self.slaves = []

    def __enter__(self) -> CoSimulation:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


Master = Callable[[CoSimulation, float, float], None]


def jacobi(row: CoSimulation, time: float, step: float) -> None:
    """One step of all, from what all gave before it."""
    row.write()
    for slave in row.slaves:
        row.step(slave, time, step)
    row.read()


def extrapolated(row: CoSimulation, time: float, step: float) -> None:
    """`jacobi`, with the slopes of the inputs that the system lists, from their values here and a step ago."""
    row.write()
    row.write_slopes(time)
    for slave in row.slaves:
        row.step(slave, time, step)
    row.read()


def gauss_seidel(row: CoSimulation, time: float, step: float) -> None:
    """One step of each in turn, from what those before it give for the step's end."""
    for slave in row.slaves:
        row.write(slave)
        row.step(slave, time, step)
        row.read(slave)


def fixed_steps(row: CoSimulation, master: Master, stop: float, step: float) -> Iterator[float]:
    """Steps to ``stop``; yields the time after each."""
    for i in range(round((stop - row.start) / step)):
        master(row, row.start + i * step, step)
        yield row.start + (i + 1) * step


def controlled_steps(row: CoSimulation, master: Master, stop: float, longest: float,
                     tolerance: float = 1.0) -> Iterator[float]:
    """Steps as long as ``tolerance`` times the system's step_control allows; yields the time after each.

    A step is done once whole and once in two halves, which are kept where the difference is allowed.
    What begins in a second half shows in neither: ``longest`` is what bounds that error.
    """
    unable = [s.name for s in row.slaves if not s.description.coSimulation.canGetAndSetFMUstate
              or not s.description.coSimulation.canHandleVariableCommunicationStepSize]
    if unable:
        raise NoRollback("Steps can be controlled only where every FMU offers its state and takes steps of any length; "
                          f"not so: {', '.join(unable)}.")
    if not any(row.tolerances):
        raise SystemFault("Steps can be controlled only where step_control names the unit of a connected output.")
    time, step = row.start, SMALLEST_STEP
    while time < stop - 1e-9:
        step = min(step, stop - time)
        saved = row.save()
        master(row, time, step)
        whole = list(row.signals)
        row.restore(saved)
        master(row, time, step / 2)
        master(row, time + step / 2, step / 2)
        error = max(abs(a - b) / t for a, b, t in zip(whole, row.signals, row.tolerances) if t) / tolerance
        accepted = error <= 1 or step <= SMALLEST_STEP
        if not accepted:
            row.restore(saved)
        row.free(saved)
        taken, step = step, min(max(step * min(max(0.9 / max(error, 1e-12) ** 0.5, 0.3), 2.0), SMALLEST_STEP), longest)
        if accepted:
            time += taken
            yield time
