"""Checks that need this project's interface; any other FMU skips them. Nothing else in this room knows the project."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from fmpy.model_description import ModelVariable

from ..interface import Derivative, Interface, Output, Parameter, load_interface
from .runs import time_of
from .subject import MODEL_EXCHANGE, NotApplicable, Subject, limits_of, number
from .units import BASE, shown

CLOSE = {"m": 1e-12, "m/s": 1e-11, "m/s2": 1e-9, "rad": 1e-11}  # to the twin's numpy, beyond what both round


def interface_of(fmu: Subject) -> Interface:
    """The interface of this project; raises NotApplicable where the FMU has another."""
    interface = load_interface()
    if not {variable.name for variable in fmu.description.modelVariables} >= {"crank.phi", "tip.x", "geometry.L1"}:
        raise NotApplicable(f"an FMU of its own interface, not {interface.model.name}'s")
    return interface


def interface(fmu: Subject) -> Iterator[str]:
    """Every variable as interface.toml declares it, and the token that belongs to them."""
    ours = interface_of(fmu)
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
            "derivative of": variable.of if isinstance(variable, Derivative) else None,
            "range": (isinstance(variable, Parameter) and variable.range) or (-np.inf, np.inf),
        }
        has = dict(
            zip(
                wanted,
                (
                    found.valueReference,
                    found.causality,
                    found.unit,
                    found.displayUnit,
                    declared(found),
                    found.derivative and found.derivative.name,
                    limits_of(found),
                ),
                strict=True,
            )
        )
        for what, value in wanted.items():
            if value != has[what]:
                yield f"{variable.name}: {what} {has[what]}, not {value}"
    yield from other_units(fmu, ours)
    yield from other_dependencies(fmu, ours)
    edition = (fmu.description.modelName or "").removeprefix(ours.model.name)
    if fmu.description.guid != ours.edition_token(edition):
        yield f"its token {fmu.description.guid} is not that of this interface, {ours.edition_token(edition)}"


def other_units(fmu: Subject, ours: Interface) -> Iterator[str]:
    """Units that are defined otherwise than in interface.toml."""
    given = {unit.name: unit for unit in fmu.description.unitDefinitions}
    for name, unit in ours.units.items():
        if name not in given:
            continue  # no variable has it, or else that was said
        base = given[name].baseUnit
        found = {power: value for power in BASE if base is not None and (value := getattr(base, power))}
        if found != unit.exponents or base.factor != 1 or base.offset != 0:
            yield f"unit {name}: {shown(base) if base else 'not defined'}, factor {base.factor if base else 1:g}"
        factors = {display.name: (display.factor, display.offset) for display in given[name].displayUnits}
        if unit.display is not None and factors.get(unit.display[0]) != (unit.display[1], 0.0):
            factor = factors.get(unit.display[0], (None,))[0]
            yield f"unit {name}: display unit {unit.display[0]} with the factor {factor}, not {unit.display[1]}"


def other_dependencies(fmu: Subject, ours: Interface) -> Iterator[str]:
    """Dependencies and their kinds that are others than interface.toml's."""
    structure = fmu.description
    wanted = {variable.name: variable.depends for variable in ours.unknowns}
    first = {}
    for variable in ours.unknowns:
        if not variable.is_state:
            parameters = variable.initially if isinstance(variable, Output) else ()
            first[variable.name] = dict.fromkeys(parameters, "dependent") | variable.depends
    for where, unknowns, those in (("", [*structure.outputs, *structure.derivatives], wanted),
                                   (" initially", structure.initialUnknowns, first)):  # fmt: skip
        for unknown in unknowns:
            name = unknown.variable.name
            if name not in those:
                continue
            known = [variable.name for variable in unknown.dependencies or []]
            kinds = dict(zip(known, unknown.dependenciesKind or ["dependent"] * len(known), strict=False))
            for other in sorted(set(kinds) | set(those[name])):
                if kinds.get(other) != those[name].get(other):
                    yield (
                        f"{name}{where} depends on {other}: {kinds.get(other, 'not declared')}, "
                        f"not {those[name].get(other, 'at all')}"
                    )


def declared(variable: ModelVariable) -> float | bool | str | None:
    """The start value in the description."""
    if variable.type == "Boolean" and variable.start is not None:
        return variable.start in ("true", "1")
    return variable.start if variable.start is None else number(variable.start, variable.start)


def kinematics(fmu: Subject, kind: str) -> Iterator[str]:
    """One turn of the crank at the published speed: after each step the tip is where the readable edition in numpy
    has it at the step's end, not at its beginning.
    """
    from ..twin.linkage import Geometry, solve

    ours = interface_of(fmu)
    starts = {variable.name: variable.start for variable in fmu.description.modelVariables}
    geometry = Geometry(**{name: float(starts[f"geometry.{name}"]) for name in ours.geometry})
    speed = 2 * np.pi / ours.model.turn_time
    count = 200
    step = ours.model.turn_time / count
    # in Model Exchange outputs follow the inputs as set, which a run here sets at a step's beginning
    shift = step if kind != MODEL_EXCHANGE else 0.0
    times = np.arange(count) * step
    units = {output.name: output.unit.name for output in ours.of_kind("output") if output.name.startswith("tip.")}
    names = list(units)
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
        unit = units[name]
        off = np.abs(held[name] - exact[name])
        worst = int(np.argmax(np.where(np.isnan(off), np.inf, off)))
        if not off[worst] <= CLOSE[unit]:
            yield (
                f"{name} is {held[name][worst]:.9g} {unit} at {time_of(course, worst):.4g} s, "
                f"{off[worst]:.2g} {unit} off the exact {exact[name][worst]:.9g}"
            )
