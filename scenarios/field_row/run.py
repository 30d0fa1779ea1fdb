"""A field row planted: the system run by a master, its record, and what the record says. All in SI units."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from scenarios.common.operating_point import PLANTS_PER_MINUTE
from scenarios.field_row.masters import (
    CoSimulation,
    Master,
    controlled_steps,
    extrapolated,
    fixed_steps,
    gauss_seidel,
    jacobi,
)
from scenarios.field_row.system import System

MASTERS: dict[str, Master] = {"jacobi": jacobi, "extrapolated": extrapolated, "gauss-seidel": gauss_seidel}
CONTROLLED = "controlled"
LONGEST_STEP = 5e-3  # s, of the controlled master
STANDSTILL = 0.3  # s, watched after the stop
PLANTED, EMPTY, MISSED, NO_SEEDLING = "planted", "empty cup", "missed the nozzle", "no seedling"

WATCHED = {  # what is recorded of the row, where it is offered, and in which unit
    "drivetrain.crank.phi": "rad",
    "drivetrain.crank.w": "rad/s",
    "drivetrain.machine.v": "m/s",
    "drivetrain.machine.s": "m",
    "drivetrain.machine.pull": "N",
    "drivetrain.shaft.tau": "N.m",
    "drivetrain.energy.tractor": "J",
    "drivetrain.energy.shaft": "J",
    "drivetrain.energy.stored": "J",
    "linkage.ground.x": "m",
    "linkage.ground.y": "m",
    "linkage.crank.tau": "N.m",
    "linkage.crank.inertia": "kg.m2",
    "linkage.machine.fx": "N",
    "linkage.machine.fy": "N",
    "linkage.linkage.kinetic": "J",
    "linkage.linkage.potential": "J",
    "linkage.machine.s": "m",
    "linkage.tip.angle": "rad",
    "conveyor.seedling.in_nozzle": "1",
    "conveyor.seedling.y": "m",
    "conveyor.seedling.offset": "m",
    "conveyor.cups.opened": "1",
    "conveyor.cups.empty": "1",
    "conveyor.seedlings.caught": "1",
    "conveyor.seedlings.missed": "1",
    "soil.tip.fx": "N",
    "soil.tip.fy": "N",
    "soil.tip.depth": "m",
    "soil.energy.soil": "J",
    "soil.hole.count": "1",
    "soil.hole.entry": "m",
    "soil.hole.exit": "m",
    "soil.hole.length": "m",
    "soil.hole.depth": "m",
    "soil.hole.speed": "m/s",
    "soil.plant.count": "1",
    "soil.plant.in_hole": "1",
    "soil.plant.x": "m",
    "soil.plant.lean": "rad",
}


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
    """The watched outputs in SI after every step, and at the start; what an FMU does not offer is NaN.

    ``steps_done`` counts the steps of each FMU, those taken back and repeated in halves included.
    """

    time: np.ndarray
    columns: dict[str, np.ndarray]
    not_offered: tuple[str, ...]
    steps_done: int

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]

    def offers(self, *names: str) -> bool:
        """Whether all of these were recorded."""
        return not set(names) & set(self.not_offered)

    def rms(self, values: np.ndarray) -> float:
        """Root of the mean over time of a signal's square."""
        return float(np.sqrt(np.trapezoid(values**2, self.time) / np.ptp(self.time)))

    @property
    def holes(self) -> list[Hole]:
        """One for each time that the soil's count of holes grew."""
        count = np.nan_to_num(self["soil.hole.count"])
        found, since = [], 0
        for k in np.flatnonzero(np.diff(count) > 0) + 1:
            figures = [
                float(self[f"soil.{name}"][k])
                for name in (
                    "hole.entry",
                    "hole.exit",
                    "hole.length",
                    "hole.depth",
                    "hole.speed",
                    "plant.x",
                    "plant.lean",
                )
            ]
            fate = PLANTED if self["soil.plant.in_hole"][k] else NO_SEEDLING
            for name, reason in (("cups.empty", EMPTY), ("seedlings.missed", MISSED)):
                if fate == NO_SEEDLING and self[f"conveyor.{name}"][k] > self[f"conveyor.{name}"][since]:
                    fate = reason
            found.append(Hole(*figures, fate))
            since = k
        return found

    @property
    def links(self) -> np.ndarray:
        """What the moving links store more than at the start, J; 0 where the linkage does not say."""
        stored = np.nan_to_num(self["linkage.linkage.kinetic"] + self["linkage.linkage.potential"])
        return stored - stored[0]

    @property
    def has_masses(self) -> bool:
        return bool(np.any(self["linkage.linkage.kinetic"] > 0))

    @property
    def imbalance(self) -> np.ndarray:
        """The tractor's work less what shaft and soil took and what is stored: the coupling error, J."""
        return (
            self["drivetrain.energy.tractor"]
            - self["drivetrain.energy.shaft"]
            - self["drivetrain.energy.stored"]
            - self["soil.energy.soil"]
            - self.links
        )


