"""What the masses of the links do to a row and to its drive.

    shares    torque over one turn of the crank, split into inertia, weight, soil and the machine's acceleration
    evenness  of the crank's speed, with masses and without
    coupling  a soft, light drive that is given crank.inertia and crank.tau_bias, beside one that is given crank.tau:
              error over step, and the least inertia of the drive with which crank.tau stays bounded

The coupled drive is the row's drivetrain with a shaft that does not twist but slips: a torque of SLOPE times what the
crank lags behind the wheel. No soil. The truth is one differential equation, solved to rounding: the drivetrain's own
(partners/drivetrain.py), with inertia and bias asked of the linkage at each of its points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace

import numpy as np

from scenarios.common.instance import UnpackedFmu
from scenarios.common.linkage import Linkage
from scenarios.field_row import run as row_run
from scenarios.field_row.component import SystemFault, Value
from scenarios.field_row.partners.drivetrain import Drivetrain
from scenarios.field_row.run import Record
from scenarios.field_row.system import ROW, System, load_system

PLANTS, STEP = 3, 2e-3  # of the rows with and without masses
STEPS_MS = (1.0, 2.0, 5.0, 10.0)
SLOPE, LIGHT = 5.0, 0.02  # N m per rad/s, kg m2: the soft drive
SHAFT = {"shaft.k": 1e-9, "shaft.c": SLOPE, "disturbance.share": 0.0, "speed.ramp": 0.4}
TURNS = 2.0  # at full speed, after the ramp
LIGHTEST, HEAVIEST = 0.01, 0.5  # kg m2: between which the border is sought
HALVINGS = 4
WILD = 4.0  # times the cruising speed: what a crank never reaches unless the coupling diverges
MASSLESS = {f"linkage.body.{body}.{key}": 0.0 for body in ("OA", "CD", "AB", "DE", "EF", "GF") for key in "mJ"}
SHARES = ("inertia", "weight", "soil", "machine")


@dataclass(frozen=True)
class Hand:
    """What a drive is handed over, and what it makes of it within a step."""

    key: str
    title: str
    torque: bool
    held: bool


HANDS = (
    Hand("inertia", "crank.inertia, crank.tau_bias", torque=False, held=False),
    Hand("inertia_held", "inertia and bias, held in a step", torque=False, held=True),
    Hand("torque", "crank.tau", torque=True, held=False),
    Hand("torque_held", "crank.tau, held in a step", torque=True, held=True),
)


@dataclass(frozen=True)
class Coupling:
    """``worst``: the crank's worst error in rad by hand and step in s, inf where it diverged; ``border``: the least
    inertia of the drive in kg m2 with which the crank's speed stays bounded, of hands that give the torque.

    ``largest``: the greatest crank.inertia; ``speed``: least, mean and greatest of the soft drive's crank in rad/s.
    """

    worst: dict[tuple[str, float], float]
    border: dict[tuple[str, float], float]
    largest: float
    speed: tuple[float, float, float]

    def order(self, key: str) -> float:
        """Fitted slope of log(error) over log(step)."""
        used = [(step, worst) for (hand, step), worst in self.worst.items() if hand == key and math.isfinite(worst)]
        return float(np.polyfit(*np.log(np.array(used).T), 1)[0]) if len(used) > 1 else math.nan


@dataclass(frozen=True)
class MassStudy:
    """Rows of PLANTS plants on even ground speed, the shares of torque over one turn (N m, by SHARES) at crank angles
    in rad, and the coupling; ``mass`` of the links in kg.
    """

    mass: float
    without: Record
    heavy: Record
    phi: np.ndarray
    shares: dict[str, np.ndarray]
    coupling: Coupling


WATCHED = {**row_run.WATCHED, "drivetrain.crank.a": "rad/s2"}


def offered(system: System) -> bool:
    """Whether linkage and drivetrain of a system are such as the study needs."""
    return all(
        system.offers(name)
        for name in ("linkage.body.OA.m", "linkage.crank.tau_bias", "drivetrain.inputs.held", "drivetrain.crank.a")
    )


def soft(system: System, masses: Mapping[str, Value], inertia: float = LIGHT, hand: Hand = HANDS[0]) -> System:
    """The soft drive and the linkage of a system, coupled by a hand."""
    least = load_system(ROW.with_name("drive_only.toml"))
    least = replace(least, components=tuple(system.component(c.name) or c for c in least.components))
    least = least.without("linkage.machine.v").with_parameters(
        {
            **masses,
            **{f"drivetrain.{name}": value for name, value in SHAFT.items()},
            "drivetrain.crank.J": inertia,
            "drivetrain.inputs.held": hand.held,
            "linkage.tip.fy": 0.0,
        }
    )
    if not hand.torque:
        return least
    least = least.without("drivetrain.crank.inertia")
    bias, tau = least.port("drivetrain.crank.tau_bias"), least.port("linkage.crank.tau")
    return replace(least, connections={**least.connections, bias: tau})


def turned(system: System, turns: float) -> tuple[float, float]:
    """Cruising speed of the crank in rad/s, and the time in s of the ramp and so many turns."""
    spacing, cruise = (row_run.start_value(system, f"drivetrain.{name}") for name in ("plant.spacing", "speed.cruise"))
    w = math.tau * cruise / spacing
    return w, math.ceil((SHAFT["speed.ramp"] + turns * math.tau / w) / 0.01) * 0.01


def stepped(system: System, step: float, turns: float) -> Record | None:
    """A run of a soft drive; None where its coupling diverged."""
    cruise, stop = turned(system, turns)
    watched = {name: row_run.WATCHED[name] for name in ("drivetrain.crank.phi", "drivetrain.crank.w")}
    try:
        record = row_run.run(system, "jacobi", step, stop, watched=watched)
    except SystemFault:  # the linkage refuses what is beyond all numbers
        return None
    return record if abs(record["drivetrain.crank.w"]).max() < WILD * cruise else None


def border(system: System, masses: Mapping[str, Value], hand: Hand, step: float) -> float:
    """The least inertia of the drive, kg m2, with which the coupling does not diverge in a turn: by halving."""
    low, high = math.log(LIGHTEST), math.log(HEAVIEST)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        is_bounded = stepped(soft(system, masses, math.exp(middle), hand), step, 1.0) is not None
        low, high = (low, middle) if is_bounded else (middle, high)
    return math.exp(high)


def truth(system: System, masses: Mapping[str, Value], times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle and speed of the soft drive's crank at these times, and nothing of co-simulation in them."""
    from scipy.integrate import solve_ivp  # not among what `make run` installs

    told = soft(system, masses)
    drive = Drivetrain(instance_name="truth")
    for port in (told.port(f"drivetrain.{name}") for name in drive.value if told.offers(f"drivetrain.{name}")):
        if (value := row_run.start_value(told, str(port))) is not None:
            drive.value[port.variable] = type(drive.value[port.variable])(value)
    drive.setup_experiment(0.0)
    drive.exit_initialization_mode()
    own = {port.variable: value for port, value in told.parameters.items() if port.component == "linkage"}
    with UnpackedFmu(told.component("linkage").fmu) as fmu, Linkage(fmu, "true") as linkage:
        linkage.setup().enter().set(own)

        def rates(time: float, y: np.ndarray) -> tuple[float, ...]:
            linkage.set({"crank.phi": y[1], "crank.w": y[2]})
            drive.value["crank.inertia"], drive.value["crank.tau_bias"] = linkage.get("crank.inertia", "crank.tau_bias")
            return drive.equations()(time, *y)[:3]

        begin = [drive.value["crank.phi"], drive.value["crank.phi"], drive.value["crank.w"]]
        found = solve_ivp(rates, (0.0, times[-1]), begin, "DOP853", times, rtol=1e-11, atol=1e-12)
    return found.y[1], found.y[2]


