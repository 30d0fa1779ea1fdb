"""Run the linkage FMU through crank turns at constant speed, with fmpy alone.

What the component is called, starts with and by default simulates is read from its
modelDescription. One binary is loaded once and reset between runs, so that a hundred
parameter sets cost little more than their steps.

Units are those of the FMU (SI) unless a name says otherwise (``_mm``, ``_deg``).
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription
from fmpy.simulation import instantiate_fmu

INPUTS = ("crank.phi", "crank.w", "machine.v")
OUTPUTS = (
    "tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay", "tip.angle",
    "ground.x", "ground.y", "ground.vx", "ground.vy", "assembly.margin",
)
PARAMETERS = ("geometry.L1", "geometry.L4", "geometry.L7", "geometry.L9", "geometry.phi1", "geometry.phi4")


class FmuError(Exception):
    """The file cannot be used as the linkage FMU; the message is for the user."""


class Refused(Exception):
    """The FMU refused a run; the message is its own (for instance: a dyad cannot close)."""


@dataclass(frozen=True)
class Turns:
    """One run: samples at equal crank angles, both ends included.

    ``phi_deg`` is the angle that the cranks have turned in the working direction.
    ``values`` holds the FMU's outputs by name, which belong to the same instants.
    """

    parameters: dict[str, float]
    time: np.ndarray
    phi_deg: np.ndarray
    values: dict[str, np.ndarray]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]

    @property
    def static_mm(self) -> np.ndarray:
        """The tip relative to the machine, as complex numbers x + iy (x forward, y up)."""
        return 1e3 * (self["tip.x"] + 1j * self["tip.y"])

    @property
    def dynamic_mm(self) -> np.ndarray:
        """The tip relative to the ground, as complex numbers x + iy (x forward, y up)."""
        return 1e3 * (self["ground.x"] + 1j * self["ground.y"])

    @property
    def speed(self) -> np.ndarray:
        """Magnitude of the tip's velocity relative to the machine, m/s."""
        return np.hypot(self["tip.vx"], self["tip.vy"])

    @property
    def acceleration(self) -> np.ndarray:
        """Magnitude of the tip's acceleration, m/s2."""
        return np.hypot(self["tip.ax"], self["tip.ay"])


