"""Reference results and parameter sets in the FMU, in the place and form that others know.

The FMI layered standard FMI-LS-REF (modelica/fmi-ls-ref, 1.0.0-beta.1) says where: a manifest in
extra/org.fmi-standard.fmi-ls-ref names each file with its role. Parameter sets are SSV (SSP 1.0). The
experiments are in the Modelica Association's experiments format (modelica/ma-hs-experiments, a draft), each
with parameters, inputs ("stimuli") and exact results ("references") as CSV, and with absolute tolerances in an
annotation of the results: the format has none.

What is packed is declared in fmu_src/reference/experiments.toml and computed there by the oracle of the tests,
in 50-digit arithmetic: building an FMU copies it. formats/ls_ref.py reads it back, from any FMU that has such.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

from lxml import etree

from ..formats.ls_ref import CHECKSUM, EXPERIMENTS_TYPE, FOLDER, SSC, SSV, TOLERANCES
from ..interface import Interface, Unit, read_toml
from .compiler import SOURCE_ROOT

SOURCE = SOURCE_ROOT / "reference"
VERSION = "1.0.0-beta.1"  # of FMI-LS-REF
DESCRIPTION = "Layered Standard providing information on related files included in an FMU."  # fixed by its schema
MANIFEST_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
EXPERIMENTS = "reference.exp"
NOMINAL = "nominal.ssv"
SSV_TYPE = "application/x-ssp-parameter-set"


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
    table = read_toml(SOURCE / "experiments.toml")
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
    """The geometry as SSV, the nominal set but for what is `changed`, and the masses that are."""
    root = etree.Element(f"{{{SSV}}}ParameterSet", nsmap={"ssv": SSV, "ssc": SSC}, version="1.0", name=name)
    parameters = etree.SubElement(root, f"{{{SSV}}}Parameters")
    geometry = [v for v in interface.of_kind("parameter") if v.name.startswith("geometry.") or v.name in changed]
    used: dict[str, Unit] = {}
    for variable in geometry:
        if variable.unit is None:
            raise ValueError(f"{variable.name}: a parameter of the geometry has a unit")
        used[variable.unit.name] = variable.unit
        element = etree.SubElement(parameters, f"{{{SSV}}}Parameter", name=variable.name)
        value = changed.get(variable.name, variable.start)
        etree.SubElement(element, f"{{{SSV}}}Real", value=repr(value), unit=variable.unit.name)
    units = etree.SubElement(root, f"{{{SSV}}}Units")
    for unit in used.values():
        element = etree.SubElement(units, f"{{{SSC}}}Unit", name=unit.name)
        etree.SubElement(element, f"{{{SSC}}}BaseUnit", {base: str(power) for base, power in unit.exponents.items()})
    return _xml(root)


def _manifest(files: dict[str, bytes], related: list[tuple[str, str, str, str]]) -> bytes:
    ls = {"name": "org.fmi-standard.fmi-ls-ref", "version": VERSION, "description": DESCRIPTION}
    attributes = {f"{{{MANIFEST_NAMESPACE}}}fmi-ls-{name}": value for name, value in ls.items()}
    root = etree.Element("fmiReferences", attributes, nsmap={"fmi-ls": MANIFEST_NAMESPACE})
    for kind, source, role, description in related:
        entry = etree.SubElement(root, "Related", type=kind, source=source, role=role, description=description)
        # 1.0.0-beta.1 has no attribute for it; its successor's, checksum and checksumType, have these names and values
        annotation = etree.SubElement(etree.SubElement(entry, "Annotations"), "Annotation", type=CHECKSUM)
        digest = hashlib.sha3_256(files[source]).hexdigest()
        etree.SubElement(annotation, "Checksum", checksum=digest, checksumType="SHA3-256")
    return _xml(root)


def _xml(root: etree._Element) -> bytes:
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
