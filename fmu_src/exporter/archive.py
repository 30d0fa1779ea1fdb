"""A reproducible .fmu: the same content gives the same bytes, whenever and wherever written."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# The earliest time that zip knows: no file of an FMU is about when it was packed.
FIXED_TIME = (1980, 1, 1, 0, 0, 0)
READABLE_FILE, EXECUTABLE_FILE = 0o100644, 0o100755
UNIX = 3


@contextmanager
def put_in_place(path: Path) -> Iterator[Path]:
    """A place to write a file at, from which it goes to `path` when it is whole.

    Any number of writers may be at work on one path: the last one's file stays. Where one fails, `path` is as it was,
    and nothing is left over; an OSError that names no file, as on a full disk, names `path`.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}-") as folder:
            unfinished = Path(folder) / path.name
            yield unfinished
            unfinished.replace(path)
    except OSError as problem:
        if problem.filename is None and problem.errno is not None:
            raise OSError(problem.errno, problem.strerror, str(path)) from problem
        raise


def write_archive(path: Path, content: dict[str, bytes]) -> None:
    """Write `content` (file name in the archive to bytes), modelDescription.xml first, then sorted."""
    with (
        put_in_place(path) as unfinished,
        zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive,
    ):
        for name in sorted(content, key=lambda name: (name != "modelDescription.xml", name)):
            entry = zipfile.ZipInfo(name, FIXED_TIME)
            entry.create_system = UNIX
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (EXECUTABLE_FILE if name.startswith("binaries/") else READABLE_FILE) << 16
            archive.writestr(entry, content[name])
