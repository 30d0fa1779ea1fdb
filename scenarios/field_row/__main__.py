"""A field row: drivetrain, seedling conveyor, linkage and soil planted together.

    python -m scenarios.field_row

runs the system of scenarios/field_row/row.toml, 50 plants by default, draws the row, judges its
quality, balances its energy, and measures the error against the communication step. Another FMU
takes a partner's place by --system, with a copy of that file.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import multiprocessing
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from tqdm import tqdm
from transplanter_linkage.measures import GEOMETRY

from scenarios.common import command, reports, units
from scenarios.common.command import ROOT
from scenarios.common.instance import FmuError
from scenarios.common.masses import plausible
from scenarios.common.variants import PHASE, PREFIX, VariantError, read_ssv, unit_of
from scenarios.field_row import mass_study
from scenarios.field_row import run as row_run
from scenarios.field_row import study as row_study
from scenarios.field_row.component import SystemFault, Value
from scenarios.field_row.mass_study import HANDS, MassStudy
from scenarios.field_row.partners.build import OUTPUT as OUR_PARTNERS
from scenarios.field_row.partners.build import PARTNERS, PartnerError
from scenarios.field_row.partners.build import build as build_partners
from scenarios.field_row.run import CONTROLLED, EMPTY, MASTERS, MISSED, PLANTED, WATCHED, Record, Row
from scenarios.field_row.study import MASTERS as MASTER_WAYS
from scenarios.field_row.study import Study
from scenarios.field_row.system import ROW, System, load_system

OUTPUT = ROOT / "build" / "reports" / "field_row"
LINKAGE = "linkage"  # the component to which a design belongs
PLANTS = 50
STEP_MS = 2.0
MASTER = "extrapolated"
FACTOR = 10  # the linkage's own error is to be so many times below the rest's


@dataclass(frozen=True)
class Results:
    """What a run found; where ``study`` is None, ``no_study`` says why."""

    system_file: Path
    row: Row
    record: Record
    master: str
    step_ms: float
    study: Study | None
    no_study: str
    masses: MassStudy | None = None


def main(arguments: Sequence[str] | None = None, meanwhile: Callable[[], object] = lambda: None) -> int:
    """Command line; returns the exit status. ``meanwhile`` is called while other processes plant."""
    parser = argparse.ArgumentParser(
        prog="python -m scenarios.field_row", description=__doc__.splitlines()[0], formatter_class=command.Help
    )
    parser.add_argument(
        "--system",
        type=Path,
        default=ROW,
        metavar="FILE",
        help="FMUs, connections and parameters (default: %(default)s)",
    )
    parser.add_argument(
        "--plants", type=command.plants(10_000), default=PLANTS, help="plants in the row (default: %(default)s)"
    )
    parser.add_argument(
        "--master",
        choices=[*MASTERS, CONTROLLED],
        default=MASTER,
        metavar="NAME",
        help=f"of {', '.join([*MASTERS, CONTROLLED])} (default: %(default)s)",
    )
    parser.add_argument(
        "--step",
        type=command.between(0.1, 20, "a step", "ms"),
        default=STEP_MS,
        metavar="MS",
        help="communication step, 0.1 to 20 ms; the controlled master chooses its own (default: %(default)s)",
    )
    parser.add_argument(
        "--set",
        type=_setting,
        action="append",
        default=[],
        metavar="COMPONENT.VARIABLE=VALUE",
        dest="settings",
        help="a parameter, for instance soil.ridge.wave=0, geometry.L1=55mm (of the linkage) or theta41=180deg; SI "
        "units where none is given; may be repeated",
    )
    parser.add_argument(
        "--ssv", type=_design, default={}, metavar="FILE", help="plant with the linkage's geometry in a parameter set"
    )
    parser.add_argument(
        "--masses",
        action="store_true",
        help="give the links the masses of a plausible machine, sections of steel and aluminium, 3.4 kg in all; and "
        "show what they do to torque, speed and coupling",
    )
    parser.add_argument("--no-study", action="store_true", help="leave out the error against the communication step")
    parser.add_argument(
        "--output", type=Path, default=OUTPUT, help="folder for tables and figures (default: %(default)s)"
    )
    options = parser.parse_args(arguments)
    try:
        results, written = run(
            options.system,
            options.output,
            options.plants,
            master=options.master,
            step_ms=options.step,
            settings=options.ssv | dict(options.settings),
            with_masses=options.masses,
            with_study=not options.no_study,
            meanwhile=meanwhile,
        )
    except (SystemFault, FmuError, PartnerError) as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(f"The reports cannot be written to {options.output}: {error}", file=sys.stderr)
        return 1
    show(results)
    print(f"Tables and figures: {reports.shown(options.output)}")
    for path in written:
        print(f"  {path.name}")
    return 0


def _setting(text: str) -> tuple[str, Value]:
    name, _, value = text.partition("=")
    if value in ("true", "false"):
        return name, value == "true"
    if name == PHASE or name.startswith(PREFIX):
        name = f"{LINKAGE}.{name}"
    part, _, own = name.partition(".")
    is_geometry = part == LINKAGE and (own == PHASE or own.removeprefix(PREFIX) in GEOMETRY)
    try:
        if value.lstrip("+-").isdecimal():
            return name, int(value)
        return name, units.si(value, unit_of(own.removeprefix(PREFIX)) if is_geometry else None)
    except units.UnitError as error:
        raise argparse.ArgumentTypeError(
            f"give component.variable=number, with a unit or in SI units, true or false, not {text!r}: {error}"
        ) from None


def _design(text: str) -> dict[str, Value]:
    """A parameter set as settings of the linkage."""
    try:
        return {f"{LINKAGE}.{PREFIX}{name}": value for name, value in read_ssv(Path(text)).changes.items()}
    except VariantError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _told_apart(settings: dict[str, Value], system: System) -> dict[str, Value]:
    """The phase difference of the cranks as phi4, which moves with it."""
    told = dict(settings)
    phase = told.pop(f"{LINKAGE}.{PHASE}", None)
    linkage = system.component(LINKAGE)
    if phase is not None and linkage is not None:
        phi1 = f"{PREFIX}phi1"
        told[f"{LINKAGE}.{PREFIX}phi4"] = float(told.get(f"{LINKAGE}.{phi1}", linkage.start(phi1) or 0.0)) + float(
            phase
        )
    return told


def _is_ours_to_weigh(system: System) -> bool:
    return all(_is_ours(system, name) for name in ("drivetrain", "soil")) and mass_study.offered(system)


def masses_of(system: System, settings: Mapping[str, Value] | None = None) -> dict[str, Value]:
    """The masses of a plausible machine as parameters of the system: those of the geometry that it is given."""
    given = {str(port): value for port, value in system.parameters.items()} | dict(settings or {})
    linkage = system.component(LINKAGE)
    if linkage is None:
        raise SystemFault(f"--masses: the system has no component {LINKAGE!r}.")
    geometry = {
        name: float(given.get(f"{LINKAGE}.{PREFIX}{name}", linkage.start(PREFIX + name) or 0.0)) for name in GEOMETRY
    }
    return {f"{LINKAGE}.{name}": value for name, value in plausible(geometry).items()}


def run(
    system_file: Path,
    output: Path,
    plants: int = PLANTS,
    *,
    master: str = MASTER,
    step_ms: float = STEP_MS,
    settings: dict[str, Value] | None = None,
    with_masses: bool = False,
    with_study: bool = True,
    meanwhile: Callable[[], object] = lambda: None,
) -> tuple[Results, list[Path]]:
    """Plant the row, write the reports into ``output``; returns what came out and the files.

    ``meanwhile`` is called in this process while others plant, before anything is shown.

    Raises SystemFault, FmuError or PartnerError with a line for the user, and OSError where the
    reports cannot be written.
    """
    build_partners()
    system = load_system(system_file)
    told = _told_apart(settings or {}, system)
    system = system.with_parameters((masses_of(system, told) if with_masses else {}) | told)
    row = row_run.row_of(system, plants)
    output.mkdir(parents=True, exist_ok=True)
    missing = row_study.missing(system)
    no_study = "" if with_study else "as asked by --no-study"
    if missing and not no_study:
        no_study = f"it needs {', '.join(missing)}, which the FMUs of this system do not offer"
    if with_masses and not no_study and _is_ours_to_weigh(system) and not importlib.util.find_spec("scipy"):
        raise SystemFault(
            "--masses: the study of what masses do needs scipy, which `make .venv/ready-test` installs; --no-study "
            "leaves it out."
        )
    study = of_masses = None
    if no_study:
        meanwhile()
        with _bar(row.stop, "planting") as bar:
            record = row_run.run(row.system, master, step_ms * 1e-3, row.stop, bar.update)
        drawn = _figures().draw_record(output, record, row.spacing)
    else:
        # Fresh processes: a PythonFMU does not outlive a fork, nor does it let its Python run in two threads.
        with ProcessPoolExecutor(_processors(), multiprocessing.get_context("spawn")) as pool:
            runs = [pool.submit(row_run.run, row.system, master, step_ms * 1e-3, row.stop)]
            try:
                is_weighed = with_masses and _is_ours_to_weigh(system)
                weighed = (
                    mass_study.measure(system, masses_of(system, told), pool, runs.append)
                    if is_weighed
                    else lambda: None
                )
                studied = row_study.measure(system, pool, runs.append)
                meanwhile()
                with _bar(len(runs), "runs") as bar:
                    for run in runs:
                        run.add_done_callback(lambda _: bar.update())
                    record = runs[0].result()
                    drawn = _figures().draw_record(output, record, row.spacing)
                    study, of_masses = studied(), weighed()
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
    results = Results(system_file, row, record, master, step_ms, study, no_study, of_masses)
    drawn += _figures().draw_studies(output, study, of_masses)
    return results, sorted(write_tables(output, results) + drawn)


def _figures() -> ModuleType:
    """Imported here: each process of the study imports this file, and none of them draws."""
    from scenarios.field_row import figures

    return figures


def _processors() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _bar(total: float, what: str) -> tqdm:
    """On a terminal only, and only once the run proves not to be instant."""
    form = "{l_bar}{bar}| {n:.0f}/{total:.0f} [{elapsed}<{remaining}]"
    return tqdm(total=total, desc=what, leave=False, disable=None, delay=1.0, bar_format=form)


# --- what the row is like -------------------------------------------------------------------------


def ours(results: Results, name: str) -> bool:
    """Whether a component is the partner of this project."""
    return _is_ours(results.row.system, name)


def _is_ours(system: System, name: str) -> bool:
    component = system.component(name)
    return component is not None and component.fmu in {OUR_PARTNERS / f"{partner}.fmu" for partner in PARTNERS}


def quality(results: Results) -> list[tuple[str, str, str]]:
    """Measure, value and remark of each line of the table of planting quality."""
    record, row = results.record, results.row
    if not record.offers("soil.hole.count"):
        return [("holes", "not recorded", "nothing in this system offers soil.hole.count")]
    holes, spacing = record.holes, row.spacing
    if not holes:
        return [("holes", "0", "the tip never went into the soil and out again")]
    fates = [hole.seedling for hole in holes]
    apart = np.diff([hole.plant_x for hole in holes])
    standing = np.diff([hole.plant_x for hole in holes if hole.seedling == PLANTED])
    asked = f"asked for: {row.plants}" if row.plants else f"in {row.stop:g} s: the drivetrain is not told when to stop"
    lines = [("holes", str(len(holes)), asked)]
    if record.offers("soil.plant.in_hole"):
        planted = fates.count(PLANTED)
        lines.append(("planted", f"{planted}", f"{100 * planted / len(holes):.0f} % of the holes"))
    if record.offers("conveyor.cups.empty"):
        lines.append(("cups left empty", f"{fates.count(EMPTY)}", "by the operator"))
    if record.offers("conveyor.seedlings.missed"):
        lines.append(("seedlings missed", f"{fates.count(MISSED)}", "fell beside the nozzle's mouth"))
    if len(apart) and np.isfinite(apart).all():
        slip = "our drivetrain's wheel is taken not to slip" if ours(results, "drivetrain") else ""
        variation = f"{100 * apart.std() / apart.mean():.3f} %"
        lines += [
            (
                "spacing of the holes, mean",
                f"{1e3 * apart.mean():.2f} mm",
                f"set: {1e3 * spacing:g} mm" if spacing else "the drivetrain is not told a spacing",
            ),
            ("spacing of the holes, coefficient of variation", variation, slip),
        ]
    if len(standing) and np.isfinite(standing).all():
        between = spacing or float(np.median(apart))
        lines.append(
            (
                "distance from plant to plant, longest",
                f"{1e3 * standing.max():.0f} mm",
                f"{np.count_nonzero(standing > 1.5 * between)} gaps longer than 1.5 spacings",
            )
        )
    more = (
        ("depth", "depth", 1e3, 1, "mm", "lowest point below the ridge; mean (least to most)"),
        ("hole at the surface", "length", 1e3, 1, "mm", "entry to exit"),
        ("speed over ground at depth", "speed", 1e3, 0, "mm/s", "0 would be ideal"),
        (
            "lean of the seedling",
            "lean",
            180 / math.pi,
            2,
            "deg",
            "forward, out of the vertical, where the nozzle opens",
        ),
    )
    for label, name, scale, digits, unit, remark in more:
        values = scale * np.array([getattr(hole, name) for hole in holes])
        if np.isfinite(values).all():
            text = f"{values.mean():.{digits}f} ({values.min():.{digits}f} to {values.max():.{digits}f}) {unit}"
            lines.append((label, text, remark))
    return lines


def sizing(results: Results) -> list[tuple[str, ...]]:
    """Lines under SIZING: what the drive and the tractor must be made for; those that are offered."""
    record = results.record
    quantities = (
        ("torque of the linkage on the crank", ("linkage.crank.tau",), "N·m"),
        ("its power: torque times the crank's speed", ("linkage.crank.tau", "drivetrain.crank.w"), "W"),
        ("torque in the shaft", ("drivetrain.shaft.tau",), "N·m"),
        ("force of the linkage on the machine, forward", ("linkage.machine.fx",), "N"),
        ("... upward", ("linkage.machine.fy",), "N"),
        ("pull of the tractor", ("drivetrain.machine.pull",), "N"),
        ("its power: pull times the machine's speed", ("drivetrain.machine.pull", "drivetrain.machine.v"), "W"),
    )
    lines = []
    for label, names, unit in quantities:
        if record.offers(*names):
            signal = np.prod([record[name] for name in names], axis=0)
            ends = (abs(signal).max(), signal.min(), signal.max(), record.rms(signal))
            lines.append((label, *(f"{value + 0.0:.3g} {unit}" for value in ends)))
    return lines


ENERGIES = ("drivetrain.energy.tractor", "soil.energy.soil", "drivetrain.energy.shaft", "drivetrain.energy.stored")


def balance(results: Results) -> list[tuple[str, str, str]]:
    """Energy of the whole row: part, J, share of the tractor's work. Empty where one of ENERGIES is not offered."""
    record = results.record
    if not record.offers(*ENERGIES):
        return []
    labels = ("given by the tractor", "taken by the soil", "heat in the shaft", "stored in shaft and crank")
    ends = [(label, float(record[name][-1])) for label, name in zip(labels, ENERGIES, strict=True)]
    if record.has_masses:
        ends += [
            ("stored in the links", float(record.links[-1])),
            ("... at most, and given back in each turn", float(record.links.max())),
        ]
    ends += [
        ("not accounted for: error of the coupling, at the end", float(record.imbalance[-1])),
        ("... and at most", float(abs(record.imbalance).max())),
    ]
    given = float(record[ENERGIES[0]][-1])
    known = math.isfinite(given) and given != 0
    return [
        (label, f"{value + 0.0:.2f}", f"{100 / given * value + 0.0:.2f} %" if known else "") for label, value in ends
    ]


