"""What a step of the linkage FMU costs a host: in C, and through fmpy.

A small C host (scene_cost.c, compiled here with ziglang) measures scenes and rungs
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

HOST_SOURCE = Path(__file__).with_name("scene_cost.c")
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
class Scene:
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
SCENES = (
    Scene("nothing", "nothing read", CRANK, ()),
    Scene("positions", "positions", CRANK, TIP[:2]),
    Scene("velocities", "+ velocities", CRANK, TIP[:4]),
    Scene("accelerations", "+ accelerations", CRANK, TIP),
    Scene("ground", "+ ground frame", (*CRANK, "machine.v"), _ALL),
    Scene("torque", "+ torque", _FORCES, (*_ALL, "crank.tau")),
    Scene("sensitivities", "+ derivatives by crank.phi", _FORCES, (*_ALL, "crank.tau"), (*_ALL, "crank.tau")),
)
BASE = "positions"
FMPY_STEPS = 100  # a round of one rung through fmpy


def scene_of(rung: Rung) -> Scene:
    """A step of a rung, of which position, velocity and acceleration of the tip are read."""
    return Scene(
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
    """Nanoseconds by scene, an array of rounds each; "sincos" is one call of libm's."""

    rounds: dict[str, np.ndarray]

    def ratios(self, scene: str, base: str) -> Ratios:
        """One scene's time in times of another's."""
        return Ratios(self.rounds[scene] / self.rounds[base])

    def ratio(self, scene: str, base: str) -> float:
        """Median over the rounds of one scene's time in times of another's."""
        return self.ratios(scene, base).median

    def spread(self, scene: str, base: str) -> tuple[float, float]:
        """Between which ratios the middle half of the rounds lies."""
        return self.ratios(scene, base).quartiles


def in_c_host(fmu: UnpackedFmu, scenes: Sequence[Scene], rounds: int) -> Costs:
    """Measure scenes in the C host. Raises RuntimeError where it cannot be built or run."""
    lines = "".join(_line(scene, fmu.reference) for scene in scenes)
    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "scene_cost"
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
    return Costs(dict(zip(("sincos", *(scene.key for scene in scenes)), table.T, strict=True)))


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


def _line(scene: Scene, reference: dict[str, int]) -> str:
    """A scene as the C host reads it."""

    def listed(numbers: Sequence[object]) -> list[object]:
        return [len(numbers), *numbers]

    inputs = [number for name in scene.inputs for number in (reference[name], VALUES[name])]
    words = [
        *listed([reference[name] for name in scene.flags]),
        reference[SMOOTHING],
        scene.smoothing,
        len(scene.inputs),
        *inputs,
        scene.derivatives,
        *listed([reference[name] for name in scene.outputs]),
        *listed([reference[name] for name in scene.sensitivities]),
    ]
    return " ".join(map(str, words)) + "\n"


def _run(command: Sequence[str], given: str = "") -> str:
    try:
        return subprocess.run(command, input=given, check=True, capture_output=True, text=True).stdout
    except OSError as error:
        raise RuntimeError(str(error)) from error
    except subprocess.CalledProcessError as error:
        raise RuntimeError(error.stderr.strip() or f"{command[0]} failed") from error
