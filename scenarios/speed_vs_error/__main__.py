"""Speed against error: what each way of using the linkage FMU costs and brings, in one report.

    python -m scenarios.speed_vs_error
    python -m scenarios.speed_vs_error --short

measures, in this order, and writes tables and figures to one folder:

    solving      one evaluation, ours beside other packages', against 50 digits
    dynamics     torque, inertia and bias of the moving masses, likewise
    cost         what a step costs beside the bare core; FMI 2.0, FMI 3.0, the twin; one of many instances
    hard_cases   dead points, poles, odd clocks and hosts: worst values and bounds
    coupling     every way of giving the crank to the FMU, along several motions, with steps from 0.1 to 20 ms;
                 what a step costs by what it sets and reads

Times are ratios from interleaved rounds of this run. Exits with 1 where a hard case is not met.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from tqdm import tqdm

from scenarios.common import command, reports
from scenarios.common.command import FMI3, ROOT, TWIN
from scenarios.common.instance import UnpackedFmu, require_fmu
from scenarios.common.timing import STEADY, noise_here
from scenarios.speed_vs_error import figures as speed_figures
from scenarios.speed_vs_error.cost import use_cost
from scenarios.speed_vs_error.cost.use_cost import BASE, USES, Costs
from scenarios.speed_vs_error.coupling import measure as coupled
from scenarios.speed_vs_error.coupling import smoothing
from scenarios.speed_vs_error.coupling.crank_profiles import PROFILES
from scenarios.speed_vs_error.coupling.measure import (
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
)
from scenarios.speed_vs_error.coupling.smoothing import EXACT, NOISY, SMOOTHED, WINDOWS_MS, Smoothing

OUTPUT = ROOT / "build" / "reports" / "speed_vs_error"
PARTS = ("solving", "dynamics", "cost", "hard_cases", "coupling")
NOT_MEASURED = {
    "solving": "## Solving\n\nNot measured in this run.\n",
    "dynamics": "## Inverse dynamics\n\nNot measured in this run.\n",
    "cost": "## Cost of a step\n\nNot measured in this run.\n",
    "hard_cases": "## The hard cases\n\nNot measured in this run.\n",
}  # sections of the report
SHORT = {"smallest_step": 2.0, "rounds": 31, "angles": 200, "angles_of_dynamics": 40, "instances": 1000}

ROUNDS = 1001  # of the C host
REFERENCE = "ripple"  # the profile of the headline
TOLERANCE = 10e-6  # m: what the headline asks of the tip
BY_PROFILE_MS = (1.0, 10.0)
HEADLINE_MS = 10.0
SINCOS = "libm's sincos"
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
    parser = command.parser("speed_vs_error", __doc__)
    parser.add_argument("--fmi3", type=Path, default=FMI3, help="the same, FMI 3.0 (default: %(default)s)")
    parser.add_argument("--twin", type=Path, default=TWIN, help="the twin in Python (default: %(default)s)")
    parser.add_argument(
        "--only", action="append", choices=PARTS, metavar="PART", help=f"of {', '.join(PARTS)}; repeatable"
    )
    parser.add_argument("--short", action="store_true", help="a quick look: fewer steps, rounds, angles; no peers")
    parser.add_argument(
        "--smallest-step",
        type=float,
        choices=[step for step in STEPS_MS if step <= 2],
        metavar="MS",
        help=f"leave out smaller steps: 0.1 to 2 ms (default: {STEPS_MS[0]:g})",
    )
    parser.add_argument(
        "--rounds", type=_rounds, help=f"of the time measurements (default: {ROUNDS}; solving, dynamics: 101)"
    )
    parser.add_argument(
        "--figure", type=Path, metavar="FILE", help="only write the documentation's figure, as SVG, to this file"
    )
    options = parser.parse_args(arguments)
    met: list[bool] = []
    status = command.run(lambda chosen, console: perform(chosen, console, met), options)
    return status or int(not all(met))


def perform(options: argparse.Namespace, console: Console, met: list[bool]) -> list[Path]:
    """Measure the parts that are wanted and write the report; ``met`` is told whether the hard cases are."""
    if options.figure:
        write_figure(options.fmu, options.figure)
        return [options.figure]
    parts = options.only or PARTS
    for path in (options.fmu, *([options.fmi3] if "cost" in parts else [])):
        require_fmu(path)
    if {"solving", "cost"} & set(parts):
        require_fmu(options.twin)
    rounds = options.rounds or (SHORT["rounds"] if options.short else ROUNDS)
    sections, written = dict(NOT_MEASURED), []
    if "solving" in parts:
        # its packages are many and slow to import: only who measures waits for them
        from scenarios.speed_vs_error.solving import __main__ as solving

        angles = SHORT["angles"] if options.short else solving.way.ANGLES
        turns = min(rounds, solving.ROUNDS)
        sections["solving"], files = apart(
            solving.perform, options.output, options.fmu, options.twin, turns, angles, not options.short
        )
        written += files
    if "dynamics" in parts:
        from scenarios.speed_vs_error.dynamics import report as dynamics

        angles = SHORT["angles_of_dynamics"] if options.short else dynamics.ANGLES
        turns = min(rounds, dynamics.ROUNDS)
        sections["dynamics"], files = apart(
            dynamics.perform, options.output, options.fmu, turns, angles, not options.short
        )
        written += files
    if "cost" in parts:
        from scenarios.speed_vs_error.cost import instances, step_cost

        of_step, files = apart(step_cost.perform, options.output, options.fmu, options.fmi3, options.twin, rounds)
        most = SHORT["instances"] if options.short else instances.COUNTS[-1]
        of_many, more = instances.perform(options.output, options.fmu, min(rounds, instances.ROUNDS), most)
        sections["cost"] = f"{of_step}\n{of_many}"
        written += [*files, *more]
    if "hard_cases" in parts:
        from scenarios.speed_vs_error.hard_cases import __main__ as hard_cases

        sections["hard_cases"], files, all_met = hard_cases.perform(options.output, options.fmu)
        met.append(all_met)
        written += files
    if "coupling" in parts:
        smallest = options.smallest_step or (SHORT["smallest_step"] if options.short else STEPS_MS[0])
        results, files = run(options.fmu, options.output, smallest, rounds, sections)
        show(results, console)
        written += files
    return written


def apart(part: Callable[..., tuple[str, list[Path]]], *arguments: object) -> tuple[str, list[Path]]:
    """Run a part in a process of its own: one that has loaded the twin, a Python in Python, cannot load it anew."""
    sys.stdout.flush()
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(part, *arguments).result()


def _rounds(text: str) -> int:
    if not text.isdecimal() or not 3 <= int(text) <= 100_000:
        raise argparse.ArgumentTypeError("give a number of rounds from 3 to 100000")
    return int(text)


def run(
    fmu: Path,
    output: Path,
    smallest_step_ms: float = STEPS_MS[0],
    rounds: int = ROUNDS,
    sections: Mapping[str, str] = NOT_MEASURED,
) -> tuple[Results, list[Path]]:
    """Measure the coupling and write the report into ``output``; returns what came out and the files.

    ``sections`` of the report are those of the other parts.
    Raises FmuError for a file that cannot be used and OSError where reports cannot be written.
    """
    steps = tuple(step for step in STEPS_MS if step >= smallest_step_ms)
    fmpy_rounds = max(3, rounds // 10)
    with UnpackedFmu(fmu) as unpacked:
        output.mkdir(parents=True, exist_ok=True)
        fmpy_steps = fmpy_rounds * len(RUNGS) * use_cost.FMPY_STEPS
        total = (
            coupled.step_count(PROFILES, RUNGS, steps)
            + fmpy_steps
            + smoothing.step_count(smoothing.steps_from(smallest_step_ms))
        )
        # A bar on a terminal only, and only once the run proves not to be instant.
        with tqdm(
            total=total, desc="time of a step", unit="step", unit_scale=True, leave=False, disable=None, delay=1.0
        ) as bar:
            c_host, why = None, ""
            try:
                c_host = use_cost.in_c_host(unpacked, (*USES, *map(use_cost.use_of, (*RUNGS, SMOOTHED))), rounds)
            except RuntimeError as error:
                why = str(error)
            fmpy_host = use_cost.through_fmpy(unpacked, RUNGS, fmpy_rounds, bar.update)
            bar.set_description("error of the tip")
            errors = coupled.measure(unpacked, PROFILES, RUNGS, steps, bar.update)
            windows = smoothing.measure(unpacked, smallest_step_ms, bar.update)
    results = Results(errors, windows, c_host, fmpy_host, reports.machine(), why)
    written = write_tables(output, results, sections)
    written += speed_figures.draw_all(
        output,
        errors,
        windows,
        profiles=PROFILES,
        reference=REFERENCE,
        c_host=c_host,
        fmpy_host=fmpy_host,
        uses=USES,
    )
    return results, sorted(written)


def write_figure(fmu: Path, path: Path) -> None:
    """The documentation's figure: errors on the reference profile, with every step."""
    profile = next(p for p in PROFILES if p.key == REFERENCE)
    with UnpackedFmu(fmu) as unpacked:
        errors = coupled.measure(unpacked, [profile], RUNGS, STEPS_MS, lambda steps: None)
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
    more_as_good, more_within = (
        float(f"{errors.times_more_steps(REFERENCE, HELD.key, error, HEADLINE_MS):.2g}")
        for error in (full.worst[0], TOLERANCE)
    )
    return [
        (
            f"At {HEADLINE_MS:g} ms, on a crank that ripples by 10 %, angle, speed and acceleration keep the tip "
            f"within {full.worst[0] * 1e3:.4f} mm of the truth, where a held input is {held.worst[0] * 1e3:.1f} mm off "
            f"({held.first_second * 1e3:.1f} mm within the first second)."
        ),
        (
            f"For the same error the held input needs {more_as_good:.0f} times the steps, that is "
            f"{math.log10(more_as_good):.1f} decimal orders more; for {TOLERANCE * 1e3:g} mm, {more_within:.0f} times "
            f"({math.log10(more_within):.1f} orders). "
            f"Both are extrapolated from {HEADLINE_MS:g} ms by its fitted order, {order:.2f}."
        ),
    ]


