"""Masters: how FMUs for co-simulation (FMI 2.0) are stepped together.

jacobi         every FMU gets the outputs of the step's begin, all step; of order 1 where outputs are held
extrapolated   jacobi, and the slopes of some inputs besides, for FMUs that take them (`slopes` in the system)
gauss_seidel   one after the other: each gets what those before it gave for the step's end
controlled     jacobi, each step done once and again in two halves; their difference says how long the next
               may be, or that this one must be taken back (Schierz, Arnold and Clauss 2012, Co-simulation with
               communication step size control in an FMI compatible master algorithm). Needs the FMUs' states.

with CoSimulation(load_system(), watched) as simulation:
    for time in fixed_steps(simulation, jacobi, stop=10.0, step=0.005): ...
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from ctypes import byref, c_double, c_int32, c_uint32, c_void_p
from types import TracebackType

from fmpy.model_description import ModelVariable

from scenarios.common.instance import OK, WARNING, FmuError, Instance, UnpackedFmu
from scenarios.field_row.component import Component, Port, SystemFault, Unit, Value, kind
from scenarios.field_row.system import System

C_TYPES = {"Real": c_double, "Integer": c_int32, "Boolean": c_int32}
SMALLEST_STEP = 1e-4  # s, of the controlled master


class NoRollback(SystemFault):
    """An FMU of the system does not offer what controlled steps need."""


class Slave:
    """One FMU in its place: loaded, and addressed by the names of the system. ``messages`` is shared by all."""

    def __init__(self, component: Component, messages: deque[str]) -> None:
        self.name, self.component, self._messages = component.name, component, messages
        self.can = component.description.coSimulation  # what the FMU says that it is able to
        try:
            self._fmu = UnpackedFmu(component.fmu)
        except FmuError as error:
            raise SystemFault(f"{self.name}: {error}") from error
        try:  # with its messages: they say why it fails
            self.instance = Instance(self._fmu, self.name, logging=True, messages=messages)
        except FmuError as error:
            self._fmu.close()
            raise SystemFault(f"{self.name}: {error}") from error

    def call(self, what: str, function: str, *arguments: object) -> None:
        """Call an FMI function; raises SystemFault with the FMU's own words where it refuses."""
        self.prepared(what, function, *arguments)()

    def prepared(self, what: str, function: str, *arguments: object) -> Callable[[], None]:
        """`call` of always the same arguments: most of a step's time is the way to the FMU and back."""
        call, messages = self.instance.prepared(function, *arguments), self._messages

        def repeated() -> None:
            messages.clear()
            status = call()
            if status != OK:
                self.demand(self.instance.noted(status), what, function)

        return repeated

    def step(self, time: float, step: float) -> None:
        self._messages.clear()
        status = self.instance.call("fmi2DoStep", time, step, True)
        if status != OK:
            self.demand(status, f"at t = {time:.4f} s, in a step of {1e3 * step:g} ms", "fmi2DoStep")

    def demand(self, status: int, what: str, function: str) -> None:
        if status > WARNING:
            said = next((text for text in self._messages if text), f"{function} returned status {status}").splitlines()
            if said[0].startswith("Fatal py exception"):  # of PythonFMU: what Python said comes last
                said = said[-1:]
            raise SystemFault(f"{self.name} failed {what}: {' '.join(said)}")

    def set(self, name: str, value: Value) -> None:
        """A parameter, or the start of an input, in SI."""
        own, variable = self.component.settable(name, value), self.component.variable(name)
        array = (C_TYPES[kind(variable)] * 1)(own)
        reference = (c_uint32 * 1)(variable.valueReference)
        self.call(f"to take {name} = {value:g}", f"fmi2Set{kind(variable)}", reference, 1, array)

    def free(self) -> None:
        self.instance.free()
        self._fmu.close()


