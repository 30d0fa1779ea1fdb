"""The ways in Python that need no other package: the twin, the paper's equations, fmpy."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace

import fmpy
import numpy as np

from scenarios.common.operating_point import TURN
from scenarios.speed_vs_error.solving.way import GEOMETRY, OURS, PAPER, SPEED, Way
from scenarios.speed_vs_error.yardstick import printed_equations, twin

PRINTED = Path(printed_equations.__file__)
NUMPY_FOR_MPMATH = {
    "acos": np.arccos,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "cos": np.cos,
    "sin": np.sin,
    "sqrt": np.sqrt,
    "tan": np.tan,
    "mpf": float,
}


def ways() -> list[Way]:
    """The twin and the paper's equations."""
    return [
        Way(
            "twin_arrays",
            "twin, numpy arrays",
            OURS,
            twin_answers,
            remark="fmu_src/twin/linkage.py, all angles at once",
        ),
        Way(
            "twin_scalar",
            "twin, angle by angle",
            OURS,
            lambda phi, order: np.concatenate([twin_answers(phi[i : i + 1], order) for i in range(len(phi))]),
        ),
        Way(
            "printed_arrays",
            "the paper's equations, numpy",
            PAPER,
            printed_answers,
            remark="mended where the print is wrong; all angles at once",
        ),
    ]


def twin_answers(phi: np.ndarray, order: int) -> np.ndarray:
    """By fmu_src/twin/linkage.py."""
    tip = twin.solve(twin.Geometry(), phi, order).tip
    return _columns([derivative * SPEED**n for n, derivative in enumerate(tip)])


def _columns(complex_numbers: list[np.ndarray]) -> np.ndarray:
    return np.stack([part for z in complex_numbers for part in (z.real, z.imag)], axis=-1)


# ---- the paper's equations with numpy's functions --------------------------------------


def _printed_equations() -> ModuleType:
    """fmu_src/oracle/printed_equations.py, its own copy, with numpy's functions in the place of mpmath's."""
    spec = importlib.util.spec_from_file_location("printed_equations_in_numpy", PRINTED)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    vars(module).update(NUMPY_FOR_MPMATH)
    return module


_printed = _printed_equations()
_GEOMETRY = SimpleNamespace(**GEOMETRY)


def printed_answers(phi: np.ndarray, order: int) -> np.ndarray:
    """By equations (1) to (8), (9) to (16), (17) to (25), those that are wrong in print as mended."""
    p, g = _printed, _GEOMETRY
    s = SimpleNamespace(phi=-phi, dphi1=-SPEED, dphi4=-SPEED)
    s.phi3 = p.equation_4(g, s)
    s.phi5 = s.phi3 - g.theta3
    s.X_A, s.Y_A = p.equation_1(g, s)
    s.X_D, s.Y_D = p.equation_2(g, s)
    s.X_E, s.Y_E = p.equation_5(g, s)
    s.phi7 = p.equation_6(g, s)
    s.X_F, s.Y_F = g.XG + g.L7 * np.cos(s.phi7), g.YG + g.L7 * np.sin(s.phi7)  # (7)
    s.phi6 = np.arctan2(s.Y_F - s.Y_E, s.X_F - s.X_E)
    s.phi8 = s.phi6 - np.pi + g.theta8
    s.phi9 = s.phi8 + g.theta9
    s.X_H, s.Y_H = (s.X_E + s.X_F) / 2, (s.Y_E + s.Y_F) / 2
    answers = [*p.equation_8(g, s)]
    if order >= 1:
        s.phi2 = np.arctan2(s.Y_D + g.L3 * np.sin(s.phi3) - s.Y_A, s.X_D + g.L3 * np.cos(s.phi3) - s.X_A)  # (3)
        s.dphi2 = p.equation_10_mended(g, s)
        s.dphi3 = p.equation_11(g, s)
        s.dX_E, s.dY_E = p.equation_12_mended(g, s)
        s.dphi6, s.dphi7 = p.equation_14(g, s), p.equation_15(g, s)
        *_, s.dX_F, s.dY_F = p.equation_13(g, s)
        answers += p.equation_16(g, s)
    if order >= 2:
        s.ddphi3 = p.equation_19(g, s)
        s.ddX_E, s.ddY_E = p.equation_20_mended(g, s)
        s.ddphi6, s.ddphi7 = p.equation_22(g, s), p.equation_23_mended(g, s)
        s.ddX_F, s.ddY_F = p.equation_24(g, s)
        answers += p.equation_25(g, s)
    return np.stack(answers, axis=-1)


# ---- FMUs in fmpy ----------------------------------------------------------------------


@contextmanager
def in_fmpy(fmu: Path, folder: Path, key: str, title: str) -> Iterator[Way]:
    """A step through fmpy's object: three inputs set, step, 2 to 6 outputs read; angles are those of the step's end."""
    description = fmpy.read_model_description(str(fmu))
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    unpacked = fmpy.extract(str(fmu), str(folder / fmu.stem))
    instance = fmpy.instantiate_fmu(unpacked, description, "CoSimulation")
    instance.setBoolean([reference["crank.at_step_end"]], [True])
    instance.setupExperiment(startTime=0.0)
    instance.enterInitializationMode()
    instance.exitInitializationMode()
    inputs = [reference[f"crank.{name}"] for name in ("phi", "w", "a")]
    outputs = [reference[f"tip.{name}"] for name in ("x", "y", "vx", "vy", "ax", "ay")]
    time, last = 0.0, 0.0

    def evaluate(phi: np.ndarray, order: int) -> np.ndarray:
        nonlocal time, last
        answers, read = [], outputs[: 2 * (order + 1)]
        for angle in phi.tolist():
            # As long as the crank takes to turn so far: a speed that the angles contradict is ignored.
            step = ((angle - last) % TURN or TURN) / SPEED
            instance.setReal(inputs, [angle, SPEED, 0.0])
            instance.doStep(time, step)
            answers.append(instance.getReal(read))
            time, last = time + step, angle
        return np.array(answers)

    try:
        yield Way(key, title, OURS, evaluate, remark="a whole step: three inputs set, step, outputs read")
    finally:
        instance.terminate()
        instance.freeInstance()
