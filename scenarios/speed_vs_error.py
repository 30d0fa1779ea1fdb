"""Speed against error: what each way of coupling the linkage FMU costs and brings.

    python -m scenarios.speed_vs_error

drives the crank of the built FMU along several motions, with every way of giving it to the FMU
and with steps from 0.1 to 20 ms, measures what a step costs by what it sets and reads, and
writes tables and figures. Times are ratios from interleaved rounds of this run.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy.fmi1 import FMICallException
from tqdm import tqdm

from scenarios import coupling as coupled
from scenarios import reports, scene_cost, smoothing, speed_figures
from scenarios.coupling import (
    ANGLE,
    AT_END,
    FULL,
    HELD,
    ORDER_RANGE_MS,
    QUANTITIES,
    RUNGS,
    SOLVING,
    START_UP,
    STEPS_MS,
    Coupling,
    UnpackedFmu,
)
from scenarios.crank_profiles import PROFILES
from scenarios.cycle import FmuError
from scenarios.scene_cost import BASE, SCENES, Costs
from scenarios.smoothing import EXACT, NOISY, SMOOTHED, WINDOWS_MS, Smoothing

ROOT = Path(__file__).resolve().parent.parent
FMU = ROOT / "build" / "fmi2" / "TransplanterLinkage.fmu"
OUTPUT = ROOT / "build" / "reports" / "speed_vs_error"

ROUNDS = 1001         # of the C host
REFERENCE = "ripple"  # the profile of the headline
TOLERANCE = 10e-6     # m: what the headline asks of the tip
BY_PROFILE_MS = (1.0, 10.0)
HEADLINE_MS = 10.0
UNITS = ("mm", "mm/s", "mm/s2")


@dataclass(frozen=True)
class Results:
    """What a run found. ``c_host`` is None where no C host could be built; ``why`` says why."""

    coupling: Coupling
    smoothing: Smoothing
    c_host: Costs | None
    fmpy_host: Costs
    machine: str
    why: str = ""


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m scenarios.speed_vs_error", description=__doc__.splitlines()[0])
    parser.add_argument("--fmu", type=Path, default=FMU, help="the linkage FMU, FMI 2.0 (default: %(default)s)")
    parser.add_argument("--output", type=Path, default=OUTPUT,
                        help="folder for tables and figures (default: %(default)s)")
    parser.add_argument("--smallest-step", type=float, choices=[step for step in STEPS_MS if step <= 2],
                        default=STEPS_MS[0], metavar="MS",
                        help="leave out smaller steps, for a quick look: 0.1 to 2 ms (default: %(default)s)")
    parser.add_argument("--rounds", type=_rounds, default=ROUNDS,
                        help="of the time measurements (default: %(default)s)")
    parser.add_argument("--figure", type=Path, metavar="FILE",
                        help="only write the README's figure, as SVG, to this file")
    options = parser.parse_args(arguments)
    try:
        if options.figure:
            write_figure(options.fmu, options.figure)
            return 0
        results, written = run(options.fmu, options.output, options.smallest_step, options.rounds)
    except FmuError as error:
        print(error, file=sys.stderr)
        return 1
    except FMICallException as error:
        print(f"{options.fmu} refused: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"The reports cannot be written to {options.output}: {error}", file=sys.stderr)
        return 1
    show(results)
    print(f"Tables and figures: {options.output}")
    for path in written:
        print(f"  {path.name}")
    return 0


def _rounds(text: str) -> int:
    if not text.isdecimal() or not 3 <= int(text) <= 100_000:
        raise argparse.ArgumentTypeError("give a number of rounds from 3 to 100000")
    return int(text)


def run(fmu: Path, output: Path, smallest_step_ms: float = STEPS_MS[0],
        rounds: int = ROUNDS) -> tuple[Results, list[Path]]:
    """Measure everything, write the reports into ``output``; returns what came out and the files.

    Raises FmuError for a file that cannot be used and OSError where reports cannot be written.
    """
    steps = tuple(step for step in STEPS_MS if step >= smallest_step_ms)
    fmpy_rounds = max(3, rounds // 10)
    with UnpackedFmu(fmu) as folder:
        output.mkdir(parents=True, exist_ok=True)
        fmpy_steps = fmpy_rounds * len(RUNGS) * scene_cost.FMPY_STEPS
        total = (coupled.step_count(PROFILES, RUNGS, steps) + fmpy_steps
                 + smoothing.step_count(smoothing.steps_from(smallest_step_ms)))
        # A bar on a terminal only, and only once the run proves not to be instant.
        with tqdm(total=total, desc="time of a step", unit="step", unit_scale=True, leave=False, disable=None,
                  delay=1.0) as bar:
            c_host, why = None, ""
            try:
                c_host = scene_cost.in_c_host(folder, (*SCENES, *map(scene_cost.scene_of, (*RUNGS, SMOOTHED))), rounds)
            except RuntimeError as error:
                why = str(error)
            fmpy_host = scene_cost.through_fmpy(folder, RUNGS, fmpy_rounds, bar.update)
            bar.set_description("error of the tip")
            errors = coupled.measure(folder, PROFILES, RUNGS, steps, bar.update)
            windows = smoothing.measure(folder, smallest_step_ms, bar.update)
    results = Results(errors, windows, c_host, fmpy_host, scene_cost.machine(), why)
    written = write_tables(output, results)
    written += speed_figures.draw_all(output, errors, windows, PROFILES, REFERENCE, c_host, fmpy_host, SCENES)
    return results, sorted(written)


def write_figure(fmu: Path, path: Path) -> None:
    """The README's figure: errors on the reference profile, with every step."""
    profile = next(p for p in PROFILES if p.key == REFERENCE)
    with UnpackedFmu(fmu) as folder:
        errors = coupled.measure(folder, [profile], RUNGS, STEPS_MS, lambda steps: None)
    speed_figures.write_headline(path, errors, profile, TOLERANCE)


