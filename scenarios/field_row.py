"""A field row: drivetrain, seedling conveyor, linkage and soil planted together.

    python -m scenarios.field_row

runs the system of scenarios/row_system.toml, 50 plants by default, draws the row, judges its
quality, balances its energy, and measures the error against the communication step. Another FMU
takes a partner's place by --system, with a copy of that file.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from tqdm import tqdm

from scenarios import reports, row_figures, row_run, row_study
from scenarios.cycle import FmuError
from scenarios.partners.build import PartnerError
from scenarios.partners.build import build as build_partners
from scenarios.row_run import CONTROLLED, EMPTY, MASTERS, MISSED, PLANTED, Record, Row
from scenarios.row_study import LINKAGE, Study
from scenarios.system import ROW, SystemFault, Value, load_system

OUTPUT = Path(__file__).resolve().parent.parent / "build" / "reports" / "field_row"
PLANTS = 50
STEP_MS = 2.0
MASTER = "extrapolated"
FACTOR = 10  # the linkage's own error is to be so many times below the rest's


@dataclass(frozen=True)
class Results:
    """What a run found; ``study`` is None where it was left out, or where an FMU does not offer what it needs."""

    row: Row
    record: Record
    master: str
    step_ms: float
    study: Study | None


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m scenarios.field_row", description=__doc__.splitlines()[0])
    parser.add_argument("--system", type=Path, default=ROW, metavar="FILE",
                        help="FMUs, connections and parameters (default: %(default)s)")
    parser.add_argument("--plants", type=_plants, default=PLANTS, help="plants in the row (default: %(default)s)")
    parser.add_argument("--master", choices=[*MASTERS, CONTROLLED], default=MASTER, help="(default: %(default)s)")
    parser.add_argument("--step", type=_step, default=STEP_MS, metavar="MS",
                        help="communication step, 0.1 to 20 ms; the controlled master chooses its own "
                             "(default: %(default)s)")
    parser.add_argument("--set", type=_setting, action="append", default=[], metavar="COMPONENT.VARIABLE=VALUE",
                        dest="settings", help="a parameter, for instance soil.ridge.wave=0; may be repeated")
    parser.add_argument("--no-study", action="store_true", help="leave out the error against the communication step")
    parser.add_argument("--output", type=Path, default=OUTPUT,
                        help="folder for tables and figures (default: %(default)s)")
    options = parser.parse_args(arguments)
    try:
        results, written = run(options.system, options.output, options.plants, options.master, options.step,
                               dict(options.settings), not options.no_study)
    except (SystemFault, FmuError, PartnerError) as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(f"The reports cannot be written to {options.output}: {error}", file=sys.stderr)
        return 1
    show(results)
    print(f"Tables and figures: {_shown(options.output)}")
    for path in written:
        print(f"  {path.name}")
    return 0


def _plants(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 10_000:
        raise argparse.ArgumentTypeError("give a number of plants from 1 to 10000")
    return int(text)


def _step(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.1 <= value <= 20:
        raise argparse.ArgumentTypeError("give a step from 0.1 to 20 ms")
    return value


def _setting(text: str) -> tuple[str, Value]:
    name, _, value = text.partition("=")
    if value in ("true", "false"):
        return name, value == "true"
    try:
        return name, int(value) if value.lstrip("+-").isdecimal() else float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"give component.variable=number, true or false, not {text!r}") from None


def _shown(path: Path) -> Path:
    """A path as seen from where the user stands, if it lies below."""
    try:
        return path.resolve().relative_to(Path.cwd())
    except ValueError:
        return path


def run(system_file: Path, output: Path, plants: int = PLANTS, master: str = MASTER, step_ms: float = STEP_MS,
        settings: dict[str, Value] | None = None, with_study: bool = True) -> tuple[Results, list[Path]]:
    """Plant the row, write the reports into ``output``; returns what came out and the files.

    Raises SystemFault, FmuError or PartnerError with a line for the user, and OSError where the
    reports cannot be written.
    """
    build_partners()
    system = load_system(system_file).with_parameters(settings or {})
    row = row_run.row_of(system, plants)
    output.mkdir(parents=True, exist_ok=True)
    # A bar on a terminal only, and only once the run proves not to be instant.
    with tqdm(total=row.stop, desc="planting", unit="s of the row", leave=False, disable=None, delay=1.0,
              bar_format="{l_bar}{bar}| {n:.0f}/{total:.0f} {unit} [{elapsed}<{remaining}]") as bar:
        record = row_run.run(row.system, master, step_ms * 1e-3, row.stop, bar.update)
    study = None
    if with_study and not set(row_study.WATCHED) & set(record.not_offered):
        span = row_study.seconds(row_run.row_of(system, row_study.PLANTS).stop)
        with tqdm(total=span, desc="error against step", leave=False, disable=None, delay=1.0,
                  bar_format="{l_bar}{bar}| [{elapsed}<{remaining}]") as bar:
            study = row_study.measure(system, bar.update)
    results = Results(row, record, master, step_ms, study)
    written = write_tables(output, results) + row_figures.draw_all(output, record, row.spacing, study)
    return results, sorted(written)


# --- what the row is like -------------------------------------------------------------------------

def quality(results: Results) -> list[tuple[str, str, str]]:
    """Measure, value and remark of each line of the table of planting quality."""
    holes, spacing = results.record.holes, results.row.spacing
    if not holes:
        return [("holes", "0", "the tip never went into the soil and out again")]
    fates = [hole.seedling for hole in holes]
    apart = np.diff([hole.plant_x for hole in holes])
    standing = np.diff([hole.plant_x for hole in holes if hole.seedling == PLANTED])

    def spread(values: Sequence[float], scale: float, digits: int = 1) -> str:
        v = scale * np.asarray(values)
        return f"{v.mean():.{digits}f} ({v.min():.{digits}f} to {v.max():.{digits}f})"

    rows = [
        ("holes", str(len(holes)), f"asked for: {results.row.plants}"),
        ("planted", f"{fates.count(PLANTED)}", f"{100 * fates.count(PLANTED) / len(holes):.0f} % of the holes"),
        ("cups left empty", f"{fates.count(EMPTY)}", "by the operator"),
        ("seedlings missed", f"{fates.count(MISSED)}", "fell beside the nozzle's mouth"),
    ]
    if len(apart):
        rows += [("spacing of the holes, mean", f"{1e3 * apart.mean():.2f} mm",
                  f"set: {1e3 * spacing:g} mm"),
                 ("spacing of the holes, coefficient of variation", f"{100 * apart.std() / apart.mean():.3f} %",
                  "the wheel is taken not to slip")]
    if len(standing):
        rows.append(("distance from plant to plant, longest", f"{1e3 * standing.max():.0f} mm",
                     f"{np.count_nonzero(standing > 1.5 * spacing)} gaps longer than 1.5 spacings"))
    return [*rows,
            ("depth", f"{spread([h.depth for h in holes], 1e3)} mm",
             "lowest point below the ridge; mean (least to most)"),
            ("hole at the surface", f"{spread([h.length for h in holes], 1e3)} mm", "entry to exit"),
            ("speed over ground at depth", f"{spread([h.speed for h in holes], 1e3, 0)} mm/s", "0 would be ideal"),
            ("lean of the seedling", f"{spread([h.lean for h in holes], 180 / math.pi, 2)} deg",
             "forward, out of the vertical, where the nozzle opens")]


def balance(results: Results) -> list[tuple[str, str, str]]:
    """Energy of the whole row: part, J, share of the tractor's work."""
    record = results.record
    given = float(record["drivetrain.energy.tractor"][-1])
    ends = [("given by the tractor", given)] + [(label, float(record[name][-1])) for label, name in (
        ("taken by the soil", "soil.energy.soil"), ("heat in the shaft", "drivetrain.energy.shaft"),
        ("stored in shaft and crank", "drivetrain.energy.stored"))]
    ends += [("not accounted for: error of the coupling, at the end", float(record.imbalance[-1])),
             ("... and at most", float(abs(record.imbalance).max()))]
    share = 100 / given if given else math.nan

    def cells(label: str, value: float) -> tuple[str, str, str]:
        if not math.isfinite(value):
            return label, "not offered", ""
        return label, f"{value + 0.0:.2f}", f"{share * value + 0.0:.2f} %" if math.isfinite(share) else ""

    return [cells(label, value) for label, value in ends]


