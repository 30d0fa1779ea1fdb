"""The best design for a question, by the exact gradients of the linkage FMU.

    python -m scenarios.design practical
    python -m scenarios.design my_study.toml

A study names what may change, what is wanted and what must hold; scenarios/design/studies/ has some, of which
practical.toml explains all that may stand in one. The report compares the design with the published one, says what
limits it and what the workshop's tolerances do to it, and has it as a parameter set for any FMI host. A study that was
stopped, however hard, goes on where it was when it is started again.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from tqdm import tqdm
from transplanter_linkage.measures import MEASURES, Operation, Turn

from scenarios.common import beside, command, figures, reports
from scenarios.common.instance import FmuError
from scenarios.common.turn import FmuSource
from scenarios.common.variants import read_ssv
from scenarios.design import figures as drawings
from scenarios.design import report, rivals, search
from scenarios.design.problem import DENSE, Outcome, Problem
from scenarios.design.study import STUDIES, Study, StudyError, load
from scenarios.design.tolerances import spreads

OUTPUT = command.ROOT / "build" / "reports" / "design"
TIMES = 10  # the turns that a rival is given, in those of the gradients
SEEDS = 3  # of a front, where its methods are compared
SAME = 1e-9  # of a value: re-measured from the parameter set


def knee(front: Sequence[Outcome], names: Sequence[str]) -> int:
    """The point farthest from the line between the ends, each objective in its own span."""
    points = np.array([[each.values[name] for name in names] for each in front])
    span = np.ptp(points, axis=0)
    if len(points) < 3 or not span.all():
        return 0
    share = (points - points[0]) / (points[-1] - points[0])
    return int(np.argmax(np.abs(share[:, 0] - share[:, 1])))


def scenario(options: argparse.Namespace, console: Console) -> list[Path]:
    """Run, print and write everything; returns the files."""
    with FmuSource(options.fmu) as source:
        depth = source.published_depth()
        first = Turn(source.set({}), Operation(depth=depth)).measure()
        study = load(options.study, source.nominal, first, depth)
        source.bodies = study.masses
        source.set({})
        operation = study.operation
        published = Turn(source, operation)
        figures_then = published.measure()
        study = load(options.study, source.nominal, figures_then, depth)  # "published" as in the study's operation
        options.output = options.output or OUTPUT / f"{study.name}-{study.number(options.fmu.read_bytes())}"
        store = search.Store(options.output / "jobs")
        total = search.jobs(study) + (study.samples if study.tolerances else 0)
        with tqdm(total=total, desc=study.name, unit="job", leave=False, disable=None) as bar:
            result = search.run(source, study, figures_then, store, bar.update)
            found = findings(source, study, result, published, figures_then)
            if study.tolerances and any(study.tolerances.values()):
                bar.set_description("tolerances")
                found.spreads, found.refused = spreads(
                    source, found.geometry, found.turn.operation, study.tolerances, study.samples, bar.update
                )
        names = [each.measure for each in study.objectives] if result.front else []
        if names:
            repeat(source, study, figures_then, found, options)
        if options.rivals and names:
            compete(source, study, figures_then, found, options.seeds)
        source.set(found.geometry)
        pictures = draw(options.output, found, names)
        written = report.write(options.output, found, pictures, names, study.reference)
        measure_again(options.output / "design.ssv", found)
        written = report.write(options.output, found, pictures, names, study.reference)
    console.print(f"{study.title}. {store.known} jobs from before, {store.done} now.", markup=False)
    show(console, found, names)
    return written


def findings(
    source: FmuSource, study: Study, result: search.Result, published: Turn, figures_then: dict[str, float]
) -> report.Findings:
    """The reported design, measured anew; of a front its knee."""
    best, of = result.best, study
    if result.front:
        names = [each.measure for each in study.objectives]
        best = result.front[knee(result.front, names)]
        of = search.bounded(study, best.values[names[0]])
    elif len(study.objectives) > 1:
        of = search.alone(study, 0)
    problem = Problem(source, of, figures_then)
    dense = problem.turn(best.design, DENSE).measure()
    turn = problem.turn(best.design)
    turn.measure()
    geometry = best.design.variant("", source.nominal).geometry(source.nominal)
    source.bodies = problem.masses(best.design)  # from here on: of the published design all has been measured
    source.set(geometry)
    return report.Findings(problem, result, best, published, turn, geometry, dense)


def repeat(
    source: FmuSource, study: Study, figures_then: dict[str, float], found: report.Findings, options: argparse.Namespace
) -> None:
    """The front from other random starts."""
    found.fronts.append(found.result)
    with tqdm(
        total=(options.seeds - 1) * search.jobs(study), desc="seeds", unit="job", leave=False, disable=None
    ) as bar:
        for seed in range(study.seed + 1, study.seed + options.seeds):
            store = search.Store(options.output / "jobs" / f"seed-{seed}")
            found.fronts.append(search.run(source, replace(study, seed=seed), figures_then, store, bar.update))


def compete(
    source: FmuSource, study: Study, figures_then: dict[str, float], found: report.Findings, seeds: int
) -> None:
    """Give the rivals their turns, a seed each."""
    if not rivals.available():
        raise FmuError("--rivals needs pymoo: make .venv/ready-bench")
    found.rival_turns = TIMES * found.result.turns
    total = found.rival_turns * seeds * len(rivals.METHODS)
    with tqdm(total=total, desc="rivals", unit="turn", leave=False, disable=None) as bar:
        for method in rivals.METHODS:
            runs = (
                rivals.run(Problem(source, study, figures_then), method, found.rival_turns, seed, bar.update)
                for seed in range(study.seed, study.seed + seeds)
            )
            found.rivals[method] = list(runs)


def measure_again(ssv: Path, found: report.Findings) -> None:
    """From the parameter set, in the FMU of the other FMI version."""
    other = command.FMU if found.problem.source.path.resolve() != command.FMU.resolve() else command.FMI3
    if not other.is_file():
        return
    with FmuSource(other) as fresh:
        fresh.bodies = found.problem.masses(found.best.design)
        again = Turn(fresh.set(read_ssv(ssv).changes), found.turn.operation).measure()
    here = found.turn.measure()
    found.again_fmu = f"fresh {other.parent.name}/{other.name}"
    found.again = max(
        abs(again[name] - here[name]) / max(abs(here[name]), SAME) for name in MEASURES if not math.isnan(here[name])
    )


def draw(output: Path, found: report.Findings, names: list[str]) -> list[str]:
    """Write the pictures; returns their names."""
    source = found.problem.source
    both = {"published": found.published, "this design": found.turn}
    geometries = {"published": source.nominal, "this design": found.geometry}
    opened = {name: Turn(beside.Held(source, geometries[name]), turn.operation) for name, turn in both.items()}
    made = {"designs": lambda: beside.designs(opened, geometries)}
    if names:
        points = np.array([[each.values[name] for name in names] for each in found.result.front])
        then = found.published.measure(*names)
        others = {method: runs[0] for method, runs in found.rivals.items()}
        chosen = found.result.front.index(found.best)
        made["front"] = lambda: drawings.front(points, names, others, chosen, [then[name] for name in names])
    return [path.name for path in figures.save_all(output, made)]


def show(console: Console, found: report.Findings, names: list[str]) -> None:
    """What a terminal gets."""
    if names:
        reports.show_table(console, "The front", *report.front_table(found, names), words=("",))
        if found.study.reference:
            units = " x ".join(MEASURES[name].unit for name in names)
            rows = report.volumes(found, names, found.study.reference)
            title = f"Hypervolume / ({units}), greater is better"
            reports.show_table(console, title, report.VOLUMES, rows, words=("whole turns",))
    reports.show_table(console, "Figure by figure", *report.figures_table(found))
    reports.show_table(console, "Its parameters", *report.parameters_table(found), words=("ended",))
    if found.best.is_feasible:
        headings, rows = report.limits_table(found)
        if rows:
            reports.show_table(
                console, "What limits it, and what a little more would bring", headings, rows, words=("for",)
            )
    if found.spreads:
        reports.show_table(
            console, "Tolerances, standard deviations", *report.tolerance_table(found), words=("most of it from",)
        )
    for sentence in report.sentences(found):
        console.print(f"- {sentence}", markup=False)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = command.parser(
        "design",
        __doc__,
        default=None,
        help="folder for report and jobs (default: one for each study in build/reports/design)",
    )
    shipped = ", ".join(sorted(path.stem for path in STUDIES.glob("*.toml")))
    parser.add_argument("study", type=Path, metavar="STUDY", help=f"a file, or one of {shipped}")
    parser.add_argument(
        "--rivals",
        action="store_true",
        help="of a front: hold pymoo's NSGA-II and CMOPSO beside it, with ten times the turns",
    )
    parser.add_argument(
        "--seeds",
        type=command.whole(1, 100),
        metavar="N",
        help=f"of a front: search it with so many seeds, from the study's on (default: 1; with --rivals {SEEDS})",
    )
    parser.set_defaults(fmu=command.FMI3)
    options = parser.parse_args(arguments)
    options.seeds = options.seeds or (SEEDS if options.rivals else 1)
    try:
        return command.run(scenario, options)
    except StudyError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("Stopped. What was done is kept: the same command goes on from there.", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