# --- what the figures say ---------------------------------------------------------------------

def number(value: float, quantity: int = 0) -> str:
    """An error in m or its rates as mm or its rates, three digits; 'exact' at the solving error."""
    if value <= SOLVING[quantity]:
        return "exact"
    scaled = value * 1e3
    if 1e-2 <= scaled < 1e4:
        return f"{float(f'{scaled:.3g}'):g}"
    return f"{scaled:.2e}".replace("e-0", "e-").replace("e+0", "e")


def _order(value: float) -> str:
    return "" if math.isnan(value) else f"{round(value, 1) + 0.0:.1f}"  # no -0.0


def promises(results: Results) -> list[str]:
    """What the headline claims, from the figures."""
    errors = results.coupling
    full, held = (errors.at(REFERENCE, rung.key, HEADLINE_MS) for rung in (FULL, HELD))
    order = errors.order(REFERENCE, HELD.key)
    more_as_good, more_within = (float(f"{errors.times_more_steps(REFERENCE, HELD.key, error, HEADLINE_MS):.2g}")
                                 for error in (full.worst[0], TOLERANCE))
    return [
        f"At {HEADLINE_MS:g} ms, on a crank that ripples by 10 %, angle, speed and acceleration keep the tip within "
        f"{full.worst[0] * 1e3:.4f} mm of the truth, where a held input is {held.worst[0] * 1e3:.1f} mm off "
        f"({held.first_second * 1e3:.1f} mm within the first second).",
        f"For the same error the held input needs {more_as_good:.0f} times the steps, that is "
        f"{math.log10(more_as_good):.1f} decimal orders more; for {TOLERANCE * 1e3:g} mm, {more_within:.0f} times "
        f"({math.log10(more_within):.1f} orders). "
        f"Both are extrapolated from {HEADLINE_MS:g} ms by its fitted order, {order:.2f}.",
    ]


