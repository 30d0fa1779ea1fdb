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
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path

from dask.distributed import get_worker
from transplanter_linkage.measures import Operation, Turn

from scenarios.common.instance import FmuError, Refused, first_line, starts
from scenarios.common.operating_point import SPACING
from scenarios.common.turn import FmuSource
from scenarios.common.variants import PHASE, PREFIX

OWN = "scene."  # prefix of the scene's own arguments among the parameters
MEASURED = ("swept", "hole", "lean", "lean_change", "ground_speed", "height", "peak_acceleration", "margin")


Point = tuple[int, dict[str, float]]  # its number, and the parameters of its run


class SweepError(Exception):
    """The sweep cannot start or go on; the message is for the user."""


@lru_cache(maxsize=1)
def _linkage(fmu: Path) -> tuple[FmuSource, float]:
    """The FMU, loaded once in each process, and how deep in m its tip is in the ridge with its start values."""
    source = FmuSource(fmu)
    atexit.register(source.close)
    return source, source.published_depth()


def planting_cycle(fmu: Path, parameters: Mapping[str, float], *, spacing: float = SPACING) -> dict[str, float]:
    """One crank turn at planting speed with a plant spacing S in m: the measures of `transplanter_linkage.measures`
    that MEASURED names, SI units; NaN where the turn lacks what one is about.

    The ridge's surface lies as far above the tip's lowest point as the published hole's.
    """
    source, depth = _linkage(fmu)
    unknown = [name for name in parameters if name.removeprefix("geometry.") not in source.nominal]
    if unknown:
        raise FmuError(f"a planting cycle has no use for {', '.join(unknown)}")
    source.set({name.removeprefix("geometry."): value for name, value in parameters.items()})
    return Turn(source, Operation(spacing=spacing, depth=depth)).measure(*MEASURED)


def find_scene(name: str) -> Callable[[Path, Mapping[str, float]], Mapping[str, float]]:
    """The function that ``package.module:name`` names."""
    module, _, function = name.partition(":")
    try:
        return getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise SweepError(f"There is no scene {name!r} (package.module:function): {first_line(error)}") from error


def run_parcel(
    scene: str, fmu: bytes, points: Sequence[Point], longest: float, limit: float
) -> list[dict[str, object]]:
    """Run points one after the other, in a worker, until ``longest`` seconds are over: at least one."""
    rows: list[dict[str, object]] = []
    begin = time.perf_counter()
    for point in points:
        if rows and time.perf_counter() - begin > longest:
            break
        rows.append(run_point(scene, fmu, *point, limit))
    return rows


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
    try:
        own = {name[len(OWN) :]: value for name, value in parameters.items() if name.startswith(OWN)}
        fmus = {name: value for name, value in parameters.items() if not name.startswith(OWN)}
        with _watchdog().over(limit):
            found = find_scene(scene)(_unpacked(fmu), _phased(_unpacked(fmu), fmus), **own)
        row |= {name: float(value) for name, value in found.items()}
        row |= {"status": "done", "message": ""}
    except Refused as refusal:
        row |= {"status": "refused", "message": str(refusal)}
    except Exception as error:  # noqa: BLE001 - whatever a scene or an FMU may raise is worth a row, not the sweep's end
        row |= {"status": "failed", "message": f"{type(error).__name__}: {error}"}
    return row | {"seconds": time.perf_counter() - begin}


def _phased(fmu: Path, parameters: dict[str, float]) -> dict[str, float]:
    """The FMU's own parameters, where PHASE is told by phi4."""
    if PHASE not in parameters:
        return parameters
    first, second = PREFIX + "phi1", PREFIX + "phi4"
    phi1 = parameters[first] if first in parameters else starts(fmu)[first]
    return {**{name: value for name, value in parameters.items() if name != PHASE}, second: phi1 + parameters[PHASE]}


class _Watchdog:
    """Ends the process once a run has passed its deadline: one thread for all runs, for to start one takes as long as
    a third of a run.
    """

    def __init__(self) -> None:
        self._deadlines: dict[int, float] = {}  # by thread
        self._sleeps_until = math.inf
        self._called = threading.Condition()
        threading.Thread(target=self._watch, daemon=True).start()

    @contextlib.contextmanager
    def over(self, limit: float) -> Iterator[None]:
        """Within this, no longer than ``limit`` seconds."""
        thread, deadline = threading.get_ident(), time.monotonic() + limit
        if math.isfinite(limit):
            with self._called:
                self._deadlines[thread] = deadline
                if deadline < self._sleeps_until:
                    self._called.notify()
        try:
            yield
        finally:
            self._deadlines.pop(thread, None)

    def _watch(self) -> None:
        with self._called:
            while True:
                now = time.monotonic()
                if any(deadline <= now for deadline in tuple(self._deadlines.values())):
                    os._exit(1)
                # A run that ended is not waited for, but its deadline is: the next run's comes later.
                self._sleeps_until = min(tuple(self._deadlines.values()), default=math.inf)
                self._called.wait(min(self._sleeps_until - now, threading.TIMEOUT_MAX))


@lru_cache(maxsize=1)
def _watchdog() -> _Watchdog:
    return _Watchdog()


@lru_cache(maxsize=1)
def _unpacked(fmu: bytes) -> Path:
    """The FMU as a file of this worker: a cluster may share none. Dask deletes the worker's folder."""
    with contextlib.suppress(ValueError):  # not in a worker
        tempfile.tempdir = get_worker().local_directory
    path = Path(tempfile.mkdtemp(prefix="sweep-")) / "swept.fmu"
    path.write_bytes(fmu)
    return path
