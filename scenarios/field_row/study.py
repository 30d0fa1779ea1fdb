"""Error against communication step: the field row with every master, and with the linkage coupled in several ways.

The error is the distance of the tip, over ground, from where it is in the truth: the same system
with a step so small that it no longer matters. It has two parts:

    the linkage's own   the tip as the linkage gave it, against where it is for the crank angle and the way of
                        the machine that the drivetrain reached in the same run
    the rest            that place, against the truth: what the other couplings leave

The place for an angle is asked of a second instance of the linkage, which in initialization mode
predicts nothing (scenarios/speed_vs_error/coupling/measure.py). The runs are spread over processes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass

import numpy as np

from scenarios.common.instance import UnpackedFmu
from scenarios.common.linkage import Linkage, Motion
from scenarios.field_row import run as row_run
from scenarios.field_row.component import Port
from scenarios.field_row.masters import NoRollback
from scenarios.field_row.run import CONTROLLED, Record
from scenarios.field_row.system import System

STEPS_MS = (1.0, 2.0, 5.0, 10.0)
TRUTH_MS = 0.2
LIMIT_MS = 0.5  # and twice that: plain Jacobi steps from which the truth is sought another way
TOLERANCES = (10.0, 1.0, 0.1)
CONTROLLED_MS = 1.5  # about what the controlled master takes a step
PLANTS = 3
WATCHED = {
    name: row_run.WATCHED[name]
    for name in (
        "drivetrain.crank.phi",
        "drivetrain.machine.s",
        "linkage.ground.x",
        "linkage.ground.y",
        "drivetrain.energy.tractor",
        "drivetrain.energy.shaft",
        "drivetrain.energy.stored",
        "soil.energy.soil",
        "linkage.linkage.kinetic",
        "linkage.linkage.potential",
    )
}
OPTIONAL = {"linkage.linkage.kinetic", "linkage.linkage.potential"}  # of WATCHED: without them there are no masses


@dataclass(frozen=True)
class Way:
    """A master, and how the linkage is coupled: inputs left unconnected, and whether it predicts."""

    key: str
    title: str
    master: str
    unconnected: tuple[str, ...] = ()
    held: bool = False
    connected: tuple[str, ...] = ()

    def fits(self, system: System) -> bool:
        """Whether the system has what the title says: the connections, and slopes for the master that gives them."""
        if self.master == "extrapolated":
            ports = [Port(c.name, name) for c in system.components for name in c.slopes]
            return any(port in system.connections for port in ports)
        return all(system.port(name) in system.connections for name in self.connected)

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
    Way("angle_speed", "crank.phi, crank.w", "jacobi", ("linkage.crank.a",), connected=("linkage.crank.w",)),
    Way("rates", "crank.phi, crank.w, crank.a", "jacobi", connected=("linkage.crank.w", "linkage.crank.a")),
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
    plain Jacobi steps, taken to the limit by Richardson's extrapolation; ``work``: of the tractor, J.
    ``uncontrolled``: why there is none of the controlled master.
    """

    masters: tuple[Errors, ...]
    controlled: tuple[Errors, ...]
    linkage: tuple[Errors, ...]
    truth_error: float
    truth_other: float
    work: float
    seconds: float
    uncontrolled: str = ""

    @property
    def ways(self) -> list[Way]:
        """The masters, and how the linkage was coupled to the plain one: the last is the best coupled."""
        return list({e.way.key: e.way for e in (*self.masters, *self.linkage)}.values())

    def of(self, key: str) -> list[Errors]:
        """The errors of one way, by step."""
        found = {(e.way.key, e.step): e for e in (*self.masters, *self.linkage) if e.way.key == key}
        return [found[k] for k in sorted(found, key=lambda k: k[1])]

    def order(self, key: str, what: str, largest: float = 5e-3) -> float:
        """Fitted slope of log(error) over log(step), of steps to ``largest``."""
        used = [(e.step, getattr(e, what)) for e in self.of(key) if e.step <= largest]
        return float(np.polyfit(*np.log(np.array(used).T), 1)[0]) if len(used) > 2 else float("nan")


def missing(system: System) -> list[str]:
    """What the study needs and the system does not offer."""
    return [name for name in WATCHED if name not in OPTIONAL and not system.offers(name)]


