"""Reference results and parameter sets in the FMU, in the place and form that others know.

The FMI layered standard FMI-LS-REF (modelica/fmi-ls-ref, 1.0.0-beta.1) says where: a manifest in
extra/org.fmi-standard.fmi-ls-ref names each file with its role. Parameter sets are SSV (SSP 1.0). The
experiments are in the Modelica Association's experiments format (modelica/ma-hs-experiments, a draft), each
with parameters, inputs ("stimuli") and exact results ("references") as CSV, and with absolute tolerances in an
annotation of the results: the format has none.

What is packed is declared in fmu_src/reference/experiments.toml and computed there by the oracle of the tests,
in 50-digit arithmetic: building an FMU copies it. `read_reference` reads it back, from any FMU that has such.
"""

from __future__ import annotations

import csv
import hashlib
import posixpath
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

import numpy as np
from lxml import etree

from ..interface import Interface, tomllib
from .compiler import SOURCE_ROOT

SOURCE = SOURCE_ROOT / "reference"
FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
MANIFEST = f"{FOLDER}/fmi-ls-manifest.xml"
VERSION = "1.0.0-beta.1"  # of FMI-LS-REF
DESCRIPTION = "Layered Standard providing information on related files included in an FMU."  # fixed by its schema
MANIFEST_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
EXPERIMENTS = "reference.exp"
EXPERIMENTS_TYPE = "application/x-ma-hs-experiments"
NOMINAL = "nominal.ssv"
SSV_TYPE = "application/x-ssp-parameter-set"
SSV, SSC = (f"http://ssp-standard.org/SSP1/SystemStructure{part}" for part in ("ParameterValues", "Common"))
TOLERANCES = "transplanter-linkage.tolerances"  # the type of our annotation


# ---- what is packed ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Definition:
    """One experiment of experiments.toml, which says what each number means."""

    name: str
    description: str
    w: float
    v: float
    force: tuple[float, float]
    stop: float
    step: float
    every: float
    tolerance: dict[str, float]  # by unit
    phi_0: float = 0.0
    ripple: float = 0.0
    ripple_frequency: float = 0.0
    parameters: dict[str, float] = field(default_factory=dict)

    @property
    def input_times(self) -> list[float]:
        """Two where all inputs are linear, for hosts interpolate so; else one each step."""
        return [0.0, self.stop] if self.ripple == 0 else _multiples(self.step, self.stop)

    @property
    def result_times(self) -> list[float]:
        return _multiples(self.every, self.stop)


def _multiples(step: float, stop: float) -> list[float]:
    """0, step, 2 step... as the doubles that their decimals are read as."""
    return [round(k * step, 9) for k in range(round(stop / step) + 1)]


def definitions(interface: Interface) -> list[Definition]:
    """The experiments of experiments.toml; raises ValueError where one names what the interface has not."""
    table = tomllib.loads((SOURCE / "experiments.toml").read_text(encoding="utf-8"))
    found = [Definition(**entry) for entry in table["experiment"]]
    known = {variable.name for variable in interface.of_kind("parameter")}
    units = {variable.unit.name for variable in interface.of_kind("output")}
    for of in found:
        if unknown := (set(of.parameters) - known) | (units ^ set(of.tolerance)):
            raise ValueError(f"experiments.toml: {of.name}: no such parameter, or unit of an output: {sorted(unknown)}")
    return found


def file_of(of: Definition, kind: str) -> Path:
    """The table of inputs ("in") or results ("ref")."""
    return SOURCE / f"{of.name}_{kind}.csv"


def reference_content(interface: Interface) -> dict[str, bytes]:
    """The files in the archive, by name."""
    files = {NOMINAL: parameter_set(interface, "nominal", {})}
    related = [(SSV_TYPE, NOMINAL, "parameter", "The nominal geometry, as published")]
    experiments = etree.Element(
        "Experiments",
        name=f"{interface.model.name} reference results",
        description="Exact results, computed with 50 digits: each is the nearest double",
    )
    for of in definitions(interface):
        name = f"{of.name}.ssv" if of.parameters else NOMINAL
        if of.parameters:
            files[name] = parameter_set(interface, of.name, of.parameters)
            related.append((SSV_TYPE, name, "parameter", f"The geometry of the experiment {of.name}"))
        stimuli, results = file_of(of, "in"), file_of(of, "ref")
        files |= {file.name: file.read_bytes() for file in (stimuli, results)}
        related.append(("text/csv", stimuli.name, "other", f"Inputs of the experiment {of.name}"))
        related.append(("text/csv", results.name, "result", f"Exact outputs of the experiment {of.name}"))
        _add_experiment(experiments, interface, of, name)
    files[EXPERIMENTS] = _xml(experiments)
    related.append((EXPERIMENTS_TYPE, EXPERIMENTS, "experiment/validation", "The experiments that check host and FMU"))
    files["fmi-ls-manifest.xml"] = _manifest(files, related)
    return {f"{FOLDER}/{name}": content for name, content in files.items()}