def reading(results: Results) -> list[str]:
    """Which rung to take at which step: three sentences."""
    errors, costs = results.coupling, results.c_host or results.fmpy_host
    largest = {rung.key: errors.largest_step(REFERENCE, rung.key, TOLERANCE) for rung in RUNGS}
    by_step: dict[float, list[str]] = {}
    for rung in RUNGS:
        if rung not in (HELD, AT_END):
            by_step.setdefault(largest[rung.key], []).append(rung.title)
    within = "; ".join(f"{' or '.join(titles)}, {f'{step:g} ms' if step else 'none of these steps'}"
                       for step, titles in sorted(by_step.items(), reverse=True))
    dearest = max(costs.ratio(rung.key, HELD.key) for rung in RUNGS)
    windows = results.smoothing
    finest = windows.steps_ms[0]
    window = windows.best_window(finest)
    with_speed = errors.at("encoder", "angle_speed", errors.steps_ms[0]).worst[2]
    step = 1.0 if 1.0 in errors.steps_ms else errors.steps_ms[0]
    jumps = {rung.key: errors.at("clutch", rung.key, step).worst for rung in RUNGS}
    return [
        f"Give all that the drive knows and take the largest step that keeps your tolerance (for {TOLERANCE * 1e3:g} mm "
        f"on the rippling crank: {within}): the step is what costs, no rung costs more than {dearest:.1f} times the held "
        "step.",
        "Where the angle comes from an encoder, connect crank.w or set crank.smoothing: with a 20-bit angle alone the "
        f"acceleration's worst error at {finest:g} ms is {number(windows.worst(NOISY, 0.0, finest, 2), 2)} mm/s2, smoothed "
        f"over {window:g} ms {number(windows.worst(NOISY, window, finest, 2), 2)}, with the speed {number(with_speed, 2)}.",
        f"A jump in speed is foreseen by no rung, so its step is off by about jump times step (here at {step:g} ms "
        f"{number(jumps['derivative_1'][0])} mm with input derivatives, {number(jumps['angle_speed'][0])} with the "
        f"speed, {number(jumps['angle'][0])} with the angle alone); none carries it on, but where the angle is all there "
        f"is, the acceleration is off by {number(jumps['angle'][2], 2)} mm/s2 for the steps that it takes to tell "
        f"(with the speed {number(jumps['angle_speed'][2], 2)}): smaller steps lessen only the position's error.",
    ]


# --- tables -----------------------------------------------------------------------------------

def headline(results: Results) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: the rungs on the reference profile."""
    errors = results.coupling
    shown = [step for step in BY_PROFILE_MS if step in errors.steps_ms] or [HEADLINE_MS]
    headings = ("what the host gives", *(f"at {step:g} ms / mm" for step in shown), "order",
                f"step for {TOLERANCE * 1e3:g} mm", *(["time in C"] if results.c_host else []), "time in fmpy")
    rows = []
    for rung in RUNGS:
        largest = errors.largest_step(REFERENCE, rung.key, TOLERANCE)
        hosts = [host for host in (results.c_host, results.fmpy_host) if host is not None]
        rows.append((
            rung.title, *(number(errors.at(REFERENCE, rung.key, step).worst[0]) for step in shown),
            _order(errors.order(REFERENCE, rung.key)),
            f"{largest:g} ms" if largest else f"< {errors.steps_ms[0]:g} ms",
            *(f"{host.ratio(rung.key, HELD.key):.2f}" for host in hosts)))
    return headings, rows


def profile_table(errors: Coupling, profile: str) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: every rung on one profile; worst errors and fitted orders."""
    shown = [step for step in BY_PROFILE_MS if step in errors.steps_ms] or [HEADLINE_MS]
    headings = ("what the host gives", *(heading for quantity, unit in zip(QUANTITIES, UNITS) for heading in (
        *(f"{quantity} at {step:g} ms / {unit}" for step in shown), "order")))
    rows = [(rung.title, *(cell for n in range(len(QUANTITIES)) for cell in (
        *(number(errors.at(profile, rung.key, step).worst[n], n) for step in shown),
        _order(errors.order(profile, rung.key, n))))) for rung in RUNGS]
    return headings, rows


def start_up_table(errors: Coupling, profile: str) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: position after each of the first steps."""
    headings = ("what the host gives", *(f"step {k + 1} / mm" for k in range(START_UP)))
    rows = [(rung.title, *(number(row[0]) for row in errors.at(profile, rung.key, HEADLINE_MS).start_up))
            for rung in RUNGS]
    return headings, rows


def smoothing_table(windows: Smoothing) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: by window, the noisy angle's acceleration and position, the exact one's position."""
    columns = ((NOISY, 2, "acceleration", "encoder"), (NOISY, 0, "position", "encoder"), (EXACT, 0, "position", "exact"))
    headings = ("crank.smoothing", *(f"{name}, {given}, {step:g} ms / {UNITS[quantity]}"
                                     for _, quantity, name, given in columns for step in windows.steps_ms))
    rows = [(f"{window:g} ms" if window else "0 (none)",
             *(number(windows.worst(profile, window, step, quantity), quantity)
               for profile, quantity, _, _ in columns for step in windows.steps_ms)) for window in WINDOWS_MS]
    return headings, rows


