"""What a parameter study runs: the scenes, and one run in a worker. scenarios/sweep/__main__.py is the study.

Every worker process imports this module, so that it imports little.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import math
import os
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from dask.distributed import get_worker

from scenarios.common import measures
from scenarios.common.instance import FmuError, Refused, first_line
from scenarios.common.linkage import LinkageFmu
from scenarios.common.operating_point import SPACING, hole_depth

OWN = "scene."  # prefix of the scene's own arguments among the parameters
STEP_DEG = 0.5  # of the crank, between the samples of a planting cycle


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
    return {
        "hole": hole.size / 1e3 if hole else math.nan,
        "posture": float(lean.mean()),
        "acceleration": float(turns.acceleration.max()),
        "height": float(np.ptp(path.imag)) / 1e3,
        "margin": float(turns["assembly.margin"].min()),
    }


def find_scene(name: str) -> Callable[[Path, Mapping[str, float]], Mapping[str, float]]:
    """The function that ``package.module:name`` names."""
    module, _, function = name.partition(":")
    try:
        return getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise SweepError(f"There is no scene {name!r} (package.module:function): {first_line(error)}") from error


def run_point(
    scene: str, fmu: bytes, key: int, parameters: dict[str, float], limit: float = math.inf
) -> dict[str, object]:
    """Run one point, in a worker; a refusal or any other error of the run is a result, too.

    A run that takes longer than ``limit`` seconds ends its process: what hangs in a library answers to nothing else.
    """
    row: dict[str, object] = {"point": key, **parameters}
    with contextlib.suppress(SweepError):  # said below
        find_scene(scene)  # what it imports is no part of the run
    begin = time.perf_counter()
    watchdog = threading.Timer(min(limit, threading.TIMEOUT_MAX), os._exit, (1,))
    watchdog.daemon = True
    watchdog.start()
    try:
        own = {name[len(OWN) :]: value for name, value in parameters.items() if name.startswith(OWN)}
        fmus = {name: value for name, value in parameters.items() if not name.startswith(OWN)}
        row |= {name: float(value) for name, value in find_scene(scene)(_unpacked(fmu), fmus, **own).items()}
        row |= {"status": "done", "message": ""}
    except Refused as refusal:
        row |= {"status": "refused", "message": str(refusal)}
    except Exception as error:  # noqa: BLE001 - whatever a scene or an FMU may raise is worth a row, not the sweep's end
        row |= {"status": "failed", "message": f"{type(error).__name__}: {error}"}
    finally:
        watchdog.cancel()
    return row | {"seconds": time.perf_counter() - begin}


@lru_cache(maxsize=1)
def _unpacked(fmu: bytes) -> Path:
    """The FMU as a file of this worker: a cluster may share none. Dask deletes the worker's folder."""
    with contextlib.suppress(ValueError):  # not in a worker
        tempfile.tempdir = get_worker().local_directory
    path = Path(tempfile.mkdtemp(prefix="sweep-")) / "swept.fmu"
    path.write_bytes(fmu)
    return path