def small(metres: float) -> str:
    """An error in mm, three digits."""
    value = 1e3 * metres
    return f"{float(f'{value:.2g}'):g}" if value < 0.1 else f"{value:.2f}"


def master_table(study: Study) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and lines: worst error of the tip and of the energy by master and step."""
    headings = ("master", "step / ms", "steps", "worst error of the tip / mm", "rms / mm", "energy / % of the work")
    lines = [
        (
            e.way.title,
            f"{1e3 * e.step:.3g}",
            str(e.steps),
            small(e.worst),
            small(e.rms),
            f"{100 * e.imbalance / study.work:.2g}",
        )
        for e in (*study.masters, *study.controlled)
    ]
    return headings, lines


def linkage_table(study: Study) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and lines: what the linkage itself leaves, beside the rest."""
    headings = (
        "connected to the linkage",
        "step / ms",
        "its own error, worst / mm",
        "the rest, worst / mm",
        "rest / own, worst",
        "rest / own, rms",
    )
    return headings, [
        (
            e.way.title,
            f"{1e3 * e.step:g}",
            small(e.own_worst),
            small(e.rest_worst),
            f"{e.rest_worst / e.own_worst:.2g}",
            f"{e.rest_rms / e.own_rms:.2g}",
        )
        for e in study.linkage
    ]