def scene_table(costs: Costs) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: what a step costs by what it reads."""
    headings = ("what is read", "outputs", "time of a step (positions = 1)", "middle half of the rounds",
                "in calls of sincos")
    rows = []
    for scene in SCENES:
        low, high = costs.spread(scene.key, BASE)
        read = f"{len(scene.outputs)}" + (f" and {len(scene.sensitivities)} by angle" if scene.sensitivities else "")
        rows.append((scene.title, read, f"{costs.ratio(scene.key, BASE):.2f}", f"{low:.2f} to {high:.2f}",
                     f"{costs.ratio(scene.key, 'sincos'):.1f}"))
    return headings, rows


def write_tables(output: Path, results: Results) -> list[Path]:
    """Write the Markdown report and the CSV files; returns their paths."""
    errors = results.coupling
    (output / "speed_vs_error.md").write_text(report(results, solving_part(output)), encoding="utf-8")
    reports.write_csv(
        output / "coupling.csv",
        ("profile", "rung", "step_ms", "steps_per_s", *(f"{kind}_{name}_{unit}" for kind in ("worst", "median")
                                                        for name, unit in zip(QUANTITIES, ("m", "m_s", "m_s2")))),
        ((e.profile, e.rung, f"{e.step_ms:g}", f"{1e3 / e.step_ms:g}", *(f"{v:.6g}" for v in (*e.worst, *e.median)))
         for e in errors.all))
    reports.write_csv(
        output / "orders.csv", ("profile", "rung", *QUANTITIES),
        ((p.key, rung.key, *(f"{errors.order(p.key, rung.key, n):.3f}" for n in range(len(QUANTITIES))))
         for p in PROFILES for rung in RUNGS))
    reports.write_csv(
        output / "start_up.csv",
        ("profile", "rung", "step_ms", "step", "position_m", "velocity_m_s", "acceleration_m_s2"),
        ((e.profile, e.rung, f"{e.step_ms:g}", k + 1, *(f"{v:.6g}" for v in row))
         for e in errors.all for k, row in enumerate(e.start_up)))
    windows = results.smoothing
    reports.write_csv(
        output / "smoothing.csv", ("profile", "window_ms", "step_ms", "position_m", "velocity_m_s", "acceleration_m_s2"),
        ((profile.key, f"{window:g}", f"{step:g}", *(f"{windows.worst(profile, window, step, n):.6g}" for n in range(3)))
         for profile in (NOISY, EXACT) for window in WINDOWS_MS for step in windows.steps_ms))
    hosts = {"C": results.c_host, "fmpy": results.fmpy_host}
    bases = {"scene": BASE, "rung": HELD.key}
    rows = []
    for host, costs in hosts.items():
        for key in costs.rounds if costs else ():
            kind = "scene" if key in {scene.key for scene in SCENES} else "rung"
            if key != "sincos":
                low, high = costs.spread(key, bases[kind])
                ratios = costs.ratio(key, bases[kind]), low, high
                rows.append((host, kind, key, bases[kind], *(f"{ratio:.4f}" for ratio in ratios)))
    reports.write_csv(output / "scene_cost.csv",
                      ("host", "kind", "key", "in_times_of", "median", "lower_quartile", "upper_quartile"), rows)
    names = ("speed_vs_error.md", "coupling.csv", "orders.csv", "start_up.csv", "smoothing.csv", "scene_cost.csv")
    return [output / name for name in names]


def solving_part(output: Path) -> str:
    """The section on solving, where it was measured: the core and its peers are not the scenario's to know."""
    part = output / "solving.md"
    if part.is_file():
        return part.read_text(encoding="utf-8")
    return "## Solving\n\nNot measured here: `make bench` measures one evaluation, ours beside other packages'.\n"