def dearest_rung(costs: Costs) -> str:
    """What giving more of the crank costs a step, to end a sentence with; "" where the scatter is too large to tell."""
    ratios = [costs.ratios(rung.key, HELD.key) for rung in RUNGS if rung is not HELD]
    most = max(each.quartiles[1] for each in ratios)
    if any(each.side(most * (1 + STEADY)) >= 0 for each in ratios):
        return ""
    return f": the step is what costs, no rung costs more than {most * (1 + STEADY):.1f} times the held step"


def reading(results: Results) -> list[str]:
    """Which rung to take at which step: three sentences."""
    errors, costs = results.coupling, results.c_host or results.fmpy_host
    largest = {rung.key: errors.largest_step(REFERENCE, rung.key, TOLERANCE) for rung in RUNGS}
    by_step: dict[float, list[str]] = {}
    for rung in RUNGS:
        if rung not in (HELD, AT_END):
            by_step.setdefault(largest[rung.key], []).append(rung.title)
    within = "; ".join(
        f"{' or '.join(titles)}, {f'{step:g} ms' if step else 'none of these steps'}"
        for step, titles in sorted(by_step.items(), reverse=True)
    )
    windows = results.smoothing
    finest = windows.steps_ms[0]
    window = windows.best_window(finest)
    with_speed = errors.at("encoder", "angle_speed", errors.steps_ms[0]).worst[2]
    step = 1.0 if 1.0 in errors.steps_ms else errors.steps_ms[0]
    jumps = {rung.key: errors.at("clutch", rung.key, step).worst for rung in RUNGS}
    return [
        (
            f"Give all that the drive knows and take the largest step that keeps your tolerance (for "
            f"{TOLERANCE * 1e3:g} mm on the rippling crank: {within}){dearest_rung(costs)}."
        ),
        (
            "Where the angle comes from an encoder, connect crank.w or set crank.smoothing: with a 20-bit angle alone "
            f"the acceleration's worst error at {finest:g} ms is {number(windows.worst(NOISY, 0.0, finest, 2), 2)} "
            f"mm/s2, smoothed over {window:g} ms {number(windows.worst(NOISY, window, finest, 2), 2)}, with the speed "
            f"{number(with_speed, 2)}."
        ),
        (
            f"A jump in speed is foreseen by no rung, so its step is off by about jump times step (here at {step:g} ms "
            f"{number(jumps['derivative_1'][0])} mm with input derivatives, {number(jumps['angle_speed'][0])} with the "
            f"speed, {number(jumps['angle'][0])} with the angle alone); none carries it on, but where the angle is all "
            f"there is, the acceleration is off by {number(jumps['angle'][2], 2)} mm/s2 for the steps that it takes to "
            f"tell (with the speed {number(jumps['angle_speed'][2], 2)}): smaller steps lessen only the position's "
            "error."
        ),
    ]


