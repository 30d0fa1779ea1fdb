"""What `linkage-fmu build` produces: the FMU, its example input, the twin."""

from __future__ import annotations

import csv
import io
import math
import tempfile
from collections.abc import Iterable
from pathlib import Path

from ..interface import Interface, load_interface
from . import compiler
from .archive import write_archive
from .model_description import fmi2_xml

PROJECT_ROOT = compiler.SOURCE_ROOT.parent


def build_fmi2(output: Path, platforms: Iterable[compiler.Platform]) -> Path:
    """Write `output`/fmi2/TransplanterLinkage.fmu with binaries for `platforms`; returns its path."""
    interface = load_interface()
    content = {"modelDescription.xml": fmi2_xml(interface)}
    content["documentation/licenses/LICENSE.txt"] = (PROJECT_ROOT / "LICENSE").read_bytes()
    sources = compiler.LINKAGE_SOURCES + compiler.COMPONENT_SOURCES + compiler.FMI2_SOURCES
    with tempfile.TemporaryDirectory() as folder:
        for target in platforms:
            name = f"binaries/{target.folder}/{interface.model.name}{target.suffix}"
            library = Path(folder) / name
            compiler.compile_library(sources, library, target)
            content[name] = library.read_bytes()
    fmu = output / "fmi2" / f"{interface.model.name}.fmu"
    write_archive(fmu, content)
    return fmu


def write_example_input(output: Path) -> Path:
    """Write `output`/fmi2/one_turn.csv: an input table of one crank turn for fmpy's command line."""
    interface = load_interface()
    path = output / "fmi2" / "one_turn.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(example_input(interface), encoding="utf-8")
    return path


def example_input(interface: Interface) -> str:
    """One turn at the published frequency and spacing; two rows suffice, hosts interpolate."""
    turn = interface.model.turn_time
    constant = {"crank.w": 2 * math.pi / turn, "machine.v": interface.model.machine_speed}
    inputs = [variable.name for variable in interface.of_kind("input")]
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(["time", *inputs])
    for time, angle in ((0.0, 0.0), (turn, 2 * math.pi)):
        values = constant | {"crank.phi": angle}
        writer.writerow([time, *(values.get(name, 0.0) for name in inputs)])
    return table.getvalue()
