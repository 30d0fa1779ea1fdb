"""Checks that run the FMU, each in another process that may crash or hang (probe.py). `kind` is the interface type."""

from __future__ import annotations

from collections.abc import Iterator

import fmpy
import numpy as np

from .probe import table
from .subject import NotApplicable, Subject, can_be_moved

WRONG_TOKEN = "{00000000-0000-0000-0000-000000000000}"
RELATIVE_SLOPE = 1e-3  # of a directional derivative against central differences
RELATIVE_RESULT = 1e-3  # of a result that comes without a tolerance, of its range
PAIRS = 60  # of an unknown and a known, at most


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
        yield "the binary accepts any token: it would run with the description of another FMU"


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
        words = declared.split() if isinstance(values, list) else [declared]
        values = values if isinstance(values, list) else [values]
        if len(words) == 1:
            words *= len(values)  # of an array whose elements all start alike
        if [meaning(word, type_) for word in words] != [held_value(value, type_) for value in values]:
            shown = " ".join(str(held_value(value, type_)) for value in values)
            yield f"{name} starts with {declared} in the description and with {shown} in the binary"


def meaning(word: str, type_: str) -> float | int | bool | str:
    """A start value of the description."""
    if type_ in ("Real", "Float64"):
        return float(word)
    if type_ == "Float32":
        return float(np.float32(word))
    if type_ == "Boolean":
        return word.strip() in ("true", "1")
    return word if type_ == "String" else int(word)


def held_value(text: str, type_: str) -> float | int | bool | str:
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
        if types[name] in ("Real", "Float64", "Float32"):
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
    half = fmu.course["count"] // 2
    found = fmu.ask(kind, "replay", course=fmu.course, half=half)
    yield from differences(fmu, fmu.run(kind)[half:], found["first"], "a run in which a state was saved", half)
    yield from differences(fmu, found["first"], found["second"], "the run from the restored state", half)


def serialized_state(fmu: Subject, kind: str) -> Iterator[str]:
    """The state as bytes, and a run that goes on from them in another process."""
    fmu.demand(kind, "canSerializeFMUstate", "canSerializeFMUState")
    half = fmu.course["count"] // 2
    found = fmu.ask(kind, "serialize", course=fmu.course, half=half)
    fields = {"course": fmu.course, "half": half, "serialized": found["serialized"], "own": found["own"]}
    rows = fmu.ask_other(kind, "resume", **fields)["rows"]
    yield from differences(fmu, found["rows"], rows, "the run in another process", half)


def derivatives(fmu: Subject, kind: str) -> Iterator[str]:
    """Directional derivatives of the outputs by the continuous inputs, against central differences."""
    fmu.demand(kind, "providesDirectionalDerivative", "providesDirectionalDerivatives")
    course = fmu.course
    pairs = [
        (unknown.variable.name, known.name)
        for unknown in fmu.description.outputs
        if unknown.variable.type in ("Real", "Float64") and not unknown.variable.shape
        for known in known_of(fmu, unknown)
        if known.name in course["inputs"]
    ][:PAIRS]
    if not pairs:
        raise NotApplicable("no output depends on a continuous input")
    inputs = {name: values[course["count"] // 3] for name, values in course["inputs"].items()}
    stop = course["start"] + course["step"] * course["count"]
    found = fmu.ask(kind, "slopes", start=course["start"], stop=stop, inputs=inputs, pairs=pairs)
    for (unknown, known), (given, near, far, noise) in zip(pairs, found, strict=True):
        allowed = RELATIVE_SLOPE * abs(near) + 4 * abs(near - far) + 1e-14 * noise
        if not abs(given - near) <= allowed:
            yield f"d({unknown})/d({known}) is given as {given:.6g}; differences give {near:.6g}"


def known_of(fmu: Subject, unknown) -> list:
    """What an output depends on: all inputs where nothing is declared."""
    if unknown.dependencies is not None:
        return unknown.dependencies
    return [variable for variable in fmu.description.modelVariables if can_be_moved(variable)]


def reference_results(fmu: Subject, kind: str) -> Iterator[str]:
    """The experiments that the FMU carries (FMI-LS-REF), run by fmpy: within the tolerances stated with them, and where
    there are none within a part of what a variable ranges over."""
    from ..reference import UnreadableReference, deviations, read_reference

    try:
        experiments = [experiment for experiment in read_reference(fmu.path) if experiment.results is not None]
    except UnreadableReference as problem:
        yield str(problem)
        return
    if not experiments:
        raise NotApplicable("it carries none")
    known = {variable.name for variable in fmu.description.modelVariables}
    for experiment in experiments:
        names = [name for name in experiment.results.dtype.names if name != "time"]
        if unknown := [name for name in names if name not in known]:
            yield f"{experiment.name}: no variable {', '.join(unknown)}"
            continue
        times = experiment.results["time"]
        settings = {
            "start_time": float(times[0]) if experiment.start is None else experiment.start,
            "stop_time": float(times[-1]) if experiment.stop is None else experiment.stop,
            "output_interval": float(np.diff(times).min()) if experiment.step is None else experiment.step,
        }
        inputs = None if experiment.inputs is None else columns(experiment.inputs)
        found = fmu.ask(kind, "experiment", start_values=experiment.parameters, inputs=inputs, names=names,
                        settings=settings)  # fmt: skip
        for name, (error, time) in deviations(experiment, table(found)).items():
            allowed = experiment.tolerances.get(name, RELATIVE_RESULT * np.ptp(experiment.results[name]))
            if not error <= allowed:
                yield f"{experiment.name}: {name} is off by {error:.3g} at {time:g} s; {allowed:.3g} is allowed"


def columns(rows: np.ndarray) -> dict[str, list[float]]:
    return {name: rows[name].tolist() for name in rows.dtype.names}


def differences(fmu: Subject, wanted: list, found: list, which: str, first: int = 0) -> Iterator[str]:
    """The first bit that differs, and how many variables do."""
    names = fmu.course["names"]
    for index, (row, other) in enumerate(zip(wanted, found, strict=True)):
        differing = [column for column, pair in enumerate(zip(row, other, strict=True)) if pair[0] != pair[1]]
        if differing:
            column = differing[0]
            more = f", and {len(differing) - 1} more variables" if len(differing) > 1 else ""
            values = f"{names[column]} = {shown(other[column])}, not {shown(row[column])}"
            yield f"{which} gives {values} at {time_of(fmu.course, first + index):g} s{more}"
            return


def shown(value: str | list) -> str:
    """Every digit of a real value."""
    if isinstance(value, list):
        return "[" + " ".join(map(shown, value)) + "]"
    return repr(float.fromhex(value)) if "0x" in value else value


def time_of(course: dict, index: int) -> float:
    """The end of step `index`."""
    return course["start"] + course["step"] * (index + 1)
