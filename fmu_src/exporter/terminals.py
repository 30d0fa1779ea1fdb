"""terminalsAndIcons/: which variables belong together in a connection, and how the FMU is drawn.

FMI 3.0, section 2.4.9; FMI 2.0.4, section 2.3 takes the folder over as it is, so the file names version 3.0 in both.

A terminal is the first part of the variables' names, its members are what follows: the drive of a host with
outputs phi, w, a and an input tau connects to `crank` as a whole. The rule is "bus": a host connects those members
that the other side has, for w, a and the forces are optional.
"""

from __future__ import annotations

from pathlib import Path

import fmpy
from lxml import etree

from ..interface import Interface
from .icons import FOLDER

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"
# The signs are Modelica's: tau is positive where it acts on the component, so that tau w flows into it.
ROTATIONAL_FLANGE = "Modelica.Mechanics.Rotational.Interfaces.Flange_a"
FLOWS = {"crank.tau": "inflow"}  # that add up to zero where terminals meet; components of plane forces do not
TERMINALS = {  # name: (kind, icon, place of its middle in the icon's coordinates, description)
    "crank": (
        ROTATIONAL_FLANGE,
        "flange",
        (-100, 60),
        "Drive: angle, velocity and acceleration in; torque, inertia and bias out",
    ),
    "machine": (None, "point", (-100, -60), "Travel: forward speed in; distance, and force of the linkage out"),
    "tip": (None, "point", (100, 60), "Tip relative to the machine, and the force of the soil on it"),
    "ground": (None, "point", (100, -60), "Tip relative to the ground, for soil models"),
}
HALF = 10  # of a terminal's icon, in the same coordinates


def terminal_content(interface: Interface, version: int) -> dict[str, bytes]:
    """The files in the archive, by name, with the icon where each version of FMI has it."""
    content = {"terminalsAndIcons.xml": terminals_xml(interface)}
    names = ["icon", *dict.fromkeys(icon for _, icon, _, _ in TERMINALS.values())]
    content |= {file: (FOLDER / file).read_bytes() for name in names for file in (f"{name}.png", f"{name}.svg")}
    content = {f"terminalsAndIcons/{name}": data for name, data in content.items()}
    if version == 2:
        content["model.png"] = (FOLDER / "icon.png").read_bytes()
    return content


def members(interface: Interface, terminal: str) -> dict[str, str]:
    """{member: variable} of a terminal: inputs and outputs."""
    names = [variable.name for variable in interface.variables if variable.kind in ("input", "output")]
    return {name.partition(".")[2]: name for name in names if name.startswith(f"{terminal}.")}


def terminals_xml(interface: Interface) -> bytes:
    root = etree.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = etree.SubElement(root, "GraphicalRepresentation")
    box = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    etree.SubElement(graphics, "CoordinateSystem", box, suggestedScalingFactorTo_mm="0.1")
    etree.SubElement(graphics, "Icon", box)
    terminals = etree.SubElement(root, "Terminals")
    for name, (kind, icon, (x, y), text) in TERMINALS.items():
        terminal = etree.SubElement(terminals, "Terminal", name=name, matchingRule="bus", description=text)
        if kind is not None:
            terminal.set("terminalKind", kind)
        for member, variable in members(interface, name).items():
            etree.SubElement(terminal, "TerminalMemberVariable", variableName=variable, memberName=member,
                             variableKind=FLOWS.get(variable, "signal"))  # fmt: skip
        corners = {"x1": x - HALF, "y1": y - HALF, "x2": x + HALF, "y2": y + HALF}
        etree.SubElement(terminal, "TerminalGraphicalRepresentation",
                         {"iconBaseName": icon, "defaultConnectionColor": "11 83 148"}
                         | {name: str(value) for name, value in corners.items()})  # fmt: skip
    etree.XMLSchema(etree.parse(str(SCHEMA))).assertValid(root)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