def findings(results: Results) -> list[str]:
    """What the study says, in sentences."""
    study = results.study
    if study is None:
        return []
    best, masters = study.ways[-1], [way for way in study.ways if way in MASTER_WAYS]
    rates = study.of(best.key)
    kept = [1e3 * e.step for e in rates if e.rest_worst >= FACTOR * e.own_worst]
    at_10, held_10, sequential = (
        next(e for e in study.of(key) if math.isclose(e.step, 10e-3)) for key in (best.key, "held", "gauss_seidel")
    )
    orders = "; ".join(
        f"{way.title} {study.order(way.key, 'worst'):.2f} and {study.order(way.key, 'imbalance'):.2f}"
        for way in masters
    )
    times, where = at_10.rest_worst / at_10.own_worst, ""
    if times < FACTOR and ours(results, "drivetrain") and ours(results, "soil"):
        where = (
            " Its worst are where the soil's force sets in and where it turns about at the lowest point, and with it "
            "the crank's acceleration: what changes within a step of 10 ms cannot be told at its begin."
        )
    return [
        (
            f"Orders, fitted up to 5 ms, of the tip and of the energy: {orders}. What a component gives reaches those "
            "that step before it a step late, in Gauss-Seidel too."
        ),
        f"The linkage's own error, with {best.title} connected, is at 10 ms {small(at_10.own_worst)} mm where the rest "
        f"of the system is {small(at_10.rest_worst)} mm off: {times:.1f} times (rms: "
        f"{at_10.rest_rms / at_10.own_rms:.1f} times). It is {FACTOR} times below the rest "
        + (f"up to {max(kept):g} ms." if kept else "at none of these steps.")
        + where,
        (
            f"Where the drivetrain steps first and the linkage gets the angle of the step's end (Gauss-Seidel), its "
            f"own error at 10 ms is {small(sequential.own_worst)} mm, "
            f"{sequential.rest_worst / sequential.own_worst:.0f} times below the rest."
        ),
        f"A linkage that predicts nothing is {small(held_10.own_worst)} mm off at 10 ms.",
        (
            f"The truth was stepped at {row_study.TRUTH_MS:g} ms. At twice that step it moves by "
            f"{small(study.truth_error)} mm, and plain Jacobi steps, taken to the limit, come to within "
            f"{small(study.truth_other)} mm of it."
        ),
        *([f"The controlled master is left out. {study.uncontrolled}"] if study.uncontrolled else []),
    ]


