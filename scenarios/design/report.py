"""What a study gives its reader: tables on the screen, report.md, design.json, and parameter sets."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from transplanter_linkage.measures import MEASURES, TORQUE, Operation, Turn

from scenarios.common import reports, units
from scenarios.common.beside import label, number
from scenarios.common.variants import PHASE, PREFIX, explored, unit_of, write_ssv
from scenarios.design.problem import DENSE, Outcome, Problem
from scenarios.design.search import Result, hypervolume
from scenarios.design.study import COUNTERWEIGHT
from scenarios.design.tolerances import Spread

MODEL = (
    "No such model knows whether links collide, how the seedling is let go, or how much room there is to build: "
    "that is the designer's to check."
)
VOLUMES = ("method", "least", "median", "of each seed", "whole turns")
REDUNDANT = {"L8", "L9", "theta8", "theta9"}


@dataclass
class Findings:
    """A study's result, measured anew in every way that is reported."""

    problem: Problem  # whose best design this is: of a front, with the bound of the point that is reported
    result: Result
    best: Outcome
    published: Turn
    turn: Turn
    geometry: dict[str, float]
    dense: dict[str, float]
    again: float = math.nan  # worst relative difference of the measures, re-measured from the parameter set
    again_fmu: str = ""
    spreads: list[Spread] = field(default_factory=list)
    refused: int = 0
    fronts: list[Result] = field(default_factory=list)  # of each seed, the study's own first
    rivals: dict[str, list[np.ndarray]] = field(default_factory=dict)
    rival_turns: int = 0

    @property
    def study(self):
        return self.problem.study


def figures_table(found: Findings) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Figure by figure, beside the published design."""
    rows = []
    before, after = found.published.measure(), found.turn.measure()
    for name in MEASURES:
        if name in TORQUE and math.isnan(after[name]):
            continue
        change = round(after[name] - before[name], 9) + 0.0
        said = (
            "" if math.isnan(change) else f"{MEASURES[name].shown(change):+.{3 if MEASURES[name].unit == '1' else 2}f}"
        )
        rows.append((label(name), number(name, before[name]), number(name, after[name]), said))
    return ("figure", "published", "this design", "change"), rows


def parameters_table(found: Findings) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The parameters that the study may change; and where in their ranges they ended."""
    nominal, rows = found.problem.source.nominal, []
    for each in found.study.ranges:
        value = found.best.design.x[each.name]
        unit = "m" if each.name == "spacing" else unit_of(each.name)
        start = {"spacing": found.published.operation.spacing, PHASE: nominal["phi4"] - nominal["phi1"]}
        before = {**dict.fromkeys(COUNTERWEIGHT, 0.0), **found.study.masses, **nominal, **start}.get(each.name, 0.0)
        shown = units.SHOWN.get(unit, unit)
        scale = 1 / units.UNITS[shown][1]
        share = (value - each.low) / (each.high - each.low)
        where = "at its least" if share < 1e-6 else "at its greatest" if share > 1 - 1e-6 else ""
        rows.append(
            (
                f"{each.name} / {shown}",
                f"{before * scale:.3f}",
                f"{value * scale:.3f}",
                f"{(value - before) * scale:+.3f}",
                f"{each.low * scale:.2f} to {each.high * scale:.2f}",
                where,
            )
        )
    return ("parameter", "published", "this design", "change", "range", "ended"), rows


def limits_table(found: Findings) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """What keeps the design from being better, and what a unit more would bring: most first."""
    problem = found.problem
    by_limit, by_end, _ = problem.multipliers(found.best.design)
    objective = MEASURES[found.study.objectives[0].measure]
    rows = []
    for k, gain in by_limit.items():
        constraint = found.study.constraints[problem.limits[k].constraint]
        measure = MEASURES[constraint.measures[0]]
        step = 0.01 if measure.unit == "1" else 1.0
        rows.append(
            (constraint.text, "0.01" if measure.unit == "1" else f"1 {measure.unit}", gain * step / measure.scale)
        )
    for name, gain in by_end.items():
        unit = "m" if name == "spacing" else unit_of(name)
        unit = units.SHOWN.get(unit, unit)
        z = problem.z_of(found.best.design)[problem.names.index(name)]
        rows.append((f"{name} at its {'greatest' if z > 0 else 'least'}", f"1 {unit}", gain * units.UNITS[unit][1]))
    rows.sort(key=lambda row: -row[2])
    return (
        ("what limits it", "for", f"{found.study.objectives[0].measure} would gain / {objective.unit}"),
        [(text, step, f"{objective.shown(gain):.3f}") for text, step, gain in rows if objective.shown(gain) > 5e-4],
    )


