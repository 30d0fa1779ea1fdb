"""What one communication step costs, beside the bare core: FMI 2.0, FMI 3.0, Model Exchange, derivatives, the twin.

A C host (step_cost.c) loads the FMUs and interleaves rounds of: libm's sincos, the bare core
(linkage/) alone, and whole steps. Then fmpy steps the FMU and the twin in turns. Ratios are
medians over the rounds of one run, so that a busy machine slows both sides alike; nanoseconds are
given for orientation only, and verdicts only where the scatter carries them.
"""

from __future__ import annotations

import csv
import io
import statistics
import subprocess
import tempfile
import time
import zipfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from scenarios.common import reports
from scenarios.common.command import ROOT
from scenarios.common.instance import Instance, UnpackedFmu
from scenarios.common.masses import plausible
from scenarios.common.reports import machine
from scenarios.common.timing import Ratios, noise_here
from scenarios.speed_vs_error.yardstick import (
    INTERFACE_SOURCE,
    LINKAGE_SOURCES,
    NOMINAL,
    compile_program,
    host_platform,
)

ROUNDS = 1001
STEP = "step_phi_w_a_get_6"
FOR_DRIVE = "step_for_drive"
STEP_IN_CORES, STEP_IN_SINCOS = 1.4, 5.8  # what a step may cost at most
FOR_DRIVE_IN_STEPS = 1.6  # what one with masses may, for a drive
HOST_SOURCE = Path(__file__).with_name("step_cost.c")

MEANING = {
    "multiplication": "a multiplication that waits for the last one",
    "sincos": "libm's sincos",
    "core_0": "bare core: position",
    "core_1": "bare core: + velocity",
    "core_2": "bare core: + acceleration",
    "core_2_chain": "the same, each angle waiting for the last acceleration",
    "step_phi_w_a_get_6": "step: angle, speed, acceleration in; position, velocity, acceleration out",
    "step_phi_w_get_6": "step: angle, speed in; the same out",
    "step_phi_get_6": "step: angle in; the same out",
    "step_phi_w_a_get_4": "step: three in; position, velocity out",
    "step_phi_w_a_get_2": "step: three in; position out",
    "step_phi_w_a_get_0": "step: three in; nothing read",
    "step_for_drive": "step: three in; crank torque, inertia and bias out, with all masses set",
    "step_fmi3": "FMI 3.0 step: three in; position, velocity, acceleration out",
    "model_exchange": "Model Exchange: time and three in; the same out",
    "initializing": "initialization mode: three in; the same out",
    "initializing_directional": "the same, and its derivative along all parameters",
    "initializing_adjoint": "the same, and its gradient by all parameters",
}


def perform(output: Path, fmu: Path, fmi3: Path, twin: Path, rounds: int = ROUNDS) -> tuple[str, list[Path]]:
    """Measure, print and write into `output`; returns the section of the report and the files written.

    Raises RuntimeError where no C host can be built or run here.
    """
    with ExitStack() as stack:
        edition2, twins = (stack.enter_context(UnpackedFmu(path)) for path in (fmu, twin))
        measured = measure(edition2, fmi3, rounds)
        remark = measure_fmpy([edition2, twins])
    rows = summarize(measured)
    versions = Ratios(np.array([r["step_fmi3"] / r[STEP] for r in measured]))
    remarks = [
        *verdicts(measured),
        chain(measured, machine()),
        f"FMI 3.0 step / FMI 2.0 step: {versions}.",
        remark,
        noise_here([r["sincos"] for r in measured], MEANING["sincos"]),
    ]
    heading = f"{machine()}, {rounds} rounds of 2000"
    show(rows, heading)
    for sentence in remarks:
        print(f"- {sentence}")
    return section(rows, heading, remarks), [write_rounds(output, measured)]


def measure(fmu: UnpackedFmu, fmi3: Path, rounds: int) -> list[dict[str, float]]:
    """Nanoseconds of each measurement, one dictionary a round."""
    target = host_platform()
    with tempfile.TemporaryDirectory() as folder:
        library3 = zipfile.ZipFile(fmi3).extract(f"binaries/{target.other_folder}/{fmu.library.name}", folder)
        host = Path(folder) / "step_cost"
        options = ("-I", str(ROOT), "-ldl", "-Wno-conversion")
        compile_program((HOST_SOURCE, *LINKAGE_SOURCES, INTERFACE_SOURCE), host, target, *options)
        masses = plausible(NOMINAL)
        values = [repr(masses[name]) for name in sorted(masses, key=lambda name: fmu.reference[name])]
        command = [str(host), str(fmu.library), library3, fmu.guid, str(rounds), *values]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(io.StringIO(output))]


def measure_fmpy(fmus: Sequence[UnpackedFmu], rounds: int = 15, steps: int = 500) -> str:
    """The same step through fmpy's FMU objects, a sentence: microseconds of each FMU, and their ratio."""
    times: list[list[float]] = [[] for _ in fmus]
    with ExitStack() as stack:
        hosts = [(stack.enter_context(Instance(fmu)).slave, fmu.reference) for fmu in fmus]
        for _ in range(rounds):
            for host, taken in zip(hosts, times, strict=True):
                taken.append(fmpy_step_time(*host, steps))
    native, twin = [statistics.median(taken) * 1e6 for taken in times]
    ratios = Ratios(np.array(times[1]) / np.array(times[0]))
    return f"Through fmpy: FMU {native:.1f} us a step, twin {twin:.0f} us, {ratios} times as long."


