"""What a planted row is like, in tables and sentences: on the screen, in field_row.md and its CSV files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from transplanter_linkage.measures import MEASURES

from scenarios.common import reports
from scenarios.field_row import mass_report
from scenarios.field_row import study as row_study
from scenarios.field_row.mass_study import MassStudy
from scenarios.field_row.partners.build import OUTPUT as OUR_PARTNERS
from scenarios.field_row.partners.build import PARTNERS
from scenarios.field_row.run import CONTROLLED, EMPTY, MISSED, PLANTED, WATCHED, Record, Row
from scenarios.field_row.study import MASTERS as MASTER_WAYS
from scenarios.field_row.study import Study
from scenarios.field_row.system import System

FACTOR = 10  # the linkage's own error is to be so many times below the rest's
QUALITY = ("", "value", "remark")
SIZING = ("", "peak, either way", "least", "greatest", "rms over the run")
COMPARABLE = ("hole", "swept", "ground_speed")  # of the measures, what a hole has as well, and the sweep
BALANCE = ("energy of the row", "J", "share")


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
    level: dict[str, float] | None = None  # the linkage's measures, see level.py


def ours(results: Results, name: str) -> bool:
    """Whether a component is the partner of this project."""
    return is_ours(results.row.system, name)


def is_ours(system: System, name: str) -> bool:
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
    if results.level is not None:
        lines.append(("the same on level ground", _told(results.level), "at a steady speed: a design's own figures"))
    return lines


def _told(level: Mapping[str, float]) -> str:
    """The figures that compare with those of reports on designs."""
    shown = ((name, MEASURES[name].shown(level[name]), MEASURES[name].unit) for name in COMPARABLE)
    return ", ".join(f"{name.replace('_', ' ')} {value:.2f} {unit}" for name, value, unit in shown)


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
        mass_report.show(console, results.masses)
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
    if results.masses:
        parts += mass_report.section(results.masses)
    parts += [
        "## Files",
        "",
        "`plants.csv`: a line a hole; `signals.csv`: every step, each signal in the SI unit of its heading"
        + ("; `errors.csv`: the errors, in SI units." if results.study else "."),
        "",
    ]
    (output / "field_row.md").write_text("\n".join(parts), encoding="utf-8")
    return written
