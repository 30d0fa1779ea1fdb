"""Parameter studies of an FMU on Dask: many runs of a scene, on all cores or on a cluster.

    python -m scenarios.sweep
    python -m scenarios.sweep --parameter geometry.L1=45mm:55mm --parameter scene.spacing=300mm:500mm --grid 9

Every run is one row of a Parquet dataset, ``results/`` in the study's own folder, written within a second
of its end. A sweep that was stopped, however hard, goes on where it was when it is started again. A run that
the FMU refuses is a row too, with its message. ``sweep.png`` shows the trade-off between swept width,
lean and acceleration.

A scene is a function (path of the FMU, {parameter: value}, *, own=...) -> {name: number}; ``--scene
package.module:function`` runs another than scenarios.sweep.scenes:planting_cycle, for instance
scenarios.field_row.scene:planted_row, the whole field row. What is varied are real parameters of the
FMU, with their units or in SI units, ``theta41``, the phase difference of the cranks, and as ``scene.own``
the scene's own keyword arguments.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import importlib.util
import inspect
import itertools
import json
import math
import os
import signal
import sys
import tempfile
import time
import uuid
import zipfile
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from dask import config
from dask.distributed import Client, Future, LocalCluster, as_completed, wait
from dask.system import CPU_COUNT
from filelock import FileLock, Timeout
from fmpy import read_model_description
from rich.console import Console
from tqdm import tqdm
from transplanter_linkage import measures
from transplanter_linkage.measures import GEOMETRY
from transplanter_linkage.measures import MEASURES as CYCLE

from scenarios.common import command, reports, units
from scenarios.common.instance import FmuError, Refused, first_line, require_fmu
from scenarios.common.variants import PHASE, PREFIX, unit_of
from scenarios.sweep.scenes import OWN, Point, SweepError, find_scene, run_parcel

# The parameters of the paper's section 4, each as far as the linkage still turns or a little beyond.
DEFAULT_RANGES = {
    "geometry.L1": (0.035, 0.065),
    "geometry.L4": (0.006, 0.036),
    "geometry.L7": (0.235, 0.270),
    "geometry.phi4": (5.0, 5.9),
}
OUTPUT = command.ROOT / "build" / "reports" / "sweep"
SAMPLES = 200
MERGE_AT = 256  # files are merged into one when there are so many
SCENE = "scenarios.sweep.scenes:planting_cycle"
PATIENCE = "5s"  # for a scheduler to answer
LIMIT = 600.0  # s that one run may take
AHEAD = 2  # parcels of runs given to each worker at a time
MOST_RUNS, LONGEST = 128, 0.5  # in a parcel, at most: runs, and s until it begins no other run
MEASURES = ("swept", "lean", "peak_acceleration")
SHOWN = (*MEASURES, "ground_speed")  # in the table


# --- what is to be run -------------------------------------------------------------------------


@dataclass(frozen=True)
class Study:
    """What a sweep computes: two with the same study give the same runs."""

    fmu: str  # SHA-256 of the file
    scene: str
    ranges: dict[str, tuple[float, float]]
    grid: int  # values of each parameter, or 0: Latin hypercube
    samples: int
    seed: int

    @property
    def number(self) -> str:
        """Tells studies apart, in eight digits."""
        return hashlib.sha256(json.dumps(asdict(self)).encode()).hexdigest()[:8]

    def points(self) -> np.ndarray:
        """The parameter sets, a row each, in the order of ``ranges``."""
        low, high = np.array(list(self.ranges.values())).T
        if self.grid:
            axes = [np.linspace(a, b, self.grid) for a, b in zip(low, high, strict=True)]
            return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        from scipy.stats import qmc  # takes longer to import than a small study to run

        return qmc.scale(qmc.LatinHypercube(len(low), rng=self.seed).random(self.samples), low, high)


# --- what has been run -------------------------------------------------------------------------


class Results:
    """The rows of a study as Parquet files in a folder; whatever was added survives the process.

    A file is written under another name and then renamed, so that there is never half of one.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.glob("*.writing"):
            left.unlink()
        self._waiting = len(self._files())

    def _files(self) -> list[Path]:
        return sorted(self.folder.glob("*.parquet"))

    def _write(self, table: pa.Table) -> Path:
        path = self.folder / f"{uuid.uuid4().hex}.parquet"
        writing = path.with_suffix(".writing")
        pq.write_table(table, writing)
        with writing.open("rb+") as file:
            os.fsync(file.fileno())
        return writing.replace(path)

    def add(self, *rows: Mapping[str, object]) -> None:
        """Keep rows, for good when this returns."""
        names = dict.fromkeys(name for row in rows for name in row)  # some rows lack what others have
        self._write(pa.Table.from_pylist([{name: row.get(name) for name in names} for row in rows]))
        self._waiting += 1
        if self._waiting >= MERGE_AT:
            self.merge()

    def table(self) -> pa.Table:
        """All rows by point; each once, even where a merge was cut off before it deleted what it had merged."""
        files = self._files()
        if not files:
            return pa.table({"point": pa.array([], pa.int64()), "status": pa.array([], pa.string())})
        table = pa.concat_tables(map(pq.read_table, files), promote_options="permissive")
        _, first = np.unique(table["point"].to_numpy(), return_index=True)
        return table.take(first)

    def merge(self) -> pa.Table:
        """Make one file of all; returns its table."""
        files = self._files()
        table = self.table()
        if len(files) > 1:
            self._write(table)
            for path in files:
                path.unlink()
        self._waiting = 1
        return table