def start_value(system: System, name: str) -> float | None:
    """A parameter in SI as the system sets it, else as its FMU starts with it; None where there is none."""
    if not system.offers(name):
        return None
    port = system.port(name)
    if port in system.parameters:
        return float(system.parameters[port])
    return system.component(port.component).start(port.variable)


@dataclass(frozen=True)
class Row:
    """A row to be planted until ``stop``, s. ``spacing`` in m is what the wheel is set to, ``plants`` how many are
    asked for; each is None where the drivetrain cannot be told.
    """

    system: System
    plants: int | None
    spacing: float | None
    stop: float


def row_of(system: System, plants: int) -> Row:
    """The system, told to stop at the headland after so many plants (where its drivetrain can be told).

    Where it cannot, it runs for as long as so many plants take at the published operating point. Raises SystemFault
    with all that keeps the system from running.
    """
    system.check(WATCHED)
    spacing = start_value(system, "drivetrain.plant.spacing")
    cruise = start_value(system, "drivetrain.speed.cruise")
    ramp = start_value(system, "drivetrain.speed.ramp") or 0.0
    # Starting and stopping are mirror images: the way is as if cruising from the begin of one to that of the other.
    headland = plants * (spacing / cruise if spacing and cruise else 60 / PLANTS_PER_MINUTE)
    stops = bool(spacing and cruise) and system.offers("drivetrain.speed.headland")
    if stops:
        system = system.with_parameters({"drivetrain.speed.headland": headland})
    return Row(system, plants if stops else None, spacing, headland + ramp + STANDSTILL)


def run(
    system: System,
    master: str,
    step: float,
    stop: float,
    done: Callable[[float], object] = lambda seconds: None,
    *,
    tolerance: float = 1.0,
    watched: Iterable[str] | Mapping[str, str] = WATCHED,
) -> Record:
    """Run a system to ``stop``; ``done`` is called with the seconds of its time that each step took.

    ``step`` in s is of all masters but the controlled one, which takes what ``tolerance`` times
    the system's step_control allows.
    """
    with CoSimulation(system, watched, at_step_end=master == "gauss-seidel") as simulation:
        times, samples = [simulation.start], [simulation.values()]
        steps = (
            controlled_steps(simulation, extrapolated, stop, LONGEST_STEP, tolerance)
            if master == CONTROLLED
            else fixed_steps(simulation, MASTERS[master], stop, step)
        )
        for time in steps:
            done(time - times[-1])
            times.append(time)
            samples.append(simulation.values())
        table = np.array(samples)
        columns = {name: table[:, i] for i, name in enumerate(simulation.watched)}
        for name in simulation.not_offered:
            columns[name] = np.full(len(times), np.nan)
        return Record(
            np.array(times), columns, tuple(simulation.not_offered), simulation.steps_done // len(simulation.slaves)
        )