def fmpy_step_time(instance, reference: dict[str, int], steps: int) -> float:
    """Seconds a step: three inputs set, step done, six outputs read."""
    inputs = [reference[f"crank.{name}"] for name in ("phi", "w", "a")]
    outputs = [reference[f"tip.{name}"] for name in ("x", "y", "vx", "vy", "ax", "ay")]
    instance.reset()
    instance.setupExperiment(startTime=0.0)
    instance.enterInitializationMode()
    instance.exitInitializationMode()
    begin = time.perf_counter()
    for i in range(steps):
        instance.setReal(inputs, [i * 6.8e-3, 6.8, 0.01])
        instance.doStep(i * 1e-3, 1e-3)
        instance.getReal(outputs)
    return (time.perf_counter() - begin) / steps


Row = tuple[str, float, Ratios, Ratios]  # what is measured, its median in ns, in times of the core and of sincos


def summarize(rounds: list[dict[str, float]]) -> list[Row]:
    """Per measurement: median time, and the ratios within each round."""

    def of(name: str, base: str) -> Ratios:
        return Ratios(np.array([r[name] / r[base] for r in rounds]))

    return [
        (MEANING[name], statistics.median(r[name] for r in rounds), of(name, "core_2"), of(name, "sincos"))
        for name in rounds[0]
    ]


BOUNDS = (
    ("A step with three inputs and six outputs", STEP, "core_2", STEP_IN_CORES),
    ("A step with three inputs and six outputs", STEP, "sincos", STEP_IN_SINCOS),
    ("A step that reads torque, inertia and bias, with all masses set,", FOR_DRIVE, STEP, FOR_DRIVE_IN_STEPS),
)  # what is measured, its key, what it is measured by, how often that it may take at most


def verdicts(rounds: list[dict[str, float]]) -> list[str]:
    """Whether a step keeps its bounds on this machine; where the scatter does not tell, that is what is said."""
    said = []
    for title, name, base, bound in BOUNDS:
        ratios = Ratios(np.array([r[name] / r[base] for r in rounds]))
        verdict = {-1: "kept", 0: "not to be told from the scatter of this run", 1: "not kept"}[ratios.side(bound)]
        low, high = ratios.quartiles
        said.append(
            f"{title} in times of {MEANING[base]}: {ratios.median:.2f} (middle half "
            f"{low:.2f} to {high:.2f}); the bound of {bound:g} is {verdict}."
        )
    return said


# Cycles until the product of two doubles is there: Intel since Skylake, AMD since Zen (uops.info).
CYCLES = {"Intel": 4, "AMD": 3}


def chain(rounds: list[dict[str, float]], processor: str) -> str:
    """What bounds the core, a sentence: how long its chain of operations is, and how much evaluations overlap."""
    in_multiplications = Ratios(np.array([r["core_2_chain"] / r["multiplication"] for r in rounds]))
    overlapped = Ratios(np.array([r["core_2"] / r["core_2_chain"] for r in rounds]))
    cycles = next((number for name, number in CYCLES.items() if name in processor), None)
    in_cycles = f", {cycles * in_multiplications.median:.0f} cycles at {cycles} each" if cycles else ""
    return (
        "What bounds an evaluation is its chain of operations that wait for one another, "
        f"{in_multiplications} multiplications long{in_cycles}. In a loop over angles that are known beforehand, where "
        f"evaluations could overlap, one takes {overlapped} of that; a step has a chain of its own before it, from the "
        "inputs to the angle of its end, and three calls."
    )


HEADINGS = ("measurement", "ns", "/ bare core", "middle half", "/ sincos")


def cells(row: Row) -> tuple[str, ...]:
    name, ns, of_core, of_sincos = row
    low, high = of_core.quartiles
    return name, f"{ns:.1f}", f"{of_core.median:.2f}", f"{low:.2f} to {high:.2f}", f"{of_sincos.median:.2f}"


def show(rows: list[Row], heading: str) -> None:
    reports.show_table(reports.console(), f"Cost of a step: {heading}", HEADINGS, map(cells, rows))


def section(rows: list[Row], heading: str, remarks: Sequence[str]) -> str:
    """The section of the report on speed and error."""
    return "\n".join(
        [
            "## Cost of a step",
            "",
            (
                f"A C host beside the bare core, in one process. Measured on: {heading}. Nanoseconds are for "
                "orientation; the ratios are medians over the rounds. `step_cost.csv` has every round."
            ),
            "",
            reports.markdown_table(HEADINGS, map(cells, rows)),
            *(f"- {remark}" for remark in remarks),
            "",
        ]
    )


def write_rounds(output: Path, rounds: list[dict[str, float]]) -> Path:
    """step_cost.csv in `output`: nanoseconds, a row a round."""
    output.mkdir(parents=True, exist_ok=True)
    reports.write_csv(output / "step_cost.csv", tuple(rounds[0]), (tuple(r.values()) for r in rounds))
    return output / "step_cost.csv"
