"""The ways in C (evaluations.c), in one library compiled as the FMU is."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scenarios.common.command import ROOT
from scenarios.common.instance import UnpackedFmu
from scenarios.speed_vs_error.solving.way import CORE, GEOMETRY, HAND, MOTION, OURS, PAPER, SPEED, Question, Way
from scenarios.speed_vs_error.yardstick import compile_library, host_platform

SOURCE = Path(__file__).with_name("evaluations.c")
WAYS = (
    "sincos", CORE, "printed", "naive", "table", "fmu_in_c", "generated_0", "generated_1",
    "core_dynamics", "fmu_dynamics", "generated_dynamics_0", "generated_dynamics_1",
)  # fmt: skip  # as in evaluations.c
_POINTER, _SIZE = ctypes.c_void_p, ctypes.c_size_t


class Library:
    """The compiled ways; `folder` must outlive it."""

    def __init__(self, folder: Path) -> None:
        target = host_platform()
        path = folder / f"evaluations{target.suffix}"
        compile_library((SOURCE,), path, target, "-I", str(ROOT), "-Wno-unused-function")
        self._c = ctypes.CDLL(str(path))
        self._c.answer.argtypes = (ctypes.c_int, ctypes.c_int, _POINTER, _SIZE, _POINTER)
        self._c.take_time.argtypes = (ctypes.c_int, ctypes.c_int, _POINTER, _SIZE)
        self._c.take_time.restype = ctypes.c_double
        self._c.adopt.argtypes = (ctypes.c_int, ctypes.c_int, _POINTER)
        self._c.prepare.argtypes = (_POINTER, ctypes.c_double)
        parameters = np.array(list(GEOMETRY.values()))
        self._c.prepare(parameters.ctypes.data, SPEED)

    def give_masses(self, masses: Sequence[float], load: Sequence[float]) -> None:
        """To the core and to the FMU that is loaded thereafter; load: see `Load` in evaluations.c."""
        given = [np.array(values, dtype=float) for values in (masses, load)]
        self._c.give_masses(*(ctypes.c_void_p(values.ctypes.data) for values in given))

    def load_fmu(self, fmu: Path) -> None:
        """Instantiate the built FMU; ends the process where that fails, as the small C hosts do."""
        with UnpackedFmu(fmu) as unpacked:  # what is loaded stays when its file goes
            flag = unpacked.reference["crank.at_step_end"]
            self._c.load(str(unpacked.library).encode(), unpacked.guid.encode(), ctypes.c_uint(flag))

    def adopt(self, which: int, order: int, function: ctypes._CFuncPtr) -> None:
        """Give a generated function its place."""
        self._c.adopt(which, order, ctypes.cast(function, _POINTER))

    def way(
        self, key: str, title: str, whose: str, remark: str = "", c_name: str = "", question: Question = MOTION
    ) -> Way:
        """One of WAYS."""
        number = WAYS.index(c_name or key)

        def evaluate(phi: np.ndarray, order: int) -> np.ndarray:
            answers = np.empty((len(phi), question.width(order)))
            self._c.answer(number, order, phi.ctypes.data, len(phi), answers.ctypes.data)
            return answers

        def take_time(phi: np.ndarray, order: int) -> float:
            return self._c.take_time(number, order, phi.ctypes.data, len(phi))

        return Way(key, title, whose, evaluate, take_time, remark)

    def ways(self, fmu: Path | None) -> list[Way]:
        """All but sincos and the generated ones; the FMU where there is one."""
        found = [
            self.way(CORE, "exact core, C", OURS, "fmu_src/linkage as the FMU is compiled"),
            self.way("printed", "the paper's equations, C", PAPER, "mended where the print is wrong"),
            self.way("naive", "circles by acos and atan2, C", HAND, "rates by central differences of three positions"),
            self.way(
                "table",
                "table of 512 quintics, C",
                HAND,
                "the tip's path between 512 nodes that have two derivatives; 48 KiB; another geometry takes 512 "
                "evaluations by the core anew; it knows no nozzle angle and no dead point",
            ),
        ]
        if fmu is not None:
            self.load_fmu(fmu)
            found.append(
                self.way("fmu_in_c", "FMU in a C host", OURS, "a whole step: three inputs set, step, outputs read")
            )
        return found