def coupled(system: System, masses: Mapping[str, Value], pool: Executor, begun: Callable) -> Callable[[], Coupling]:
    """Begin all runs; what is returned waits for them."""
    runs: dict[tuple[str, float], Future] = {}
    borders: dict[tuple[str, float], Future] = {}
    for hand in HANDS:
        for step in STEPS_MS:
            job = soft(system, masses, LIGHT, hand), step * 1e-3, TURNS
            begun(runs.setdefault((hand.key, step * 1e-3), pool.submit(stepped, *job)))
        for step in STEPS_MS if hand.torque else ():
            job = system, masses, hand, step * 1e-3
            begun(borders.setdefault((hand.key, step * 1e-3), pool.submit(border, *job)))

    def wait() -> Coupling:
        cruise, stop = turned(system, TURNS)
        finest = STEPS_MS[0] * 1e-3
        times = np.arange(round(stop / finest) + 1) * finest
        phi, w = truth(system, masses, times)
        worst = {}
        for (key, step), run in runs.items():
            record = run.result()
            every = round(step / finest)
            off = math.inf if record is None else abs(record["drivetrain.crank.phi"] - phi[::every]).max()
            worst[key, step] = float(off)
        turn = w[times > stop - math.tau / cruise]
        return Coupling(
            worst,
            {key: run.result() for key, run in borders.items()},
            largest(system, masses),
            (float(turn.min()), float(turn.mean()), float(turn.max())),
        )

    return wait