class Values:
    """Variables of one type of one FMU that are read or written together; ``places``: where in the signals."""

    def __init__(
        self,
        slave: Slave,
        kind: str,
        variables: Sequence[ModelVariable],
        places: Sequence[int],
        scales: Sequence[tuple[float, float]] = (),
    ) -> None:
        count = len(variables)
        self.slave, self.places = slave, places
        self._converted = [(i, *scale) for i, scale in enumerate(scales) if scale != (1.0, 0.0)]
        self._buffer = (C_TYPES[kind] * count)()
        arguments = (c_uint32 * count)(*[v.valueReference for v in variables]), count, self._buffer
        self._get = slave.prepared("to give outputs", f"fmi2Get{kind}", *arguments)
        self._set = slave.prepared("to take inputs", f"fmi2Set{kind}", *arguments)

    def read(self, signals: list[float]) -> None:
        self._get()
        for place, value in zip(self.places, self._buffer[:], strict=True):
            signals[place] = value

    def write(self, signals: Sequence[float]) -> None:
        given = [signals[place] for place in self.places]
        for i, factor, offset in self._converted:
            given[i] = given[i] * factor + offset
        self._buffer[:] = given
        self._set()


class Slopes:
    """The inputs of one FMU that are given their first time derivative."""

    def __init__(
        self, slave: Slave, variables: Sequence[ModelVariable], places: Sequence[int], factors: Sequence[float]
    ) -> None:
        count = len(variables)
        self._places, self._factors = places, factors
        self._values = (c_double * count)()
        references = (c_uint32 * count)(*[v.valueReference for v in variables])
        self._set = slave.prepared(
            "to take slopes",
            "fmi2SetRealInputDerivatives",
            references,
            count,
            (c_int32 * count)(*[1] * count),
            self._values,
        )

    def write(self, was: Sequence[float], now: Sequence[float], since: float) -> None:
        for i, (place, factor) in enumerate(zip(self._places, self._factors, strict=True)):
            self._values[i] = factor * (now[place] - was[place]) / since
        self._set()