def by_hand(found: MassStudy) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and lines: what a soft drive makes of what it is handed over."""
    steps = [f"{step:g} ms" for step in mass_study.STEPS_MS]
    headings = ("handed over", *(f"error at {step} / mrad" for step in steps), "order")
    lines = []
    for hand in HANDS:
        worst = [found.coupling.worst[hand.key, 1e-3 * step] for step in mass_study.STEPS_MS]
        texts = (f"{1e3 * value:.2g}" if math.isfinite(value) else "diverges" for value in worst)
        order = found.coupling.order(hand.key)
        lines.append((hand.title, *texts, f"{order:.1f}" if math.isfinite(order) else "-"))
    return headings, lines


def borders(found: MassStudy) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and lines: the least inertia of the drive with which its coupling stays bounded."""
    headings = ("handed over", *(f"at {step:g} ms / kg·m²" for step in mass_study.STEPS_MS))
    return headings, [
        (hand.title, *(f"{found.coupling.border[hand.key, 1e-3 * step]:.2g}" for step in mass_study.STEPS_MS))
        for hand in HANDS
        if hand.torque
    ]


WITH_MASSES = ("", "without masses", "with masses")


def with_masses_beside(found: MassStudy) -> list[tuple[str, str, str]]:
    """Lines under WITH_MASSES: a row of few plants on even ground speed, in its middle turn and as a whole."""
    records = found.without, found.heavy

    def ends(name: str, unit: str, scale: float = 1.0) -> tuple[str, str]:
        texts = (f"{scale * r[name].min() + 0.0:.3g} to {scale * r[name].max() + 0.0:.3g} {unit}" for r in records)
        return tuple(texts)

    uneven = []
    for record in records:
        w = mass_study.middle_turn(record)[1]
        uneven.append(f"{100 * np.ptp(w) / w.mean():.2g} %")
    off = (f"{100 * abs(r.imbalance).max() / r['drivetrain.energy.tractor'][-1]:.2g} %" for r in records)
    return [
        ("torque of the linkage on the crank", *ends("linkage.crank.tau", "N·m")),
        ("torque in the shaft", *ends("drivetrain.shaft.tau", "N·m")),
        ("force of the linkage on the machine, forward", *ends("linkage.machine.fx", "N")),
        ("... upward", *ends("linkage.machine.fy", "N")),
        ("pull of the tractor", *ends("drivetrain.machine.pull", "N")),
        ("crank's speed in a turn, greatest less least, of its mean", *uneven),
        ("energy swinging in the links", "none", f"{np.ptp(found.heavy.links):.3g} J"),
        ("energy not accounted for, of the tractor's work", *off),
    ]


