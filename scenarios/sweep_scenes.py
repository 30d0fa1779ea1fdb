"""What a parameter study runs: the scenes, and one run in a worker. scenarios/sweep.py is the study.

Every worker process imports this module, so that it imports little.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import math
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from dask.distributed import get_worker

from scenarios import measures
from scenarios.cycle import FmuError, LinkageFmu, Refused, first_line
from scenarios.published import SPACING, hole_depth
from scenarios.system import SystemFault

OWN = "scene."   # prefix of the scene's own arguments among the parameters
STEP_DEG = 0.5   # of the crank, between the samples of a planting cycle
ROW_PLANTS = 3
ROW_STEP = 5e-3  # s: communication step of a planted row


class SweepError(Exception):
    """The sweep cannot start or go on; the message is for the user."""


@lru_cache(maxsize=1)
def _linkage(fmu: Path) -> tuple[LinkageFmu, float]:
    """The FMU, loaded once in each process, and how deep in mm its tip is in the ridge with its start values."""
    linkage = LinkageFmu(fmu, SPACING)
    atexit.register(linkage.close)
    depth = hole_depth(linkage.run(STEP_DEG).dynamic_mm)
    if depth is None:
        raise FmuError(f"{fmu} does not start with the published set: no ridge surface gives the published hole.")
    return linkage, depth


def planting_cycle(fmu: Path, parameters: Mapping[str, float], *, spacing: float = SPACING) -> dict[str, float]:
    """One crank turn at planting speed with a plant spacing S in m.

    ``hole`` is its length in m at a surface as far above the tip's lowest point as the published hole's
    (NaN: none; negative: the path has crossed itself), ``posture`` how far in rad the nozzle leans from
    straight down, on the mean over its time in the ridge, ``acceleration`` the tip's greatest in m/s2,
    ``height`` the static trajectory's in m and ``margin`` the least assembly.margin.
    """
    linkage, depth = _linkage(fmu)
    linkage.spacing = spacing
    turns = linkage.run(STEP_DEG, parameters)
    path = turns.dynamic_mm
    surface_mm = path.imag.min() + depth
    hole = measures.hole(path, surface_mm)
    lean = np.abs(turns["tip.angle"][path.imag < surface_mm] + math.pi / 2)
    return {"hole": hole.size / 1e3 if hole else math.nan, "posture": float(lean.mean()),
            "acceleration": float(turns.acceleration.max()), "height": float(np.ptp(path.imag)) / 1e3,
            "margin": float(turns["assembly.margin"].min())}


def planted_row(fmu: Path, parameters: Mapping[str, float], *, spacing: float = SPACING,
                cruise: float = SPACING * 65 / 60) -> dict[str, float]:
    """The field row of scenarios/row_system.toml with this linkage: ROW_PLANTS plants, ``cruise`` is in m/s.

    ``hole`` and ``depth`` in m, ``posture`` (the seedling's lean out of the vertical, either way) in rad and ``speed``
    over ground at depth in m/s are means of the holes; ``acceleration`` is the tip's greatest in m/s2,
    ``work`` the tractor's in J a plant. Needs the project where it runs: its workers load the partners' FMUs.
    """
    from scenarios import row_run
    from scenarios.system import load_system

    system = load_system()
    system = replace(system, components=tuple(replace(c, fmu=fmu) if c.name == "linkage" else c
                                              for c in system.components))
    row = row_run.row_of(system.with_parameters({
        "drivetrain.plant.spacing": spacing, "drivetrain.speed.cruise": cruise,
        **{f"linkage.{name}": value for name, value in parameters.items()}}), ROW_PLANTS)
    record = row_run.run(row.system, "extrapolated", ROW_STEP, row.stop,
                         watched=(*row_run.WATCHED, "linkage.tip.ax", "linkage.tip.ay"))
    holes = record.holes
    if not holes:
        raise Refused("the tip never went into the soil and out again")
    return {"hole": float(np.mean([hole.length for hole in holes])),
            "posture": float(np.mean([abs(hole.lean) for hole in holes])),
            "acceleration": float(np.hypot(record["linkage.tip.ax"], record["linkage.tip.ay"]).max()),
            "depth": float(np.mean([hole.depth for hole in holes])),
            "speed": float(np.mean([hole.speed for hole in holes])),
            "work": float(record["drivetrain.energy.tractor"][-1]) / len(holes)}


def find_scene(name: str) -> Callable[[Path, Mapping[str, float]], Mapping[str, float]]:
    """The function that ``package.module:name`` names."""
    module, _, function = name.partition(":")
    try:
        return getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise SweepError(f"There is no scene {name!r} (package.module:function): {first_line(error)}") from error


def run_point(scene: str, fmu: bytes, key: int, parameters: dict[str, float]) -> dict[str, object]:
    """Run one point, in a worker; a refusal or any other error of the run is a result, too."""
    row: dict[str, object] = {"point": key, **parameters}
    begin = time.perf_counter()
    try:
        own = {name[len(OWN):]: value for name, value in parameters.items() if name.startswith(OWN)}
        fmus = {name: value for name, value in parameters.items() if not name.startswith(OWN)}
        row |= {name: float(value) for name, value in find_scene(scene)(_unpacked(fmu), fmus, **own).items()}
        row |= {"status": "done", "message": ""}
    except (Refused, SystemFault) as refusal:
        row |= {"status": "refused", "message": str(refusal)}
    except Exception as error:  # whatever a scene or an FMU may raise is worth a row, not the sweep's end
        row |= {"status": "failed", "message": f"{type(error).__name__}: {error}"}
    return row | {"seconds": time.perf_counter() - begin}


@lru_cache(maxsize=1)
def _unpacked(fmu: bytes) -> Path:
    """The FMU as a file of this worker: a cluster may share none. Dask deletes the worker's folder."""
    with contextlib.suppress(ValueError):  # not in a worker
        tempfile.tempdir = get_worker().local_directory
    path = Path(tempfile.mkdtemp(prefix="sweep-")) / "swept.fmu"
    path.write_bytes(fmu)
    return path
