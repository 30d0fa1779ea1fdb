"""A field row planted: the system run by a master, its record, and what the record says.

Lengths in m, angles in rad, forces in N, energies in J unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from fmpy import read_model_description

from scenarios.cycle import first_line
from scenarios.masters import (
    CoSimulation,
    Master,
    controlled_steps,
    extrapolated,
    fixed_steps,
    gauss_seidel,
    jacobi,
)
from scenarios.system import System, SystemFault

MASTERS: dict[str, Master] = {"jacobi": jacobi, "extrapolated": extrapolated, "gauss-seidel": gauss_seidel}
CONTROLLED = "controlled"
LONGEST_STEP = 5e-3  # s, of the controlled master
STANDSTILL = 0.3     # s, watched after the stop
PLANTED, EMPTY, MISSED, NO_SEEDLING = "planted", "empty cup", "missed the nozzle", "no seedling"

WATCHED = (
    "drivetrain.crank.phi", "drivetrain.crank.w", "drivetrain.machine.v", "drivetrain.machine.s",
    "drivetrain.machine.pull", "drivetrain.shaft.tau", "drivetrain.energy.tractor", "drivetrain.energy.shaft",
    "drivetrain.energy.stored", "linkage.ground.x", "linkage.ground.y", "linkage.crank.tau", "linkage.machine.s",
    "linkage.tip.angle", "conveyor.seedling.in_nozzle", "conveyor.seedling.y", "conveyor.seedling.offset",
    "conveyor.cups.opened", "conveyor.cups.empty", "conveyor.seedlings.caught", "conveyor.seedlings.missed",
    "soil.tip.fx", "soil.tip.fy", "soil.tip.depth", "soil.energy.soil", "soil.hole.count", "soil.hole.entry",
    "soil.hole.exit", "soil.hole.length", "soil.hole.depth", "soil.hole.speed", "soil.plant.count",
    "soil.plant.in_hole", "soil.plant.x", "soil.plant.lean",
)


@dataclass(frozen=True)
class Hole:
    """A hole as the soil recorded it, and what became of its seedling; lengths m, speed m/s, lean rad."""

    entry: float
    exit: float
    length: float
    depth: float
    speed: float
    plant_x: float
    lean: float
    seedling: str


@dataclass(frozen=True)
class Record:
    """The watched outputs after every step, and at the start; what an FMU does not offer is NaN.

    ``steps_done`` counts the steps of each FMU, those taken back and repeated in halves included.
    """

    time: np.ndarray
    columns: dict[str, np.ndarray]
    not_offered: tuple[str, ...]
    steps_done: int

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    @property
    def holes(self) -> list[Hole]:
        """One for each time that the soil's count of holes grew."""
        count = np.nan_to_num(self["soil.hole.count"])
        found, since = [], 0
        for k in np.flatnonzero(np.diff(count) > 0) + 1:
            figures = [float(self[f"soil.{name}"][k]) for name in
                       ("hole.entry", "hole.exit", "hole.length", "hole.depth", "hole.speed", "plant.x", "plant.lean")]
            fate = PLANTED if self["soil.plant.in_hole"][k] else NO_SEEDLING
            for name, reason in (("cups.empty", EMPTY), ("seedlings.missed", MISSED)):
                if fate == NO_SEEDLING and self[f"conveyor.{name}"][k] > self[f"conveyor.{name}"][since]:
                    fate = reason
            found.append(Hole(*figures, fate))
            since = k
        return found

    @property
    def imbalance(self) -> np.ndarray:
        """The tractor's work less what shaft and soil took and what is stored: the coupling error, J."""
        return (self["drivetrain.energy.tractor"] - self["drivetrain.energy.shaft"]
                - self["drivetrain.energy.stored"] - self["soil.energy.soil"])


def start_value(system: System, name: str) -> float | None:
    """A parameter as the system sets it, else as its FMU starts with it; None where there is no such parameter."""
    port = system.port(name)
    if port in system.parameters:
        return float(system.parameters[port])
    component = next(c for c in system.components if c.name == port.component)
    try:
        variables = read_model_description(str(component.fmu)).modelVariables
    except Exception as error:
        raise SystemFault(f"{component.name}: {component.fmu} cannot be read: {first_line(error)}") from error
    own = component.names.get(port.variable, port.variable)
    return next((float(v.start) for v in variables if v.name == own and v.start is not None), None)


@dataclass(frozen=True)
class Row:
    """How many plants, and the time that they take. ``spacing`` in m is what the wheel is set to."""

    system: System
    plants: int
    spacing: float
    stop: float


def row_of(system: System, plants: int) -> Row:
    """The system, told to stop at the headland after so many plants (where its drivetrain can be told)."""
    spacing = start_value(system, "drivetrain.plant.spacing") or 0.4
    cruise = start_value(system, "drivetrain.speed.cruise") or spacing * 65 / 60
    ramp = start_value(system, "drivetrain.speed.ramp") or 0.0
    # Starting and stopping are mirror images: the way is as if cruising from the begin of one to that of the other.
    headland = plants * spacing / cruise
    if start_value(system, "drivetrain.speed.headland") is not None:
        system = system.with_parameters({"drivetrain.speed.headland": headland})
    return Row(system, plants, spacing, headland + ramp + STANDSTILL)


def run(system: System, master: str, step: float, stop: float, done: Callable[[float], object] = lambda seconds: None,
        tolerance: float = 1.0, watched: tuple[str, ...] = WATCHED) -> Record:
    """Run a system to ``stop``; ``done`` is called with the seconds of its time that each step took.

    ``step`` in s is of all masters but the controlled one, which takes what ``tolerance`` times
    the system's step_control allows.
    """
    with CoSimulation(system, watched, at_step_end=master == "gauss-seidel") as row:
        times, rows = [row.start], [row.values()]
        steps = (controlled_steps(row, extrapolated, stop, LONGEST_STEP, tolerance) if master == CONTROLLED
                 else fixed_steps(row, MASTERS[master], stop, step))
        for time in steps:
            done(time - times[-1])
            times.append(time)
            rows.append(row.values())
        table = np.array(rows)
        columns = {name: table[:, i] for i, name in enumerate(row.watched)}
        for name in row.not_offered:
            columns[name] = np.full(len(times), np.nan)
        return Record(np.array(times), columns, tuple(row.not_offered), row.steps_done // len(row.slaves))