# --- tables -----------------------------------------------------------------------------------


def headline(results: Results) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: the rungs on the reference profile."""
    errors = results.coupling
    shown = [step for step in BY_PROFILE_MS if step in errors.steps_ms] or [HEADLINE_MS]
    headings = (
        "what the host gives",
        *(f"at {step:g} ms / mm" for step in shown),
        "order",
        f"step for {TOLERANCE * 1e3:g} mm",
        *(["time in C"] if results.c_host else []),
        "time in fmpy",
    )
    rows = []
    for rung in RUNGS:
        largest = errors.largest_step(REFERENCE, rung.key, TOLERANCE)
        hosts = [host for host in (results.c_host, results.fmpy_host) if host is not None]
        rows.append(
            (
                rung.title,
                *(number(errors.at(REFERENCE, rung.key, step).worst[0]) for step in shown),
                _order(errors.order(REFERENCE, rung.key)),
                f"{largest:g} ms" if largest else f"< {errors.steps_ms[0]:g} ms",
                *(str(host.ratios(rung.key, HELD.key)) for host in hosts),
            )
        )
    return headings, rows


def profile_table(errors: Coupling, profile: str) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: every rung on one profile; worst errors and fitted orders."""
    shown = [step for step in BY_PROFILE_MS if step in errors.steps_ms] or [HEADLINE_MS]
    headings = (
        "what the host gives",
        *(
            heading
            for quantity, unit in zip(QUANTITIES, UNITS, strict=True)
            for heading in (*(f"{quantity} at {step:g} ms / {unit}" for step in shown), "order")
        ),
    )
    rows = [
        (
            rung.title,
            *(
                cell
                for n in range(len(QUANTITIES))
                for cell in (
                    *(number(errors.at(profile, rung.key, step).worst[n], n) for step in shown),
                    _order(errors.order(profile, rung.key, n)),
                )
            ),
        )
        for rung in RUNGS
    ]
    return headings, rows


