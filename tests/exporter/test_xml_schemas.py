"""Every XML in every archive that is built against the schema of its standard.

FMPy brings the schemas of FMI and SSP. Those of FMI-LS-REF and of the experiments are on no package index; what they
demand is stated here in this file's own words, on top of FMI's schemas for annotations and manifests, as FMPy has
them. (The fixed values of the manifest's name and description, which libxml2 does not look at where an attribute is
referred to, are checked in test_reference.py.) Sources: schema/fmi3LayeredStandardReferenceManifest.xsd of
github.com/modelica/fmi-ls-ref (1.0.0-beta.1) and schema/maHarmonizedSpecificationExperiments.xsd of
github.com/modelica/ma-hs-experiments (a draft).
"""

from __future__ import annotations

import posixpath
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import fmpy
import pytest
from lxml import etree

from fmu_src.formats.ls_ref import MANIFEST
from scenarios.field_row import ssp
from scenarios.field_row.partners.build import build as build_partners
from scenarios.field_row.run import row_of
from scenarios.field_row.system import ROW, load_system
from tests.conftest import PROJECT_ROOT

FMI, SSP = (Path(fmpy.__file__).parent / folder / "schema" for folder in ("", "ssp"))
OWN = ("fmi2", "fmi3", "twin")  # that carry reference results, terminals and icons
PARTNERS = ("Conveyor", "Drivetrain", "Soil")
ARCHIVES = (*OWN, *PARTNERS, "row")

SCHEMA = """<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" elementFormDefault="qualified">
  <xs:include schemaLocation="{annotation}"/>{head}</xs:schema>"""
MANIFEST_SCHEMA = """
  <xs:import namespace="http://fmi-standard.org/fmi-ls-manifest" schemaLocation="{manifest}"/>
  <xs:element name="fmiReferences"><xs:complexType>
    <xs:sequence>
      <xs:element name="Related" type="Related" minOccurs="0" maxOccurs="unbounded"/>
      <xs:element ref="Annotations" minOccurs="0"/>
    </xs:sequence>
    <xs:attribute ref="ls:fmi-ls-name" use="required" fixed="org.fmi-standard.fmi-ls-ref" xmlns:ls="{space}"/>
    <xs:attribute ref="ls:fmi-ls-version" use="required" xmlns:ls="{space}"/>
    <xs:attribute ref="ls:fmi-ls-description" use="required" xmlns:ls="{space}"
      fixed="Layered Standard providing information on related files included in an FMU."/>
  </xs:complexType></xs:element>
  <xs:complexType name="Related">
    <xs:sequence><xs:element ref="Annotations" minOccurs="0"/></xs:sequence>
    <xs:attribute name="type" type="xs:string"/>
    <xs:attribute name="source" type="xs:anyURI" use="required"/>
    <xs:attribute name="role" use="required"><xs:simpleType><xs:restriction base="xs:string">
      <xs:pattern value="document|requirement|specification|model|parameter|system|testcase|experiment
        |experiment/(smoke-test|validation|uncertainty-analysis)|result|method|rationale|report|request|delivery
        |configuration|signature|serialized-state(/.*)?|other"/>
    </xs:restriction></xs:simpleType></xs:attribute>
    <xs:attribute name="description" type="xs:string"/>
  </xs:complexType>"""
EXPERIMENTS_SCHEMA = """
  <xs:element name="Experiments"><xs:complexType>
    <xs:sequence>
      <xs:element name="Experiment" type="Experiment" maxOccurs="unbounded"/>
      <xs:element ref="Annotations" minOccurs="0"/>
    </xs:sequence>
    <xs:attribute name="name" type="xs:string" use="required"/><xs:attribute name="description" type="xs:string"/>
  </xs:complexType></xs:element>
  <xs:complexType name="Experiment">
    <xs:sequence>
      <xs:element name="TransientSimulation"><xs:complexType>
        <xs:attribute name="startTime" type="xs:double"/><xs:attribute name="stopTime" type="xs:double"/>
        <xs:attribute name="stepSize" type="xs:double"/>
      </xs:complexType></xs:element>
      <xs:element name="Parameters" type="Source" minOccurs="0"/>
      <xs:element name="Stimuli" type="Source" minOccurs="0"/>
      <xs:element name="References" type="Source" minOccurs="0"/>
      <xs:element ref="Annotations" minOccurs="0"/>
    </xs:sequence>
    <xs:attribute name="name" type="xs:string" use="required"/><xs:attribute name="description" type="xs:string"/>
    <xs:attribute name="tolerance" type="xs:double"/>
  </xs:complexType>
  <xs:complexType name="Source">
    <xs:sequence><xs:element ref="Annotations" minOccurs="0"/></xs:sequence>
    <xs:attribute name="type" type="xs:string"/><xs:attribute name="source" type="xs:anyURI" use="required"/>
  </xs:complexType>"""


