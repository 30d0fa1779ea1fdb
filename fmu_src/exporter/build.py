"""What `linkage-fmu build` produces: the FMUs, their example input, and the twin's FMU."""

from __future__ import annotations

import csv
import io
import math
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

from ..interface import INTERFACE_FILE, Interface, load_interface
from . import compiler
from .archive import put_in_place, write_archive
from .documentation import documentation_content
from .fmi_ls_wasm import web_assembly_content
from .mach_o import universal
from .model_description import FMI3, NATIVE, TWIN, Edition, model_description_xml
from .page import PAGE, page
from .python_fmu import mended
from .reference import reference_content
from .sources import source_content
from .terminals import terminal_content
from .version import DISTRIBUTION

PARTS = "transplanter_linkage_parts"  # the twin's modules in its FMU, under a name that nothing else has


class TwinError(RuntimeError):
    """PythonFMU could not load the twin's slave; the message is what Python said."""


def build_fmu(version: int, output: Path, platforms: Iterable[compiler.Platform]) -> Path:
    """Write `output`/fmi<version>/TransplanterLinkage.fmu with binaries for `platforms`; returns its path.

    version: 2 or 3, FMI 2.0 or 3.0; the former has no WebAssembly.
    """
    interface, edition, platforms = load_interface(), FMI3 if version == 3 else NATIVE, list(platforms)
    content = carried(interface, edition) | source_content(interface, version)
    content |= binaries(interface, version, [target for target in platforms if target != compiler.WEB_ASSEMBLY])
    if version == 3 and compiler.WEB_ASSEMBLY in platforms:
        content |= web_assembly_content(interface)
    if any(target.suffix == ".dll" for target in platforms):
        content["documentation/licenses/mingw-w64.txt"] = compiler.mingw_license()
    fmu = output / f"fmi{version}" / f"{interface.model.name}.fmu"
    write_archive(fmu, content)
    return fmu


def carried(interface: Interface, edition: Edition) -> dict[str, bytes]:
    """What every FMU has but what it runs on and its sources, by name in the archive."""
    content = {"modelDescription.xml": model_description_xml(interface, edition)}
    content |= documentation_content(interface, edition) | terminal_content(interface, edition.fmi)
    content |= reference_content(interface)
    content[f"documentation/{PAGE}"] = page(interface)
    content["documentation/licenses/license.txt"] = license_text(DISTRIBUTION)
    return content


def binaries(interface: Interface, version: int, platforms: Iterable[compiler.Platform]) -> dict[str, bytes]:
    """The libraries for `platforms` in the archive, by name. version: 2 or 3, FMI 2.0 or 3.0.

    FMI 3.0 has a folder for each system and processor. FMI 2.0 has one a system: macOS for both processors is one
    file in it; where Linux's is taken, another processor's binary goes where FMI 3.0 has it.
    """
    content: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as folder:
        for target in platforms:
            file = f"{interface.model.name}{target.suffix}"
            library = Path(folder) / target.name / file
            compiler.compile_library((compiler.FMU_SOURCE[version],), library, target)
            name = f"binaries/{target.folder}/{file}"
            if version == 2 and target.suffix == ".dylib" and name in content:
                content[name] = universal([content[name], library.read_bytes()])
            elif version == 3 or name in content:
                content[f"binaries/{target.other_folder}/{file}"] = library.read_bytes()
            else:
                content[name] = library.read_bytes()
    return content


def build_twin(output: Path) -> Path:
    """Write `output`/twin/TransplanterLinkageTwin.fmu by PythonFMU; returns its path.

    PythonFMU's own description knows no units and no dependencies, and its archive the time of
    day: both are replaced. Its library is mended. Raises TwinError, PythonFmuError.
    """
    interface = load_interface()
    twin = compiler.SOURCE_ROOT / "twin"
    slave = twin / "transplanter_linkage_twin.py"
    parts = [twin / name for name in ("__init__.py", "dynamics.py", "linkage.py", "motion.py")]
    parts += [INTERFACE_FILE.with_suffix(".py"), INTERFACE_FILE]
    with tempfile.TemporaryDirectory() as folder:
        # in a process of its own, with the files as they will lie in the FMU
        laid_out = Path(folder) / "resources"
        (laid_out / PARTS).mkdir(parents=True)
        (laid_out / slave.name).write_bytes(slave.read_bytes())
        for file in parts:
            (laid_out / PARTS / file.name).write_bytes(file.read_bytes())
        raw = Path(folder) / "raw.fmu"
        command = [sys.executable, "-B", "-m", "pythonfmu", "build", "-f", slave.name, "-d", str(raw), PARTS]
        done = subprocess.run(command, cwd=laid_out, capture_output=True, text=True)
        if done.returncode != 0:
            raise TwinError(f"the twin does not load:\n{done.stderr.strip()}")
        with zipfile.ZipFile(raw) as archive:
            content = {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}
    content |= carried(interface, TWIN) | mended(content)
    # the archive carries PythonFMU's binaries and modules
    content["documentation/licenses/PythonFMU.txt"] = license_text("pythonfmu")
    fmu = output / "twin" / f"{interface.model.name}{TWIN.suffix}.fmu"
    write_archive(fmu, content)
    return fmu


def license_text(distribution: str) -> bytes:
    """The license file that an installed distribution brings along."""
    return next(file for file in metadata.files(distribution) or [] if file.name == "LICENSE").read_binary()


def write_page(output: Path) -> Path:
    """Write `output`/explorer.html, the page that is in each FMU; returns its path."""
    path = output / PAGE
    with put_in_place(path) as unfinished:
        unfinished.write_bytes(page(load_interface()))
    return path


def write_example_input(output: Path) -> Path:
    """Write `output`/fmi2/one_turn.csv: an input table of one crank turn for fmpy's command line."""
    interface = load_interface()
    path = output / "fmi2" / "one_turn.csv"
    with put_in_place(path) as unfinished:
        unfinished.write_text(example_input(interface), encoding="utf-8")
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
