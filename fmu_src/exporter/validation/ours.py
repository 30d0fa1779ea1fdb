"""Checks that need this project's interface; any other FMU skips them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from fmpy.model_description import ModelVariable

from .runs import time_of
from .subject import MODEL_EXCHANGE, Subject, number

CLOSE = {"m": 1e-12, "m/s": 1e-11, "m/s2": 1e-9, "rad": 1e-11}  # to the twin's numpy, beyond what both round


def interface(fmu: Subject) -> Iterator[str]:
    """Every variable as interface.toml declares it, and the token that belongs to them."""
    ours = fmu.ours
    given = {variable.name: variable for variable in fmu.description.modelVariables}
    for variable in ours.variables:
        if variable.name not in given:
            yield f"{variable.name} is missing"
            continue
        found = given[variable.name]
        wanted = {
            "value reference": variable.value_reference,
            "causality": "local" if variable.kind == "derivative" else variable.kind,
            "unit": None if variable.unit is None else variable.unit.name,
            "display unit": None if variable.unit is None else variable.unit.display_name,
            "start": None if variable.start is None else variable.start,
        }
        has = dict(
            zip(
                wanted,
                (found.valueReference, found.causality, found.unit, found.displayUnit, declared(found)),
                strict=True,
            )
        )
        for what, value in wanted.items():
            if value != has[what]:
                yield f"{variable.name}: {what} {has[what]}, not {value}"
    edition = (fmu.description.modelName or "").removeprefix(ours.model.name)
    if fmu.description.guid != ours.edition_token(edition):
        yield f"its token {fmu.description.guid} is not that of this interface, {ours.edition_token(edition)}"


def declared(variable: ModelVariable) -> float | bool | str | None:
    """The start value in the description."""
    if variable.type == "Boolean" and variable.start is not None:
        return variable.start in ("true", "1")
    return variable.start if variable.start is None else number(variable.start, variable.start)


def kinematics(fmu: Subject, kind: str) -> Iterator[str]:
    """One turn of the crank at the published speed: after each step the tip is where the readable edition in numpy
    has it at the step's end, not at its beginning."""
    from ...twin.linkage import Geometry, solve

    ours = fmu.ours
    starts = {variable.name: variable.start for variable in fmu.description.modelVariables}
    geometry = Geometry(**{name: float(starts[f"geometry.{name}"]) for name in ours.geometry})
    speed = 2 * np.pi / ours.model.turn_time
    count = 200
    step = ours.model.turn_time / count
    # in Model Exchange outputs follow the inputs as set, which a run here sets at a step's beginning
    shift = step if kind != MODEL_EXCHANGE else 0.0
    times = np.arange(count) * step
    names = [variable.name for variable in ours.of_kind("output") if variable.name.startswith("tip.")]
    inputs = {"crank.phi": speed * times, "crank.w": np.full(count, speed)}
    course = {"names": names, "start": 0.0, "step": step, "count": count,
              "inputs": {name: values.tolist() for name, values in inputs.items()}}  # fmt: skip
    rows = fmu.ask(kind, "run", course=course)["rows"]
    held = {name: np.array([float.fromhex(row[column]) for row in rows]) for column, name in enumerate(names)}
    solution = solve(geometry, speed * (times + shift))
    velocity, acceleration = solution.velocity(speed), solution.acceleration(speed)
    exact = {
        "tip.x": solution.tip[0].real, "tip.y": solution.tip[0].imag, "tip.vx": velocity.real, "tip.vy": velocity.imag,
        "tip.ax": acceleration.real, "tip.ay": acceleration.imag, "tip.angle": solution.angle[0],
    }  # fmt: skip
    for name in names:
        unit = ours[name].unit.name
        off = np.abs(held[name] - exact[name])
        worst = int(np.argmax(np.where(np.isnan(off), np.inf, off)))
        if not off[worst] <= CLOSE[unit]:
            yield (
                f"{name} is {held[name][worst]:.9g} {unit} at {time_of(course, worst):.4g} s, "
                f"{off[worst]:.2g} {unit} off the exact {exact[name][worst]:.9g}"
            )
