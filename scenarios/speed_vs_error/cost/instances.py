"""What a step costs where one host steps many instances in turns: 1 to 100 000, whose data no cache holds.

A C host (instances.c) steps all of a count in turns, in interleaved rounds of one run. What is reported are the
ratios, within a round, to one instance alone, and the bytes that the FMU asks the host for.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from scenarios.common import reports
from scenarios.common.command import ROOT
from scenarios.common.figures import BLUE, NOTE, save_all
from scenarios.common.instance import UnpackedFmu
from scenarios.common.reports import machine
from scenarios.common.timing import Ratios
from scenarios.speed_vs_error.yardstick import compile_program, host_platform

COUNTS = (1, 10, 100, 1000, 10_000, 100_000)
ROUNDS = 101
MOST_TIMES, MOST_BYTES = 1.5, 2048  # what was asked of 100 000 instances, and of the memory of one
HOST_SOURCE = Path(__file__).with_name("instances.c")


@dataclass(frozen=True)
class Instances:
    """Nanoseconds of a step by the number of instances, an array of rounds each; bytes of one instance."""

    rounds: Mapping[int, np.ndarray]
    size: int

    def ratios(self, count: int) -> Ratios:
        """In times of one alone."""
        return Ratios(self.rounds[count] / self.rounds[1])


def perform(output: Path, fmu: Path, rounds: int = ROUNDS, most: int = COUNTS[-1]) -> tuple[str, list[Path]]:
    """Measure up to ``most`` instances, print and write into `output`; returns the report's section and the files.

    Raises RuntimeError where no C host can be built or run here.
    """
    with UnpackedFmu(fmu) as unpacked:
        found = measure(unpacked, tuple(count for count in COUNTS if count <= most), rounds)
    heading = f"{machine()}, {rounds} rounds"
    reports.show_table(reports.console(), f"Many instances: {heading}", HEADINGS, table(found))
    for sentence in (said := sentences(found)):
        print(f"- {sentence}")
    output.mkdir(parents=True, exist_ok=True)
    reports.write_csv(output / "instances.csv", tuple(map(str, found.rounds)), zip(*found.rounds.values(), strict=True))
    written = [output / "instances.csv", *save_all(output, {"instances": lambda: draw(found)})]
    return section(found, heading, said), written


def measure(fmu: UnpackedFmu, counts: tuple[int, ...], rounds: int) -> Instances:
    """Compile the host and let it measure; raises RuntimeError where it does not end well."""
    target = host_platform()
    with tempfile.TemporaryDirectory() as folder:
        host = Path(folder) / "instances"
        compile_program((HOST_SOURCE,), host, target, "-I", str(ROOT), "-ldl")
        command = [str(host), str(fmu.library), fmu.guid, str(rounds), *map(str, counts)]
        done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{HOST_SOURCE.name}: {done.stderr.strip() or f'ended with {done.returncode}'}")
    size, *lines = done.stdout.split()
    times = np.array([[float(cell) for cell in line.split(",")] for line in lines]).reshape(rounds, len(counts))
    return Instances(dict(zip(counts, times.T, strict=True)), round(float(size)))


HEADINGS = ("instances", "ns a step", "/ one alone", "middle half")


def table(found: Instances) -> list[tuple[str, ...]]:
    """Lines under HEADINGS."""
    lines = []
    for count, times in found.rounds.items():
        ratios = found.ratios(count)
        low, high = ratios.quartiles
        lines.append((thousands(count), f"{np.median(times):.0f}", f"{ratios.median:.2f}", f"{low:.2f} to {high:.2f}"))
    return lines


def thousands(count: int) -> str:
    return f"{count:,}".replace(",", " ")


def sentences(found: Instances) -> list[str]:
    """The memory of an instance; what one among the most costs and, where all counts were measured, the bound."""
    most = max(found.rounds)
    ratios = found.ratios(most)
    verdict = {-1: "kept", 0: "not to be told from the scatter of this run", 1: "not kept"}[ratios.side(MOST_TIMES)]
    within = "within" if found.size <= MOST_BYTES else "above"
    judged = f"; the bound of {MOST_TIMES:g} is {verdict}" if most == COUNTS[-1] else ""
    return [
        f"An instance asks its host for {found.size} bytes, {within} the {MOST_BYTES} that were aimed at.",
        f"One of {thousands(most)} instances costs {ratios} times one alone{judged}.",
    ]


def section(found: Instances, heading: str, said: list[str]) -> str:
    """The section of the report on speed and error."""
    return "\n".join(
        [
            "## Many instances",
            "",
            (
                "One C host steps instances in turns, three inputs set and six outputs read. Measured on: "
                f"{heading}; ratios are medians over the rounds. `instances.csv` has every round."
            ),
            "",
            reports.markdown_table(HEADINGS, table(found)),
            *(f"- {sentence}" for sentence in said),
            "",
            "![Cost of a step over the number of instances](instances.png)",
            "",
        ]
    )


def draw(found: Instances) -> Figure:
    """The ratios over the number of instances, with the middle half of the rounds."""
    figure, axes = plt.subplots(figsize=(8.0, 3.4))
    counts = list(found.rounds)
    ratios = np.array([found.ratios(count).median for count in counts])
    low, high = np.array([found.ratios(count).quartiles for count in counts]).T
    axes.fill_between(counts, low, high, color=BLUE, alpha=0.2, linewidth=0)
    axes.plot(counts, ratios, color=BLUE, marker="o")
    for count, ratio in zip(counts, ratios, strict=True):
        axes.annotate(f"{ratio:.2f}", (count, ratio), xytext=(0, 7), textcoords="offset points", ha="center")
    axes.set_xscale("log")
    axes.set_xticks(counts, [thousands(count) for count in counts])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_ylim(0, 1.15 * max(high.max(), ratios.max()))
    axes.set_xlabel(f"instances, stepped in turns; {found.size} bytes each")
    axes.set_ylabel("time of a step (one alone = 1)")
    axes.set_title("What a step costs among others, in a C host", loc="left")
    axes.text(0.99, 0.04, "band: middle half of the rounds", transform=axes.transAxes, ha="right", color=NOTE)
    figure.tight_layout()
    return figure