def largest(system: System, masses: Mapping[str, Value]) -> float:
    """The greatest crank.inertia in a turn, kg m2."""
    own = {name.removeprefix("linkage."): value for name, value in masses.items()}
    with UnpackedFmu(system.component("linkage").fmu) as fmu, Linkage(fmu, "true") as linkage:
        linkage.setup().enter().set(own)
        return max(linkage.set({"crank.phi": phi}).get("crank.inertia")[0] for phi in np.linspace(0, math.tau, 721))


def middle_turn(record: Record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the turn in the middle of a record: angle in rad from its begin, speed in rad/s, and which samples it is."""
    turns = record["drivetrain.crank.phi"] / math.tau
    middle = math.floor(turns.max() / 2)
    part = (turns >= middle) & (turns <= middle + 1)
    return math.tau * (turns[part] - middle), record["drivetrain.crank.w"][part], part


def split(system: System, record: Record) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """The torque of the linkage over the turn in the middle of a record: angles in rad from its begin, and shares.

    Each is asked of the linkage in initialization mode, at the crank's angle, speed and acceleration, one cause alone.
    """
    phi, w, part = middle_turn(record)
    a, fx, fy = (record[name][part] for name in ("drivetrain.crank.a", "soil.tip.fx", "soil.tip.fy"))
    machine = np.gradient(record["drivetrain.machine.v"], record.time)[part]
    own = {port.variable: value for port, value in system.parameters.items() if port.component == "linkage"}
    rows = []
    with UnpackedFmu(system.component("linkage").fmu) as fmu, Linkage(fmu, "true") as linkage:
        linkage.setup().enter().set(own)
        still = {"crank.w": 0.0, "crank.a": 0.0, "tip.fx": 0.0, "tip.fy": 0.0}
        for at in np.column_stack((phi, w, a, fx, fy, machine)).tolist():
            (weight,) = linkage.set(still | {"crank.phi": at[0]}).get("crank.tau")
            (moved,) = linkage.set({"crank.w": at[1], "crank.a": at[2]}).get("crank.tau")
            (loaded,) = linkage.set({"tip.fx": at[3], "tip.fy": at[4]}).get("crank.tau")
            status, (by_acceleration,) = linkage.try_sensitivity(["machine.fx"], {"crank.a": 1.0})
            linkage.demand(status, "d machine.fx / d crank.a")
            rows.append((moved - weight, weight, loaded - moved, -by_acceleration * at[5]))
    return phi, dict(zip(SHARES, np.array(rows).T, strict=True))


def measure(
    system: System, masses: Mapping[str, Value], pool: Executor, begun: Callable[[Future], object] = lambda run: None
) -> Callable[[], MassStudy]:
    """Begin all runs in the processes of a pool; ``begun`` is given each. What is returned waits for them."""
    even = system.with_parameters({"drivetrain.disturbance.share": 0.0})
    rows = [row_run.row_of(even.with_parameters(given), PLANTS) for given in (MASSLESS, masses)]
    records = [pool.submit(row_run.run, row.system, "extrapolated", STEP, row.stop, watched=WATCHED) for row in rows]
    for record in records:
        begun(record)
    coupling = coupled(system, masses, pool, begun)

    def wait() -> MassStudy:
        without, heavy = (record.result() for record in records)
        phi, shares = split(rows[1].system, heavy)
        total = sum(value for name, value in masses.items() if name.endswith(".m"))
        return MassStudy(float(total), without, heavy, phi, shares, coupling())

    return wait
