"""The field row as an SSP archive, for engines that are not ours (System Structure and Parameterization 1.0).

    python -m scenarios.field_row.ssp

writes build/TransplanterRow.ssp: SystemStructure.ssd with the components and connections of
scenarios/field_row/row.toml, a parameter set (.ssv) for each component that is given values, and the FMUs.
What is written is checked against the schemas of the standard, which fmpy brings.

All parameter sets have the name PARAMETER_SET: some engines apply a set by its name, some all there are.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

import fmpy
from lxml import etree
from lxml.etree import SubElement

from scenarios.common import command, reports
from scenarios.common.command import ROOT
from scenarios.field_row import run as row_run
from scenarios.field_row.masters import CoSimulation
from scenarios.field_row.partners.build import PartnerError
from scenarios.field_row.partners.build import build as build_partners
from scenarios.field_row.system import ROW, System, SystemFault, load_system

OUTPUT = ROOT / "build" / "TransplanterRow.ssp"
NAME = "TransplanterRow"
PARAMETER_SET = "row"
PLANTS = 10
SCHEMAS = Path(fmpy.__file__).parent / "ssp" / "schema"
SPACES = {
    short: f"http://ssp-standard.org/SSP1/SystemStructure{name}"
    for short, name in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"))
}
TIMES = (1980, 1, 1, 0, 0, 0)  # of the files in the archive: the same content makes the same archive


def _tag(name: str) -> str:
    space, _, local = name.partition(":")
    return f"{{{SPACES[space]}}}{local}"


def _element(parent: etree._Element, tag: str, /, **attributes: str) -> etree._Element:
    return SubElement(parent, _tag(tag), attributes)


def _text(value: float | int | bool) -> str:
    """A value with all its digits, as XML Schema writes it."""
    return str(value).lower() if isinstance(value, bool) else repr(value)


def _document(root: etree._Element, schema: str) -> bytes:
    """The XML, checked against a schema of the standard; raises SystemFault with the first fault."""
    valid = etree.XMLSchema(file=str(SCHEMAS / schema))
    if not valid.validate(root):
        raise SystemFault(f"{root.get('name')}: {valid.error_log[0].message}")
    return etree.tostring(root, encoding="UTF-8", xml_declaration=True, pretty_print=True)


def structure(system: System, stop: float) -> tuple[bytes, dict[str, bytes]]:
    """SystemStructure.ssd, and the parameter sets by their names in the archive; ``stop`` is in s."""
    ports = dict.fromkeys(system.connections, "input") | dict.fromkeys(system.connections.values(), "output")
    with CoSimulation(system) as connected:  # finds what is wrong, and what units make of the connections
        slaves, conversions = {slave.name: slave for slave in connected.slaves}, connected.conversions
        variables = {p: slaves[p.component].component.variable(p.variable) for p in (*ports, *system.parameters)}
    root = etree.Element(
        _tag("ssd:SystemStructureDescription"),
        {"version": "1.0", "name": NAME},
        nsmap={short: SPACES[short] for short in ("ssd", "ssc")},
    )
    top = _element(root, "ssd:System", name=NAME)
    elements, sets = _element(top, "ssd:Elements"), {}
    for component in system.components:
        element = _element(
            elements,
            "ssd:Component",
            name=component.name,
            source=f"resources/{component.fmu.name}",
            type="application/x-fmu-sharedlibrary",
        )
        connectors = _element(element, "ssd:Connectors")
        for port, causality in ports.items():
            if port.component == component.name:
                connector = _element(connectors, "ssd:Connector", name=variables[port].name, kind=causality)
                _element(connector, f"ssc:{variables[port].type}")
        given = {port: value for port, value in system.parameters.items() if port.component == component.name}
        if given:
            source = f"resources/{component.name}.ssv"
            _element(_element(element, "ssd:ParameterBindings"), "ssd:ParameterBinding", source=source)
            values = etree.Element(
                _tag("ssv:ParameterSet"), {"version": "1.0", "name": PARAMETER_SET}, nsmap={"ssv": SPACES["ssv"]}
            )
            parameters = _element(values, "ssv:Parameters")
            for port, value in given.items():
                parameter = _element(parameters, "ssv:Parameter", name=variables[port].name)
                own = component.settable(port.variable, value)  # in the FMU's own unit
                _element(parameter, f"ssv:{variables[port].type}", value=_text(own))
            sets[source] = _document(values, "SystemStructureParameterValues.xsd")
    connections = _element(top, "ssd:Connections")
    for target, source in system.connections.items():
        connection = _element(
            connections,
            "ssd:Connection",
            startElement=source.component,
            startConnector=variables[source].name,
            endElement=target.component,
            endConnector=variables[target].name,
        )
        factor, offset = conversions[target]
        if (factor, offset) != (1.0, 0.0):
            _element(connection, "ssc:LinearTransformation", factor=_text(factor), offset=_text(offset))
    _element(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=_text(float(stop)))
    return _document(root, "SystemStructureDescription.xsd"), sets


def write(system: System, stop: float, path: Path) -> Path:
    """Write the archive; the same system makes the same file. Raises SystemFault for a system that cannot be."""
    sources = {f"resources/{component.fmu.name}": component.fmu for component in system.components}
    if len(sources) < len({component.fmu for component in system.components}):
        raise SystemFault("Two different FMUs of this system have the same file name: rename one.")
    description, sets = structure(system, stop)
    files = {"SystemStructure.ssd": description, **sets, **{name: fmu.read_bytes() for name, fmu in sources.items()}}
    path.parent.mkdir(parents=True, exist_ok=True)
    # whole or not at all, and beside others who write the same
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}-") as folder:
        writing = Path(folder) / path.name
        with zipfile.ZipFile(writing, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                archive.writestr(zipfile.ZipInfo(name, TIMES), content, zipfile.ZIP_DEFLATED)
        return writing.replace(path)


def main(arguments: Sequence[str] | None = None) -> int:
    """Command line; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m scenarios.field_row.ssp", description=__doc__.splitlines()[0], formatter_class=command.Help
    )
    parser.add_argument(
        "--system",
        type=Path,
        default=ROW,
        metavar="FILE",
        help="FMUs, connections and parameters (default: %(default)s)",
    )
    parser.add_argument(
        "--plants",
        type=command.plants(10_000),
        default=PLANTS,
        metavar="N",
        help="plants in the row (default: %(default)s)",
    )
    parser.add_argument("--output", type=Path, default=OUTPUT, help="the archive (default: %(default)s)")
    options = parser.parse_args(arguments)
    try:
        build_partners()
        row = row_run.row_of(load_system(options.system), options.plants)
        path = write(row.system, row.stop, options.output.resolve())
        print(reports.shown(path))
    except (SystemFault, PartnerError) as error:
        print(error, file=sys.stderr)
    except OSError as error:
        print(f"{options.output} cannot be written: {error}", file=sys.stderr)
    else:
        return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
