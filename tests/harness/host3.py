"""A small FMI 3.0 host, with the words of the FMI 2.0 host: what differs between the versions is here.

Its callbacks: `intermediate(instance, time, set_requested, get_allowed, step_finished, can_return_early)` is called in
each step; it returns None, or the time at which it wants the step to end early.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from ctypes import POINTER, byref, c_bool, c_char, c_double, c_int32, c_uint8, c_void_p
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import fmpy
from fmpy.fmi3 import FMU3Slave, fmi3IntermediateUpdateCallback, fmi3LogMessageCallback

from tests.harness.host import Fmu, Instance, Message

# FMI 3.0, sections 2.2, 2.3, 3.2, 4.2 and 5.2: all that an FMU exports, whatever it supports.
TYPES = (
    "Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Boolean", "String",
    "Binary", "Clock",
)  # fmt: skip
CLOCK_FUNCTIONS = (
    "fmi3GetIntervalDecimal", "fmi3GetIntervalFraction", "fmi3GetShiftDecimal", "fmi3GetShiftFraction",
    "fmi3SetIntervalDecimal", "fmi3SetIntervalFraction", "fmi3SetShiftDecimal", "fmi3SetShiftFraction",
)  # fmt: skip
FUNCTIONS = (
    "fmi3GetVersion", "fmi3SetDebugLogging", "fmi3FreeInstance",
    "fmi3InstantiateModelExchange", "fmi3InstantiateCoSimulation", "fmi3InstantiateScheduledExecution",
    "fmi3EnterInitializationMode", "fmi3ExitInitializationMode", "fmi3EnterEventMode", "fmi3Terminate", "fmi3Reset",
    *[f"fmi3{verb}{type_}" for type_ in TYPES for verb in ("Get", "Set")],
    "fmi3GetNumberOfVariableDependencies", "fmi3GetVariableDependencies",
    "fmi3GetFMUState", "fmi3SetFMUState", "fmi3FreeFMUState",
    "fmi3SerializedFMUStateSize", "fmi3SerializeFMUState", "fmi3DeserializeFMUState",
    "fmi3GetDirectionalDerivative", "fmi3GetAdjointDerivative",
    "fmi3EnterConfigurationMode", "fmi3ExitConfigurationMode", *CLOCK_FUNCTIONS,
    "fmi3EvaluateDiscreteStates", "fmi3UpdateDiscreteStates",
    "fmi3EnterContinuousTimeMode", "fmi3CompletedIntegratorStep", "fmi3SetTime", "fmi3SetContinuousStates",
    "fmi3GetContinuousStateDerivatives", "fmi3GetEventIndicators", "fmi3GetContinuousStates",
    "fmi3GetNominalsOfContinuousStates", "fmi3GetNumberOfEventIndicators", "fmi3GetNumberOfContinuousStates",
    "fmi3EnterStepMode", "fmi3GetOutputDerivatives", "fmi3DoStep", "fmi3ActivateModelPartition",
)  # fmt: skip


@dataclass(frozen=True)
class Fmu3(Fmu):
    """The built FMU, unpacked."""

    @property
    def library(self) -> Path:
        name = self.description.coSimulation.modelIdentifier + fmpy.sharedLibraryExtension
        return self.folder / "binaries" / fmpy.platform_tuple / name

    def load(self, instance_name: str = "linkage") -> FMU3Slave:
        return FMU3Slave(**self._location, instanceName=instance_name)

    def instance(self, name: str = "linkage", **options) -> Instance3:
        return Instance3(self, name, **options)


class Step(NamedTuple):
    """What fmi3DoStep tells."""

    status: int
    event_handling_needed: bool
    terminate: bool
    early_return: bool
    last_successful_time: float


class Instance3(Instance):
    """One instance of the FMI 3.0 FMU; names of FMI 2.0 functions in `call` stand for those of the same service."""

    has_input_derivatives = False
    functions = {"fmi2GetReal": "fmi3GetFloat64", "fmi2SetReal": "fmi3SetFloat64"} | {
        f"fmi2{name}": f"fmi3{name.replace('FMUstate', 'FMUState').replace('DeS', 'Des')}"
        for name in (
            "GetFMUstate", "SetFMUstate", "FreeFMUstate", "SerializedFMUstateSize", "SerializeFMUstate",
            "DeSerializeFMUstate", "Reset", "Terminate", "ExitInitializationMode", "SetDebugLogging",
        )
    }  # fmt: skip

    def __init__(
        self,
        fmu: Fmu3,
        name: str = "linkage",
        *,
        logging: bool = True,
        guid: str | None = None,
        model_exchange: bool = False,
        event_mode: bool = False,
        early_return: bool = False,
        intermediate: Callable[..., float | None] | None = None,
        required: Sequence[str | int] = (),
        with_logger: bool = True,
    ) -> None:
        self.fmu = fmu
        self.model_exchange = model_exchange
        self.messages: list[Message] = []
        self._states: list[c_void_p] = []
        self._start: tuple[float, float | None] = (0.0, None)
        self._failure: BaseException | None = None
        self.slave = fmu.load(name)

        def receive(environment, status, category, text):
            self.messages.append(Message(name or "none", status, category.decode(), text.decode()))

        def update(environment, time, set_requested, get_allowed, finished, can_return, requested, early_time):  # noqa: PLR0917 - FMI's
            try:
                wanted = intermediate(self, time, set_requested, get_allowed, finished, can_return)
                if wanted is not None:
                    requested[0], early_time[0] = True, wanted
            except BaseException as problem:  # noqa: BLE001 - ctypes would only print it
                self._failure = problem

        self._logger = fmi3LogMessageCallback(receive) if with_logger else fmi3LogMessageCallback()
        self._update = fmi3IntermediateUpdateCallback(update) if intermediate else fmi3IntermediateUpdateCallback()
        token = (fmu.description.guid if guid is None else guid).encode()
        head = (name.encode(), token, None, False, logging)
        if model_exchange:
            self.component = self.slave.dll.fmi3InstantiateModelExchange(*head, None, self._logger)
        else:
            references = self.references(required)
            self.component = self.slave.dll.fmi3InstantiateCoSimulation(
                *head, event_mode, early_return, references, len(references), None, self._logger, self._update
            )

    def call(self, function: str, *arguments) -> int:
        if function.startswith("fmi2"):
            if function == "fmi2EnterInitializationMode":
                return self.call("fmi3EnterInitializationMode", False, 0.0, *self._start_arguments())
            if function in ("fmi2GetReal", "fmi2SetReal"):
                arguments = (*arguments, arguments[1])
            function = self.functions[function]
        # fmpy declares bytes as unsigned
        arguments = [
            ctypes.cast(a, POINTER(c_uint8)) if isinstance(a, ctypes.Array) and a._type_ is c_char else a
            for a in arguments
        ]
        return getattr(self.slave.dll, function)(self.component, *arguments)

    def free(self) -> None:
        if self.component is not None:
            for state in self._states:
                self.call("fmi2FreeFMUstate", byref(state))
            self.slave.dll.fmi3FreeInstance(self.component)
            self.component = None

    # ---- modes -----------------------------------------------------------------------------------

    def setup(self, start: float = 0.0, stop: float | None = None) -> Instance3:
        self._start = (start, stop)
        return self

    def enter(self) -> Instance3:
        self.demand(self.call("fmi2EnterInitializationMode"), "fmi3EnterInitializationMode")
        return self

    def _start_arguments(self) -> tuple[float, bool, float]:
        start, stop = self._start
        return start, stop is not None, stop or 0.0

    def to(self, mode: str) -> Instance3:
        """fmi3Enter<mode>Mode."""
        self.demand(self.call(f"fmi3Enter{mode}Mode"), f"entering {mode} mode")
        return self

    # ---- values ----------------------------------------------------------------------------------

    def try_set(self, values: Mapping[str | int, float | bool]) -> int:
        for type_, c_type, function in ((bool, c_bool, "fmi3SetBoolean"), (float, c_double, "fmi3SetFloat64")):
            chosen = {name: value for name, value in values.items() if isinstance(value, bool) == (type_ is bool)}
            if chosen:
                array = (c_type * len(chosen))(*chosen.values())
                status = self.call(function, self.references(chosen), len(chosen), array, len(chosen))
                if status != 0:
                    return status
        return 0

    def get_boolean(self, name: str) -> bool:
        value = c_bool()
        self.demand(self.call("fmi3GetBoolean", self.references([name]), 1, byref(value), 1), f"getting {name}")
        return value.value

    # ---- steps -----------------------------------------------------------------------------------

    def do_step(self, time: float, step: float) -> Step:
        event, terminate, early, last = c_bool(), c_bool(), c_bool(), c_double(math.nan)
        status = self.call("fmi3DoStep", time, step, True, byref(event), byref(terminate), byref(early), byref(last))
        if self._failure is not None:
            raise self._failure
        return Step(status, event.value, terminate.value, early.value, last.value)

    def try_step(self, time: float, step: float) -> int:
        return self.do_step(time, step).status

    def last_successful_time(self) -> float:
        return self.get("time")[0]

    # ---- derivatives -----------------------------------------------------------------------------

    def try_get_derivatives(self, *wanted: tuple[str | int, int]) -> tuple[int, list[float]]:
        count = len(wanted)
        values = (c_double * count)(*[math.nan] * count)
        orders = (c_int32 * count)(*[order for _, order in wanted])
        references = self.references(name for name, _ in wanted)
        return self.call("fmi3GetOutputDerivatives", references, count, orders, values, count), list(values)

    def try_sensitivity(
        self, unknowns: Iterable[str | int], seed: Mapping[str | int, float]
    ) -> tuple[int, list[float]]:
        return self._derivative("fmi3GetDirectionalDerivative", list(unknowns), list(seed), list(seed.values()))

    def try_adjoint(self, weights: Mapping[str | int, float], knowns: Iterable[str | int]) -> tuple[int, list[float]]:
        """The gradient, by the knowns, of the unknowns times their weights, summed up."""
        return self._derivative("fmi3GetAdjointDerivative", list(weights), list(knowns), list(weights.values()))

    def adjoint(self, weights: Mapping[str, float], knowns: Iterable[str]) -> list[float]:
        status, values = self.try_adjoint(weights, knowns)
        self.demand(status, f"adjoint derivative of {dict(weights)}")
        return values

    def _derivative(self, function: str, unknowns: list, knowns: list, seed: list[float]) -> tuple[int, list[float]]:
        count = len(knowns if "Adjoint" in function else unknowns)
        values = (c_double * count)(*[math.nan] * count)
        status = self.call(
            function, self.references(unknowns), len(unknowns), self.references(knowns), len(knowns),
            (c_double * len(seed))(*seed), len(seed), values, count,
        )  # fmt: skip
        return status, list(values)
