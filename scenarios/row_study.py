"""Error against communication step: the field row with every master, and with the linkage coupled in several ways.

The error is the distance of the tip, over ground, from where it is in the truth: the same system
with a step so small that it no longer matters. It has two parts:

    the linkage's own   the tip as the linkage gave it, against where it is for the crank angle and the way of
                        the machine that the drivetrain reached in the same run
    the rest            that place, against the truth: what the other couplings leave

The place for an angle is asked of a second instance of the linkage, which in initialization mode
predicts nothing (scenarios/coupling.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenarios import row_run
from scenarios.coupling import Linkage, UnpackedFmu
from scenarios.crank_profiles import Motion
from scenarios.masters import NoRollback
from scenarios.row_run import CONTROLLED, Record
from scenarios.system import System

STEPS_MS = (1.0, 2.0, 5.0, 10.0)
TRUTH_MS = 0.2
TOLERANCES = (10.0, 1.0, 0.1)
CONTROLLED_MS = 1.5  # about what the controlled master takes a step
PLANTS = 3
WATCHED = ("drivetrain.crank.phi", "drivetrain.machine.s", "linkage.ground.x", "linkage.ground.y",
           "drivetrain.energy.tractor", "drivetrain.energy.shaft", "drivetrain.energy.stored", "soil.energy.soil")


@dataclass(frozen=True)
class Way:
    """A master, and how the linkage is coupled: inputs left unconnected, and whether it predicts."""

    key: str
    title: str
    master: str
    unconnected: tuple[str, ...] = ()
    held: bool = False

    @property
    def coupled(self) -> tuple:
        """What tells its runs from those of others."""
        return self.master, self.unconnected, self.held

    def of(self, system: System) -> System:
        """The system coupled this way."""
        system = system.without(*self.unconnected)
        return system.with_parameters({"linkage.crank.at_step_end": True}) if self.held else system


MASTERS = (
    Way("jacobi", "Jacobi", "jacobi"),
    Way("gauss_seidel", "Gauss-Seidel", "gauss-seidel"),
    Way("extrapolated", "Jacobi with the force's slope", "extrapolated"),
)
LINKAGE = (
    Way("held", "the angle held: nothing predicted", "jacobi", held=True),
    Way("angle", "crank.phi alone", "jacobi", ("linkage.crank.w", "linkage.crank.a")),
    Way("angle_speed", "crank.phi, crank.w", "jacobi", ("linkage.crank.a",)),
    Way("rates", "crank.phi, crank.w, crank.a", "jacobi"),
)


@dataclass(frozen=True)
class Errors:
    """Of one way and step: worst and root mean square, m; ``imbalance`` is the worst of the energy's, J.

    ``step`` in s is the mean of the ``steps`` that were done.
    """

    way: Way
    step: float
    steps: int
    worst: float
    rms: float
    own_worst: float
    own_rms: float
    rest_worst: float
    rest_rms: float
    imbalance: float


@dataclass(frozen=True)
class Study:
    """``truth_error``: how far the truth with twice its step is from it, m; ``truth_other``: the same of
    plain Jacobi steps as small, taken to the limit by Richardson's extrapolation; ``work``: of the tractor, J.
    """

    masters: tuple[Errors, ...]
    controlled: tuple[Errors, ...]
    linkage: tuple[Errors, ...]
    truth_error: float
    truth_other: float
    work: float
    seconds: float

    def of(self, key: str) -> list[Errors]:
        """The errors of one way, by step."""
        found = {(e.way.key, e.step): e for e in (*self.masters, *self.linkage) if e.way.key == key}
        return [found[k] for k in sorted(found, key=lambda k: k[1])]

    def order(self, key: str, what: str, largest: float = 5e-3) -> float:
        """Fitted slope of log(error) over log(step), of steps to ``largest``."""
        used = [(e.step, getattr(e, what)) for e in self.of(key) if e.step <= largest]
        return float(np.polyfit(*np.log(np.array(used).T), 1)[0]) if len(used) > 2 else float("nan")


def seconds(stop: float) -> float:
    """How many times ``TRUTH_MS`` `measure` steps through, for a progress bar: roughly."""
    ways = len({way.coupled for way in (*MASTERS, *LINKAGE)})
    return stop * (3 + sum(TRUTH_MS / s for s in STEPS_MS) * ways + len(TOLERANCES) * TRUTH_MS / CONTROLLED_MS)


def measure(system: System, done: Callable[[float], object]) -> Study:
    """Run everything; ``done`` is called with shares of `seconds`."""
    row = row_run.row_of(system, PLANTS)
    stop = np.ceil(row.stop / 0.02) * 0.02  # a multiple of all steps

    def run(way: Way, step_ms: float, tolerance: float | None = None) -> Record:
        cost = TRUTH_MS / (step_ms if tolerance is None else CONTROLLED_MS)
        return row_run.run(way.of(row.system), way.master if tolerance is None else CONTROLLED, step_ms * 1e-3, stop,
                           lambda taken: done(taken * cost), tolerance or 1.0, WATCHED)

    plain, _, best = MASTERS
    truth, coarser = run(best, TRUTH_MS), run(best, 2 * TRUTH_MS)
    jacobi, jacobi_coarser = run(plain, TRUTH_MS), run(plain, 2 * TRUTH_MS)
    limit = 2 * place(jacobi)[::2] - place(jacobi_coarser)
    with UnpackedFmu(next(c.fmu for c in system.components if c.name == "linkage")) as folder, \
            Linkage(folder, "true") as linkage:

        def errors(way: Way, step: float, record: Record) -> Errors:
            exact = true_place(linkage, record)
            true = np.interp(record.time, truth.time, place(truth))
            off, own, rest = abs(place(record) - true), abs(place(record) - exact), abs(exact - true)
            figures = [f(e) for e in (off, own, rest) for f in (np.max, lambda e: np.sqrt(np.mean(e**2)))]
            return Errors(way, step, record.steps_done, *map(float, figures), float(abs(record.imbalance).max()))

        records: dict[tuple, Record] = {}

        def known(way: Way, step: float) -> Errors:
            if (way.coupled, step) not in records:
                records[way.coupled, step] = run(way, step)
            return errors(way, step * 1e-3, records[way.coupled, step])

        controlled = []
        for tolerance in TOLERANCES:
            way = Way(f"controlled_{tolerance:g}", f"steps controlled, tolerance {tolerance:g}", CONTROLLED)
            try:
                record = run(best, CONTROLLED_MS, tolerance)
            except NoRollback:
                break
            controlled.append(errors(way, float(stop) / record.steps_done, record))
        return Study(tuple(known(w, s) for w in MASTERS for s in STEPS_MS), tuple(controlled),
                     tuple(known(w, s) for w in LINKAGE for s in STEPS_MS),
                     float(abs(place(coarser) - place(truth)[::2]).max()), float(abs(limit - place(truth)[::2]).max()),
                     float(truth["drivetrain.energy.tractor"][-1]), float(stop))


def place(record: Record) -> np.ndarray:
    """The tip over ground as the linkage gave it, x + iy."""
    return record["linkage.ground.x"] + 1j * record["linkage.ground.y"]


def true_place(linkage: Linkage, record: Record) -> np.ndarray:
    """The tip over ground for the crank angle and the way that the drivetrain reached, x + iy."""
    phi = record["drivetrain.crank.phi"]
    tip = linkage.exact(Motion(phi, np.zeros_like(phi), np.zeros_like(phi)))
    return record["drivetrain.machine.s"] + tip[:, 0] + 1j * tip[:, 1]
