"""Reference results that an FMU carries, as FMI-LS-REF has them (modelica/fmi-ls-ref, 1.0.0-beta.1).

A manifest names each file with its role; experiments are in the Modelica Association's format
(modelica/ma-hs-experiments, a draft), parameter sets are SSV (SSP 1.0). exporter/reference.py packs such.
"""

from __future__ import annotations

import csv
import hashlib
import posixpath
import zipfile
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import numpy as np
from lxml import etree

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{FOLDER}/fmi-ls-manifest.xml"
EXPERIMENTS_TYPE = "application/x-ma-hs-experiments"
SSV, SSC = (f"http://ssp-standard.org/SSP1/SystemStructure{part}" for part in ("ParameterValues", "Common"))
# The types of our annotations.
TOLERANCES, CHECKSUM = "transplanter-linkage.tolerances", "transplanter-linkage.checksum"


class UnreadableReference(ValueError):
    """What an FMU carries as reference results cannot be read; the message names the file and the reason."""


@dataclass(frozen=True)
class Experiment:
    """One experiment as an FMU carries it. Tables are as fmpy's simulate_fmu takes and returns them: structured
    arrays, the column "time" first. `tolerances` are absolute, by variable; empty where the FMU states none.
    """

    name: str
    description: str
    start: float | None
    stop: float | None
    step: float | None
    parameters: dict[str, float | bool]
    inputs: np.ndarray | None
    results: np.ndarray | None
    tolerances: dict[str, float]


def read_reference(fmu: Path | str) -> list[Experiment]:
    """The experiments of an FMU's manifest, in its order; none where it has no manifest or no experiments.

    Raises UnreadableReference where a file that the manifest or an experiment names is missing, was changed since
    (checksum), or cannot be read.
    """
    try:
        with zipfile.ZipFile(fmu) as archive:
            content = {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}
    except (OSError, zipfile.BadZipFile) as problem:
        raise UnreadableReference(f"{fmu}: {problem}") from None
    if MANIFEST not in content:
        return []
    found: list[Experiment] = []
    for related in _parse(content, MANIFEST).iter("Related"):
        file = _resolve(MANIFEST, related.get("source", ""))
        _check_sum(content, file, related)
        if related.get("role", "").partition("/")[0] == "experiment" and related.get("type") == EXPERIMENTS_TYPE:
            found += [_read_experiment(content, file, entry) for entry in _parse(content, file).iter("Experiment")]
    return found


def deviations(experiment: Experiment, found: np.ndarray) -> dict[str, tuple[float, float]]:
    """For each variable that both tables have: the greatest absolute error, and the time at which it occurs.

    Raises ValueError where the experiment has no results, or `found` lacks one of their times (to 1e-9 s); a value that
    is no number is an infinite error.
    """
    if (exact := experiment.results) is None:
        raise ValueError(f"{experiment.name}: the FMU carries no results of it")
    times = exact["time"]
    rows = np.argmin(np.abs(found["time"][None, :] - times[:, None]), axis=1)
    if (off := np.abs(found["time"][rows] - times)).max() > 1e-9:
        missing = times[int(np.argmax(off))]
        raise ValueError(f"{experiment.name}: no result at {missing:g} s; the exact ones are at {len(times)} times")
    errors = {}
    for name in (exact.dtype.names or ())[1:]:
        if name in (found.dtype.names or ()):
            error = np.nan_to_num(np.abs(found[name][rows] - exact[name]), nan=np.inf)
            errors[name] = float(error.max()), float(times[int(np.argmax(error))])
    return errors


def read_table(text: str) -> np.ndarray:
    """CSV with a line of names, "time" first, as a structured array of floats."""
    names, *rows = csv.reader(text.splitlines())
    if names[0] != "time" or not rows or len(set(names)) != len(names):
        raise ValueError("a table has different names in its first line, time first, and numbers below")
    return np.array([tuple(map(float, row)) for row in rows], dtype=[(name, float) for name in names])


def _read_experiment(content: dict[str, bytes], file: str, entry: etree._Element) -> Experiment:
    def source_of(element: etree._Element | None) -> str | None:
        return None if element is None else _resolve(file, element.get("source", ""))

    def table(element: etree._Element | None) -> np.ndarray | None:
        if (source := source_of(element)) is None:
            return None
        try:
            return read_table(_read(content, source).decode("utf-8-sig"))
        except (ValueError, StopIteration) as problem:
            raise UnreadableReference(f"{source}: {problem}") from None

    # the draft's schema has the times in an element of their own, its text among the experiment's attributes
    times = entry.find("TransientSimulation")
    times = entry if times is None else times
    start, stop, step = (
        None if (value := times.get(name)) is None else float(value) for name in ("startTime", "stopTime", "stepSize")
    )
    results = entry.find("References")
    parameters = source_of(entry.find("Parameters"))
    return Experiment(
        name=entry.get("name", ""),
        description=entry.get("description", ""),
        start=start,
        stop=stop,
        step=step,
        parameters={} if parameters is None else _read_parameters(_parse(content, parameters)),
        inputs=table(entry.find("Stimuli")),
        results=table(results),
        tolerances={
            t.get("variable", ""): float(t.get("absolute", "nan"))
            for t in entry.iterfind(f"References/Annotations/Annotation[@type='{TOLERANCES}']/Tolerance")
        },
    )


def _read_parameters(root: etree._Element) -> dict[str, float | bool]:
    values: dict[str, float | bool] = {}
    for parameter in root.iter(f"{{{SSV}}}Parameter"):
        for value in parameter:
            if value.tag == f"{{{SSV}}}Boolean":
                values[parameter.get("name", "")] = value.get("value") in ("true", "1")
            elif value.tag == f"{{{SSV}}}Real":
                values[parameter.get("name", "")] = float(value.get("value", "nan"))
    return values


def _resolve(base: str, source: str) -> str:
    """A relative URI in a file of the archive as a name in the archive."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(base), unquote(source)))


def _read(content: dict[str, bytes], file: str) -> bytes:
    if file not in content:
        raise UnreadableReference(f"{file}: named as reference, but not in the archive")
    return content[file]


def _parse(content: dict[str, bytes], file: str) -> etree._Element:
    try:
        return etree.fromstring(_read(content, file), etree.XMLParser(resolve_entities=False, no_network=True))
    except etree.XMLSyntaxError as problem:
        raise UnreadableReference(f"{file}: {problem}") from None


def _check_sum(content: dict[str, bytes], file: str, related: etree._Element) -> None:
    """By our annotation, and by the attributes that later versions of FMI-LS-REF have."""
    for given in (related, *related.iterfind(f"Annotations/Annotation[@type='{CHECKSUM}']/Checksum")):
        algorithm = given.get("checksumType", "SHA3-256").lower().replace("sha3-", "sha3_").replace("sha-", "sha")
        wanted = given.get("checksum", "").lower()
        if wanted and hashlib.new(algorithm, _read(content, file)).hexdigest() != wanted:
            raise UnreadableReference(f"{file}: changed since the manifest was written: its {algorithm} is another")