def report(results: Results, solving: str) -> str:
    """The Markdown report; ``solving`` is its section of that name."""
    errors, table = results.coupling, reports.markdown_table
    low, high = ORDER_RANGE_MS
    parts = [
        "# Speed against error", "",
        f"Measured on: {results.machine}. Written by `python -m scenarios.speed_vs_error`.", "",
        "## Which way to take", "",
        *(f"- {sentence}" for sentence in reading(results)), "",
        "## The headline", "",
        "Worst error of the tip on a crank at 6.807 rad/s that ripples by 10 % at 3 Hz, over 12 s; time of a step in "
        "times of the held one, position, velocity and acceleration read; the largest of these steps that keeps "
        f"{TOLERANCE * 1e3:g} mm.", "",
        table(*headline(results)),
        *(f"{sentence}\n" for sentence in promises(results)),
        "![Error against speed](error_over_speed.png)", "",
        "## Coupling", "",
        "In FMI an input set before a step belongs to its start, an output read after it to its end. A rung is what the "
        "host gives of the crank; *held* is a component that predicts nothing (`crank.at_step_end` with inputs of the "
        "step's start). The truth is the same FMU in initialization mode, where outputs follow inputs, at the true angle, speed "
        f"and acceleration; its solving error, about 1e-15 m, is not seen here. The first {START_UP} steps are "
        f"reported apart. Orders are slopes fitted over {low:g} to {high:g} ms, where the errors stand clear of rounding; "
        "where noise or a jump rules, the slope is no order of the method. *exact*: as small as the solving error.", "",
    ]
    for name in QUANTITIES:
        parts += [f"![Worst error of the {name}](error_of_{name}.png)", ""]
    for profile in PROFILES:
        parts += [f"### {profile.title[0].upper()}{profile.title[1:]}", ""]
        parts += [f"{profile.remark}\n"] if profile.remark else []
        parts += [table(*profile_table(errors, profile.key))]
    parts += ["## Start-up", "",
              f"Position error after each of the first {START_UP} steps of {HEADLINE_MS:g} ms, while the histories fill.", ""]
    for profile in PROFILES:
        if profile.key in (REFERENCE, "start"):
            parts += [f"{profile.title[0].upper()}{profile.title[1:]}:", "", table(*start_up_table(errors, profile.key))]
    smoothed_cost = (f" In a C host a step that smooths takes {results.c_host.ratio(SMOOTHED.key, ANGLE.key):.2f} times "
                     "one that does not." if results.c_host else "")
    parts += ["## Smoothing", "",
              "The angle alone on the rippling crank, as a 20-bit encoder reads it and exactly, with `crank.smoothing` "
              "from none to 48 ms: worst errors once the window is full. A window buys what it averages over and costs "
              f"its lag, which grows with its fourth power.{smoothed_cost}", "",
              table(*smoothing_table(results.smoothing)),
              "![What smoothing buys and costs](smoothing.png)", ""]
    parts += [solving]
    parts += ["## Scenes", ""]
    if results.c_host is None:
        parts += [f"Not measured: the C host could not be built or run here ({results.why.partition(chr(10))[0]}).", ""]
    else:
        parts += [
            "A C host sets the crank's angle, speed and acceleration (from the ground frame on also the machine's speed, "
            "from the torque on also the soil's force), does a step and reads; each line reads what the lines above it "
            f"read, too. Medians of the ratios within {len(results.c_host.rounds[BASE])} interleaved rounds.", "",
            table(*scene_table(results.c_host)), "![What a scene pays](scenes.png)", ""]
    parts += ["## The hard cases", "",
              "Dead points, poles, random geometries, odd clocks and hosts: [hard_cases.md](hard_cases.md), which `make bench` "
              "writes beside this page.", "",
              "## Files", "",
              "`coupling.csv`: every worst and median error; `orders.csv`: the fitted orders (nan: less than three errors "
              "clear of rounding); `start_up.csv`: the first steps; `smoothing.csv`: worst errors by window; `scene_cost.csv`: the ratios of times. SI units.", ""]
    return "\n".join(parts)


def show(results: Results) -> None:
    """Print the summary; in ASCII where the output is not a terminal."""
    console = reports.console()
    tables = [("Worst error of the tip: 10 % ripple at 3 Hz; time of a step: held = 1", headline(results))]
    if results.c_host is not None:
        tables.append((f"What a scene pays, in a C host: {results.machine}", scene_table(results.c_host)))
    for title, (headings, rows) in tables:
        reports.show_table(console, title, headings, rows)
    for sentence in (*promises(results), *reading(results)):
        console.print(f"- {sentence}", markup=False)


if __name__ == "__main__":
    sys.exit(main())