def findings_of_masses(found: MassStudy) -> list[str]:
    """What the masses do, in sentences."""
    coupling, shares = found.coupling, found.shares
    mean = coupling.speed[1]
    diverged = [step for (key, step), worst in coupling.worst.items() if key == "torque" and math.isinf(worst)]
    rpm = [60 / math.tau * w for w in coupling.speed]
    return [
        (
            "The masses are assumptions: links of steel and aluminium with sections drawn in "
            f"`scenarios/common/masses.py`, {found.mass:.2f} kg in all."
        ),
        (
            f"In a turn, inertia takes {shares['inertia'].min():.1f} to {shares['inertia'].max():.1f} N·m of the "
            f"crank, weight {shares['weight'].min():.1f} to {shares['weight'].max():.1f}, the soil "
            f"{shares['soil'].min():.1f} to {shares['soil'].max():.1f}; all together "
            f"{sum(shares.values()).min():.1f} to {sum(shares.values()).max():.1f}."
        ),
        (
            f"A drive of {mass_study.LIGHT:g} kg·m² that gives way by {mass_study.SLOPE:g} N·m per rad/s runs between "
            f"{rpm[0]:.0f} and {rpm[2]:.0f} turns a minute "
            f"({100 * (coupling.speed[2] - coupling.speed[0]) / mean:.0f} % of its mean) with these links, without "
            "any soil."
        ),
        (
            "Given `crank.inertia` and `crank.tau_bias` it keeps order "
            f"{coupling.order('inertia'):.1f}. Given `crank.tau`, which contains the acceleration of the last step, it "
            + (f"diverges at {', '.join(f'{1e3 * step:g}' for step in diverged)} ms. " if diverged else "stays. ")
            + "Its last acceleration comes back in each step times up to crank.inertia / J, here "
            f"{coupling.largest / mass_study.LIGHT:.1f}, and more where it goes on as a straight line: shorter steps "
            "do not help, only a drive heavier than the linkage, whose greatest inertia is "
            f"{coupling.largest:.3f} kg·m²."
        ),
    ]