def start_up_table(errors: Coupling, profile: str) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: position after each of the first steps."""
    headings = ("what the host gives", *(f"step {k + 1} / mm" for k in range(START_UP)))
    rows = [
        (rung.title, *(number(row[0]) for row in errors.at(profile, rung.key, HEADLINE_MS).start_up)) for rung in RUNGS
    ]
    return headings, rows


def smoothing_table(windows: Smoothing) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: by window, the noisy angle's acceleration and position, the exact one's position."""
    columns = (
        (NOISY, 2, "acceleration", "encoder"),
        (NOISY, 0, "position", "encoder"),
        (EXACT, 0, "position", "exact"),
    )
    headings = (
        "crank.smoothing",
        *(
            f"{name}, {given}, {step:g} ms / {UNITS[quantity]}"
            for _, quantity, name, given in columns
            for step in windows.steps_ms
        ),
    )
    rows = [
        (
            f"{window:g} ms" if window else "0 (none)",
            *(
                number(windows.worst(profile, window, step, quantity), quantity)
                for profile, quantity, _, _ in columns
                for step in windows.steps_ms
            ),
        )
        for window in WINDOWS_MS
    ]
    return headings, rows


def use_table(costs: Costs) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows: what a step costs by what it reads."""
    headings = (
        "what is read",
        "outputs",
        "time of a step (positions = 1)",
        "middle half of the rounds",
        "in calls of sincos",
    )
    rows = []
    for use in USES:
        low, high = costs.spread(use.key, BASE)
        read = f"{len(use.outputs)}" + (f" and {len(use.sensitivities)} by angle" if use.sensitivities else "")
        rows.append(
            (
                use.title,
                read,
                f"{costs.ratio(use.key, BASE):.2f}",
                f"{low:.2f} to {high:.2f}",
                f"{costs.ratio(use.key, 'sincos'):.1f}",
            )
        )
    return headings, rows


def write_tables(output: Path, results: Results, sections: Mapping[str, str]) -> list[Path]:
    """Write the Markdown report and the CSV files; returns their paths."""
    errors = results.coupling
    (output / "speed_vs_error.md").write_text(report(results, sections), encoding="utf-8")
    reports.write_csv(
        output / "coupling.csv",
        (
            "profile",
            "rung",
            "step_ms",
            "steps_per_s",
            *(
                f"{kind}_{name}_{unit}"
                for kind in ("worst", "median")
                for name, unit in zip(QUANTITIES, ("m", "m_s", "m_s2"), strict=True)
            ),
        ),
        (
            (e.profile, e.rung, f"{e.step_ms:g}", f"{1e3 / e.step_ms:g}", *(f"{v:.6g}" for v in (*e.worst, *e.median)))
            for e in errors.all
        ),
    )
    reports.write_csv(
        output / "orders.csv",
        ("profile", "rung", *QUANTITIES),
        (
            (p.key, rung.key, *(f"{errors.order(p.key, rung.key, n):.3f}" for n in range(len(QUANTITIES))))
            for p in PROFILES
            for rung in RUNGS
        ),
    )
    reports.write_csv(
        output / "start_up.csv",
        ("profile", "rung", "step_ms", "step", "position_m", "velocity_m_s", "acceleration_m_s2"),
        (
            (e.profile, e.rung, f"{e.step_ms:g}", k + 1, *(f"{v:.6g}" for v in row))
            for e in errors.all
            for k, row in enumerate(e.start_up)
        ),
    )
    windows = results.smoothing
    reports.write_csv(
        output / "smoothing.csv",
        ("profile", "window_ms", "step_ms", "position_m", "velocity_m_s", "acceleration_m_s2"),
        (
            (
                profile.key,
                f"{window:g}",
                f"{step:g}",
                *(f"{windows.worst(profile, window, step, n):.6g}" for n in range(3)),
            )
            for profile in (NOISY, EXACT)
            for window in WINDOWS_MS
            for step in windows.steps_ms
        ),
    )
    hosts = {"C": results.c_host, "fmpy": results.fmpy_host}
    bases = {"use": BASE, "rung": HELD.key}
    rows = []
    for host, costs in hosts.items():
        for key in costs.rounds if costs else ():
            kind = "use" if key in {use.key for use in USES} else "rung"
            if key != "sincos":
                low, high = costs.spread(key, bases[kind])
                ratios = costs.ratio(key, bases[kind]), low, high
                rows.append((host, kind, key, bases[kind], *(f"{ratio:.4f}" for ratio in ratios)))
    reports.write_csv(
        output / "use_cost.csv",
        ("host", "kind", "key", "in_times_of", "median", "lower_quartile", "upper_quartile"),
        rows,
    )
    names = ("speed_vs_error.md", "coupling.csv", "orders.csv", "start_up.csv", "smoothing.csv", "use_cost.csv")
    return [output / name for name in names]


def report(results: Results, sections: Mapping[str, str]) -> str:
    """The Markdown report; ``sections`` are those of the other parts."""
    errors, table = results.coupling, reports.markdown_table
    low, high = ORDER_RANGE_MS
    parts = [
        "# Speed against error",
        "",
        f"Measured on: {results.machine}. Written by `python -m scenarios.speed_vs_error`.",
        "",
        "## Which way to take",
        "",
        *(f"- {sentence}" for sentence in reading(results)),
        "",
        "## The headline",
        "",
        (
            "Worst error of the tip on a crank at 65 turns a minute that ripples by 10 % at 3 Hz, over 12 s; time of a "
            "step in times of the held one (a range where the rounds scatter: their middle half), position, velocity "
            "and acceleration read; the largest of these steps that keeps "
            f"{TOLERANCE * 1e3:g} mm."
        ),
        "",
        table(*headline(results)),
        *(f"{sentence}\n" for sentence in promises(results)),
        "![Error against speed](error_over_speed.png)",
        "",
        "## Coupling",
        "",
        (
            "In FMI an input set before a step belongs to its start, an output read after it to its end. A rung is "
            "what the host gives of the crank; *held* is a component that predicts nothing (`crank.at_step_end` with "
            "inputs of the step's start). The truth is the same FMU in initialization mode, where outputs follow "
            f"inputs, at the true angle, speed and acceleration; its solving error, about 1e-15 m, is not seen here. "
            f"The first {START_UP} steps are reported apart. Orders are slopes fitted over {low:g} to {high:g} ms, "
            "where the errors stand clear of rounding; where noise or a jump rules, the slope is no order of the "
            "method. *exact*: as small as the solving error."
        ),
        "",
    ]
    for name in QUANTITIES:
        parts += [f"![Worst error of the {name}](error_of_{name}.png)", ""]
    for profile in PROFILES:
        parts += [f"### {profile.title[0].upper()}{profile.title[1:]}", ""]
        parts += [f"{profile.remark}\n"] if profile.remark else []
        parts += [table(*profile_table(errors, profile.key))]
    parts += [
        "## Start-up",
        "",
        f"Position error after each of the first {START_UP} steps of {HEADLINE_MS:g} ms, while the histories fill.",
        "",
    ]
    for profile in PROFILES:
        if profile.key in (REFERENCE, "start"):
            parts += [
                f"{profile.title[0].upper()}{profile.title[1:]}:",
                "",
                table(*start_up_table(errors, profile.key)),
            ]
    smoothed_cost = (
        f" In a C host a step that smooths takes {results.c_host.ratios(SMOOTHED.key, ANGLE.key)} times "
        "one that does not."
        if results.c_host
        else ""
    )
    parts += [
        "## Smoothing",
        "",
        (
            "The angle alone on the rippling crank, as a 20-bit encoder reads it and exactly, with `crank.smoothing` "
            "from none to 48 ms: worst errors once the window is full. A window buys what it averages over and costs "
            f"its lag, which grows with its fourth power.{smoothed_cost}"
        ),
        "",
        table(*smoothing_table(results.smoothing)),
        "![What smoothing buys and costs](smoothing.png)",
        "",
    ]
    parts += [sections["solving"], sections["dynamics"], sections["cost"]]
    parts += ["## What a step costs by what is read", ""]
    if results.c_host is None:
        parts += [f"Not measured: the C host could not be built or run here ({results.why.partition(chr(10))[0]}).", ""]
    else:
        parts += [
            (
                "A C host sets the crank's angle, speed and acceleration (from the ground frame on also the machine's "
                "speed, from the torque on also the soil's force), does a step and reads; each line reads what the "
                f"lines above it read, too. Medians of the ratios within {len(results.c_host.rounds[BASE])} "
                f"interleaved rounds. {noise_here(results.c_host.rounds['sincos'], SINCOS)}"
            ),
            "",
            table(*use_table(results.c_host)),
            "![What a step pays for what is read](uses.png)",
            "",
        ]
    parts += [
        sections["hard_cases"],
        "## Files",
        "",
        (
            "`coupling.csv`: every worst and median error; `orders.csv`: the fitted orders (nan: less than three "
            "errors clear of rounding); `start_up.csv`: the first steps; `smoothing.csv`: worst errors by window; "
            "`use_cost.csv`: the ratios of times. SI units."
        ),
        "",
    ]
    return "\n".join(parts)


def show(results: Results, console: Console) -> None:
    """Print the summary of the coupling."""
    tables = [("Worst error of the tip: 10 % ripple at 3 Hz; time of a step: held = 1", headline(results))]
    if results.c_host is not None:
        tables.append((f"What a step pays for what is read, in a C host: {results.machine}", use_table(results.c_host)))
    for title, (headings, rows) in tables:
        reports.show_table(console, title, headings, rows)
    for sentence in (*promises(results), *reading(results)):
        console.print(f"- {sentence}", markup=False)


if __name__ == "__main__":
    sys.exit(main())
