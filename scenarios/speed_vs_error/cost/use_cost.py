"""What a step of the linkage FMU costs a host: in C, and through fmpy.

A small C host (use_cost.c, compiled here with ziglang) measures uses and rungs
in interleaved rounds, so that a busy machine slows all alike. What is reported are medians of
the ratios within a round; only ratios of one run mean something.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np

from scenarios.common.command import ROOT
from scenarios.common.instance import UnpackedFmu
from scenarios.common.linkage import AT_STEP_END, CRANK, SMOOTHING, TIP, Linkage
from scenarios.common.operating_point import PLANTING_SPEED
from scenarios.common.timing import Ratios
from scenarios.speed_vs_error.coupling.crank_profiles import constant
from scenarios.speed_vs_error.coupling.measure import Rung, drive

HOST_SOURCE = Path(__file__).with_name("use_cost.c")
GROUND = ("ground.x", "ground.y", "ground.vx", "ground.vy", "ground.ax", "ground.ay")
# What the measured steps set: the crank turns evenly; a gentle acceleration, so that it counts.
VALUES = {
    "crank.phi": PLANTING_SPEED,
    "crank.w": PLANTING_SPEED,
    "crank.a": 0.01,
    "machine.v": 0.433,
    "tip.fx": -20.0,
    "tip.fy": 70.0,
}


@dataclass(frozen=True)
class Use:
    """What a host sets and reads in each step; ``sensitivities`` are outputs by crank.phi."""

    key: str
    title: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sensitivities: tuple[str, ...] = ()
    derivatives: int = 0
    flags: tuple[str, ...] = ()
    smoothing: float = 0.0


_ALL = (*TIP, *GROUND)
_FORCES = (*CRANK, "machine.v", "tip.fx", "tip.fy")
USES = (
    Use("nothing", "nothing read", CRANK, ()),
    Use("positions", "positions", CRANK, TIP[:2]),
    Use("velocities", "+ velocities", CRANK, TIP[:4]),
    Use("accelerations", "+ accelerations", CRANK, TIP),
    Use("ground", "+ ground frame", (*CRANK, "machine.v"), _ALL),
    Use("torque", "+ torque", _FORCES, (*_ALL, "crank.tau")),
    Use("sensitivities", "+ derivatives by crank.phi", _FORCES, (*_ALL, "crank.tau"), (*_ALL, "crank.tau")),
)
BASE = "positions"
FMPY_STEPS = 100  # a round of one rung through fmpy


def use_of(rung: Rung) -> Use:
    """A step of a rung, of which position, velocity and acceleration of the tip are read."""
    return Use(
        rung.key,
        rung.title,
        CRANK[: rung.inputs],
        TIP,
        derivatives=rung.derivatives,
        flags=(AT_STEP_END,) if rung.nothing_predicted else (),
        smoothing=rung.smoothing,
    )


@dataclass(frozen=True)
class Costs:
    """Nanoseconds by use, an array of rounds each; "sincos" is one call of libm's."""

    rounds: dict[str, np.ndarray]

    def ratios(self, use: str, base: str) -> Ratios:
        """One use's time in times of another's."""
        return Ratios(self.rounds[use] / self.rounds[base])

    def ratio(self, use: str, base: str) -> float:
        """Median over the rounds of one use's time in times of another's."""
        return self.ratios(use, base).median

    def spread(self, use: str, base: str) -> tuple[float, float]:
        """Between which ratios the middle half of the rounds lies."""
        return self.ratios(use, base).quartiles


def in_c_host(fmu: UnpackedFmu, uses: Sequence[Use], rounds: int) -> Costs:
    """Measure uses in the C host. Raises RuntimeError where it cannot be built or run."""
    lines = "".join(_line(use, fmu.reference) for use in uses)
    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "use_cost"
        _run(
            [
                sys.executable,
                "-m",
                "ziglang",
                "cc",
                "-std=c99",
                "-O2",
                "-fno-math-errno",
                "-fno-sanitize=all",
                "-Wall",
                "-Wextra",
                "-Werror",
                "-I",
                str(ROOT),
                "-I",
                str(Path(fmpy.__file__).parent / "c-code"),
                "-o",
                str(program),
                str(HOST_SOURCE),
                "-lm",
                "-ldl",
            ]
        )
        printed = _run([str(program), str(fmu.library), fmu.guid, str(rounds)], lines)
    table = np.array([[float(cell) for cell in line.split(",")] for line in printed.splitlines()])
    return Costs(dict(zip(("sincos", *(use.key for use in uses)), table.T, strict=True)))


def through_fmpy(fmu: UnpackedFmu, rungs: Sequence[Rung], rounds: int, done: Callable[[int], object]) -> Costs:
    """Measure rungs through fmpy's FMU objects, in interleaved rounds."""
    times = np.arange(FMPY_STEPS + 1) * 1e-3
    motion = constant(times)
    taken: dict[str, list[float]] = {rung.key: [] for rung in rungs}
    with Linkage(fmu, "timed") as linkage:
        for _ in range(rounds):
            for rung in rungs:
                begin = time.perf_counter()
                drive(linkage, rung, times, motion)
                taken[rung.key].append((time.perf_counter() - begin) / FMPY_STEPS * 1e9)
                done(FMPY_STEPS)
    return Costs({key: np.array(values) for key, values in taken.items()})


def _line(use: Use, reference: dict[str, int]) -> str:
    """A use as the C host reads it."""

    def listed(numbers: Sequence[object]) -> list[object]:
        return [len(numbers), *numbers]

    inputs = [number for name in use.inputs for number in (reference[name], VALUES[name])]
    words = [
        *listed([reference[name] for name in use.flags]),
        reference[SMOOTHING],
        use.smoothing,
        len(use.inputs),
        *inputs,
        use.derivatives,
        *listed([reference[name] for name in use.outputs]),
        *listed([reference[name] for name in use.sensitivities]),
    ]
    return " ".join(map(str, words)) + "\n"


def _run(command: Sequence[str], given: str = "") -> str:
    try:
        return subprocess.run(command, input=given, check=True, capture_output=True, text=True).stdout
    except OSError as error:
        raise RuntimeError(str(error)) from error
    except subprocess.CalledProcessError as error:
        raise RuntimeError(error.stderr.strip() or f"{command[0]} failed") from error