def small(metres: float) -> str:
    """An error in mm, three digits."""
    value = 1e3 * metres
    return f"{float(f'{value:.2g}'):g}" if value < 0.1 else f"{value:.2f}"


def master_table(study: Study) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: worst error of the tip and of the energy by master and step."""
    headings = ("master", "step / ms", "steps", "worst error of the tip / mm", "rms / mm", "energy / % of the work")
    rows = [(e.way.title, f"{1e3 * e.step:.3g}", str(e.steps), small(e.worst), small(e.rms),
             f"{100 * e.imbalance / study.work:.2g}") for e in (*study.masters, *study.controlled)]
    return headings, rows


def linkage_table(study: Study) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: what the linkage itself leaves, beside the rest."""
    headings = ("connected to the linkage", "step / ms", "its own error, worst / mm", "the rest, worst / mm",
                "rest / own, worst", "rest / own, rms")
    return headings, [(e.way.title, f"{1e3 * e.step:g}", small(e.own_worst), small(e.rest_worst),
                       f"{e.rest_worst / e.own_worst:.2g}", f"{e.rest_rms / e.own_rms:.2g}") for e in study.linkage]


def findings(study: Study) -> list[str]:
    """What the study says, in sentences."""
    rates = study.of(LINKAGE[-1].key)
    kept = [1e3 * e.step for e in rates if e.rest_worst >= FACTOR * e.own_worst]
    at_10 = next(e for e in rates if math.isclose(e.step, 10e-3))
    held_10 = next(e for e in study.of("held") if math.isclose(e.step, 10e-3))
    sequential = next(e for e in study.of("gauss_seidel") if math.isclose(e.step, 10e-3))
    tip = {key: study.order(key, "worst") for key in ("jacobi", "gauss_seidel", "extrapolated")}
    energy = {key: study.order(key, "imbalance") for key in tip}
    times = at_10.rest_worst / at_10.own_worst
    where = ("" if times >= FACTOR else
             " Its worst are where the soil's force sets in and where it turns about at the lowest point, and with it "
             "the crank's acceleration: what changes within a step of 10 ms cannot be told at its begin.")
    return [
        f"Orders, fitted up to 5 ms, of the tip and of the energy: Jacobi {tip['jacobi']:.2f} and "
        f"{energy['jacobi']:.2f}, Gauss-Seidel {tip['gauss_seidel']:.2f} and {energy['gauss_seidel']:.2f} (the soil's "
        f"force reaches the linkage, and its torque the drivetrain, a step late); with the force's slope "
        f"{tip['extrapolated']:.2f} and {energy['extrapolated']:.2f}.",
        f"The linkage's own error, with angle, speed and acceleration connected, is at 10 ms "
        f"{small(at_10.own_worst)} mm where the rest of the system is {small(at_10.rest_worst)} mm off: "
        f"{times:.1f} times (rms: {at_10.rest_rms / at_10.own_rms:.1f} times). It is {FACTOR} times below the rest "
        + (f"up to {max(kept):g} ms." if kept else "at none of these steps.") + where,
        f"Where the drivetrain steps first and the linkage gets the angle of the step's end (Gauss-Seidel), its own "
        f"error at 10 ms is {small(sequential.own_worst)} mm, "
        f"{sequential.rest_worst / sequential.own_worst:.0f} times below the rest.",
        f"A linkage that predicts nothing is {small(held_10.own_worst)} mm off at 10 ms.",
        f"The truth was stepped at {row_study.TRUTH_MS:g} ms. At twice that step it moves by "
        f"{small(study.truth_error)} mm, and plain Jacobi steps, taken to the limit, come to within "
        f"{small(study.truth_other)} mm of it.",
    ]