class CoSimulation:
    """The FMUs of a system, loaded, connected and initialized; a context manager.

    ``signals`` are the connected outputs, each in the unit of its FMU; ``tolerances`` in the same units.

    ``watched`` outputs are read by `values`, in SI. Those that a swapped FMU lacks are left out and
    listed in ``not_offered``. As a mapping it gives their units, which must be of the same dimension. With
    ``at_step_end`` the FMUs after the first are told that the inputs which they get belong to the end of the step.
    ``steps_done`` counts the steps of all FMUs, taken back or not.

    Raises SystemFault, with a line for each fault, before any FMU is loaded.
    """

    def __init__(
        self,
        system: System,
        watched: Iterable[str] | Mapping[str, str] = (),
        at_step_end: bool = False,
        start: float = 0.0,
    ) -> None:
        self.system, self.start = system, start
        self.steps_done = 0
        self.slaves: list[Slave] = []
        system.check(watched)
        messages: deque[str] = deque(maxlen=20)
        try:
            for component in system.components:
                self.slaves.append(Slave(component, messages))
            self._connect()
            self._prepare_slopes()
            self._watch(watched)
            self._initialize(at_step_end)
        except BaseException:
            self.close()
            raise

    def _slave(self, port: Port) -> Slave:
        return next(slave for slave in self.slaves if slave.name == port.component)

    def _connect(self) -> None:
        """A place in the signals for each connected output, and who reads and writes it."""
        connections = self.system.connections
        sources = sorted(set(connections.values()))
        self._place = {source: i for i, source in enumerate(sources)}
        self.signals: list[float] = [0.0] * len(sources)
        self.tolerances = [self.system.tolerance(source) for source in sources]
        self.conversions = {target: self.system.conversion(target, source) for target, source in connections.items()}
        outputs = self._grouped(sources, self._place)
        places = {target: self._place[source] for target, source in connections.items()}
        inputs = self._grouped(list(connections), places, self.conversions)
        self.outputs = {slave.name: [v for v in outputs if v.slave is slave] for slave in self.slaves}
        self.inputs = {slave.name: [v for v in inputs if v.slave is slave] for slave in self.slaves}

    def _grouped(
        self,
        ports: Sequence[Port],
        places: Mapping[Port, int],
        scales: Mapping[Port, tuple[float, float]] | None = None,
    ) -> list[Values]:
        """The variables of each FMU and type together."""
        groups: dict[tuple[str, str], list[Port]] = {}
        variables = {port: self._slave(port).component.variable(port.variable) for port in ports}
        for port in ports:
            groups.setdefault((port.component, kind(variables[port])), []).append(port)
        return [
            Values(
                self._slave(group[0]),
                type_,
                [variables[port] for port in group],
                [places[port] for port in group],
                [scales[port] for port in group] if scales else (),
            )
            for (_, type_), group in groups.items()
        ]

    def _prepare_slopes(self) -> None:
        self._sampled: tuple[float, list[float]] | None = None
        self._slopes = []
        for slave in self.slaves:
            ports = [Port(slave.name, name) for name in slave.component.slopes]
            ports = [port for port in ports if port in self.system.connections]
            if ports:
                variables = [slave.component.variable(port.variable) for port in ports]
                places = [self._place[self.system.connections[port]] for port in ports]
                self._slopes.append(Slopes(slave, variables, places, [self.conversions[port][0] for port in ports]))

    def _watch(self, watched: Iterable[str]) -> None:
        self.watched = [name for name in watched if self.system.offers(name)]
        self.not_offered = [name for name in watched if not self.system.offers(name)]
        ports = [self.system.port(name) for name in self.watched]
        self._watched = self._grouped(ports, {port: i for i, port in enumerate(ports)})
        self.units: list[Unit] = [self.system.unit(port) for port in ports]  # of the watched, as their FMUs give them
        self._foreign = [(i, unit) for i, unit in enumerate(self.units) if (unit.factor, unit.offset) != (1.0, 0.0)]

    def _initialize(self, at_step_end: bool) -> None:
        for slave in self.slaves:
            slave.call("to be set up", "fmi2SetupExperiment", False, 0.0, self.start, False, 0.0)
        for port, value in self.system.parameters.items():
            self._slave(port).set(port.variable, value)
        for slave in self.slaves[1:]:
            if at_step_end and slave.component.at_step_end:
                slave.set(slave.component.at_step_end, True)
        for slave in self.slaves:
            slave.call("to initialize", "fmi2EnterInitializationMode")
        for _ in self.slaves:  # so often that what the first gives reaches the last
            self.read()
            self.write()
        for slave in self.slaves:
            slave.call("to initialize", "fmi2ExitInitializationMode")
        self.read()

    def read(self, slave: Slave | None = None) -> None:
        """Outputs into the signals, of one FMU or of all."""
        for one in [slave] if slave else self.slaves:
            for values in self.outputs[one.name]:
                values.read(self.signals)

    def write(self, slave: Slave | None = None) -> None:
        """Signals to the inputs, of one FMU or of all."""
        for one in [slave] if slave else self.slaves:
            for values in self.inputs[one.name]:
                values.write(self.signals)

    def write_slopes(self, time: float) -> None:
        """fmi2SetRealInputDerivatives, order 1, for the inputs in `slopes`; needs two calls at different times."""
        before, self._sampled = self._sampled, (time, list(self.signals))
        if before and before[0] < time:
            for slopes in self._slopes:
                slopes.write(before[1], self.signals, time - before[0])

    def step(self, slave: Slave, time: float, step: float) -> None:
        self.steps_done += 1
        slave.step(time, step)

    def values(self) -> list[float]:
        """The watched outputs in SI, in the order of ``watched``."""
        found = [0.0] * len(self.watched)
        for values in self._watched:
            values.read(found)
        for i, unit in self._foreign:
            found[i] = unit.to_si(found[i])
        return found

    def save(self) -> tuple:
        """The states of all FMUs, to be restored once or more and then freed."""
        states = [c_void_p() for _ in self.slaves]
        for slave, state in zip(self.slaves, states, strict=True):
            slave.call("to save its state", "fmi2GetFMUstate", byref(state))
        return states, list(self.signals), self._sampled

    def restore(self, saved: tuple) -> None:
        for slave, state in zip(self.slaves, saved[0], strict=True):
            slave.call("to restore its state", "fmi2SetFMUstate", state)
        self.signals, self._sampled = list(saved[1]), saved[2]

    def free(self, saved: tuple) -> None:
        for slave, state in zip(self.slaves, saved[0], strict=True):
            slave.call("to free its state", "fmi2FreeFMUstate", byref(state))

    def close(self) -> None:
        for slave in self.slaves:
            slave.free()
        self.slaves = []

    def __enter__(self) -> CoSimulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


