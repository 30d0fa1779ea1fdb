"""The linkage FMU over a whole turn, pose by pose, with its derivatives: a loop in C (turn.c) over FMI functions.

Each pose is the FMU's own answer in Initialization Mode, where outputs belong to the crank angle as set. The crank
turns with 1 rad/s, so that velocity and acceleration are the tip's derivatives by the crank angle. `FmuSource` is what
`transplanter_linkage.measures` takes: the same measures are made of the FMU and of the package's solver in numpy.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from ctypes import POINTER, addressof, c_int64, c_size_t, c_uint32, c_uint64, c_void_p, cast
from functools import cache
from importlib import resources
from pathlib import Path
from types import TracebackType
from typing import Any

import fmpy
import numpy as np
from fmpy.simulation import instantiate_fmu
from transplanter_linkage.measures import GEOMETRY, MASSES, SIGNALS, Operation, Turn

from scenarios.common.instance import OK, FmuError, Refused, UnpackedFmu, first_line
from scenarios.common.operating_point import HOLE_MM

OUTPUTS = ("tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay", "tip.angle", "assembly.margin")
KNOWNS = tuple(f"geometry.{name}" for name in GEOMETRY)
TORQUE_KNOWNS = (*KNOWNS, *MASSES, "crank.w")
LEAST_DEPTH, MOST_DEPTH = 0.05, 0.15  # m, between which the published hole's is sought
BUILD = Path(__file__).resolve().parents[2] / "build"
assert len(OUTPUTS) == len(SIGNALS)


class _Host(ctypes.Structure):
    """Host of turn.c."""

    _fields_ = [
        ("fmi2", c_int64),
        ("instance", c_void_p),
        *((name, c_void_p) for name in ("set2", "get2", "direct2", "set3", "get3", "direct3", "adjoint3")),
        ("outputs", c_uint64),
        ("knowns", c_uint64),
        *((name, POINTER(c_uint32)) for name in ("output", "known", "angle")),
    ]


FUNCTIONS = {
    "2.0": {"set2": "fmi2SetReal", "get2": "fmi2GetReal", "direct2": "fmi2GetDirectionalDerivative"},
    "3.0": {
        "set3": "fmi3SetFloat64",
        "get3": "fmi3GetFloat64",
        "direct3": "fmi3GetDirectionalDerivative",
        "adjoint3": "fmi3GetAdjointDerivative",
    },
}


@cache
def loop() -> ctypes.CDLL:
    """turn.c as a library, compiled once for each version of it: in build/, or where there is none for this process."""
    source = (resources.files("scenarios.common") / "turn.c").read_bytes()
    name = f"turn-{hashlib.sha256(source).hexdigest()[:12]}-{sysconfig.get_platform()}{fmpy.sharedLibraryExtension}"
    folder = BUILD / "scenarios"
    try:
        folder.mkdir(parents=True, exist_ok=BUILD.is_dir())
    except OSError:  # as where the scenarios came in an archive
        folder = Path(tempfile.mkdtemp(prefix="turn-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
    library = folder / name
    if not library.is_file():
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            file, made = Path(scratch) / "turn.c", Path(scratch) / name
            file.write_bytes(source)
            line = [sys.executable, "-m", "ziglang", "cc", "-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden"]
            line += ["-fno-sanitize=all", "-Wall", "-Wextra", "-Werror"]
            line += ["-I", str(Path(fmpy.__file__).parent / "c-code"), "-o", str(made), str(file)]
            compiled = subprocess.run(line, capture_output=True, encoding="utf-8", errors="replace")
            if compiled.returncode:
                raise FmuError(f"The loop over a turn, turn.c, cannot be compiled: {compiled.stderr.strip()}")
            made.replace(library)  # whole or not at all, whoever else is at it
    loaded = ctypes.CDLL(os.fspath(library))
    loaded.turn_sample.argtypes = [c_void_p, c_size_t, *[c_void_p] * 4]
    loaded.turn_gradient.argtypes = [c_void_p, c_size_t, *[c_void_p] * 5]
    return loaded


class _Held:
    """Rows of numbers that stay where they are until more are needed: to find an array's address takes as long as
    several poses.
    """

    def __init__(self, columns: int) -> None:
        self.rows = np.empty((0, columns))
        self.room(512)

    def room(self, count: int) -> np.ndarray:
        """So many rows, of any content."""
        if count > len(self.rows):
            self.rows = np.empty((count, self.rows.shape[1]))
            self.address = self.rows.ctypes.data
        return self.rows[:count]


class FmuSource:
    """The linkage FMU, of FMI 2.0 or 3.0, as a source of the measures; a context manager.

    FMI 3.0 answers a gradient with one call, FMI 2.0 with eighteen.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._fmu = UnpackedFmu(path, versions=("2.0", "3.0"))
        self.messages: list[str] = []
        self._slave: Any = None
        try:
            description = self._fmu.description
            missing = [name for name in ("crank.phi", "crank.w", *OUTPUTS, *KNOWNS) if name not in self._fmu.reference]
            if missing:
                raise FmuError(f"{path} ({description.modelName}) is not the linkage: it lacks {', '.join(missing)}.")
            self.nominal = {
                v.name.removeprefix("geometry."): float(v.start) for v in description.modelVariables if v.name in KNOWNS
            }
            self.nominal = {name: self.nominal[name] for name in GEOMETRY}
            self.bodies: dict[str, float] = {}  # masses by the FMU's names, where `set` is given no others
            self._masses: dict[str, float] = {}
            self._start()
        except BaseException:
            self.close()
            raise
        self._loop = loop()
        self._at = c_size_t()
        self._phi, self._scratch = _Held(1), _Held(len(OUTPUTS))
        self._values, self._rates, self._weights = (_Held(len(OUTPUTS)) for _ in range(3))
        self._gradients = _Held(len(KNOWNS))
        self._tau, self._tau_rate, self._tau_weight = (_Held(1) for _ in range(3))
        self._tau_gradients = _Held(len(TORQUE_KNOWNS))
        self._host_address, self._at_address = addressof(self._host), addressof(self._at)
        self.poses = 0  # asked for so far

    def _start(self) -> None:
        description, is2 = self._fmu.description, self._fmu.description.fmiVersion == "2.0"

        def log(*arguments: Any) -> None:  # the text comes last in both versions
            self.messages.append(arguments[-1].decode("utf-8", "replace") if arguments[-1] else "")

        try:
            slave = instantiate_fmu(str(self._fmu.folder), description, "CoSimulation", logger=log, debug_logging=True)
        except Exception as error:
            raise FmuError(f"{self._fmu.path} cannot be loaded on this platform: {first_line(error)}") from error
        self._slave = slave
        if is2:
            slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        self._set = slave.setReal if is2 else slave.setFloat64
        self._set([self._fmu.reference["crank.w"]], [1.0])
        self._host = self._host_of(OUTPUTS, KNOWNS)
        self._has_masses = set(MASSES) <= set(self._fmu.reference)
        self._driven = self._host_of(("crank.tau",), TORQUE_KNOWNS if self._has_masses else ())

    def _host_of(self, outputs: Sequence[str], knowns: Sequence[str]) -> _Host:
        """That asks the instance for these outputs and their derivatives by these variables."""
        slave, version = self._slave, self._fmu.description.fmiVersion
        functions = {field: cast(getattr(slave.dll, name), c_void_p) for field, name in FUNCTIONS[version].items()}
        arrays = {"output": outputs, "known": knowns, "angle": ("crank.phi",)}
        return _Host(
            fmi2=int(version == "2.0"),
            instance=cast(slave.component, c_void_p),
            outputs=len(outputs),
            knowns=len(knowns),
            **functions,
            **{name: cast(self._array(each), POINTER(c_uint32)) for name, each in arrays.items()},  # which hold them
        )

    def _array(self, names: Iterable[str]) -> ctypes.Array:
        numbers = [self._fmu.reference[name] for name in names]
        return (c_uint32 * len(numbers))(*numbers)

    def set(self, geometry: Mapping[str, float], bodies: Mapping[str, float] = {}) -> FmuSource:
        """Give the linkage another geometry, {"L1": 0.05, ...}, and masses, {"body.OA.m": 0.3, ...}, in SI units; what
        is not named is nominal, and of masses as in ``self.bodies``, else 0.

        Raises Refused where the FMU takes a value for impossible.
        """
        whole = self.nominal | dict(geometry)
        masses = {**self.bodies, **bodies}
        self._require_open()
        self.messages.clear()
        try:
            self._set([self._fmu.reference[name] for name in KNOWNS], [whole[name] for name in GEOMETRY])
            if masses != self._masses:
                every = dict.fromkeys(MASSES, 0.0) | masses
                self._set([self._fmu.reference[name] for name in every], list(every.values()))
                self._masses = masses
        except fmpy.fmi1.FMICallException as error:
            raise Refused(self._said() or first_line(error)) from error
        return self

    def published_depth(self) -> float:
        """How far the ridge's surface lies above the lowest point where the FMU's start values dig the published hole,
        m: by halving. Raises FmuError where no depth from LEAST_DEPTH to MOST_DEPTH does: it starts with another set.
        """
        self.set({})

        def excess(depth: float) -> float:
            return Turn(self, Operation(depth=depth)).measure("hole")["hole"] * 1e3 - HOLE_MM

        low, high = LEAST_DEPTH, MOST_DEPTH
        if not excess(low) < 0 < excess(high):
            raise FmuError(
                f"{self.path} does not start with the published set: no ridge surface gives the published hole."
            )
        while high - low > 1e-15:
            middle = (low + high) / 2
            low, high = (middle, high) if excess(middle) < 0 else (low, middle)
        return (low + high) / 2

    def sample(self, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The SIGNALS at each angle in rad, a row each, and their derivatives by it. Raises Refused."""
        n = self._call(self._loop.turn_sample, phi, self._values, self._rates)
        return self._values.rows[:n].copy(), self._rates.rows[:n].copy()

    def gradient(self, phi: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """The gradient by GEOMETRY, a row each angle, of the sum of the SIGNALS times their weights. Raises Refused."""
        self._weights.room(len(phi))[:] = weights
        n = self._call(self._loop.turn_gradient, phi, self._weights, self._gradients, self._scratch)
        return self._gradients.rows[:n].copy()

    def torque(self, phi: np.ndarray, w: float) -> tuple[np.ndarray, np.ndarray]:
        """What the drive gives at each angle at a steady speed in rad/s, N m, without soil; its derivative by phi."""
        with self._turning(w):
            n = self._call(self._loop.turn_sample, phi, self._tau, self._tau_rate, host=self._driven)
        return self._tau.rows[:n, 0].copy(), self._tau_rate.rows[:n, 0].copy()

    def torque_gradient(self, phi: np.ndarray, w: float) -> np.ndarray:
        """Its gradient by GEOMETRY, MASSES and w, a row each angle."""
        self._tau_weight.room(len(phi))[:] = 1.0
        held = (self._tau_weight, self._tau_gradients, self._scratch)
        with self._turning(w):
            n = self._call(self._loop.turn_gradient, phi, *held, host=self._driven)
        return self._tau_gradients.rows[:n].copy()

    @contextlib.contextmanager
    def _turning(self, w: float) -> Iterator[None]:
        """The torque is asked for at a speed, the signals at 1 rad/s."""
        self._require_open()
        speed = [self._fmu.reference["crank.w"]]
        self._set(speed, [w])
        try:
            yield
        finally:
            self._set(speed, [1.0])

    def _call(self, function: Any, phi: np.ndarray, *held: _Held, host: _Host | None = None) -> int:
        """For all angles; returns how many they are."""
        n = len(phi)
        self._phi.room(n)[:, 0] = phi
        for each in held:
            each.room(n)
        self._require_open()
        self.messages.clear()
        self.poses += n
        addresses = [each.address for each in held]
        status = function(
            addressof(host) if host else self._host_address, n, self._phi.address, *addresses, self._at_address
        )
        if status != OK:
            angle = np.degrees(phi[self._at.value]) % 360
            raise Refused(self._said() or f"status {status} at the crank angle {angle:.2f} deg")
        return n

    def _said(self) -> str:
        """The FMU's first message, without the name of the FMI function: later ones repeat it."""
        head, separator, tail = (self.messages or [""])[0].partition(": ")
        return tail if separator and head.startswith("fmi") else head + separator + tail

    def _require_open(self) -> None:
        if self._slave is None:
            raise FmuError(f"{self.path} is asked for poses after it was closed.")

    def close(self) -> None:
        """Free the instance and delete the extracted files."""
        if self._slave is not None:
            self._slave.freeInstance()
            self._slave = None
        self._fmu.close()

    def __enter__(self) -> FmuSource:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
