"""The crank drive as an FMU beside the linkage, for hosts that take inputs from other FMUs alone."""

from __future__ import annotations

import tempfile
from pathlib import Path

from lxml import etree

from fmu_src.exporter.archive import write_archive
from fmu_src.exporter.compiler import compile_library, host_platform
from tests.hosts.drives import INPUTS, PULSE, SPEED, TRAVEL, Drive

MODEL = "CrankDrive"


def build_partner(drive: Drive, fmu: Path) -> Path:
    """Writes the FMU whose outputs, named as the linkage's inputs, are drive.inputs; returns its path."""
    target = host_platform()
    numbers = {"SPEED": SPEED, "SHARE": drive.share, "PULSE": PULSE, "TRAVEL": TRAVEL}
    defined = [f"-D{name}={value!r}" for name, value in numbers.items()]
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / f"{MODEL}{target.suffix}"
        compile_library((Path(__file__).with_name("partner.c"),), library, target, *defined)
        content = {f"binaries/{target.folder}/{library.name}": library.read_bytes()}
    content["modelDescription.xml"] = description()
    write_archive(fmu, content)
    return fmu


def description() -> bytes:
    root = etree.Element("fmiModelDescription", fmiVersion="2.0", modelName=MODEL, guid=MODEL)
    etree.SubElement(root, "CoSimulation", modelIdentifier=MODEL, canHandleVariableCommunicationStepSize="true")
    variables = etree.SubElement(root, "ModelVariables")
    outputs, unknowns = (etree.Element(name) for name in ("Outputs", "InitialUnknowns"))
    for reference, name in enumerate(INPUTS, 1):
        variable = etree.SubElement(
            variables, "ScalarVariable", name=name, valueReference=str(reference),
            causality="output", variability="continuous", initial="calculated",
        )  # fmt: skip
        etree.SubElement(variable, "Real")
        for parent in (outputs, unknowns):
            etree.SubElement(parent, "Unknown", index=str(reference), dependencies="")
    structure = etree.SubElement(root, "ModelStructure")
    structure.extend((outputs, unknowns))
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
