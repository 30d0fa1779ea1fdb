"""What a step of the linkage FMU costs a host: in C, and through fmpy.

A small C host (scene_cost.c, compiled here with ziglang) measures scenes and rungs
in interleaved rounds, so that a busy machine slows all alike. What is reported are medians of
the ratios within a round; only ratios of one run mean something.
"""

from __future__ import annotations

import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np

from scenarios.coupling import AT_STEP_END, CRANK, SMOOTHING, TIP, Linkage, Rung
from scenarios.crank_profiles import PLANTING_SPEED, constant

HOST_SOURCE = Path(__file__).with_name("scene_cost.c")
GROUND = ("ground.x", "ground.y", "ground.vx", "ground.vy", "ground.ax", "ground.ay")
# What the measured steps set: the crank turns evenly; a gentle acceleration, so that it counts.
VALUES = {"crank.phi": PLANTING_SPEED, "crank.w": PLANTING_SPEED, "crank.a": 0.01,
          "machine.v": 0.433, "tip.fx": -20.0, "tip.fy": 70.0}


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
    return Scene(rung.key, rung.title, CRANK[:rung.inputs], TIP, derivatives=rung.derivatives,
                 flags=(AT_STEP_END,) if rung.nothing_predicted else (), smoothing=rung.smoothing)


@dataclass(frozen=True)
class Costs:
    """Nanoseconds by scene, an array of rounds each; "sincos" is one call of libm's."""

    rounds: dict[str, np.ndarray]

    def ratio(self, scene: str, base: str) -> float:
        """Median over the rounds of one scene's time in times of another's."""
        return float(np.median(self.rounds[scene] / self.rounds[base]))

    def spread(self, scene: str, base: str) -> tuple[float, float]:
        """Between which ratios the middle half of the rounds lies."""
        low, high = np.percentile(self.rounds[scene] / self.rounds[base], (25, 75))
        return float(low), float(high)


def in_c_host(folder: Path, scenes: Sequence[Scene], rounds: int) -> Costs:
    """Measure scenes in the C host. Raises RuntimeError where it cannot be built or run."""
    with Linkage(folder, "described") as linkage:
        lines = "".join(_line(scene, linkage.reference) for scene in scenes)
        library = folder / "binaries" / fmpy.platform / (linkage.identifier + fmpy.sharedLibraryExtension)
        guid = linkage.guid
    with tempfile.TemporaryDirectory() as scratch:
        program = Path(scratch) / "scene_cost"
        _run([sys.executable, "-m", "ziglang", "cc", "-std=c99", "-O2", "-fno-math-errno", "-fno-sanitize=all",
              "-Wall", "-Wextra", "-Werror", "-I", str(Path(fmpy.__file__).parent / "c-code"), "-o", str(program),
              str(HOST_SOURCE), "-lm", "-ldl"])
        printed = _run([str(program), str(library), guid, str(rounds)], lines)
    table = np.array([[float(cell) for cell in line.split(",")] for line in printed.splitlines()])
    return Costs(dict(zip(("sincos", *(scene.key for scene in scenes)), table.T, strict=True)))


def through_fmpy(folder: Path, rungs: Sequence[Rung], rounds: int, done: Callable[[int], object]) -> Costs:
    """Measure rungs through fmpy's FMU objects, in interleaved rounds."""
    times = np.arange(FMPY_STEPS + 1) * 1e-3
    motion = constant(times)
    taken: dict[str, list[float]] = {rung.key: [] for rung in rungs}
    with Linkage(folder, "timed") as linkage:
        for _ in range(rounds):
            for rung in rungs:
                begin = time.perf_counter()
                linkage.drive(rung, times, motion)
                taken[rung.key].append((time.perf_counter() - begin) / FMPY_STEPS * 1e9)
                done(FMPY_STEPS)
    return Costs({key: np.array(values) for key, values in taken.items()})


def machine() -> str:
    """Processor and system, as the system names them."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        name = platform.processor() or platform.machine()
    return f"{name}, {platform.system()}, Python {platform.python_version()}"


def _line(scene: Scene, reference: dict[str, int]) -> str:
    """A scene as the C host reads it."""
    def listed(numbers: Sequence[object]) -> list[object]:
        return [len(numbers), *numbers]

    inputs = [number for name in scene.inputs for number in (reference[name], VALUES[name])]
    words = [*listed([reference[name] for name in scene.flags]), reference[SMOOTHING], scene.smoothing,
             len(scene.inputs), *inputs, scene.derivatives,
             *listed([reference[name] for name in scene.outputs]),
             *listed([reference[name] for name in scene.sensitivities])]
    return " ".join(map(str, words)) + "\n"


def _run(command: Sequence[str], given: str = "") -> str:
    try:
        return subprocess.run(command, input=given, check=True, capture_output=True, text=True).stdout
    except OSError as error:
        raise RuntimeError(str(error)) from error
    except subprocess.CalledProcessError as error:
        raise RuntimeError(error.stderr.strip() or f"{command[0]} failed") from error