Master = Callable[[CoSimulation, float, float], None]


def jacobi(simulation: CoSimulation, time: float, step: float) -> None:
    """One step of all, from what all gave before it."""
    simulation.write()
    for slave in simulation.slaves:
        simulation.step(slave, time, step)
    simulation.read()


def extrapolated(simulation: CoSimulation, time: float, step: float) -> None:
    """`jacobi`, with the slopes of the inputs that the system lists, from their values here and a step ago."""
    simulation.write()
    simulation.write_slopes(time)
    for slave in simulation.slaves:
        simulation.step(slave, time, step)
    simulation.read()


def gauss_seidel(simulation: CoSimulation, time: float, step: float) -> None:
    """One step of each in turn, from what those before it give for the step's end."""
    for slave in simulation.slaves:
        simulation.write(slave)
        simulation.step(slave, time, step)
        simulation.read(slave)


def fixed_steps(simulation: CoSimulation, master: Master, stop: float, step: float) -> Iterator[float]:
    """Steps to ``stop``; yields the time after each."""
    for i in range(round((stop - simulation.start) / step)):
        master(simulation, simulation.start + i * step, step)
        yield simulation.start + (i + 1) * step


def controlled_steps(
    simulation: CoSimulation, master: Master, stop: float, longest: float, tolerance: float = 1.0
) -> Iterator[float]:
    """Steps as long as ``tolerance`` times the system's step_control allows; yields the time after each.

    A step is done once whole and once in two halves, which are kept where the difference is allowed.
    What begins in a second half shows in neither: ``longest`` is what bounds that error.
    """
    unable = [
        s.name
        for s in simulation.slaves
        if not s.can.canGetAndSetFMUstate or not s.can.canHandleVariableCommunicationStepSize
    ]
    if unable:
        raise NoRollback(
            "Steps can be controlled only where every FMU offers its state and takes steps of any length; "
            f"not so: {', '.join(unable)}."
        )
    if not any(simulation.tolerances):
        raise SystemFault("Steps can be controlled only where step_control names the unit of a connected output.")
    time, step = simulation.start, SMALLEST_STEP
    while time < stop - 1e-9:
        step = min(step, stop - time)
        saved = simulation.save()
        master(simulation, time, step)
        whole = list(simulation.signals)
        simulation.restore(saved)
        master(simulation, time, step / 2)
        master(simulation, time + step / 2, step / 2)
        error = (
            max(abs(a - b) / t for a, b, t in zip(whole, simulation.signals, simulation.tolerances, strict=True) if t)
            / tolerance
        )
        accepted = error <= 1 or step <= SMALLEST_STEP
        if not accepted:
            simulation.restore(saved)
        simulation.free(saved)
        taken, step = step, min(max(step * min(max(0.9 / max(error, 1e-12) ** 0.5, 0.3), 2.0), SMALLEST_STEP), longest)
        if accepted:
            time += taken
            yield time