class LinkageFmu:
    """The FMU, extracted and loaded once; a context manager.

    ``spacing`` is the distance in metres that the machine travels in one crank turn.
    """

    def __init__(self, path: Path, spacing: float) -> None:
        self.path = path
        self.spacing = spacing
        self._messages: list[str] = []
        self._directory: str | None = None
        self._instance = None

        require_fmu(path)
        try:
            self.description: ModelDescription = read_model_description(str(path))
        except Exception as error:  # zip, XML and schema errors have no common base
            raise FmuError(f"{path} cannot be read as an FMU: {first_line(error)}") from error
        self._check_description()
        self.turn_time: float = (float(self.description.defaultExperiment.stopTime)
                                 - float(self.description.defaultExperiment.startTime or 0))
        try:
            self._directory = extract(str(path))
            self._instance = instantiate_fmu(
                self._directory, self.description, "CoSimulation",
                logger=self._log, debug_logging=True)  # its messages say why it refuses
        except Exception as error:
            self.close()
            raise FmuError(f"{path} cannot be loaded on this platform: {first_line(error)}") from error

    def _check_description(self) -> None:
        description = self.description
        if description.fmiVersion != "2.0" or description.coSimulation is None:
            raise FmuError(f"{self.path} is not an FMI 2.0 FMU for co-simulation.")
        causality = {v.name: v.causality for v in description.modelVariables}
        expected = {"input": INPUTS, "output": OUTPUTS, "parameter": PARAMETERS}
        missing = [f"{kind} {name}" for kind, names in expected.items() for name in names if causality.get(name) != kind]
        if missing:
            raise FmuError(f"{self.path} ({description.modelName}) is not the linkage: it lacks {', '.join(missing)}.")
        if description.defaultExperiment is None or description.defaultExperiment.stopTime is None:
            raise FmuError(f"{self.path} has no default experiment, which gives the time of one crank turn.")

    def _log(self, _environment: object, _instance: object, _status: int, _category: object, message: bytes) -> None:
        self._messages.append(message.decode("utf-8", "replace") if message else "")

    @property
    def nominal(self) -> dict[str, float]:
        """Start values of the real parameters: the published set."""
        return {v.name: float(v.start) for v in self.description.modelVariables
                if v.causality == "parameter" and v.type == "Real"}

    @property
    def outputs(self) -> dict[str, str]:
        """Unit of every output, in the FMU's order."""
        return {v.name: v.unit or "" for v in self.description.modelVariables if v.causality == "output"}

    @property
    def turns_per_minute(self) -> float:
        """Crank turns, and plants, a minute in the default experiment."""
        return 60 / self.turn_time

    def run(self, step_deg: float, parameters: Mapping[str, float] | None = None, turns: int = 1) -> Turns:
        """Turn the cranks at constant speed and record every output each ``step_deg`` or less.

        The crank angle is a ramp from 0. Outputs after a step belong to the step's end,
        so each sample belongs to the angle of its own time.
        """
        steps = turns * math.ceil(360 / step_deg - 1e-9)
        stop = turns * self.turn_time
        followed = self.follow({
            "time": np.array([0.0, stop]), "crank.phi": np.array([0.0, 2 * math.pi * turns]),
            "crank.w": np.full(2, 2 * math.pi / self.turn_time),
            "machine.v": np.full(2, self.spacing / self.turn_time),
        }, steps, parameters)
        return replace(followed, phi_deg=np.linspace(0, 360 * turns, steps + 1))  # without interpolation's rounding

    def follow(self, given: Mapping[str, np.ndarray], steps: int, parameters: Mapping[str, float] | None = None) -> Turns:
        """Take equal steps along inputs given by name and ``time`` from 0, and record every output after each.

        Between their samples the inputs are straight lines, beyond the named ones they keep their start values.
        """
        # Every input gets a column: fmpy prints a warning for each that is missing.
        inputs = [v for v in self.description.modelVariables if v.causality == "input"]
        signals = np.zeros(len(given["time"]), dtype=[("time", float)] + [(v.name, float) for v in inputs])
        for variable in inputs:
            signals[variable.name] = given.get(variable.name, float(variable.start or 0))
        signals["time"] = given["time"]
        stop = float(given["time"][-1])

        self._messages.clear()
        self._instance.reset()
        try:
            result = simulate_fmu(
                self._directory, model_description=self.description, fmu_instance=self._instance,
                start_time=0.0, stop_time=stop, output_interval=stop / steps,
                start_values=dict(parameters or {}), input=signals, output=list(self.outputs))
        except FMICallException as error:
            raise Refused(_refusal(self._messages) or first_line(error)) from error
        if len(result) != steps + 1:
            raise RuntimeError(f"fmpy returned {len(result)} samples instead of {steps + 1}")
        time = np.array(result["time"])
        return Turns(
            parameters=dict(parameters or {}),
            time=time,
            phi_deg=np.degrees(np.interp(time, signals["time"], signals["crank.phi"])),
            values={name: np.array(result[name]) for name in self.outputs})

    def close(self) -> None:
        """Free the instance and delete the extracted files."""
        if self._instance is not None:
            self._instance.freeInstance()
            self._instance = None
        if self._directory is not None:
            shutil.rmtree(self._directory, ignore_errors=True)
            self._directory = None

    def __enter__(self) -> LinkageFmu:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()


def require_fmu(path: Path) -> None:
    """Raises FmuError, with the way to get one, where there is no file."""
    if not path.is_file():
        raise FmuError(f"There is no FMU at {path}: run `make build`, or name one with --fmu.")


def first_line(error: Exception) -> str:
    """What an error says, or its name where it says nothing."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def _refusal(messages: list[str]) -> str:
    """The first message, without the name of the FMI function: later ones repeat it."""
    if not messages:
        return ""
    head, separator, tail = messages[0].partition(": ")
    return tail if separator and head.startswith("fmi2") else messages[0]
