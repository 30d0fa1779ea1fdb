"""The linkage FMU: driven through whole crank turns at constant speed by fmpy's simulate_fmu, or step by step.

What the component is called, starts with and by default simulates is read from its modelDescription. One binary is
loaded once and reset between runs, so that a hundred parameter sets cost little more than their steps.

Units are those of the FMU (SI) unless a name says otherwise (``_mm``, ``_deg``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType

import numpy as np
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription

from scenarios.common.instance import FmuError, Instance, Refused, UnpackedFmu, first_line

INPUTS = ("crank.phi", "crank.w", "machine.v")
OUTPUTS = (
    "tip.x",
    "tip.y",
    "tip.vx",
    "tip.vy",
    "tip.ax",
    "tip.ay",
    "tip.angle",
    "ground.x",
    "ground.y",
    "ground.vx",
    "ground.vy",
    "assembly.margin",
)
TIP = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay")
CRANK = ("crank.phi", "crank.w", "crank.a")
AT_STEP_END, SMOOTHING = "crank.at_step_end", "crank.smoothing"
PARAMETERS = ("geometry.L1", "geometry.L4", "geometry.L7", "geometry.L9", "geometry.phi1", "geometry.phi4")


@dataclass(frozen=True)
class Motion:
    """Angle, angular velocity and angular acceleration of a crank, each a sample a row."""

    phi: np.ndarray
    w: np.ndarray
    a: np.ndarray

    def __getitem__(self, rows: slice) -> Motion:
        return Motion(self.phi[rows], self.w[rows], self.a[rows])


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
    """The linkage FMU through whole crank turns, loaded once and reset between runs; a context manager.

    ``spacing`` is the distance in metres that the machine travels in one crank turn.
    """

    def __init__(self, path: Path, spacing: float) -> None:
        self.spacing = spacing
        self.design: dict[str, float] = {}  # parameters of every run, below those that it is given
        self._fmu = UnpackedFmu(path)
        try:
            self.description: ModelDescription = self._fmu.description
            self._check_description()
            self._instance = Instance(self._fmu, logging=True)  # its messages say why it refuses
        except FmuError:
            self._fmu.close()
            raise
        experiment = self.description.defaultExperiment
        self.turn_time: float = float(experiment.stopTime) - float(experiment.startTime or 0)

    def _check_description(self) -> None:
        description = self.description
        causality = {v.name: v.causality for v in description.modelVariables}
        expected = {"input": INPUTS, "output": OUTPUTS, "parameter": PARAMETERS}
        missing = [
            f"{kind} {name}" for kind, names in expected.items() for name in names if causality.get(name) != kind
        ]
        if missing:
            raise FmuError(
                f"{self._fmu.path} ({description.modelName}) is not the linkage: it lacks {', '.join(missing)}."
            )
        if description.defaultExperiment is None or description.defaultExperiment.stopTime is None:
            raise FmuError(f"{self._fmu.path} has no default experiment, which gives the time of one crank turn.")

    @property
    def nominal(self) -> dict[str, float]:
        """Start values of the real parameters: the published set."""
        return {
            v.name: float(v.start)
            for v in self.description.modelVariables
            if v.causality == "parameter" and v.type == "Real"
        }

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
        followed = self.follow(
            {
                "time": np.array([0.0, stop]),
                "crank.phi": np.array([0.0, 2 * math.pi * turns]),
                "crank.w": np.full(2, 2 * math.pi / self.turn_time),
                "machine.v": np.full(2, self.spacing / self.turn_time),
            },
            steps,
            parameters,
        )
        return replace(followed, phi_deg=np.linspace(0, 360 * turns, steps + 1))  # without interpolation's rounding

    def follow(
        self, given: Mapping[str, np.ndarray], steps: int, parameters: Mapping[str, float] | None = None
    ) -> Turns:
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

        messages, slave = self._instance.messages, self._instance.slave
        messages.clear()
        slave.reset()
        try:
            result = simulate_fmu(
                str(self._fmu.folder),
                model_description=self.description,
                fmu_instance=slave,
                start_time=0.0,
                stop_time=stop,
                output_interval=stop / steps,
                start_values=self.design | dict(parameters or {}),
                input=signals,
                output=list(self.outputs),
            )
        except FMICallException as error:
            raise Refused(_refusal(messages) or first_line(error)) from error
        if len(result) != steps + 1:
            raise RuntimeError(f"fmpy returned {len(result)} samples instead of {steps + 1}")
        time = np.array(result["time"])
        return Turns(
            parameters=dict(parameters or {}),
            time=time,
            phi_deg=np.degrees(np.interp(time, signals["time"], signals["crank.phi"])),
            values={name: np.array(result[name]) for name in self.outputs},
        )

    def close(self) -> None:
        """Free the instance and delete the extracted files."""
        self._instance.free()
        self._fmu.close()

    def __enter__(self) -> LinkageFmu:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Linkage(Instance):
    """One instance of the linkage FMU, to be stepped."""

    def __init__(self, fmu: UnpackedFmu, name: str) -> None:
        missing = [name for name in (*CRANK, *TIP, AT_STEP_END, SMOOTHING) if name not in fmu.reference]
        if missing:
            raise FmuError(
                f"{fmu.path} ({fmu.description.modelName}) is not the linkage: it lacks {', '.join(missing)}."
            )
        super().__init__(fmu, name)
        self._crank = [fmu.reference[name] for name in CRANK]
        self._tip = [fmu.reference[name] for name in TIP]

    def exact(self, motion: Motion) -> np.ndarray:
        """The tip at each sample of a motion, a row each, as TIP: in initialization mode."""
        slave = self.slave
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        rows = np.empty((len(motion.phi), len(TIP)))
        for i, values in enumerate(np.column_stack((motion.phi, motion.w, motion.a)).tolist()):
            slave.setReal(self._crank, values)
            rows[i] = slave.getReal(self._tip)
        return rows


def _refusal(messages: list[str]) -> str:
    """The first message, without the name of the FMI function: later ones repeat it."""
    if not messages:
        return ""
    head, separator, tail = messages[0].partition(": ")
    return tail if separator and head.startswith("fmi2") else messages[0]