# --- reports --------------------------------------------------------------------------------------

QUALITY = ("", "value", "remark")
SIZING = ("", "peak, either way", "least", "greatest", "rms over the run")
BALANCE = ("energy of the row", "J", "share")


def left_out(results: Results) -> list[str]:
    """What the reports do not show, and why."""
    said, system = [], results.row.system
    if results.record.not_offered:
        said.append(f"Not offered by the FMUs, and left out: {system.names(results.record.not_offered)}.")
    if not results.record.offers(*ENERGIES):
        lacking = [name for name in ENERGIES if not results.record.offers(name)]
        said.append(f"The balance of energy and energy.png are left out: they need {', '.join(lacking)}.")
    if results.no_study:
        said.append(f"The error against the communication step is left out: {results.no_study}.")
    return said


def show(results: Results) -> None:
    """Print quality, sizing, balance and what the study says."""
    console = reports.console()
    for headings, lines in ((QUALITY, quality(results)), (SIZING, sizing(results)), (BALANCE, balance(results))):
        if lines:
            reports.show_table(console, "", headings, lines, words=("remark",))
    for sentence in findings(results):
        console.print(f"- {sentence}")
    if results.masses:
        reports.show_table(console, "What masses do", WITH_MASSES, with_masses_beside(results.masses))
        reports.show_table(console, "A soft, light drive: error of its angle", *by_hand(results.masses))
        reports.show_table(console, "Inertia below which it diverges", *borders(results.masses))
        for sentence in findings_of_masses(results.masses):
            console.print(f"- {sentence}", markup=False)
    for sentence in left_out(results):
        console.print(sentence)


