"""Checks that run the FMU, each in another process that may crash or hang (probe.py). `kind` is the interface type."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import fmpy
import numpy as np
from fmpy.model_description import ModelVariable, Unknown

from ..formats.ls_ref import UnreadableReference, deviations, read_reference
from .probe import table
from .subject import CO_SIMULATION, MODEL_EXCHANGE, Advice, NotApplicable, Subject, can_be_moved, limits_of, number

WRONG_TOKEN = "{00000000-0000-0000-0000-000000000000}"
RELATIVE_SLOPE = 1e-3  # of a directional derivative against central differences
RELATIVE_RESULT = 1e-3  # of a result that comes without a tolerance, of its range
PAIRS = 60  # of an unknown and a known, at most
REALS = ("Real", "Float64", "Float32")
KNOWNS = 150  # of which the influence is tried, at most
REACHES = (0.0, 0.5, 0.5, 1.0, 2.0, 4.0)  # how far from the start the points lie at which it is tried
ENOUGH = 4  # of these points, without a change, to say that there is none
RELATIVE_CHANGE = 1e-9  # below which an output did not follow: an iteration inside the model may end elsewhere
RELATIVE_FACTOR = 1e-4  # by which a constant factor may seem to change
RELATIVE_TIME = 1e-6  # by which the independent variable may be off, of a step
LEAK, LARGE_LEAK = 16, 1 << 16  # bytes an instance: from which on memory grows, and may end a long series of runs
PAGE = 4096
LAST_DIGIT = 1e-14  # relative: a start value that was written with 15 digits
FEW_STEPS = 20


def load(fmu: Subject, kind: str) -> Iterator[str]:
    """The binary of this machine."""
    folder = fmpy.platform if fmu.is_fmi2 else fmpy.platform_tuple
    stem = f"binaries/{folder}/{fmu.interfaces[kind].modelIdentifier}"
    if f"{stem}{fmpy.sharedLibraryExtension}" not in fmu.files:
        there = sorted({binary.split("/")[1] for binary in fmu.binaries})
        yield f"nothing for this machine, {folder}: it has {', '.join(there) or 'no binary'}"
        return
    found = fmu.ask(kind, "load")
    wanted = "2." if fmu.is_fmi2 else "3."
    if not found["version"].startswith(wanted):
        yield f"the binary says that it is FMI {found['version']}, the description {fmu.description.fmiVersion}"
    if found["platform"] not in (None, "default"):
        yield f"the binary says that its types are {found['platform']!r}, not 'default'"


def instance(fmu: Subject, kind: str) -> Iterator[str]:
    """With the token of the description; all other checks of runs begin so."""
    fmu.ask(kind, "instance")
    yield from ()


def token(fmu: Subject, kind: str) -> Iterator[str]:
    """An instance is had with no token but the description's."""
    if fmu.ask(kind, "token", wrong=WRONG_TOKEN):
        yield Advice("the binary accepts any token: it would run with the description of another FMU")


def start_values(fmu: Subject, kind: str) -> Iterator[str]:
    """What the description says is what the binary begins with."""
    names = [
        variable.name for variable in fmu.description.modelVariables
        if variable.start is not None and variable.type not in ("Binary", "Clock")
        and (variable.initial == "exact" or variable.causality == "input" or variable.variability == "constant")
    ]  # fmt: skip
    if not names:
        raise NotApplicable("no variable has a start value that must hold")
    start = fmu.course["start"]
    held = fmu.ask(kind, "starts", names=names, start=start, stop=start + fmu.course["step"] * fmu.course["count"])
    by_name = {variable.name: variable for variable in fmu.description.modelVariables}
    for name, values in zip(names, held, strict=True):
        declared, type_ = by_name[name].start, by_name[name].type
        if type_ == "String":
            words = string_starts(fmu, by_name[name])
        else:
            words = declared.split() if isinstance(values, list) else [declared]
        texts = values if isinstance(values, list) else [values]
        if len(words) == 1:
            words *= len(texts)  # of an array whose elements all start alike
        wanted, found = [meaning(word, type_) for word in words], [held_value(text, type_) for text in texts]
        if wanted != found:
            shown = " ".join(map(str, found))
            sentence = f"{name} starts with {declared} in the description and with {shown} in the binary"
            is_rounded = type_ in REALS and len(wanted) == len(found) and np.allclose(wanted, found, LAST_DIGIT, 0.0)
            yield Advice(sentence) if is_rounded else sentence


