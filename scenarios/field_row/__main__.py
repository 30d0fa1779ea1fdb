"""A field row: drivetrain, seedling conveyor, linkage and soil planted together.

    python -m scenarios.field_row

runs the system of scenarios/field_row/row.toml, 50 plants by default, draws the row, judges its
quality, balances its energy, and measures the error against the communication step. Another FMU
takes a partner's place by --system, with a copy of that file.
"""

from __future__ import annotations

import argparse
import importlib.util
import multiprocessing
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import ModuleType

from tqdm import tqdm
from transplanter_linkage.measures import GEOMETRY

from scenarios.common import command, reports, units
from scenarios.common.command import ROOT
from scenarios.common.instance import FmuError
from scenarios.common.masses import plausible
from scenarios.common.variants import PHASE, PREFIX, VariantError, read_ssv, unit_of
from scenarios.field_row import mass_study, report
from scenarios.field_row import run as row_run
from scenarios.field_row import study as row_study
from scenarios.field_row.component import SystemFault, Value
from scenarios.field_row.level import LINKAGE, level
from scenarios.field_row.partners.build import PartnerError
from scenarios.field_row.partners.build import build as build_partners
from scenarios.field_row.run import CONTROLLED, MASTERS
from scenarios.field_row.system import ROW, System, load_system

OUTPUT = ROOT / "build" / "reports" / "field_row"
PLANTS = 50
STEP_MS = 2.0
MASTER = "extrapolated"


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
    report.show(results)
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
    return all(report.is_ours(system, name) for name in ("drivetrain", "soil")) and mass_study.offered(system)


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
) -> tuple[report.Results, list[Path]]:
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
    results = report.Results(system_file, row, record, master, step_ms, study, no_study, of_masses, level(row.system))
    drawn += _figures().draw_studies(output, study, of_masses)
    return results, sorted(report.write_tables(output, results) + drawn)


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


if __name__ == "__main__":
    sys.exit(main())
