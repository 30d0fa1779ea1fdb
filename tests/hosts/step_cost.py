"""What one communication step costs: `python -m tests.hosts.step_cost`, which is `make bench`.

A C host (step_cost.c) loads the FMU and interleaves rounds of: libm's sincos, the bare core
(linkage/) alone, and whole steps. Then fmpy steps the FMU and the twin in turns. Ratios are
medians over the rounds of one run, so that a busy machine slows both sides alike; nanoseconds are
given for orientation only.
"""

from __future__ import annotations

import argparse
import csv
import io
import platform
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

import fmpy
from rich.console import Console
from rich.table import Table

from fmu_src.exporter import compiler
from fmu_src.interface import load_interface

HOST_SOURCE = Path(__file__).with_name("step_cost.c")

MEANING = {
    "sincos": "libm's sincos",
    "core_0": "bare core: position",
    "core_1": "bare core: + velocity",
    "core_2": "bare core: + acceleration",
    "step_phi_w_a_get_6": "step: angle, speed, acceleration in; position, velocity, acceleration out",
    "step_phi_w_get_6": "step: angle, speed in; the same out",
    "step_phi_get_6": "step: angle in; the same out",
    "step_phi_w_a_get_4": "step: three in; position, velocity out",
    "step_phi_w_a_get_2": "step: three in; position out",
    "step_phi_w_a_get_0": "step: three in; nothing read",
    "step_fmi3": "FMI 3.0 step: three in; position, velocity, acceleration out",
    "model_exchange": "Model Exchange: time and three in; the same out",
    "initializing": "initialization mode: three in; the same out",
    "initializing_directional": "the same, and its derivative along all parameters",
    "initializing_adjoint": "the same, and its gradient by all parameters",
}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="step_cost", description=__doc__.splitlines()[0])
    parser.add_argument("--fmu", type=Path, default=Path("build/fmi2/TransplanterLinkage.fmu"))
    parser.add_argument("--fmi3", type=Path, default=Path("build/fmi3/TransplanterLinkage.fmu"))
    parser.add_argument("--twin", type=Path, default=Path("build/twin/TransplanterLinkageTwin.fmu"))
    parser.add_argument("--output", type=Path, default=Path("build/reports/step_cost"))
    parser.add_argument("--rounds", type=int, default=1001)
    chosen = parser.parse_args(arguments)
    for fmu in (chosen.fmu, chosen.fmi3, chosen.twin):
        if not fmu.exists():
            print(f"step_cost: {fmu} is missing: `make build` makes it", file=sys.stderr)
            return 1
    rounds = measure(chosen.fmu, chosen.fmi3, chosen.rounds)
    rows = summarize(rounds)
    versions = statistics.median(r["step_fmi3"] / r["step_phi_w_a_get_6"] for r in rounds)
    remark = f"FMI 3.0 step / FMI 2.0 step: {versions:.2f}. {measure_fmpy([chosen.fmu, chosen.twin])}"
    heading = f"{processor()}, {platform.system()}, {chosen.rounds} rounds of 2000"
    show(rows, heading)
    print(remark)
    write(rows, rounds, heading, remark, chosen.output)
    print(f"written to {chosen.output}/")
    return 0


def measure(fmu: Path, fmi3: Path, rounds: int) -> list[dict[str, float]]:
    """Nanoseconds of each measurement, one dictionary a round."""
    target = compiler.host_platform()
    model = load_interface().model.name
    with tempfile.TemporaryDirectory() as folder:
        libraries = [
            zipfile.ZipFile(file).extract(f"binaries/{name}/{model}{target.suffix}", folder)
            for file, name in ((fmu, target.folder), (fmi3, target.other_folder))
        ]
        host = Path(folder) / "step_cost"
        sources = (HOST_SOURCE, *compiler.LINKAGE_SOURCES, compiler.SOURCE_ROOT / "component" / "interface.c")
        compiler.compile_program(sources, host, target, "-ldl", "-Wno-conversion")
        command = [str(host), *libraries, load_interface().token, str(rounds)]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(io.StringIO(output))]


def measure_fmpy(fmus: list[Path], rounds: int = 15, steps: int = 500) -> str:
    """The same step through fmpy's FMU objects, a sentence: microseconds of each FMU, and their ratio."""
    times: list[list[float]] = [[] for _ in fmus]
    with tempfile.TemporaryDirectory() as folder:
        hosts = []
        for fmu in fmus:
            description = fmpy.read_model_description(str(fmu))
            unpacked = fmpy.extract(str(fmu), str(Path(folder) / fmu.stem))
            reference = {v.name: v.valueReference for v in description.modelVariables}
            hosts.append((fmpy.instantiate_fmu(unpacked, description, "CoSimulation"), reference))
        for _ in range(rounds):
            for host, taken in zip(hosts, times, strict=True):
                taken.append(fmpy_step_time(*host, steps))
    native, twin = ([statistics.median(taken) * 1e6 for taken in times])
    ratio = statistics.median(t / n for n, t in zip(*times, strict=True))
    return f"Through fmpy: FMU {native:.1f} us a step, twin {twin:.0f} us, {ratio:.0f} times as long."


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


def summarize(rounds: list[dict[str, float]]) -> list[dict[str, float | str]]:
    """Per measurement: median time, and medians of the ratios within a round."""
    return [
        {
            "measurement": MEANING[name],
            "ns": statistics.median(r[name] for r in rounds),
            "of core": statistics.median(r[name] / r["core_2"] for r in rounds),
            "of sincos": statistics.median(r[name] / r["sincos"] for r in rounds),
        }
        for name in rounds[0]
    ]


def show(rows: list[dict[str, float | str]], heading: str) -> None:
    table = Table(title=f"Cost of a step: {heading}", title_justify="left")
    table.add_column("measurement")
    for column in ("ns", "/ bare core", "/ sincos"):
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(row["measurement"], f"{row['ns']:.1f}", f"{row['of core']:.2f}", f"{row['of sincos']:.2f}")
    Console(width=None if sys.stdout.isatty() else 120).print(table)


def write(
    rows: list[dict[str, float | str]], rounds: list[dict[str, float]], heading: str, remark: str, output: Path
) -> None:
    output.mkdir(parents=True, exist_ok=True)
    lines = [f"# Cost of a step\n\n{heading}. Written by `make bench`.\n"]
    lines += ["| measurement | ns | / bare core | / sincos |", "|---|---:|---:|---:|"]
    lines += [f"| {r['measurement']} | {r['ns']:.1f} | {r['of core']:.2f} | {r['of sincos']:.2f} |" for r in rows]
    lines += ["", remark]
    (output / "step_cost.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    with (output / "rounds.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rounds[0].keys())
        writer.writeheader()
        writer.writerows(rounds)


def processor() -> str:
    """The processor's name as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


if __name__ == "__main__":
    sys.exit(main())
