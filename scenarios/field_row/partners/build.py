"""Build the partners' FMUs by PythonFMU: python -m scenarios.field_row.partners.build"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import zipfile
from importlib import metadata
from pathlib import Path

SOURCES = Path(__file__).resolve().parent
OUTPUT = SOURCES.parents[2] / "build" / "partners"
SHARED = SOURCES / "planting_partner.py"
PARTNERS = {"Drivetrain": "drivetrain.py", "Conveyor": "conveyor.py", "Soil": "soil.py"}


class PartnerError(RuntimeError):
    """PythonFMU could not build a partner; the message is what Python said."""


def build(output: Path = OUTPUT) -> list[Path]:
    """Write the FMUs that are missing or older than their sources; returns the paths of all."""
    output.mkdir(parents=True, exist_ok=True)
    fmus = []
    for name, source in PARTNERS.items():
        fmu = output / f"{name}.fmu"
        sources = (SOURCES / source, SHARED, Path(__file__))
        if not fmu.exists() or any(file.stat().st_mtime >= fmu.stat().st_mtime for file in sources):
            _build(SOURCES / source, fmu)
        fmus.append(fmu)
    return fmus


def _build(source: Path, fmu: Path) -> None:
    """In a process of its own, which leaves no modules behind; the file appears whole or not at all."""
    with tempfile.TemporaryDirectory(dir=fmu.parent) as folder:
        made = Path(folder) / fmu.name
        command = [
            sys.executable,
            "-B",
            "-m",
            "pythonfmu",
            "build",
            "--file",
            str(source),
            "--dest",
            str(made),
            "--handle-state",
            str(SHARED),
        ]
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(SOURCES)})
        if done.returncode != 0:
            raise PartnerError(f"{source.name} does not load:\n{done.stderr.strip()}")
        _mend(made)
        _finish(made)
        made.replace(fmu)


def _mend(fmu: Path) -> None:
    """PythonFMU's library without what uses freed memory, after an exception and when a process ends."""
    command = [sys.executable, "-m", "transplanter_linkage", "mend", str(fmu)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise PartnerError(done.stderr.strip())


def _finish(fmu: Path) -> None:
    """Without the time of day, so that the same sources give the same bytes, and with PythonFMU's license: the FMU
    carries its modules and binaries.
    """
    with zipfile.ZipFile(fmu) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    license_file = next(file for file in metadata.files("pythonfmu") or [] if file.name == "LICENSE")
    content["documentation/licenses/PythonFMU.txt"] = license_file.read_binary()
    content["modelDescription.xml"] = re.sub(rb' generationDateAndTime="[^"]*"', b"", content["modelDescription.xml"])
    with zipfile.ZipFile(fmu, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(content):
            entry = zipfile.ZipInfo(name)  # of 1980, the earliest time that zip knows
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o100644 << 16
            archive.writestr(entry, content[name])


if __name__ == "__main__":
    for path in build():
        print(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)