# --- reports --------------------------------------------------------------------------------------

QUALITY = ("", "value", "remark")
BALANCE = ("energy of the row", "J", "share")


def show(results: Results) -> None:
    """Print quality, balance and what the study says."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=reports.PLAIN_WIDTH)
    for headings, rows in ((QUALITY, quality(results)), (BALANCE, balance(results))):
        table = Table(*headings, box=box.ROUNDED if console.is_terminal else box.ASCII)
        for row in rows:
            table.add_row(*row)
        console.print(table)
    for sentence in findings(results.study) if results.study else []:
        console.print(f"- {sentence}")
    if results.record.not_offered:
        console.print(f"Not offered by the FMUs, and left out: {', '.join(results.record.not_offered)}.")


def write_tables(output: Path, results: Results) -> list[Path]:
    """Write field_row.md, plants.csv, signals.csv and, with a study, errors.csv; returns their paths."""
    record, row = results.record, results.row
    headings = ("hole", "seedling", "entry / m", "exit / m", "length / m", "depth / m", "speed at depth / (m/s)",
                "plant at / m", "lean / rad")
    reports.write_csv(output / "plants.csv", headings, (
        (k, h.seedling, *(f"{v:.6f}" for v in (h.entry, h.exit, h.length, h.depth, h.speed, h.plant_x, h.lean)))
        for k, h in enumerate(record.holes, start=1)))
    names = [name for name in record.columns if name not in record.not_offered]
    reports.write_csv(output / "signals.csv", ("time", *names),
                      ([f"{v + 0.0:.9g}" for v in sample] for sample in zip(record.time, *(record[n] for n in names))))
    master = "chosen by the master" if results.master == CONTROLLED else f"of {results.step_ms:g} ms"
    parts = [
        "# A field row", "",
        f"{row.plants} plants at {1e3 * row.spacing:g} mm, {row.stop:.1f} s of machine time in {len(record.time) - 1} "
        f"steps {master}, master `{results.master}`. Drivetrain, conveyor and soil are the PythonFMU slaves of "
        "`scenarios/partners/`, where each formula has its source; `scenarios/row_system.toml` connects them.", "",
        "![The row from the side](row.png)", "", "## Planting quality", "",
        reports.markdown_table(QUALITY, quality(results)),
        "## Energy", "", reports.markdown_table(BALANCE, balance(results)), "![Energy](energy.png)", "",
        "The tractor pulls against the ground wheel, which turns the crank, and against the soil's drag on the nozzle; "
        "the soil takes −F·v of the tip over ground.", "",
        "## A turn of the crank", "", "![A turn](turn.png)", ""]
    written = [output / name for name in ("field_row.md", "plants.csv", "signals.csv")]
    if results.study:
        study = results.study
        parts += ["## Error against communication step", "",
                  f"A row of {row_study.PLANTS} plants, {study.seconds:.1f} s.", "",
                  *(f"- {sentence}" for sentence in findings(study)), "", "![Errors](errors.png)", "",
                  reports.markdown_table(*master_table(study)),
                  "The controlled master does each step once whole and once in halves; all are counted here, and those "
                  "taken back. Its tolerance is a multiple of `step_control` in the system's file.", "",
                  "The linkage coupled in several ways, master `jacobi`:", "",
                  reports.markdown_table(*linkage_table(study))]
        reports.write_csv(output / "errors.csv", (
            "way", "step_s", "steps", "worst_m", "rms_m", "own_worst_m", "own_rms_m", "rest_worst_m", "rest_rms_m",
            "imbalance_J"), ((e.way.key, e.step, e.steps, e.worst, e.rms, e.own_worst, e.own_rms, e.rest_worst,
                              e.rest_rms, e.imbalance) for e in (*study.masters, *study.controlled, *study.linkage)))
        written.append(output / "errors.csv")
    if record.not_offered:
        parts += [f"Not offered by the FMUs, and left out: {', '.join(record.not_offered)}.", ""]
    parts += ["## Files", "", "`plants.csv`: a line a hole; `signals.csv`: every step"
              + ("; `errors.csv`: the errors. SI units." if results.study else ". SI units."), ""]
    (output / "field_row.md").write_text("\n".join(parts), encoding="utf-8")
    return written


if __name__ == "__main__":
    sys.exit(main())
