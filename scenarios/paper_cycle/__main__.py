"""The published planting cycle, from the built FMU alone.

    python -m scenarios.paper_cycle

runs the published parameter set at 65 plants a minute, varies L1, the phase difference,
L4 and L7 as the paper does, redraws its figures 3 to 8, and holds its figures and sentences
against what comes out (Chen Jianneng et al. 2010, DOI 10.3969/j.issn.1000-1298.2010.12.010).

    python -m scenarios.paper_cycle --set geometry.L1=55mm --set theta41=180deg
    python -m scenarios.paper_cycle --ssv design.ssv

show designs of your own beside the published one instead.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from tqdm import tqdm
from transplanter_linkage.measures import Operation

from scenarios.common import beside, command, measures, reports, variants
from scenarios.common.command import FMU, ROOT, Help
from scenarios.common.instance import FmuError, Refused
from scenarios.common.linkage import LinkageFmu, Turns
from scenarios.common.turn import FmuSource
from scenarios.paper_cycle import comparison, families, figures, published
from scenarios.paper_cycle.families import FAMILIES, FamilyRun
from scenarios.paper_cycle.published import Results

OUTPUT = ROOT / "build" / "reports" / "paper_cycle"

STEP_DEG = 0.05  # of the nominal turn
FAMILY_STEP_DEG = 0.25
ROUNDING_STEP_DEG = 1.0  # heights by a parabola through three samples: their changes to 0.001 mm
SCAN_SAMPLE_DEG = 1.0  # of each curve whose shape is sought
PLANTS = 2  # turns drawn in figure 7


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m scenarios.paper_cycle", description=__doc__.splitlines()[0], formatter_class=Help
    )
    parser.add_argument("--fmu", type=Path, default=FMU, help="the linkage FMU, FMI 2.0 (default: %(default)s)")
    parser.add_argument(
        "--output", type=Path, default=OUTPUT, help="folder for tables and figures (default: %(default)s)"
    )
    parser.add_argument(
        "--step",
        type=command.between(0.001, 1, "an angle", "degree"),
        default=STEP_DEG,
        metavar="DEG",
        help="crank angle between the samples of the nominal turn, in degrees (default: %(default)s)",
    )
    variants.add_options(parser)
    options = parser.parse_args(arguments)
    if options.variants:
        return command.run(designs, options)
    try:
        results, written = run(options.fmu, options.output, options.step)
    except FmuError as error:
        print(error, file=sys.stderr)
        return 1
    except Refused as refusal:
        print(f"{options.fmu} refused the published set: {refusal}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"The reports cannot be written to {options.output}: {error}", file=sys.stderr)
        return 1
    console = reports.console()
    comparison.show(console, results.rows)
    console.print(comparison.count(results.rows))
    reports.show_files(console, options.output, written)
    return 0


def designs(options: argparse.Namespace, console: Console) -> list[Path]:
    """The variants of a command line beside the published design; returns the files."""
    chosen = variants.chosen(options)
    options.output = options.output / "designs" if options.output == OUTPUT else options.output
    with FmuSource(options.fmu) as source:
        options.output.mkdir(parents=True, exist_ok=True)
        operation = Operation(depth=source.published_depth())
        found = beside.turns(source, chosen, operation)
        reports.show_table(console, "Designs beside one another", *beside.table(found))
        written = beside.write(options.output, source, chosen, found)
        for name, geometry in beside.geometries_of(source, chosen).items():
            if name != variants.PUBLISHED:
                written.append(options.output / f"{re.sub(r'[^A-Za-z0-9._-]+', '_', name)}.ssv")
                variants.write_ssv(written[-1], name, geometry, operation)
    return written


def run(fmu_path: Path, output: Path, step_deg: float = STEP_DEG) -> tuple[Results, list[Path]]:
    """Run everything, write the reports into ``output`` and return what came out and the files.

    Raises FmuError for a file that cannot be used, Refused where the FMU refuses the
    published set and OSError where the reports cannot be written.
    """
    family_step = max(step_deg, FAMILY_STEP_DEG)
    scan = range(0, 360, published.SCAN_STEP_DEG)
    with LinkageFmu(fmu_path, published.SPACING) as fmu:
        for family in FAMILIES:
            value = family.nominal_value(fmu.nominal)
            if value not in family.values:
                raise FmuError(
                    f"{fmu_path} does not start with the published set: its {family.symbol} is {value:g} {family.unit}."
                )
        output.mkdir(parents=True, exist_ok=True)
        lengths = published.lengths(fmu)
        drawings = len(FAMILIES) + 3
        total = 2 + sum(len(f.values) for f in FAMILIES) + len(scan) + len(lengths) + drawings
        # A bar on a terminal only, and only once the run proves not to be instant.
        with tqdm(total=total, desc="paper cycle", unit="run", leave=False, disable=None, delay=1.0) as bar:
            nominal = fmu.run(step_deg)
            bar.update()
            plants = fmu.run(family_step, turns=PLANTS)
            bar.update()
            runs = [families.run_family(fmu, family, family_step, bar.update) for family in FAMILIES]
            shapes = {}
            phase = next(f for f in FAMILIES if f.symbol == "theta41")
            for angle in scan:
                try:
                    turns = fmu.run(SCAN_SAMPLE_DEG, phase.parameters(angle, fmu.nominal))
                    shapes[float(angle)] = measures.shape(turns.static_mm[:-1])
                except Refused:
                    pass  # a phase difference without a whole turn has no shape
                bar.update()
            rounding = published.rounding_spread(fmu, lengths, max(step_deg, ROUNDING_STEP_DEG), bar.update)
            results = published.compare(fmu, nominal, plants, runs, shapes, rounding)
            nozzle_mm = fmu.nominal["geometry.L9"] * 1e3
            written = figures.draw_all(
                output,
                runs,
                nominal,
                plants,
                nozzle_mm=nozzle_mm,
                surface_mm=results.surface_mm,
                common=results.common,
                shapes=results.shapes,
                done=bar.update,
            )
        written += write_reports(output, nominal, runs, results)
    return results, sorted(written)


def write_reports(output: Path, nominal: Turns, runs: Sequence[FamilyRun], results: Results) -> list[Path]:
    """Write table.md, table.csv, families.csv and cycle.csv; returns their paths."""
    headings, rows = family_table(runs, results)
    (output / "table.md").write_text(
        "\n".join(
            [
                "# The published planting cycle",
                "",
                (
                    "The paper's figures and sentences beside what the FMU gives: "
                    "Chen Jianneng et al., Kinematics Modeling and Parameters Analysis of Seven-linkage Vegetable "
                    "Seedling Transplanting Mechanism, 2010, DOI 10.3969/j.issn.1000-1298.2010.12.010. "
                    "Axes: x forward, y up, origin O. Speeds and accelerations are relative to the machine."
                ),
                "",
                f"{comparison.count(results.rows).capitalize()}.",
                "",
                reports.markdown_table(comparison.HEADINGS, map(comparison.cells, results.rows)),
                "## The curves of figures 3 to 6",
                "",
                (
                    f"Hole sizes in mm: at a ridge surface fixed {-results.surface_mm:.1f} mm below O, and at one as "
                    "far above each curve's own lowest point as the published set's. A negative size: the path has "
                    "crossed itself below the surface."
                ),
                "",
                reports.markdown_table(headings, rows),
                "## Files",
                "",
                (
                    f"`cycle.csv` holds the published turn every {nominal.phi_deg[1]:g} degrees: time, crank.phi and "
                    "the FMU's outputs, in SI units. `table.csv` is the first table, `families.csv` the second. "
                    "`figure_3.png` to `figure_8.png` are the paper's figures, `figure_4_shapes.png` shows the curves "
                    "of figure 4a one by one."
                ),
                "",
            ]
        ),
        encoding="utf-8",
    )
    comparison.write_csv(output / "table.csv", results.rows)
    reports.write_csv(output / "families.csv", headings, rows)
    # Adding 0.0 turns a -0.0, which only puzzles readers, into 0.
    columns = [nominal.time, np.radians(nominal.phi_deg), *nominal.values.values()]
    reports.write_csv(
        output / "cycle.csv",
        ("time", "crank.phi", *nominal.values),
        ([f"{value + 0.0:.12g}" for value in sample] for sample in zip(*columns, strict=True)),
    )
    return [output / name for name in ("table.md", "table.csv", "families.csv", "cycle.csv")]


def family_table(runs: Sequence[FamilyRun], results: Results) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: one for each curve of figures 3 to 6."""
    headings = (
        "figure",
        "parameter",
        "value",
        "unit",
        "height / mm",
        "width / mm",
        "highest at / deg",
        "lowest at / deg",
        "hole, fixed surface / mm",
        "hole, same depth / mm",
        "least assembly.margin",
    )
    rows = []
    for family_run in runs:
        family = family_run.family
        depth = results.surface_mm - family_run.nominal.static_mm.imag.min()
        fixed = iter(published.hole_sizes(family_run, results.surface_mm))
        deep = iter(published.hole_sizes(family_run, depth, above_lowest=True))
        for member in family_run.members:
            start = (str(family.figure), family.symbol, f"{member.value:g}", family.unit)
            turns = member.turns
            if turns is None:
                rows.append((*start, *["cannot make a whole turn"], *[""] * (len(headings) - 5)))
                continue
            y = turns.static_mm.imag
            numbers = (
                families.height(turns),
                families.width(turns),
                measures.highest(turns.phi_deg, y).phi_deg,
                measures.lowest(turns.phi_deg, y).phi_deg,
                next(fixed),
                next(deep),
            )
            rows.append((*start, *(f"{n:.1f}" for n in numbers), f"{turns['assembly.margin'].min():.3f}"))
    return headings, rows


if __name__ == "__main__":
    sys.exit(main())
