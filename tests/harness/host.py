"""A small FMI 2.0 host: fmpy loads the FMU; every status and every message can be looked at.

`Instance.call` and the methods named `try_...` return FMI's status. All others demand fmi2OK and raise
AssertionError with the component's own message otherwise.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterable, Mapping
from ctypes import byref, c_double, c_int32, c_size_t, c_uint32, c_void_p
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

import fmpy
from fmpy import fmi2
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.model_description import ModelDescription

from scenarios.common.operating_point import MACHINE_SPEED, PLANTING_SPEED  # noqa: F401 - for all who drive

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
STEP_STATUS, PENDING_STATUS, LAST_SUCCESSFUL_TIME, TERMINATED = range(4)

# FMI 2.0.4, sections 2.1 and 4.2: what a co-simulation FMU exports, all of it.
FUNCTIONS = (
    "fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2SetDebugLogging", "fmi2Instantiate", "fmi2FreeInstance",
    "fmi2SetupExperiment", "fmi2EnterInitializationMode", "fmi2ExitInitializationMode", "fmi2Terminate", "fmi2Reset",
    "fmi2GetReal", "fmi2GetInteger", "fmi2GetBoolean", "fmi2GetString",
    "fmi2SetReal", "fmi2SetInteger", "fmi2SetBoolean", "fmi2SetString",
    "fmi2GetFMUstate", "fmi2SetFMUstate", "fmi2FreeFMUstate",
    "fmi2SerializedFMUstateSize", "fmi2SerializeFMUstate", "fmi2DeSerializeFMUstate",
    "fmi2GetDirectionalDerivative", "fmi2SetRealInputDerivatives", "fmi2GetRealOutputDerivatives",
    "fmi2DoStep", "fmi2CancelStep",
    "fmi2GetStatus", "fmi2GetRealStatus", "fmi2GetIntegerStatus", "fmi2GetBooleanStatus", "fmi2GetStringStatus",
)  # fmt: skip


# Section 3.2: what Model Exchange adds.
MODEL_EXCHANGE_FUNCTIONS = (
    "fmi2EnterEventMode", "fmi2NewDiscreteStates", "fmi2EnterContinuousTimeMode", "fmi2CompletedIntegratorStep",
    "fmi2SetTime", "fmi2SetContinuousStates", "fmi2GetDerivatives", "fmi2GetEventIndicators",
    "fmi2GetContinuousStates", "fmi2GetNominalsOfContinuousStates",
)  # fmt: skip


@dataclass(frozen=True)
class Fmu:
    """The built FMU, unpacked."""

    path: Path
    folder: Path
    callbacks: Path  # the compiled callbacks.c

    @cached_property
    def description(self) -> ModelDescription:
        return fmpy.read_model_description(str(self.folder))

    @cached_property
    def reference(self) -> dict[str, int]:
        """Value references by name."""
        return {variable.name: variable.valueReference for variable in self.description.modelVariables}

    @property
    def library(self) -> Path:
        """The binary for this machine."""
        name = self.description.coSimulation.modelIdentifier + fmpy.sharedLibraryExtension
        return self.folder / "binaries" / fmpy.platform / name

    def names(self, causality: str) -> list[str]:
        """The variables of one causality: "input", "output" or "parameter"."""
        return [variable.name for variable in self.description.modelVariables if variable.causality == causality]

    def load(self, instance_name: str = "linkage") -> FMU2Slave:
        """fmpy's own access to the binary, without an instance; it knows the functions of both interface types."""
        slave = FMU2Slave(**self._location, instanceName=instance_name)
        for name, (argument_types, result_type) in self._model_exchange_types.items():
            function = getattr(slave.dll, name)
            function.argtypes, function.restype = argument_types, result_type
        return slave

    @property
    def _location(self) -> dict[str, str]:
        return {
            "guid": self.description.guid,
            "unzipDirectory": str(self.folder),
            "modelIdentifier": self.description.coSimulation.modelIdentifier,
        }

    @cached_property
    def _model_exchange_types(self) -> dict[str, tuple]:
        """The C types of functions that fmpy gives to its class for Model Exchange alone."""
        library = FMU2Model(**self._location, instanceName="types").dll
        functions = {name: getattr(library, name) for name in MODEL_EXCHANGE_FUNCTIONS}
        return {name: (function.argtypes, function.restype) for name, function in functions.items()}

    def instance(self, name: str = "linkage", **options) -> Instance:
        """A new instance, with the arguments of Instance."""
        return Instance(self, name, **options)


class Message(NamedTuple):
    """What the logger callback was given."""

    instance: str | None
    status: int
    category: str | None
    text: str


