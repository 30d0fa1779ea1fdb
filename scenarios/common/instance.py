"""The driver of an FMU: FMI 2.0 for co-simulation through fmpy, unpacked once, every status to be looked at.

`Instance.call` and the methods named `try_...` return FMI's status. All others raise Refused, with the FMU's own
message, for any status but OK. Where thousands of steps are taken, `Instance.slave` is fmpy's own object, which
raises FMICallException.
"""

from __future__ import annotations

import ctypes
import math
import shutil
from collections.abc import Callable, Iterable, Mapping, MutableSequence, Sequence
from ctypes import byref, c_double, c_int32, c_size_t, c_uint32, c_void_p
from functools import cached_property, lru_cache, partial
from pathlib import Path
from types import TracebackType

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.model_description import ModelDescription
from fmpy.simulation import instantiate_fmu

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
LAST_SUCCESSFUL_TIME = 2  # of FMI's status kinds


class FmuError(Exception):
    """The file cannot be used as the linkage FMU; the message is for the user."""


class Refused(Exception):
    """The FMU refused a call or a run; the message is its own (for instance: a dyad cannot close)."""


class UnpackedFmu:
    """An FMU's files in a folder of their own, deleted at the end; a context manager.

    Raises FmuError where the file is none, or is not for co-simulation by one of the FMI ``versions``.
    """

    def __init__(self, path: Path, versions: Sequence[str] = ("2.0",)) -> None:
        require_fmu(path)
        self.path = path
        self.description = describe(path)
        if self.description.fmiVersion not in versions or self.description.coSimulation is None:
            raise FmuError(f"{path} is not an FMI {' or '.join(versions)} FMU for co-simulation.")
        try:
            self.folder = Path(fmpy.extract(str(path)))
        except Exception as error:  # zip errors have no common base
            raise FmuError(f"{path} cannot be read as an FMU: {first_line(error)}") from error

    @cached_property
    def reference(self) -> dict[str, int]:
        """Value references by name."""
        return {variable.name: variable.valueReference for variable in self.description.modelVariables}

    def names(self, causality: str) -> list[str]:
        """The variables of one causality: "input", "output" or "parameter"."""
        return [variable.name for variable in self.description.modelVariables if variable.causality == causality]

    @property
    def guid(self) -> str:
        return self.description.guid

    @property
    def library(self) -> Path:
        """The binary for this machine."""
        name = self.description.coSimulation.modelIdentifier + fmpy.sharedLibraryExtension
        return self.folder / "binaries" / fmpy.platform / name

    def close(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self) -> UnpackedFmu:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Instance:
    """One instance of the FMU; a context manager. Several may share one unpacked FMU.

    ``messages`` takes the FMU's; fmpy hands those of all FMUs in a process to the logger that was given last, so that
    instances of several FMUs share it.
    """

    def __init__(
        self,
        fmu: UnpackedFmu,
        name: str = "linkage",
        *,
        logging: bool = False,
        messages: MutableSequence[str] | None = None,
    ) -> None:
        self.fmu, self.name = fmu, name
        self.messages: MutableSequence[str] = [] if messages is None else messages
        self._lost = False  # after fmi2Fatal no function may be called, not even to free (FMI 2.0.4, section 2.1.3)
        self._states: list[c_void_p] = []
        try:
            self.slave: FMU2Slave | None = instantiate_fmu(
                str(fmu.folder), fmu.description, "CoSimulation", logger=self._log, debug_logging=logging
            )
        except Exception as error:
            raise FmuError(f"{fmu.path} cannot be loaded on this platform: {first_line(error)}") from error

    def _log(self, _environment: object, _instance: object, _status: int, _category: object, text: bytes) -> None:
        self.messages.append(text.decode("utf-8", "replace") if text else "")

    def free(self) -> None:
        """Give back all states and the instance."""
        if self.slave is not None and not self._lost:
            for state in self._states:
                self.call("fmi2FreeFMUstate", byref(state))
            self.slave.freeInstance()
        self.slave = None

    def __enter__(self) -> Instance:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.free()

    # ---- raw calls -------------------------------------------------------------------------------

    def call(self, function: str, *arguments) -> int:
        """Call an FMI function on this instance; its status."""
        return self.noted(getattr(self.slave.dll, function)(self.slave.component, *arguments))

    def prepared(self, function: str, *arguments) -> Callable[[], int]:
        """`call` of always the same arguments, for each of thousands of steps; what it returns goes to `noted`."""
        return partial(getattr(self.slave.dll, function), self.slave.component, *arguments)

    def noted(self, status: int) -> int:
        """The same status; after FMI's fatal one the instance is not touched again."""
        self._lost = self._lost or status == FATAL
        return status

    def demand(self, status: int, what: str) -> None:
        if status != OK:
            raise Refused(f"{what}: status {status}; {self.messages[-1] if self.messages else 'no message'}")

    def references(self, names: Iterable[str | int]) -> ctypes.Array:
        """Value references as a C array; a number stands for itself."""
        numbers = [name if isinstance(name, int) else self.fmu.reference[name] for name in names]
        return (c_uint32 * len(numbers))(*numbers)

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


def describe(path: Path) -> ModelDescription:
    """What the FMU declares, read once a process; raises FmuError where it cannot be read."""
    require_fmu(path)
    about = path.stat()
    return _describe(path, about.st_mtime_ns, about.st_size)


def starts(path: Path) -> dict[str, float]:
    """The start values of an FMU's real parameters by name; raises FmuError where it cannot be read."""
    variables = describe(path).modelVariables
    return {v.name: float(v.start) for v in variables if v.causality == "parameter" and v.type in ("Real", "Float64")}


@lru_cache(maxsize=32)
def _describe(path: Path, _time: int, _size: int) -> ModelDescription:
    try:
        return fmpy.read_model_description(str(path))
    except Exception as error:  # zip, XML and schema errors have no common base
        raise FmuError(f"{path} cannot be read as an FMU: {first_line(error)}") from error


def bits(values: Iterable[float]) -> list[str]:
    """Numbers so that only the same bits are equal."""
    return [value.hex() for value in values]


def require_fmu(path: Path) -> None:
    """Raises FmuError, with the way to get one, where there is no file."""
    if not path.is_file():
        raise FmuError(f"There is no FMU at {path}: run `make build`, or name one with --fmu.")


def first_line(error: Exception) -> str:
    """What an error says, or its name where it says nothing."""
    return (str(error).splitlines() or [type(error).__name__])[0]