def _add_experiment(experiments: etree._Element, interface: Interface, of: Definition, parameters: str) -> None:
    experiment = etree.SubElement(experiments, "Experiment", name=of.name, description=of.description)
    times = {"startTime": 0.0, "stopTime": of.stop, "stepSize": of.step}
    etree.SubElement(experiment, "TransientSimulation", {name: repr(value) for name, value in times.items()})
    etree.SubElement(experiment, "Parameters", source=parameters)
    etree.SubElement(experiment, "Stimuli", source=file_of(of, "in").name)
    results = etree.SubElement(experiment, "References", source=file_of(of, "ref").name)
    annotation = etree.SubElement(etree.SubElement(results, "Annotations"), "Annotation", type=TOLERANCES)
    for output in interface.of_kind("output"):
        etree.SubElement(annotation, "Tolerance", variable=output.name, absolute=repr(of.tolerance[output.unit.name]))


def parameter_set(interface: Interface, name: str, changed: dict[str, float]) -> bytes:
    """The geometry as SSV: the nominal set but for what is `changed`."""
    root = etree.Element(f"{{{SSV}}}ParameterSet", nsmap={"ssv": SSV, "ssc": SSC}, version="1.0", name=name)
    parameters = etree.SubElement(root, f"{{{SSV}}}Parameters")
    geometry = [interface[f"geometry.{symbol}"] for symbol in interface.geometry]
    for variable in geometry:
        element = etree.SubElement(parameters, f"{{{SSV}}}Parameter", name=variable.name)
        value = changed.get(variable.name, variable.start)
        etree.SubElement(element, f"{{{SSV}}}Real", value=repr(value), unit=variable.unit.name)
    units = etree.SubElement(root, f"{{{SSV}}}Units")
    for unit in {variable.unit.name: variable.unit for variable in geometry}.values():
        element = etree.SubElement(units, f"{{{SSC}}}Unit", name=unit.name)
        etree.SubElement(element, f"{{{SSC}}}BaseUnit", {base: str(power) for base, power in unit.exponents.items()})
    return _xml(root)


def _manifest(files: dict[str, bytes], related: list[tuple[str, str, str, str]]) -> bytes:
    ls = {"name": "org.fmi-standard.fmi-ls-ref", "version": VERSION, "description": DESCRIPTION}
    attributes = {f"{{{MANIFEST_NAMESPACE}}}fmi-ls-{name}": value for name, value in ls.items()}
    root = etree.Element("fmiReferences", attributes, nsmap={"fmi-ls": MANIFEST_NAMESPACE})
    for kind, source, role, description in related:
        checksum = hashlib.sha3_256(files[source]).hexdigest()
        etree.SubElement(root, "Related", type=kind, source=source, role=role, description=description,
                         checksum=checksum, checksumType="SHA3-256")  # fmt: skip
    return _xml(root)


def _xml(root: etree._Element) -> bytes:
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


# ---- what is read back ---------------------------------------------------------------------------


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

    Raises ValueError where `found` lacks one of the times (to 1e-9 s); a value that is no number is an infinite error.
    """
    times = experiment.results["time"]
    rows = np.argmin(np.abs(found["time"][None, :] - times[:, None]), axis=1)
    if (off := np.abs(found["time"][rows] - times)).max() > 1e-9:
        missing = times[int(np.argmax(off))]
        raise ValueError(f"{experiment.name}: no result at {missing:g} s; the exact ones are at {len(times)} times")
    errors = {}
    for name in experiment.results.dtype.names[1:]:
        if name in found.dtype.names:
            error = np.nan_to_num(np.abs(found[name][rows] - experiment.results[name]), nan=np.inf)
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
        tolerances={t.get("variable"): float(t.get("absolute")) for t in entry.iterfind(
            f"References/Annotations/Annotation[@type='{TOLERANCES}']/Tolerance")},
    )


def _read_parameters(root: etree._Element) -> dict[str, float | bool]:
    values: dict[str, float | bool] = {}
    for parameter in root.iter(f"{{{SSV}}}Parameter"):
        for value in parameter:
            if value.tag == f"{{{SSV}}}Boolean":
                values[parameter.get("name")] = value.get("value") in ("true", "1")
            elif value.tag == f"{{{SSV}}}Real":
                values[parameter.get("name")] = float(value.get("value"))
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
    algorithm = related.get("checksumType", "SHA3-256").lower().replace("sha3-", "sha3_").replace("sha-", "sha")
    wanted = related.get("checksum", "").lower()
    if wanted and hashlib.new(algorithm, _read(content, file)).hexdigest() != wanted:
        raise UnreadableReference(f"{file}: changed since the manifest was written: its {algorithm} is another")