class Instance:
    """One instance of the FMU."""

    has_input_derivatives = True  # FMI 3.0 has none

    def __init__(
        self,
        fmu: Fmu,
        name: str = "linkage",
        *,
        logging: bool = False,
        guid: str | None = None,
        fmu_type: int = fmi2.fmi2CoSimulation,
        model_exchange: bool = False,
        with_logger: bool = True,
        allocate: Callable[[int, int], int | None] | None = fmpy.calloc,
        free: Callable[[int], None] | None = fmpy.free,
    ) -> None:
        self.fmu = fmu
        self.model_exchange = model_exchange
        self.messages: list[Message] = []
        self._states: list[c_void_p] = []
        self.slave = fmu.load(name)
        self._environment, self.callbacks = self._make_callbacks(with_logger, allocate, free)
        self.component = self.slave.dll.fmi2Instantiate(
            name.encode(),
            fmi2.fmi2ModelExchange if model_exchange else fmu_type,
            (fmu.description.guid if guid is None else guid).encode(),
            (fmu.folder / "resources").as_uri().encode(),
            byref(self.callbacks),
            False,
            logging,
        )

    def _make_callbacks(self, with_logger, allocate, free):
        library = ctypes.CDLL(str(self.fmu.callbacks))

        @ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)
        def receive(instance, status, category, text):
            decoded = [None if word is None else word.decode() for word in (instance, category, text)]
            self.messages.append(Message(decoded[0], status, decoded[1], decoded[2]))

        environment = ctypes.pointer(receive)
        callbacks = fmi2.fmi2CallbackFunctions()
        if with_logger:
            callbacks.logger = ctypes.cast(library.log_to_receiver, fmi2.fmi2CallbackLoggerTYPE)
        if allocate is not None:
            callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(allocate)
        if free is not None:
            callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        callbacks.componentEnvironment = ctypes.cast(environment, c_void_p)
        return environment, callbacks

    def free(self) -> None:
        """Give back all states and the instance."""
        if self.component is not None:
            for state in self._states:
                self.call("fmi2FreeFMUstate", byref(state))
            self.slave.dll.fmi2FreeInstance(self.component)
            self.component = None

    def __enter__(self) -> Instance:
        return self

    def __exit__(self, kind: type | None, value: BaseException | None, traceback: TracebackType | None) -> None:
        self.free()

    # ---- raw calls -------------------------------------------------------------------------------

    def call(self, function: str, *arguments) -> int:
        """Call an FMI function on this instance; its status."""
        return getattr(self.slave.dll, function)(self.component, *arguments)

    def demand(self, status: int, what: str) -> None:
        assert status == OK, f"{what}: status {status}; {self.messages[-1].text if self.messages else 'no message'}"

    def references(self, names: Iterable[str | int]) -> ctypes.Array:
        """Value references as a C array; a number stands for itself."""
        numbers = [name if isinstance(name, int) else self.fmu.reference[name] for name in names]
        return (c_uint32 * len(numbers))(*numbers)

    @property
    def last_message(self) -> Message:
        assert self.messages, "nothing was logged"
        return self.messages[-1]

    # ---- modes -----------------------------------------------------------------------------------

    def setup(self, start: float = 0.0, stop: float | None = None) -> Instance:
        status = self.call("fmi2SetupExperiment", False, 0.0, start, stop is not None, stop or 0.0)
        self.demand(status, "fmi2SetupExperiment")
        return self

    def enter(self) -> Instance:
        self.demand(self.call("fmi2EnterInitializationMode"), "fmi2EnterInitializationMode")
        return self

    def exit(self) -> Instance:
        self.demand(self.call("fmi2ExitInitializationMode"), "fmi2ExitInitializationMode")
        return self

    def initialize(
        self, values: Mapping[str, float | bool] = {}, start: float = 0.0, stop: float | None = None
    ) -> Instance:
        """From a new instance to the first step; returns the instance itself."""
        self.setup(start, stop).enter().set(values)
        return self.exit()

    # ---- values ----------------------------------------------------------------------------------

    def try_set(self, values: Mapping[str | int, float | bool]) -> int:
        """Set reals in one call, then Booleans in another; the first status that is not OK."""
        for type_, c_type, function in ((bool, c_int32, "fmi2SetBoolean"), (float, c_double, "fmi2SetReal")):
            chosen = {name: value for name, value in values.items() if isinstance(value, bool) == (type_ is bool)}
            if chosen:
                array = (c_type * len(chosen))(*chosen.values())
                status = self.call(function, self.references(chosen), len(chosen), array)
                if status != OK:
                    return status
        return OK

    def set(self, values: Mapping[str, float | bool]) -> Instance:
        self.demand(self.try_set(values), f"setting {dict(values)}")
        return self

    def try_get(self, names: Iterable[str | int]) -> tuple[int, list[float]]:
        references = self.references(names)
        values = (c_double * len(references))(*[math.nan] * len(references))
        status = self.call("fmi2GetReal", references, len(references), values)
        return status, list(values)

    def get(self, *names: str) -> list[float]:
        status, values = self.try_get(names)
        self.demand(status, f"getting {names}")
        return values

    def get_boolean(self, name: str) -> bool:
        value = c_int32()
        self.demand(self.call("fmi2GetBoolean", self.references([name]), 1, byref(value)), f"getting {name}")
        return bool(value.value)

    def outputs(self) -> list[float]:
        return self.get(*self.fmu.names("output"))

    # ---- steps -----------------------------------------------------------------------------------

    def try_step(self, time: float, step: float) -> int:
        return self.call("fmi2DoStep", time, step, True)

    def step(self, time: float, step: float, values: Mapping[str, float | bool] = {}) -> Instance:
        """Set inputs, then step."""
        if values:
            self.set(values)
        self.demand(self.try_step(time, step), f"the step at {time} over {step}")
        return self

    def last_successful_time(self) -> float:
        value = c_double(math.nan)
        self.demand(self.call("fmi2GetRealStatus", LAST_SUCCESSFUL_TIME, byref(value)), "fmi2GetRealStatus")
        return value.value

    # ---- derivatives -----------------------------------------------------------------------------

    def try_set_derivatives(self, derivatives: Mapping[tuple[str | int, int], float]) -> int:
        """{(input, order): value}"""
        count = len(derivatives)
        return self.call(
            "fmi2SetRealInputDerivatives",
            self.references(name for name, _ in derivatives),
            count,
            (c_int32 * count)(*[order for _, order in derivatives]),
            (c_double * count)(*derivatives.values()),
        )

    def set_derivatives(self, derivatives: Mapping[tuple[str, int], float]) -> Instance:
        self.demand(self.try_set_derivatives(derivatives), f"setting derivatives {dict(derivatives)}")
        return self

    def try_get_derivatives(self, *wanted: tuple[str | int, int]) -> tuple[int, list[float]]:
        """(output, order), ..."""
        count = len(wanted)
        values = (c_double * count)(*[math.nan] * count)
        orders = (c_int32 * count)(*[order for _, order in wanted])
        references = self.references(name for name, _ in wanted)
        return self.call("fmi2GetRealOutputDerivatives", references, count, orders, values), list(values)

    def get_derivatives(self, *wanted: tuple[str, int]) -> list[float]:
        status, values = self.try_get_derivatives(*wanted)
        self.demand(status, f"getting derivatives {wanted}")
        return values

    def try_sensitivity(
        self, unknowns: Iterable[str | int], seed: Mapping[str | int, float]
    ) -> tuple[int, list[float]]:
        """The directional derivative of the unknowns along {input: change}."""
        unknown = self.references(unknowns)
        values = (c_double * len(unknown))(*[math.nan] * len(unknown))
        status = self.call(
            "fmi2GetDirectionalDerivative",
            unknown,
            len(unknown),
            self.references(seed),
            len(seed),
            (c_double * len(seed))(*seed.values()),
            values,
        )
        return status, list(values)

    def sensitivity(self, unknowns: Iterable[str], seed: Mapping[str, float]) -> list[float]:
        status, values = self.try_sensitivity(unknowns, seed)
        self.demand(status, f"directional derivative along {dict(seed)}")
        return values

    # ---- state -----------------------------------------------------------------------------------

    def save(self) -> c_void_p:
        """A copy of the state; freed with the instance."""
        state = c_void_p()
        self.demand(self.call("fmi2GetFMUstate", byref(state)), "fmi2GetFMUstate")
        self._states.append(state)
        return state

    def restore(self, state: c_void_p) -> Instance:
        self.demand(self.call("fmi2SetFMUstate", state), "fmi2SetFMUstate")
        return self

    def serialize(self, state: c_void_p | None = None) -> bytes:
        """A state, or the present one, as bytes."""
        chosen = c_void_p() if state is None else state
        if state is None:
            self.demand(self.call("fmi2GetFMUstate", byref(chosen)), "fmi2GetFMUstate")
        size = c_size_t()
        self.demand(self.call("fmi2SerializedFMUstateSize", chosen, byref(size)), "fmi2SerializedFMUstateSize")
        buffer = ctypes.create_string_buffer(size.value)
        self.demand(self.call("fmi2SerializeFMUstate", chosen, buffer, size.value), "fmi2SerializeFMUstate")
        if state is None:
            self.demand(self.call("fmi2FreeFMUstate", byref(chosen)), "fmi2FreeFMUstate")
        return buffer.raw

    def try_deserialize(self, serialized: bytes) -> tuple[int, c_void_p]:
        state = c_void_p()
        buffer = ctypes.create_string_buffer(serialized, len(serialized))
        status = self.call("fmi2DeSerializeFMUstate", buffer, len(serialized), byref(state))
        if state:
            self._states.append(state)
        return status, state

    def deserialize(self, serialized: bytes) -> Instance:
        """Continue from a serialized state."""
        status, state = self.try_deserialize(serialized)
        self.demand(status, "fmi2DeSerializeFMUstate")
        return self.restore(state)


def bits(values: Iterable[float]) -> list[str]:
    """Numbers so that only the same bits are equal."""
    return [value.hex() for value in values]