def stated(text: str) -> etree.XMLSchema:
    """A schema of this file."""
    fmi3 = FMI / "fmi3"
    head = (
        " ".join(text.split())
        .replace(" |", "|")
        .format(
            manifest=(fmi3 / "fmi3LayeredStandardManifest.xsd").as_uri(),
            space="http://fmi-standard.org/fmi-ls-manifest",
        )
    )
    whole = SCHEMA.format(annotation=(fmi3 / "fmi3Annotation.xsd").as_uri(), head=head)
    return etree.XMLSchema(etree.fromstring(whole))


@cache
def schema_of(file: str, edition: str) -> etree.XMLSchema:
    """Of a file by its place in an archive; `edition` is the FMI version of the FMU that it lies in."""
    name = posixpath.basename(file)
    if file == "modelDescription.xml":
        return etree.XMLSchema(file=str(FMI / f"fmi{edition}" / f"fmi{edition}ModelDescription.xsd"))
    if file == MANIFEST:
        return stated(MANIFEST_SCHEMA)
    if name.endswith(".exp"):
        return stated(EXPERIMENTS_SCHEMA)
    known = {
        "sources/buildDescription.xml": FMI / "fmi3" / "fmi3BuildDescription.xsd",
        "terminalsAndIcons/terminalsAndIcons.xml": FMI / "fmi3" / "fmi3TerminalsAndIcons.xsd",
        "SystemStructure.ssd": SSP / "SystemStructureDescription.xsd",
    }
    if name.endswith(".ssv"):
        return etree.XMLSchema(file=str(SSP / "SystemStructureParameterValues.xsd"))
    if name.endswith(".ssm"):
        return etree.XMLSchema(file=str(SSP / "SystemStructureParameterMapping.xsd"))
    assert file in known, f"{file}: an XML of which no schema is known"
    return etree.XMLSchema(file=str(known[file]))


def documents(archive: Path) -> Iterator[tuple[str, bytes]]:
    """All that is XML in an archive, whatever its name; pictures and pages have no schema of these standards."""
    with zipfile.ZipFile(archive) as opened:
        for name in opened.namelist():
            content = opened.read(name)
            if content.lstrip().startswith(b"<") and not name.endswith((".svg", ".html")):
                yield name, content


@pytest.fixture(scope="module")
def archives(fmu_files, tmp_path_factory) -> dict[str, Path]:
    row = row_of(load_system(ROW), 2)
    return {
        "fmi2": fmu_files[2],
        "fmi3": fmu_files[3],
        "twin": PROJECT_ROOT / "build" / "twin" / "TransplanterLinkageTwin.fmu",
        "row": ssp.write(row.system, row.stop, tmp_path_factory.mktemp("row") / "row.ssp"),
    } | {path.stem: path for path in build_partners()}


@pytest.mark.parametrize("name", ARCHIVES)
def test_every_document_is_valid(archives, name):
    found = dict(documents(archives[name]))
    for file, content in found.items():
        schema = schema_of(file, "3" if name == "fmi3" else "2")
        assert schema.validate(etree.fromstring(content)), f"{file}: {schema.error_log.last_error}"
    own = {MANIFEST, "terminalsAndIcons/terminalsAndIcons.xml", f"{posixpath.dirname(MANIFEST)}/reference.exp"}
    expected = {"SystemStructure.ssd", "resources/drivetrain.ssv"} if name == "row" else {"modelDescription.xml"}
    expected |= own if name in OWN else set()
    expected |= {"sources/buildDescription.xml"} if name == "fmi3" else set()
    assert set(found) >= expected


def test_pictures_and_pages_are_well_formed(archives):
    for name in OWN:
        with zipfile.ZipFile(archives[name]) as opened:
            for file in opened.namelist():
                if file.endswith(".svg"):
                    assert etree.fromstring(opened.read(file)).tag == "{http://www.w3.org/2000/svg}svg"


def manifest(archives) -> etree._Element:
    return etree.fromstring(dict(documents(archives["fmi2"]))[MANIFEST])


@pytest.mark.parametrize(
    "change",
    [
        lambda root: root[0].set("checksum", "00"),  # as this project's manifests had it
        lambda root: root[0].set("role", "parameters"),
        lambda root: root[0].attrib.pop("source"),
        lambda root: root.append(etree.Element("Experiment")),
        lambda root: root.attrib.pop("{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-version"),
        lambda root: root[0].find("Annotations")[0].attrib.pop("type"),
    ],
)
def test_the_stated_schema_refuses(archives, change):
    root = manifest(archives)
    assert stated(MANIFEST_SCHEMA).validate(root)
    change(root)
    assert not stated(MANIFEST_SCHEMA).validate(root)


def test_the_stated_schema_of_experiments_refuses(archives):
    (content,) = (data for name, data in documents(archives["fmi2"]) if name.endswith(".exp"))
    schema, root = stated(EXPERIMENTS_SCHEMA), etree.fromstring(content)
    assert schema.validate(root)
    root[0].set("startTime", "0.0")  # an older draft had it there
    assert not schema.validate(root)