@dataclass(frozen=True)
class _Run:
    way: Way
    step_ms: float
    tolerance: float | None = None

    @property
    def cost(self) -> float:
        """Steps of 1 ms that it is about worth; the drivetrain's own substeps bound it from below."""
        return max(1 / self.step_ms, 0.3)

    def record(self, system: System, stop: float) -> Record:
        master = self.way.master if self.tolerance is None else CONTROLLED
        system, tolerance = self.way.of(system), self.tolerance or 1.0
        return row_run.run(system, master, self.step_ms * 1e-3, stop, tolerance=tolerance, watched=WATCHED)


def measure(
    system: System, pool: Executor, begun: Callable[[Future], object] = lambda run: None
) -> Callable[[], Study]:
    """Begin all runs in the processes of a pool; ``begun`` is given each. What is returned waits for them."""
    row = row_run.row_of(system, PLANTS)
    stop = float(np.ceil(row.stop / 0.02) * 0.02)  # a multiple of all steps
    masters, linkage_ways = ([way for way in ways if way.fits(system)] for ways in (MASTERS, LINKAGE))
    plain, best = masters[0], masters[-1]
    best = best if best.master == "extrapolated" else plain
    fixed = {(w.coupled, s): _Run(w, s) for w in (*masters, *linkage_ways) for s in STEPS_MS}
    truths = [(way, k * step) for way, step in ((best, TRUTH_MS), (plain, LIMIT_MS)) for k in (1, 2)]
    fixed |= {(way.coupled, step): _Run(way, step) for way, step in truths}
    controlled = {
        t: _Run(Way(f"controlled_{t:g}", f"steps controlled, tolerance {t:g}", CONTROLLED), CONTROLLED_MS, t)
        for t in TOLERANCES
    }
    runs = {}
    for run in sorted((*fixed.values(), *controlled.values()), key=lambda run: -run.cost):  # the long ones first
        runs[run] = pool.submit(run.record, row.system, stop)
        begun(runs[run])

    def record(way: Way, step_ms: float) -> Record:
        return runs[fixed[way.coupled, step_ms]].result()

    def wait() -> Study:
        truth, coarser = record(best, TRUTH_MS), record(best, 2 * TRUTH_MS)
        half, whole = record(plain, LIMIT_MS), record(plain, 2 * LIMIT_MS)
        limit = 2 * place(half)[::2] - place(whole)
        with UnpackedFmu(system.component("linkage").fmu) as fmu, Linkage(fmu, "true") as linkage:

            def errors(way: Way, step: float, record: Record) -> Errors:
                exact = true_place(linkage, record)
                true = np.interp(record.time, truth.time, place(truth))
                off, own, rest = abs(place(record) - true), abs(place(record) - exact), abs(exact - true)
                figures = [f(e) for e in (off, own, rest) for f in (np.max, lambda e: np.sqrt(np.mean(e**2)))]
                return Errors(way, step, record.steps_done, *map(float, figures), float(abs(record.imbalance).max()))

            def of(ways: Sequence[Way]) -> tuple[Errors, ...]:
                return tuple(errors(way, step * 1e-3, record(way, step)) for way in ways for step in STEPS_MS)

            found, uncontrolled = [], ""
            for run in controlled.values():
                try:
                    kept = runs[run].result()
                except NoRollback as why:
                    uncontrolled = str(why)
                    break
                found.append(errors(run.way, stop / kept.steps_done, kept))
            return Study(
                of(masters),
                tuple(found),
                of(linkage_ways),
                float(abs(place(coarser) - place(truth)[::2]).max()),
                float(abs(limit - np.interp(whole.time, truth.time, place(truth))).max()),
                float(truth["drivetrain.energy.tractor"][-1]),
                stop,
                uncontrolled,
            )

    return wait


def place(record: Record) -> np.ndarray:
    """The tip over ground as the linkage gave it, x + iy."""
    return record["linkage.ground.x"] + 1j * record["linkage.ground.y"]


def true_place(linkage: Linkage, record: Record) -> np.ndarray:
    """The tip over ground for the crank angle and the way that the drivetrain reached, x + iy."""
    phi = record["drivetrain.crank.phi"]
    tip = linkage.exact(Motion(phi, np.zeros_like(phi), np.zeros_like(phi)))
    return record["drivetrain.machine.s"] + tip[:, 0] + 1j * tip[:, 1]