@contextlib.contextmanager
def opened(output: Path, study: Study) -> Iterator[Results]:
    """The results of a study, for one sweep at a time; SweepError where the folder holds another one's."""
    output.mkdir(parents=True, exist_ok=True)
    lock = FileLock(output / "sweep.lock")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise SweepError(f"Another sweep is running in {output}.") from None
    with lock:
        about, now = output / "study.json", json.loads(json.dumps(asdict(study)))
        try:
            before = json.loads(about.read_text(encoding="utf-8")) if about.is_file() else now
        except ValueError as error:
            raise SweepError(f"{about} cannot be read: {error}") from error
        differing = [key for key in now if before.get(key) != now[key]]
        if differing:
            raise SweepError(
                f"{output} holds the results of another study ({', '.join(differing)} differ): "
                "name another --output, or delete it."
            )
        writing = about.with_suffix(".writing")
        writing.write_text(json.dumps(now, indent=1), encoding="utf-8")
        writing.replace(about)
        yield Results(output / "results")


# --- the sweep ---------------------------------------------------------------------------------


@contextlib.contextmanager
def cluster(scheduler: str | None, workers: int | None) -> Iterator[Client]:
    """A client of the Dask cluster at an address, which is given this package if it lacks it, or of all cores here."""
    if scheduler is None:
        with config.set({"distributed.scheduler.allowed-failures": 0, "distributed.comm.timeouts.connect": "120s"}):
            before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited by the workers: Ctrl-C is for us alone
            try:
                local = LocalCluster(
                    n_workers=workers or CPU_COUNT,
                    threads_per_worker=1,
                    dashboard_address=None,
                    silence_logs="CRITICAL",
                )
            finally:
                signal.signal(signal.SIGINT, before)
            with local, Client(local) as client:
                yield client
        return
    try:
        connected = Client(scheduler, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        raise SweepError(f"There is no Dask scheduler at {scheduler}: {first_line(error)}") from error
    with connected as client, tempfile.TemporaryDirectory() as scratch:
        if all(client.run(lambda: importlib.util.find_spec("scenarios") is not None).values()):
            yield client
            return
        package = Path(scratch) / "scenarios.zip"
        with zipfile.ZipFile(package, "w") as archive:
            for source in sorted(each for end in ("*.py", "*.c") for each in (command.ROOT / "scenarios").rglob(end)):
                archive.write(source, source.relative_to(command.ROOT))
            for name in ("__init__.py", "measures.py"):
                archive.write(Path(measures.__file__).with_name(name), f"transplanter_linkage/{name}")
        client.upload_file(str(package))
        yield client


def sweep(
    fmu: Path, study: Study, results: Results, client: Client, done: Callable[[int], object], limit: float = LIMIT
) -> None:
    """Run what is missing of a study; every row is kept before the next is waited for. A run of more than ``limit``
    seconds costs its process, and is a row that says so.
    """
    known = set(results.table()["point"].to_pylist())
    done(len(known))
    missing = (
        (key, dict(zip(study.ranges, map(float, point), strict=True)))
        for key, point in enumerate(study.points())
        if key not in known
    )
    # A task rather than scattered data: when its worker dies, Dask can make it anew.
    content = client.submit(bytes, fmu.read_bytes(), pure=False)
    left: deque[Point] = deque()  # of parcels that took too long
    suspects: list[Point] = []
    running: dict[Future, list[Point]] = {}

    size = 1  # of a parcel: more where runs are short

    def start(points: list[Point]) -> Future:
        begun = client.submit(run_parcel, study.scene, content, points, LONGEST, limit, pure=False)
        running[begun] = points
        return begun

    def parcels(count: int) -> Iterator[Future]:
        for _ in range(count):
            if points := list(itertools.islice(itertools.chain(_emptied(left), missing), size)):
                yield start(points)

    def finish(future: Future, is_guilty: bool, seconds: float = 0.0) -> None:
        """Keep its rows. is_guilty: if its process has ended, then through the one run that it was."""
        nonlocal size
        points = running.pop(future)
        if future.status == "finished":
            rows = future.result()
            left.extend(points[len(rows) :])
            is_short = sum(row["seconds"] for row in rows) < LONGEST / 4
            size = min(MOST_RUNS, max(size, 2 * len(points))) if is_short else min(size, len(rows))
        elif future.status != "error":
            raise SweepError("The Dask cluster is gone. What was done is kept: the same command goes on from there.")
        elif not is_guilty:
            suspects.extend(points)
            return
        else:
            ((key, parameters),) = points
            rows = [
                {
                    "point": key,
                    **parameters,
                    "status": "failed",
                    "message": f"no end within {limit:g} s: its process was ended"
                    if seconds >= limit
                    else f"the process that ran it ended: {first_line(future.exception())}",
                }
            ]
        results.add(*rows)
        done(len(rows))

    queue = as_completed(parcels(AHEAD * max(1, len(client.nthreads()))))
    for future in queue:
        finish(future, is_guilty=False)
        queue.update(list(parcels(1)))
    # A process ended through this run, through another one that was in its parcel or waited there, or through the
    # machine, which may be too busy for any limit: once more, alone, and what ends it then once more again.
    attempts = 2
    for attempt in range(1, attempts + 1):
        again, suspects[:] = tuple(suspects), ()
        for point in again:
            begin = time.monotonic()
            future = start([point])
            wait(future)
            seconds = time.monotonic() - begin
            finish(future, attempt == attempts, seconds)


def _emptied(points: deque[Point]) -> Iterator[Point]:
    """Takes them out, one by one."""
    while points:
        yield points.popleft()


def front(values: np.ndarray) -> np.ndarray:
    """Which rows no other row beats: none is as small in every column and smaller in one."""
    no_worse = (values[:, None] <= values[None]).all(axis=2)
    better = (values[:, None] < values[None]).any(axis=2)
    return ~(no_worse & better).any(axis=0)


def scenario(options: argparse.Namespace, console: Console) -> list[Path]:
    """Run, print and write everything; returns the files."""
    study = study_of(options)
    options.output = options.output or OUTPUT / study.number
    total = len(study.points())
    with opened(options.output, study) as results:
        before = results.table().num_rows
        if before < total:
            with (
                cluster(options.scheduler, options.workers) as client,
                tqdm(total=total, desc="sweep", unit="run", leave=False, disable=None) as bar,
            ):
                sweep(options.fmu, study, results, client, bar.update, options.limit)
        table = results.merge()
    written = [options.output / "results"]
    statuses = table["status"].to_pylist()
    console.print(
        f"{total} runs: {before} from before, {total - before} now. "
        + ", ".join(f"{statuses.count(status)} {status}" for status in sorted(set(statuses)))
        + "."
    )
    for status in ("refused", "failed"):
        said = [
            message
            for message, is_status in zip(table["message"].to_pylist(), statuses, strict=True)
            if is_status == status
        ]
        if said:
            console.print(f"- {status}, for instance: {said[0]}", markup=False)
    if set(MEASURES) <= set(table.column_names):
        from scenarios.sweep import figure as sweep_figure  # matplotlib has no business in the workers

        values = np.column_stack([table[name].to_numpy() for name in MEASURES])
        usable = (np.array(statuses) == "done") & np.isfinite(values).all(axis=1)
        why = sweep_figure.left_out(statuses, values[:, 0], table["message"].to_pylist())
        if why:
            console.print(f"- {why}", markup=False)
        if usable.any():
            best = np.flatnonzero(usable)[front(np.abs(values[usable]))]
            names, shown = list(study.ranges), [name for name in SHOWN if name in table.column_names]
            looks = {name: _looks(name) for name in names}
            rows = [
                (
                    *(f"{table[name][int(k)].as_py() * scale:.5g}" for name, (_, scale) in looks.items()),
                    *(f"{CYCLE[name].shown(table[name][int(k)].as_py()):.1f}" for name in shown),
                )
                for k in best[np.argsort(values[best, 0])]
            ]
            headings = (
                *(f"{name} / {unit}" if unit else name for name, (unit, _) in looks.items()),
                *(f"{name.replace('_', ' ')} / {CYCLE[name].unit}" for name in shown),
            )
            reports.show_table(
                console,
                f"{len(best)} runs that no other beats in all three"
                + ("; 12 that sweep the least" if len(rows) > 12 else ""),
                headings,
                rows[:12],
            )
            written += [options.output / "front.csv", options.output / "sweep.png"]
            reports.write_csv(written[1], headings, rows)
            try:
                start = find_scene(study.scene)(options.fmu, {})
            except (FmuError, Refused):
                start = {}
            sweep_figure.draw(
                written[2],
                values,
                usable,
                best,
                [start[name] for name in MEASURES if start],
                why,
            )
    return written


def _looks(name: str) -> tuple[str, float]:
    """The unit in which people read what is varied, "" where none is known, and what an SI value is to be times."""
    unit = _unit(name)
    shown = units.SHOWN.get(unit or "", unit or "")
    return shown, 1 / units.UNITS[shown][1] if shown else 1.0


def study_of(options: argparse.Namespace) -> Study:
    """The study that a command line asks for; SweepError where it cannot be run."""
    require_fmu(options.fmu)
    try:
        description = read_model_description(str(options.fmu))
    except Exception as error:  # zip, XML and schema errors have no common base
        raise FmuError(f"{options.fmu} cannot be read as an FMU: {first_line(error)}") from error
    known = {v.name for v in description.modelVariables if v.causality == "parameter" and v.type in ("Real", "Float64")}
    ranges = dict(options.parameter) or DEFAULT_RANGES
    known |= {
        OWN + name
        for name, parameter in inspect.signature(find_scene(options.scene)).parameters.items()
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY
    }
    turned = {PREFIX + "phi1", PREFIX + "phi4"}
    if turned <= known:
        known.add(PHASE)
    if {PHASE, PREFIX + "phi4"} <= set(ranges):
        raise SweepError(f"{PREFIX}phi4 and {PHASE} cannot both be varied: it is phi1 + {PHASE}.")
    unknown = [name for name in ranges if name not in known]
    if unknown:
        raise SweepError(
            f"Neither {options.fmu.name} nor {options.scene} has a real parameter {', '.join(unknown)}; "
            f"they have {', '.join(sorted(known)) or 'none'}."
        )
    content = hashlib.sha256(options.fmu.read_bytes()).hexdigest()
    return Study(content, options.scene, ranges, options.grid, 0 if options.grid else options.samples, options.seed)


def _unit(name: str) -> str | None:
    """The SI unit of what is varied; None where it is not known here."""
    own = {OWN + "spacing": "m", OWN + "cruise": "m/s", PHASE: "rad"}
    known = name.removeprefix(PREFIX)
    return unit_of(known) if name.startswith(PREFIX) and known in GEOMETRY else own.get(name)


def _range(text: str) -> tuple[str, tuple[float, float]]:
    name, _, values = text.partition("=")
    unit = _unit(name)
    try:
        low, high = (units.si(each, unit) for each in values.split(":"))
    except units.UnitError as error:
        raise argparse.ArgumentTypeError(f"{name}: {error}") from error
    except ValueError:
        low = high = math.nan
    if not name or not low < high or not math.isfinite(high - low):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=LOW:HIGH with LOW below HIGH")
    return name, (low, high)


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < 1e9:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time in s above 0")
    return value


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = command.parser(
        "sweep",
        __doc__,
        default=None,
        help=("folder for results, tables and figures (default: one for each study in build/reports/sweep)"),
    )
    parser.add_argument(
        "--scene", default=SCENE, metavar="MODULE:FUNCTION", help="what a run is (default: %(default)s)"
    )
    parser.add_argument(
        "--parameter",
        action="append",
        type=_range,
        default=[],
        metavar="NAME=LOW:HIGH",
        help="vary this one, as geometry.L1=45mm:55mm; SI units without one; may be given several times (default: the "
        "paper's four)",
    )
    parser.add_argument(
        "--samples",
        type=command.whole(1, 10**7),
        default=SAMPLES,
        metavar="N",
        help="of a Latin hypercube (default: %(default)s)",
    )
    parser.add_argument(
        "--grid",
        type=command.whole(2, 10**4),
        default=0,
        metavar="N",
        help="instead: every combination of N values of each parameter",
    )
    parser.add_argument(
        "--seed", type=command.whole(0, 2**31), default=1, help="of the Latin hypercube (default: %(default)s)"
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a Dask cluster, as tcp://host:8786 (default: the "
        "cores of this machine); its workers need Python with the packages of the sweep",
    )
    parser.add_argument(
        "--workers", type=command.whole(1, 1024), metavar="N", help="processes on this machine (default: cores)"
    )
    parser.add_argument(
        "--limit",
        type=_seconds,
        default=LIMIT,
        metavar="SECONDS",
        help="most that one run may take; then its process is ended (default: %(default)g)",
    )
    options = parser.parse_args(arguments)
    try:
        return command.run(scenario, options)
    except SweepError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("Stopped. What was done is kept: the same command goes on from there.", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
