"""A reproducible .fmu: the same content gives the same bytes, whenever and wherever written."""

from __future__ import annotations

import zipfile
from pathlib import Path

# The earliest time that zip knows: no file of an FMU is about when it was packed.
FIXED_TIME = (1980, 1, 1, 0, 0, 0)
READABLE_FILE, EXECUTABLE_FILE = 0o100644, 0o100755
UNIX = 3


def write_archive(path: Path, content: dict[str, bytes]) -> None:
    """Write `content` (file name in the archive to bytes), modelDescription.xml first, then sorted."""
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".part")
    with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(content, key=lambda name: (name != "modelDescription.xml", name)):
            entry = zipfile.ZipInfo(name, FIXED_TIME)
            entry.create_system = UNIX
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (EXECUTABLE_FILE if name.startswith("binaries/") else READABLE_FILE) << 16
            archive.writestr(entry, content[name])
    unfinished.replace(path)
