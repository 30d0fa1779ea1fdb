"""Twelve rows on one crank: a linkage instance for each, turned against each other by phase offsets.

    python -m scenarios.twelve_rows

All rows get the same crank.phi, crank.w and machine.v. A row whose linkage is mounted ahead by an
angle has geometry.phi1 and geometry.phi4 smaller by it: its point A is at L1 e(phi1 - phi). A weight
hangs on every tip, so that crank.tau shows what the phases do to the shaft.

Then the cost of a communication step against the number of instances, from interleaved rounds.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from rich.console import Console
from tqdm import tqdm

from scenarios.common import command, figures, reports
from scenarios.common.instance import UnpackedFmu
from scenarios.common.linkage import Linkage
from scenarios.common.operating_point import PLANTING_SPEED, SPACING, TURN
from scenarios.common.timing import Ratios, noise_here

ROWS = 12
STEPS = 720  # of a turn; every offset is a whole number of them
WEIGHT = 10.0  # N on every tip: about that of a planting nozzle of 1 kg
INPUTS = ("crank.phi", "crank.w", "machine.v")
OUTPUTS = ("tip.x", "tip.y", "ground.x", "crank.tau")
GEOMETRY = ("geometry.phi1", "geometry.phi4")
COUNTS = (1, 2, 4, 8, 12, 24, 48, 96)
COST_STEPS, ROUNDS = 960, 31  # of one instance: of n instances the n-th part, so that all are timed for as long
HEADINGS = ("rows mounted", "shaft least / N.m", "greatest / N.m", "swing / N.m", "of all in phase")
COST_HEADINGS = (
    "instances",
    "a step (1 instance = 1)",
    "a step an instance",
    "middle half of the rounds",
    "beside one",
)
BESIDE_ONE = {-1: "cheaper", 0: "no difference seen", 1: "dearer"}


@dataclass(frozen=True)
class Mounting:
    """How far, in turns, each row is ahead of the first."""

    title: str
    offsets: tuple[float, ...]


MOUNTINGS = (
    Mounting("all in phase", (0.0,) * ROWS),
    Mounting("every other one half a turn ahead", tuple(k % 2 / 2 for k in range(ROWS))),
    Mounting("in threes, a third of a turn apart", tuple(k % 3 / 3 for k in range(ROWS))),
    Mounting("evenly, a twelfth of a turn apart", tuple(k / ROWS for k in range(ROWS))),
)


class Machine:
    """Rows on one crank: instances of one binary, loaded once; a context manager."""

    def __init__(self, fmu: UnpackedFmu, count: int) -> None:
        with contextlib.ExitStack() as opened:
            self.rows = [opened.enter_context(Linkage(fmu, f"row {k + 1}")) for k in range(count)]
            self._opened = opened.pop_all()
        reference = fmu.reference
        self._inputs, self._outputs, self._geometry, self._force = (
            [reference[name] for name in names] for names in (INPUTS, OUTPUTS, GEOMETRY, ("tip.fy",))
        )

    def start(self, offsets: Sequence[float]) -> None:
        """Mount the rows ahead by ``offsets`` turns, hang the weights on and initialise at crank angle 0."""
        for row, offset in zip(self.rows, offsets, strict=True):
            slave = row.slave
            slave.reset()
            slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
            slave.setReal(self._geometry, [angle - offset * TURN for angle in slave.getReal(self._geometry)])
            slave.setReal(self._inputs + self._force, [0.0, PLANTING_SPEED, SPEED, -WEIGHT])
            slave.exitInitializationMode()

    def turn(self, steps: int, of: int = STEPS) -> np.ndarray:
        """Take ``steps`` steps, each the ``of``-th part of a turn; rows x steps x OUTPUTS after each."""
        h = TURN / PLANTING_SPEED / of
        found = np.empty((len(self.rows), steps, len(OUTPUTS)))
        for i in range(steps):
            given = [i * h * PLANTING_SPEED, PLANTING_SPEED, SPEED]
            for k, row in enumerate(self.rows):
                row.slave.setReal(self._inputs, given)
                row.slave.doStep(i * h, h)
                found[k, i] = row.slave.getReal(self._outputs)
        return found

    def __enter__(self) -> Machine:
        return self

    def __exit__(self, *raised: object) -> None:
        self._opened.close()


SPEED = SPACING / (TURN / PLANTING_SPEED)  # m/s: one turn each plant spacing


def disagreement(runs: Sequence[np.ndarray]) -> float:
    """Worst distance in m of any row's tip from where the first row's tip is at the angle that it is ahead."""
    first = runs[0][0, :, :2]
    return max(
        float(np.abs(np.roll(first, -round(offset * STEPS), axis=0) - row[:, :2]).max())
        for mounting, run in zip(MOUNTINGS, runs, strict=True)
        for offset, row in zip(mounting.offsets, run, strict=True)
    )


def shaft_table(runs: Sequence[np.ndarray]) -> list[tuple[str, ...]]:
    """Rows under HEADINGS: the torque of the whole shaft over a turn."""
    shafts = [run[:, :, 3].sum(axis=0) for run in runs]
    return [
        (
            mounting.title,
            *(f"{value + 0.0:.2f}" for value in (shaft.min(), shaft.max(), np.ptp(shaft))),
            f"{np.ptp(shaft) / np.ptp(shafts[0]):.1%}",
        )
        for mounting, shaft in zip(MOUNTINGS, shafts, strict=True)
    ]


def cost(fmu: UnpackedFmu, counts: Sequence[int], rounds: int, done: tqdm) -> np.ndarray:
    """Time of a communication step of all rows in s: rounds x counts, in interleaved rounds."""
    taken = np.empty((rounds, len(counts)))
    with contextlib.ExitStack() as opened:
        machines = [opened.enter_context(Machine(fmu, count)) for count in counts]
        for i in range(rounds):
            for k, machine in enumerate(machines):
                machine.start([n / len(machine.rows) for n in range(len(machine.rows))])
                steps = COST_STEPS // len(machine.rows)
                begin = time.perf_counter()
                machine.turn(steps)
                taken[i, k] = (time.perf_counter() - begin) / steps
            done.update()
    return taken


def of_one_alone(taken: np.ndarray, counts: Sequence[int]) -> list[Ratios]:
    """What a step costs an instance among so many, in times of one alone, within a round."""
    return [Ratios(column / count) for column, count in zip((taken / taken[:, :1]).T, counts, strict=True)]


def cost_table(taken: np.ndarray, counts: Sequence[int]) -> list[tuple[str, ...]]:
    """Rows under COST_HEADINGS: medians of ratios within a round."""
    rows = []
    for count, each in zip(counts, of_one_alone(taken, counts), strict=True):
        low, high = each.quartiles
        beside = BESIDE_ONE[each.side()] if count > 1 else ""
        rows.append(
            (str(count), f"{count * each.median:.1f}", f"{each.median:.2f}", f"{low:.2f} to {high:.2f}", beside)
        )
    return rows


def cost_findings(taken: np.ndarray, counts: Sequence[int]) -> list[str]:
    """What the times allow to be said of an instance among others; nothing that their scatter does not carry."""
    each = dict(zip(counts, of_one_alone(taken, counts), strict=True))
    dearer = [count for count in counts[1:] if each[count].side() > 0]
    cheaper = [count for count in counts[1:] if each[count].side() < 0]
    said = []
    for kind, found in (("more", dearer), ("less", cheaper)):
        if found:
            listed = ", ".join(f"{count} ({each[count]} times)" for count in found)
            said.append(f"A step costs an instance {kind} than alone among {listed}.")
    level = [str(count) for count in counts[1:] if each[count].side() == 0]
    if level:
        worst = max(each[int(count)].quartiles[1] for count in level)
        said.append(
            f"Among {', '.join(level)} no difference from one alone is seen beyond the scatter, whose upper quartile "
            f"is {worst:.2f}."
        )
    return [*said, "All through fmpy, whose Python is most of the time."]


def draw(runs: Sequence[np.ndarray], taken: np.ndarray, counts: Sequence[int]) -> Figure:
    """The plants from above, the torque of the shaft over a turn, the cost of a step."""
    figure, (above, shaft, price) = plt.subplots(1, 3, figsize=(13.0, 4.6), layout="constrained")
    run, plants = runs[-1], 3
    for k in range(ROWS):
        x = run[k, np.argmin(run[k, :, 1]), 2] * 1e3 + np.arange(-1, plants) * SPACING * 1e3
        above.plot(x[x >= 0], np.full(np.count_nonzero(x >= 0), k + 1), "o", color=figures.GREEN, markersize=5)
    above.set(xlabel="ground.x / mm, direction of travel", ylabel="row", yticks=range(1, ROWS + 1), xlim=(-20, None))
    above.set_title("Plants from above, rows evenly ahead", loc="left")
    phi = 360 / STEPS * (1 + np.arange(STEPS))
    for mounting, each, (colour, dashes) in zip(
        MOUNTINGS,
        runs,
        ((figures.BLACK, "-"), (figures.VERMILLION, "--"), (figures.GREEN, "-."), (figures.BLUE, "-")),
        strict=True,
    ):
        shaft.plot(phi, each[:, :, 3].sum(axis=0), dashes, color=colour, label=mounting.title)
    shaft.set(
        xlabel="crank angle / degrees", ylabel="crank.tau of all rows / N·m", xlim=(0, 360), xticks=range(0, 361, 60)
    )
    shaft.set_ylim(top=shaft.get_ylim()[1] + 0.45 * np.ptp(shaft.get_ylim()))
    shaft.legend(loc="upper left", fontsize=8.5)
    shaft.set_title(f"Torque of the shaft, {WEIGHT:g} N on every tip", loc="left")
    ratios = of_one_alone(taken, counts)
    for k, (count, each) in enumerate(zip(counts, ratios, strict=True)):
        if count > 1:
            apart = count * np.linspace(0.93, 1.07, len(each.rounds))  # so that the rounds do not hide each other
            price.plot(apart, each.rounds, ".", color=figures.SKY, markersize=4, label="a round" if k == 1 else None)
            price.plot([count] * 2, each.quartiles, color=figures.BLUE, linewidth=2.2)
    middle = [each.median for each in ratios[1:]]
    price.plot(counts[1:], middle, "o", color=figures.BLUE, markersize=6, label="median and middle half")
    price.axhline(1, color=figures.BLACK, linewidth=1.0)
    price.set_xscale("log")
    price.xaxis.set_major_locator(FixedLocator(counts[1:]))
    price.xaxis.set_minor_locator(NullLocator())
    price.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    shown = np.concatenate([each.rounds for each in ratios[1:]])
    top = max(1.5, 1.15 * float(np.percentile(shown, 90)))
    price.set(xlabel="instances", ylabel="time of a step an instance (one alone = 1)", ylim=(0, top))
    beyond = int(np.count_nonzero(shown > top))
    above = f" ({beyond} of {len(shown)} lie above)" if beyond else ""
    handles, labels = price.get_legend_handles_labels()
    labels = [label + above * (label == "a round") for label in labels]
    price.legend(handles, labels, loc="upper right", bbox_to_anchor=(1.02, -0.12), ncols=2)
    price.set_title("Cost of an instance among others, through fmpy", loc="left")
    return figure


def scene(options: argparse.Namespace, console: Console) -> list[Path]:
    """Run, print and write everything; returns the files."""
    with (
        UnpackedFmu(options.fmu) as fmu,
        tqdm(total=len(MOUNTINGS) + options.rounds, unit="run", leave=False, disable=None, delay=1.0) as bar,
    ):
        options.output.mkdir(parents=True, exist_ok=True)
        runs = []
        with Machine(fmu, ROWS) as machine:
            for mounting in MOUNTINGS:
                machine.start(mounting.offsets)
                runs.append(machine.turn(STEPS))
                bar.update()
        taken = cost(fmu, COUNTS, options.rounds, bar)
    shafts, costs = shaft_table(runs), cost_table(taken, COUNTS)
    spent = cost_findings(taken, COUNTS)
    noise = noise_here(taken[:, 0], "a step of one instance")
    sentences = [
        (
            f"All {ROWS} instances run from one loaded binary side by side, and every tip is where the first row's is "
            f"at the angle that the row is ahead, within {disagreement(runs) * 1e3:.0e} mm."
        ),
        (
            f"Mounted evenly, the rows leave {shafts[-1][-1]} of the torque's swing that they have in phase "
            f"({shafts[-1][3]} of {shafts[0][3]} N.m), and their plants stand a twelfth of the spacing apart from row "
            "to row."
        ),
        *spent,
        noise,
    ]
    reports.show_table(console, f"Torque of the shaft over a turn, {WEIGHT:g} N on every tip", HEADINGS, shafts)
    reports.show_table(console, "Cost of a communication step", COST_HEADINGS, costs)
    for sentence in sentences:
        console.print(f"- {sentence}", markup=False)
    files = [options.output / name for name in ("twelve_rows.md", "turn.csv", "cost.csv", "twelve_rows.png")]
    files[0].write_text(
        "\n".join(
            [
                "# Twelve rows on one crank",
                "",
                (
                    f"Written by `python -m scenarios.twelve_rows` on: {reports.machine()}. "
                    f"{PLANTING_SPEED * 60 / TURN:.0f} turns a minute, plant spacing {SPACING * 1e3:.0f} mm, {STEPS} "
                    "communication steps a turn."
                ),
                "",
                *(f"- {sentence}" for sentence in sentences),
                "",
                "![Plants, torque and cost](twelve_rows.png)",
                "",
                reports.markdown_table(HEADINGS, shafts),
                (
                    f"A step of all instances; medians of the ratios within {options.rounds} interleaved rounds, in "
                    f"each of which {COST_STEPS} steps of an instance are timed. *Dearer* or *cheaper* than one alone "
                    "is what lies on one side of it with the middle half of each third of the rounds."
                ),
                "",
                reports.markdown_table(COST_HEADINGS, costs),
                "`turn.csv`: a turn of the evenly mounted rows, SI units.",
                "",
            ]
        ),
        encoding="utf-8",
    )
    reports.write_csv(
        files[1],
        ("row", "crank.phi", *OUTPUTS),
        (
            (k + 1, *(f"{value:.12g}" for value in (TURN * (i + 1) / STEPS, *sample)))
            for k, row in enumerate(runs[-1])
            for i, sample in enumerate(row)
        ),
    )
    reports.write_csv(files[2], COST_HEADINGS, costs)
    with plt.rc_context(figures.STYLE):
        figure = draw(runs, taken, COUNTS)
        figure.savefig(files[3])
        plt.close(figure)
    return files


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = command.parser("twelve_rows", __doc__)
    parser.add_argument(
        "--rounds",
        type=int,
        choices=range(3, 1001),
        default=ROUNDS,
        metavar="N",
        help="of the time measurements, 3 to 1000 (default: %(default)s)",
    )
    return command.run(scene, parser.parse_args(arguments))


if __name__ == "__main__":
    sys.exit(main())