def string_starts(fmu: Subject, variable: ModelVariable) -> list[str]:
    """Of a String, or of each element of an array of them: FMI 3.0 has an element for each."""
    if fmu.is_fmi2:
        return [variable.start]
    of_name = (element for element in fmu.root.iter("String") if element.get("name") == variable.name)
    return [start.get("value") for element in of_name for start in element.findall("Start")] or [variable.start]


def meaning(word: str, type_: str) -> float | int | bool | str:
    """A start value of the description."""
    if type_ in ("Real", "Float64"):
        return float(word)
    if type_ == "Float32":
        return float(np.float32(word))
    if type_ == "Boolean":
        return word.strip() in ("true", "1")
    return word if type_ == "String" else int(word)


def held_value(text: str, type_: str) -> Any:
    """What probe.py read, as `meaning` has it."""
    if type_ in ("Real", "Float64", "Float32"):
        return float.fromhex(text)
    if type_ == "Boolean":
        return text not in ("0", "False")
    return text if type_ == "String" else int(text)


def run(fmu: Subject, kind: str) -> Iterator[str]:
    """The first steps of the default experiment: no error, finite numbers, something happens."""
    rows, course = fmu.run(kind), fmu.course
    types = {variable.name: variable.type for variable in fmu.description.modelVariables}
    for column, name in enumerate(course["names"]):
        if types[name] in REALS:
            for index, row in enumerate(rows):
                values = row[column] if isinstance(row[column], list) else [row[column]]
                if any(value in ("nan", "inf", "-inf") for value in values):
                    yield f"{name} is {' '.join(values)} at {time_of(course, index):g} s"
                    break


def determinism(fmu: Subject, kind: str) -> Iterator[str]:
    """The same run in another process: the same bits."""
    yield from differences(fmu, fmu.run(kind), fmu.ask_other(kind, "run", course=fmu.course)["rows"], "a second run")


def instances(fmu: Subject, kind: str) -> Iterator[str]:
    """A second instance in the process, stepped in between with other inputs, changes nothing."""
    if fmu.interfaces[kind].canBeInstantiatedOnlyOncePerProcess:
        raise NotApplicable("canBeInstantiatedOnlyOncePerProcess is declared")
    rows = fmu.ask(kind, "run_beside", course=fmu.course)["rows"]
    yield from differences(fmu, fmu.run(kind), rows, "a run beside a second instance")


def reset(fmu: Subject, kind: str) -> Iterator[str]:
    """A used instance that was reset is like a new one."""
    rows = fmu.ask(kind, "run_after_reset", course=fmu.course)["rows"]
    yield from differences(fmu, fmu.run(kind), rows, "a run after a reset")


def state_replay(fmu: Subject, kind: str) -> Iterator[str]:
    """Save, run, restore, run again."""
    fmu.demand(kind, "canGetAndSetFMUstate", "canGetAndSetFMUState")
    half = len(fmu.run(kind)) // 2
    found = fmu.ask(kind, "replay", course=fmu.course, half=half)
    yield from differences(fmu, fmu.run(kind)[half:], found["first"], "a run in which a state was saved", half)
    yield from differences(fmu, found["first"], found["second"], "the run from the restored state", half)


def serialized_state(fmu: Subject, kind: str) -> Iterator[str]:
    """The state as bytes, and a run that goes on from them in another process."""
    fmu.demand(kind, "canSerializeFMUstate", "canSerializeFMUState")
    half = len(fmu.run(kind)) // 2
    found = fmu.ask(kind, "serialize", course=fmu.course, half=half)
    fields = {"course": fmu.course, "half": half, "serialized": found["serialized"], "own": found["own"]}
    rows = fmu.ask_other(kind, "resume", **fields)["rows"]
    yield from differences(fmu, found["rows"], rows, "the run in another process", half)