def tolerance_table(found: Findings) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Standard deviations, and which dimensions matter most."""
    rows = []
    for each in found.spreads:
        most = sorted(each.share.items(), key=lambda item: -item[1])[:3]
        digits = 5 if MEASURES[each.measure].unit == "1" else 3
        rows.append(
            (
                label(each.measure),
                f"{MEASURES[each.measure].shown(each.by_gradient):.{digits}f}",
                f"{MEASURES[each.measure].shown(each.by_samples):.{digits}f}",
                f"{each.off:+.1%}",
                ", ".join(f"{name} {share:.0%}" for name, share in most),
            )
        )
    return ("figure", "by gradient", "by samples", "apart", "most of it from"), rows


def starts_table(found: Findings) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Where each random start led."""
    name = found.study.objectives[0].measure if not found.result.front else next(iter(found.result.starts[0].values))
    rows = [
        (
            str(k),
            number(name, each.values[name]),
            "kept" if each.is_feasible else f"missed by {each.beyond:.2g} of their size",
            str(each.turns),
        )
        for k, each in enumerate(found.result.starts, start=1)
    ]
    return ("start", label(name), "constraints", "whole turns"), rows


def front_table(found: Findings, names: list[str]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """A row a point."""
    rows = [
        (str(k), *(number(name, each.values[name]) for name in names), "reported" if each is found.best else "")
        for k, each in enumerate(found.result.front, start=1)
    ]
    return ("point", *map(label, names), ""), rows


def volumes(found: Findings, names: list[str], reference: tuple[float, ...]) -> list[tuple[str, ...]]:
    """Under VOLUMES: what the fronts of each method enclose in shown units, over its seeds."""
    scale = np.array([MEASURES[name].scale for name in names])
    far = tuple(scale * reference)

    def row(method: str, fronts: Iterable[np.ndarray], turns: str) -> tuple[str, ...]:
        each = [hypervolume(points * scale, far) for points in fronts]
        return (method, f"{min(each):.0f}", f"{np.median(each):.0f}", ", ".join(f"{v:.0f}" for v in each), turns)

    mine = [np.array([[each.values[name] for name in names] for each in result.front]) for result in found.fronts]
    turns = ", ".join(str(result.turns) for result in found.fronts)
    return [
        row("gradients, epsilon-constraint", mine, turns),
        *(row(name, runs, f"{found.rival_turns} each") for name, runs in found.rivals.items()),
    ]


def sentences(found: Findings) -> list[str]:
    """What holds of the design that is reported, each checked."""
    said = []
    worst = max([0.0, *found.problem.beyond({name: found.dense[name] for name in found.problem.measures}).values()])
    if found.best.is_feasible:
        kept = "every constraint kept" if worst <= 1e-5 else f"a constraint missed by {worst:.1e} of its size"
        said.append(f"On a grid of {DENSE} angles: {kept}.")
    else:
        said.append("No design was found that keeps every constraint. The one that misses them the least:")
        said += [f"{each}." for each in found.problem.missed(found.best.values)]
    if not math.isnan(found.again):
        said.append(f"Measured again from the parameter set in {found.again_fmu}: the same to {found.again:.0e}.")
    fit = sum(each.is_feasible for each in found.result.starts)
    said.append(
        f"{fit} of {len(found.result.starts)} random starts kept every constraint; {found.result.turns} whole turns "
        "with their gradients in all."
    )
    if {each.name for each in found.study.ranges} >= REDUNDANT:
        said.append("L8, L9, theta8 and theta9 are four numbers for three: designs along a curve are the same.")
    if found.spreads:
        worst_off = max(abs(each.off) for each in found.spreads)
        said.append(
            f"Tolerances by gradient and by {found.study.samples} samples agree within {worst_off:.1%}"
            + (f"; the FMU refused {found.refused} samples." if found.refused else ".")
        )
    return [*said, MODEL]


def fragment(nominal: Mapping[str, float], geometry: Mapping[str, float], operation: Operation) -> str:
    """What differs from the published design, and how it is used, as behind the explorer's #: in SI units."""
    values = {PREFIX + name: value for name, value in geometry.items() if value != nominal[name]}
    values |= explored(operation)
    return "&".join(f"{name}={value!r}" for name, value in values.items())


def write(output: Path, found: Findings, pictures: list[str], names: list[str], by: tuple[float, ...]) -> list[Path]:
    """report.md, design.json, design.ssv, and of a front front.csv and a parameter set each; returns the paths."""
    study, nominal = found.study, found.problem.source.nominal
    operation = found.turn.operation
    parts = [
        f"# {study.title}",
        "",
        f"{study.question}",
        "",
        (
            f"Written by `python -m scenarios.design {study.name}`. Plant spacing {operation.spacing * 1e3:.1f} mm, "
            f"{operation.w * 30 / math.pi:g} turns a minute, the ridge's surface {operation.depth * 1e3:.1f} mm above "
            "the tip's lowest point; signs and frames as the FMU's: x forward, y up."
        ),
        "",
        *(f"- {sentence}" for sentence in sentences(found)),
        "",
    ]
    if names:
        parts += [
            "## The front", "", "![The front](front.png)", "", reports.markdown_table(*front_table(found, names)),
        ]  # fmt: skip
        if by:
            units_ = " x ".join(MEASURES[name].unit for name in names)
            far = ", ".join(
                f"{MEASURES[name].shown(v):g} {MEASURES[name].unit}" for name, v in zip(names, by, strict=True)
            )
            parts += [f"Hypervolume, up to {far}, in {units_}: greater is better.", ""]
            parts += [reports.markdown_table(VOLUMES, volumes(found, names, by))]
    parts += ["## Figure by figure", "", reports.markdown_table(*figures_table(found))]
    parts += ["![Paths and linkages](designs.png)", "", "## Its parameters", ""]
    parts += [reports.markdown_table(*parameters_table(found)), "## What limits it", ""]
    headings, rows = limits_table(found) if found.best.is_feasible else ((), [])
    parts += [reports.markdown_table(headings, rows)] if rows else ["Nothing but its own best.", ""]
    parts += ["## Where the searches ended", "", reports.markdown_table(*starts_table(found))]
    if found.spreads:
        parts += ["## Tolerances", "", "Standard deviations.", "", reports.markdown_table(*tolerance_table(found))]
    parts += [
        "## Files",
        "",
        (
            "`design.ssv`: the geometry as a parameter set (SSP 1.0) for any FMI host, for "
            "`python -m scenarios.paper_cycle --ssv design.ssv`, and so for the spacing and the row; "
            "`linkage-fmu explore design.ssv` opens it in the explorer, in the operation above; `design.json`: "
            "the same with all figures, in SI units" + ("; `front.csv` and `point_*.ssv`: the front." if names else ".")
        ),
        "",
    ]
    report, as_json, ssv = (output / name for name in ("report.md", "design.json", "design.ssv"))
    report.write_text("\n".join(parts), encoding="utf-8")
    content = {
        "study": study.name,
        "geometry": found.geometry,
        "masses": found.problem.masses(found.best.design),
        "operation": {key: getattr(operation, key) for key in operation.__dataclass_fields__},
        "measures": {key: None if math.isnan(value) else value for key, value in found.turn.measure().items()},
        "published": {key: None if math.isnan(value) else value for key, value in found.published.measure().items()},
        "feasible": found.best.is_feasible,
        "fragment": fragment(nominal, found.geometry, operation),
    }
    as_json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    write_ssv(ssv, study.name, found.geometry, operation, content["masses"])
    written = [report, as_json, ssv, *(output / name for name in pictures)]
    if names:
        written.append(output / "front.csv")
        keys = list(found.best.design.x)
        reports.write_csv(
            written[-1],
            ("point", *names, *keys),
            (
                (k, *(each.values[name] for name in names), *(each.design.x[key] for key in keys))
                for k, each in enumerate(found.result.front, start=1)
            ),
        )
        for k, each in enumerate(found.result.front, start=1):
            written.append(output / f"point_{k:02d}.ssv")
            geometry = each.design.variant("", nominal).geometry(nominal)
            operation, masses = found.problem.operation(each.design), found.problem.masses(each.design)
            write_ssv(written[-1], f"{study.name} {k}", geometry, operation, masses)
    return written