def about(results: Results) -> str:
    """What was run: the time, the steps, whose FMUs."""
    row, record = results.row, results.record
    master = "chosen by the master" if results.master == CONTROLLED else f"of {results.step_ms:g} ms"
    planted = [f"{row.plants} plants"] if row.plants else []
    planted += [f"at {1e3 * row.spacing:g} mm"] if row.spacing else []
    names = [c.name for c in row.system.components if ours(results, c.name)]
    said = [
        (
            f"{' '.join(planted)}{', ' if planted else ''}{row.stop:.1f} s of machine time in {len(record.time) - 1} "
            f"steps {master}, master `{results.master}`, as `{results.system_file.name}` connects the FMUs."
        )
    ]
    if names:
        said.append(
            f"Of this project are the PythonFMU slaves {', '.join(names)}: `scenarios/field_row/partners/`, where each "
            "formula has its source."
        )
    others = [
        f"{c.name} (`{c.fmu.name}`)" for c in row.system.components if c.name not in names and c.name != "linkage"
    ]
    return " ".join([*said, *([f"Others: {', '.join(others)}."] if others else [])])


def write_tables(output: Path, results: Results) -> list[Path]:
    """Write field_row.md, plants.csv, signals.csv and, with a study, errors.csv; returns their paths."""
    record = results.record
    headings = (
        "hole",
        "seedling",
        "entry / m",
        "exit / m",
        "length / m",
        "depth / m",
        "speed at depth / (m/s)",
        "plant at / m",
        "lean / rad",
    )
    reports.write_csv(
        output / "plants.csv",
        headings,
        (
            (k, h.seedling, *(f"{v:.6f}" for v in (h.entry, h.exit, h.length, h.depth, h.speed, h.plant_x, h.lean)))
            for k, h in enumerate(record.holes, start=1)
        ),
    )
    names = [name for name in record.columns if name not in record.not_offered]
    reports.write_csv(
        output / "signals.csv",
        ("time / s", *(f"{name} / {WATCHED[name]}" for name in names)),
        ([f"{v + 0.0:.9g}" for v in sample] for sample in zip(record.time, *(record[n] for n in names), strict=True)),
    )
    parts = [
        "# A field row",
        "",
        about(results),
        "",
        *(f"{sentence}\n" for sentence in left_out(results)),
        "![The row from the side](row.png)",
        "",
        "## Planting quality",
        "",
        reports.markdown_table(QUALITY, quality(results)),
        "## What the drive is to be made for",
        "",
        reports.markdown_table(SIZING, sizing(results)),
        "Of the whole run, starting and stopping included; rms is the root of the mean over time of the square.",
        "",
    ]
    if lines := balance(results):
        parts += ["## Energy", "", reports.markdown_table(BALANCE, lines), "![Energy](energy.png)", ""]
    if ours(results, "drivetrain") and ours(results, "soil"):
        parts += [
            (
                "The tractor pulls against the ground wheel, which turns the crank, and against the soil's drag on the "
                "nozzle; the soil takes −F·v of the tip over ground."
            ),
            "",
        ]
    parts += ["## A turn of the crank", "", "![A turn](turn.png)", ""]
    written = [output / name for name in ("field_row.md", "plants.csv", "signals.csv")]
    if results.study:
        study = results.study
        parts += [
            "## Error against communication step",
            "",
            f"A row of {row_study.PLANTS} plants, {study.seconds:.1f} s.",
            "",
            *(f"- {sentence}" for sentence in findings(results)),
            "",
            "![Errors](errors.png)",
            "",
            reports.markdown_table(*master_table(study)),
            (
                "The controlled master does each step once whole and once in halves; all are counted here, and those "
                "taken back. Its tolerance is a multiple of `step_control` in the system's file."
            ),
            "",
            "The linkage coupled in several ways, master `jacobi`:",
            "",
            reports.markdown_table(*linkage_table(study)),
        ]
        reports.write_csv(
            output / "errors.csv",
            (
                "way",
                "step_s",
                "steps",
                "worst_m",
                "rms_m",
                "own_worst_m",
                "own_rms_m",
                "rest_worst_m",
                "rest_rms_m",
                "imbalance_J",
            ),
            (
                (
                    e.way.key,
                    e.step,
                    e.steps,
                    e.worst,
                    e.rms,
                    e.own_worst,
                    e.own_rms,
                    e.rest_worst,
                    e.rest_rms,
                    e.imbalance,
                )
                for e in (*study.masters, *study.controlled, *study.linkage)
            ),
        )
        written.append(output / "errors.csv")
    if found := results.masses:
        parts += [
            "## Masses",
            "",
            (
                f"A row of {mass_study.PLANTS} plants without and with masses, on even ground speed, in steps of "
                f"{1e3 * mass_study.STEP:g} ms."
            ),
            "",
            *(f"- {sentence}" for sentence in findings_of_masses(found)),
            "",
            reports.markdown_table(WITH_MASSES, with_masses_beside(found)),
            "![Torque in its shares](masses.png)",
            "",
            "### What the drive is handed over",
            "",
            "The worst error of the crank's angle, against the one differential equation of drive and linkage:",
            "",
            reports.markdown_table(*by_hand(found)),
            (
                "The least inertia of the drive with which the coupling stays bounded for a turn, sought by "
                f"{mass_study.HALVINGS} halvings from {mass_study.LIGHTEST:g} to {mass_study.HEAVIEST:g} kg·m²:"
            ),
            "",
            reports.markdown_table(*borders(found)),
            "![Error over step, and border of stability](drive.png)",
            "",
        ]
    parts += [
        "## Files",
        "",
        "`plants.csv`: a line a hole; `signals.csv`: every step, each signal in the SI unit of its heading"
        + ("; `errors.csv`: the errors, in SI units." if results.study else "."),
        "",
    ]
    (output / "field_row.md").write_text("\n".join(parts), encoding="utf-8")
    return written


if __name__ == "__main__":
    sys.exit(main())