def derivatives(fmu: Subject, kind: str) -> Iterator[str]:
    """Directional derivatives by the continuous inputs, against central differences."""
    fmu.demand(kind, "providesDirectionalDerivative", "providesDirectionalDerivatives")
    yield from wrong_slopes(fmu, kind, adjoint=False)


def adjoint(fmu: Subject, kind: str) -> Iterator[str]:
    """The same of the adjoint ones."""
    if fmu.is_fmi2:
        raise NotApplicable("FMI 2.0 has no adjoint derivatives")
    fmu.demand(kind, "", "providesAdjointDerivatives")
    yield from wrong_slopes(fmu, kind, adjoint=True)


def wrong_slopes(fmu: Subject, kind: str, adjoint: bool) -> Iterator[str]:
    course = fmu.course
    pairs = [
        (unknown.variable.name, known.name)
        for unknown in (*fmu.description.outputs, *fmu.description.derivatives)
        if unknown.variable.type in ("Real", "Float64") and not unknown.variable.shape
        for known in known_of(fmu, unknown)
        if known.name in course["inputs"] and known.type in ("Real", "Float64")
    ][:PAIRS]
    if not pairs:
        raise NotApplicable("no output depends on a continuous input")
    inputs = {name: values[course["count"] // 3] for name, values in course["inputs"].items()}
    stop = course["start"] + course["step"] * course["count"]
    found = fmu.ask(kind, "slopes", start=course["start"], stop=stop, inputs=inputs, pairs=pairs, adjoint=adjoint)
    for (unknown, known), (given, near, far, noise) in zip(pairs, found, strict=True):
        allowed = RELATIVE_SLOPE * abs(near) + 4 * abs(near - far) + 1e-14 * noise
        if not abs(given - near) <= allowed:
            yield f"d({unknown})/d({known}) is given as {given:.6g}; differences give {near:.6g}"


def known_of(fmu: Subject, unknown: Unknown) -> list[ModelVariable]:
    """What an output depends on: all inputs where nothing is declared."""
    if unknown.dependencies is not None:
        return list(unknown.dependencies)
    return [variable for variable in fmu.description.modelVariables if can_be_moved(variable)]


def independent(fmu: Subject, kind: str) -> Iterator[str]:
    """The independent variable is the time to which the host has brought the FMU, with steps of any length."""
    names = [variable.name for variable in fmu.description.modelVariables
             if variable.causality == "independent" and variable.type in REALS and not variable.shape]  # fmt: skip
    if not names:
        raise NotApplicable("it declares no independent variable")
    times = fmu.outcome_of_run(kind)["times"]
    column = fmu.course["names"].index(names[0])
    yield from wrong_times(fmu, names[0], [float.fromhex(row[column]) for row in fmu.run(kind)], times)


def wrong_times(fmu: Subject, name: str, held: list[float], times: list[float]) -> Iterator[str]:
    slack = RELATIVE_TIME * fmu.course["step"]
    for value, time in zip(held, times, strict=True):
        if not abs(value - time) <= slack + 1e-12 * abs(time):
            yield f"{name} is {value:.9g} s where the host is at {time:.9g} s"
            return


def ranges(fmu: Subject, kind: str) -> Iterator[str]:
    """What is watched in a run stays within what the description says."""
    rows, course = fmu.run(kind), fmu.course
    by_name = {variable.name: variable for variable in fmu.description.modelVariables}
    limited = [
        (column, name, *limits) for column, name in enumerate(course["names"])
        if (limits := limits_of(by_name[name])) != (-math.inf, math.inf)
    ]  # fmt: skip
    if not limited:
        raise NotApplicable("nothing that changes in a run has a min or a max")
    for column, name, least, most in limited:
        for index, row in enumerate(rows):
            values = row[column] if isinstance(row[column], list) else [row[column]]
            held = [held_value(value, by_name[name].type) for value in values]
            if outside := [value for value in held if value < least or value > most]:
                yield f"{name} is {outside[0]:g} at {time_of(course, index):g} s, outside {least:g} to {most:g}"
                break


def states(fmu: Subject, kind: str) -> Iterator[str]:
    """Continuous states and their derivatives: as many as declared, the same by every way of asking, and they move."""
    if kind == CO_SIMULATION:
        yield from standing_states(fmu, kind)
        return
    course = fmu.course
    counts = [fmu.description.numberOfContinuousStates, fmu.description.numberOfEventIndicators]
    found = fmu.ask(kind, "states", start=course["start"], step=course["step"])
    if found["counts"] is not None:
        for what, declared, told in zip(
            ("continuous states", "event indicators"), counts, found["counts"], strict=True
        ):
            if declared != told:
                yield f"{declared} {what} are declared; the binary says {told}"
    if counts[1] == 0 and fmu.ask(kind, "own_indicators", start=course["start"], step=course["step"]):
        yield "no event indicator is declared, and the binary gives some"
    for name, nominal in zip(found["names"], found["nominals"], strict=False):
        if not 0 < nominal < math.inf:
            yield f"the nominal value of the state {name} is {nominal:g}"
    if "held" not in found:
        return
    ways = [("names", "held", "as variables"), ("rates", "held rates", "rates as variables")]
    if "set" in found:
        ways += [("names", "got", "got as variables"), ("rates", "rates after", "rates after as variables")]
    for names, held, read in ways:
        for name, own, variable in zip(found[names], found[held], found[read], strict=True):
            one, other = (float.fromhex(value) if isinstance(value, str) else value for value in (own, variable))
            if one != other and not abs(one - other) <= 1e-12 * max(abs(one), abs(other)):
                yield f"{name} is {other:.9g} read as a variable, and {one:.9g} by the functions of Model Exchange"
                break
    for name, wanted, got in zip(found["names"], found.get("set", ()), found.get("got", ()), strict=False):
        if got != wanted:
            yield f"the state {name} was set to {wanted:.9g} and is {got:.9g}"


def standing_states(fmu: Subject, kind: str) -> Iterator[str]:
    """Co-simulation: a state whose derivative is not 0 changes in a run."""
    columns = {name: column for column, name in enumerate(fmu.course["names"])}
    pairs = [
        (variable.derivative.name, variable.name) for variable in fmu.description.modelVariables
        if variable.derivative is not None and not variable.shape
        and {variable.name, variable.derivative.name} <= set(columns)
    ]  # fmt: skip
    if not pairs:
        raise NotApplicable("it declares no derivative of a state")
    rows = fmu.run(kind)
    for state, rate in pairs:
        held = {row[columns[state]] for row in rows}
        rates = [float.fromhex(row[columns[rate]]) for row in rows]
        scale = max(abs(float.fromhex(next(iter(held)))), 1e-6) if held else 1.0
        if len(rows) > 2 and len(held) == 1 and min(map(abs, rates)) * fmu.course["step"] > 1e-12 * scale:
            yield f"{state} stands still in a run, though {rate} is {rates[0]:.4g}"


def dependencies(fmu: Subject, kind: str) -> Iterator[str]:
    """Change one known variable where outputs follow at once, and see what follows."""
    rng = np.random.default_rng(7)
    structure = fmu.description
    judged = False
    for continuous, listed in (
        (False, structure.initialUnknowns),
        (True, [*structure.outputs, *structure.derivatives]),
    ):
        if continuous and kind != MODEL_EXCHANGE:
            continue
        unknowns = [unknown for unknown in listed if is_number(unknown.variable) and unknown.dependencies is not None]
        known = known_in(fmu, continuous)
        if not unknowns or not known:
            continue
        start, step = fmu.course["start"], fmu.course["step"]
        held = {}
        if continuous:  # a state need not start with what is declared
            found = fmu.ask(kind, "states", start=start, step=step)
            held = dict(zip(found["names"], found.get("held", ()), strict=False))
        points = [points_of(known, held, rng, reach) for reach in REACHES]
        found = fmu.ask(kind, "influence", start=start, stop=start + step * fmu.course["count"], points=points,
                        unknowns=[unknown.variable.name for unknown in unknowns], continuous=continuous,
                        seconds=fmu.options.limit / 3)  # fmt: skip
        answered = [(point, answer) for point, answer in zip(points, found, strict=True) if answer is not None]
        judged = judged or bool(answered)
        for unknown in unknowns:
            yield from wrong_dependencies(unknown, known, answered, continuous)
    if not judged:
        raise NotApplicable("it declares no dependencies of numbers that can be tried")


def is_number(variable: ModelVariable) -> bool:
    return variable.type in ("Real", "Float64") and not variable.shape and not variable.clocks


def known_in(fmu: Subject, continuous: bool) -> list[ModelVariable]:
    """What a host may set: in Initialization Mode inputs and what has an exact start, in Continuous-Time Mode
    continuous inputs and all states.
    """
    variables = fmu.description.modelVariables
    if not continuous:
        chosen = [
            variable for variable in variables
            if (variable.causality in ("input", "parameter") or (variable.initial == "exact" and is_number(variable)))
            and variable.variability != "constant" and not variable.shape and not variable.clocks
            and (is_number(variable) or variable.type == "Boolean") and variable.initial == "exact"
        ]  # fmt: skip
        return chosen[:KNOWNS]
    state = [unknown.variable.derivative for unknown in fmu.description.derivatives]
    if any(variable is None or variable.shape for variable in state):
        return []
    inputs = [variable for variable in variables if can_be_moved(variable) and is_number(variable)]
    return (state + [variable for variable in inputs if variable not in state])[: max(KNOWNS, len(state))]


def points_of(
    known: list[ModelVariable], held: dict[str, float], rng: np.random.Generator, far: float
) -> dict[str, list[float]]:
    """For each known variable its value, up to `far` nominal values from its start or what it is `held` to be, and the
    values to which it is changed alone: by d and by 2 d.
    """
    point: dict[str, list[float]] = {}
    for variable in known:
        if variable.type == "Boolean":
            is_set = variable.start in ("true", "1")
            point[variable.name] = [is_set, not is_set, not is_set]
            continue
        least, most = limits_of(variable)
        value = held.get(variable.name, number(variable.start, 0.0))
        nominal = abs(number(variable.nominal, 1.0)) or 1.0
        reach = max(nominal, abs(value)) if variable.causality == "input" else 0.04 * (abs(value) or nominal)
        value = min(max(value + min(far, 4.0 if variable.causality == "input" else 0.5) * reach
                        * float(rng.uniform(-1, 1)), least), most)  # fmt: skip
        width = 1e-3 * reach if variable.causality == "input" else 0.025 * reach
        if value + 2 * width > most:
            width = -width
        if least <= value + 2 * width <= most:
            point[variable.name] = [value, value + width, value + 2 * width]
        else:
            point[variable.name] = [value]
    return point


def wrong_dependencies(
    unknown: Unknown,
    known: list[ModelVariable],
    answered: list[tuple[dict[str, Any], dict[str, Any]]],
    continuous: bool,
) -> Iterator[str]:
    name = unknown.variable.name
    kinds = dict(zip([variable.name for variable in unknown.dependencies],
                     unknown.dependenciesKind or ["dependent"] * len(unknown.dependencies), strict=False))  # fmt: skip
    where = "in Continuous-Time Mode" if continuous else "in Initialization Mode"
    for variable in known:
        if variable.name == name:
            continue
        factors: list[tuple[float, float, float]] = []
        followed, tried = False, 0
        for point, answer in answered:
            values, (before, *after) = (
                point[variable.name],
                ([float.fromhex(value) for value in answer[variable.name].get(name, ["0x0p+0"])]),
            )
            if len(values) < 3:
                continue
            tried += 1
            followed = followed or any(
                abs(value - before) > RELATIVE_CHANGE * max(abs(value), abs(before)) + 1e-15 for value in after
            )
            if variable.type != "Boolean":
                one, two = after or (before, before)
                width = values[1] - values[0]
                noise = (
                    1e-13 * max(abs(before), abs(one), abs(two), abs(values[0] * (one - before) / width)) / abs(width)
                )
                factors.append(((one - before) / width, (two - before) / (2 * width), noise))
        if followed and variable.name not in kinds:
            yield f"{name} follows {variable.name} {where}, which its dependencies do not name"
        elif not followed and variable.name in kinds and tried >= ENOUGH and variable.type != "Boolean":
            yield Advice(f"{name} is declared to depend on {variable.name}, which changed nothing {where}")
        elif followed and kinds[variable.name] in ("constant", "fixed", "tunable", "discrete") and factors:
            kind = kinds[variable.name]
            differ = [pair for pair in factors if apart(pair[0], pair[1], pair[2])]
            if kind == "constant" or (kind == "fixed" and continuous):
                first = factors[0]
                differ += [(first[0], other[0], 0.0) for other in factors[1:]
                           if apart(first[0], other[0], first[2] + other[2])]  # fmt: skip
            if differ:
                one, other, _ = differ[0]
                factor = f"its factor of {variable.name}"
                yield f"{name}: {factor} is declared {kind}, and is {one:.6g} here, {other:.6g} there"


def apart(one: float, other: float, noise: float) -> bool:
    return abs(one - other) > RELATIVE_FACTOR * max(abs(one), abs(other)) + noise


def few_steps(fmu: Subject, names: list[str] | None = None) -> dict[str, Any]:
    """The shared run, or its first steps, with other variables watched."""
    course = fmu.course
    count = min(course["count"], FEW_STEPS)
    inputs = {name: values[:count] for name, values in course["inputs"].items()}
    return course | {"count": count, "inputs": inputs} | ({} if names is None else {"names": names})


def real_outputs(fmu: Subject) -> list[str]:
    outputs = (variable for variable in fmu.description.modelVariables if variable.causality == "output")
    return [output.name for output in outputs if is_number(output) and output.variability == "continuous"]


def input_derivatives(fmu: Subject, kind: str) -> Iterator[str]:
    """FMI 2.0: they can be set, and have an effect where the inputs themselves have one."""
    only_for(kind, CO_SIMULATION)
    if not fmu.is_fmi2:
        raise NotApplicable("FMI 3.0 has no input derivatives")
    fmu.demand(kind, "canInterpolateInputs", "")
    if not fmu.course["inputs"]:
        raise NotApplicable("it has no continuous input")
    names = [variable.name for variable in fmu.description.modelVariables
             if variable.name in fmu.watched and variable.causality != "independent"]  # fmt: skip
    ends = fmu.ask(kind, "input_derivatives", course=few_steps(fmu, names))
    if ends["held"] == ends["sloped"] != ends["other"]:
        yield "fmi2SetRealInputDerivatives says OK, and no variable follows: canInterpolateInputs is declared"


def output_derivatives(fmu: Subject, kind: str) -> Iterator[str]:
    """They can be read to the order declared; the first is the slope of the output."""
    only_for(kind, CO_SIMULATION)
    orders = fmu.interfaces[kind].maxOutputDerivativeOrder
    names = real_outputs(fmu)
    if not orders:
        raise NotApplicable("maxOutputDerivativeOrder is not declared")
    if not names:
        raise NotApplicable("it has no continuous output")
    course = few_steps(fmu, names) | {"inputs": {}}  # which hold, as the FMU must take it when nothing else is said
    found = fmu.ask(kind, "output_derivatives", course=course, orders=orders)
    values = np.array([[float.fromhex(value) for value in row] for row in found["rows"]])
    given = np.array([[[float.fromhex(v) for v in order] for order in row] for row in found["given"]])
    if len(values) < 5:
        return
    for order, column in np.argwhere(~np.isfinite(given).all(axis=0)):
        yield f"derivative {order + 1} of {names[column]} is not finite"
    slopes = np.diff(values, axis=0) / course["step"]
    before, after, first = slopes[:-1], slopes[1:], given[1:-1, 0]
    moves = np.abs(values).max(axis=0) * 1e-9 < np.ptp(values, axis=0)
    if moves.any() and not given[:, 0, moves].any():
        yield f"every first derivative is 0, though {names[int(np.argmax(moves))]} changes"
        return
    spread = np.abs(after - before)
    allowed = 3 * spread + 0.05 * np.maximum(np.abs(before), np.abs(after)) + 1e-6 * np.abs(slopes).max(axis=0)
    wrong = (np.abs(first - (before + after) / 2) > allowed) & (first != 0)
    for column in np.flatnonzero(wrong.mean(axis=0) > 0.8):
        value, slope = first[1, column], slopes[1, column]
        yield f"the first derivative of {names[column]} is given as {value:.4g}, and it rises by {slope:.4g} a second"


def event_mode(fmu: Subject, kind: str) -> Iterator[str]:
    """FMI 3.0: a host that enters Event Mode between steps."""
    only_for(kind, CO_SIMULATION)
    if fmu.is_fmi2:
        raise NotApplicable("FMI 2.0 has no Event Mode in co-simulation")
    fmu.demand(kind, "", "hasEventMode")
    fmu.ask(kind, "event_mode", course=few_steps(fmu))
    yield from ()


def intermediate_update(fmu: Subject, kind: str) -> Iterator[str]:
    """FMI 3.0: the FMU calls back during its steps, and returns early where it says that it can."""
    only_for(kind, CO_SIMULATION)
    if fmu.is_fmi2:
        raise NotApplicable("FMI 2.0 has no intermediate update")
    fmu.demand(kind, "", "providesIntermediateUpdate")
    early = fmu.interfaces[kind].canReturnEarlyAfterIntermediateUpdate
    found = fmu.ask(kind, "intermediate_update", course=few_steps(fmu), early=early)
    if not found["calls"]:
        yield "providesIntermediateUpdate is declared, and the binary never called back in a run"
    for time, begin, end in found["outside"][:1]:
        yield f"it called back for {time:.9g} s in a step from {begin:.9g} s to {end:.9g} s"
    if found["unreadable"]:
        yield f"an output with intermediateUpdate cannot be read in the callback: {found['unreadable']}"
    if found["asked"] and not found["returned"]:
        yield "canReturnEarlyAfterIntermediateUpdate is declared, and no step returned early when it was asked to"


def variable_step(fmu: Subject, kind: str) -> Iterator[str]:
    """Steps of several lengths: no error, and the time is the host's."""
    only_for(kind, CO_SIMULATION)
    fmu.demand(kind, "canHandleVariableCommunicationStepSize", "canHandleVariableCommunicationStepSize")
    course, internal = few_steps(fmu), fmu.interfaces[kind].fixedInternalStepSize
    parts = (1, 2, 1, 3) if number(internal, 0.0) > 0 else (1.0, 0.75, 1.25, 1.5)
    lengths = [course["step"] * parts[index % len(parts)] for index in range(course["count"] // 2)]
    found = fmu.ask(kind, "variable_steps", course=course, lengths=lengths)
    types = {variable.name: variable for variable in fmu.description.modelVariables}
    for column, name in enumerate(course["names"]):
        if types[name].causality == "independent" and not types[name].shape:
            yield from wrong_times(fmu, name, [float.fromhex(row[column]) for row in found["rows"]], found["times"])
        elif types[name].type in REALS and any("nan" in row[column] or "inf" in row[column] for row in found["rows"]):
            yield f"{name} is no finite number after steps of several lengths"


def log(fmu: Subject, kind: str) -> Iterator[str]:
    """What the FMU logs: categories that it declares, and UTF-8."""
    declared = {category.name for category in fmu.description.logCategories}
    unknown: set[str | None] = set()
    logged = fmu.ask(kind, "log", course=few_steps(fmu))["logged"]
    for category, message in sorted(logged, key=str):
        for what, part in (("category", category), ("message", message)):
            try:
                text = part and part.encode("latin-1").decode()
            except UnicodeDecodeError:
                yield f"the logger was called with a {what} that is no UTF-8: {part[:60]!r}"
            else:
                if what == "category" and text not in declared:
                    unknown.add(text)
    for category in sorted(unknown, key=str):
        if category is None:
            yield Advice("the logger was called without a category")
        else:
            yield Advice(
                f"the logger was called with the category {category[:60]!r}, which LogCategories does not name"
            )


def memory(fmu: Subject, kind: str) -> Iterator[str]:
    """Made and freed again and again, an instance leaves no memory behind."""
    course, most, seconds = fmu.course, 100, min(0.6, fmu.options.limit / 4)
    stop = course["start"] + course["step"] * course["count"]
    found = fmu.ask(kind, "memory", start=course["start"], stop=stop, most=most, seconds=seconds,
                    longest=fmu.options.limit / 3)  # fmt: skip
    if not found:
        raise NotApplicable("an instance takes too long to be made many times")
    batch = found[0][0]
    for column, least in ((1, LEAK * batch), (2, PAGE * max(1.0, batch / 4))):
        grown = np.diff([row[column] for row in found])[1:]
        if found[0][column] and min(grown) >= least:
            each = float(np.median(grown)) / batch
            sentence = f"every instance leaves some {each:.0f} bytes of memory behind"
            yield sentence if each >= LARGE_LEAK else Advice(sentence)
            return


def only_for(kind: str, wanted: str) -> None:
    if kind != wanted:
        raise NotApplicable(f"of {'co-simulation' if wanted == CO_SIMULATION else 'Model Exchange'} alone")


def reference_results(fmu: Subject, kind: str) -> Iterator[str]:
    """The experiments that the FMU carries (FMI-LS-REF), run by fmpy: within the tolerances stated with them, and where
    there are none within a part of what a variable ranges over.
    """
    try:
        experiments = [experiment for experiment in read_reference(fmu.path) if experiment.results is not None]
    except UnreadableReference as problem:
        yield str(problem)
        return
    if not experiments:
        raise NotApplicable("it carries none")
    known = {variable.name for variable in fmu.description.modelVariables}
    for experiment in experiments:
        if (results := experiment.results) is None:
            continue
        names = [name for name in results.dtype.names or () if name != "time"]
        if unknown := [name for name in names if name not in known]:
            yield f"{experiment.name}: no variable {', '.join(unknown)}"
            continue
        times = results["time"]
        settings = {
            "start_time": float(times[0]) if experiment.start is None else experiment.start,
            "stop_time": float(times[-1]) if experiment.stop is None else experiment.stop,
            "output_interval": float(np.diff(times).min()) if experiment.step is None else experiment.step,
        }
        inputs = None if experiment.inputs is None else columns(experiment.inputs)
        found = fmu.ask(kind, "experiment", start_values=experiment.parameters, inputs=inputs, names=names,
                        settings=settings)  # fmt: skip
        for name, (error, time) in deviations(experiment, table(found)).items():
            allowed = experiment.tolerances.get(name, RELATIVE_RESULT * float(np.ptp(results[name])))
            if not error <= allowed:
                yield f"{experiment.name}: {name} is off by {error:.3g} at {time:g} s; {allowed:.3g} is allowed"


def processes(fmu: Subject) -> Iterator[str]:
    """Freeing an instance frees what it holds, the processes that it has started among that."""
    fmu.folder  # noqa: B018 nothing was run where it cannot be unpacked
    if not fmu.interfaces:
        raise NotApplicable("it has no interface type")
    if left := fmu.close():
        yield Advice(f"{left} of the processes that it had started ran on after its host had ended")


def columns(rows: np.ndarray) -> dict[str, list[float]]:
    return {name: rows[name].tolist() for name in rows.dtype.names or ()}


def differences(fmu: Subject, wanted: list[Any], found: list[Any], which: str, first: int = 0) -> Iterator[str]:
    """The first bit that differs, and how many variables do."""
    names = fmu.course["names"]
    if len(wanted) != len(found):
        yield f"{which} ends after {first + len(found)} steps, not after {first + len(wanted)}: the FMU asked for it"
        return
    for index, (row, other) in enumerate(zip(wanted, found, strict=True)):
        differing = [column for column, pair in enumerate(zip(row, other, strict=True)) if pair[0] != pair[1]]
        if differing:
            column = differing[0]
            more = f", and {len(differing) - 1} more variables" if len(differing) > 1 else ""
            values = f"{names[column]} = {shown(other[column])}, not {shown(row[column])}"
            yield f"{which} gives {values} at {time_of(fmu.course, first + index):g} s{more}"
            return


def shown(value: str | list[Any]) -> str:
    """Every digit of a real value."""
    if isinstance(value, list):
        return "[" + " ".join(map(shown, value)) + "]"
    try:
        return repr(float.fromhex(value)) if "0x" in value else value
    except ValueError:  # a text
        return value


def time_of(course: dict[str, Any], index: int) -> float:
    """The end of step `index`."""
    return float(course["start"] + course["step"] * (index + 1))
