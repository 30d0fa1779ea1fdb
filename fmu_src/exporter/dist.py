"""`make dist`: what is handed on, in one folder: the wheel, the FMUs in it, and their checksums."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from .compiler import SOURCE_ROOT

CHECKSUMS = "SHA256SUMS"


def make_wheel(fmus: Path, output: Path, project: Path = SOURCE_ROOT.parent) -> Path:
    """Write the project's wheel, carrying the FMUs that lie in `fmus`, into `output`; returns its path.

    Raises RuntimeError with what hatchling said where it refuses. The same files give the same bytes.
    """
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(output.resolve())]
    environment = os.environ | {"LINKAGE_FMUS": str(fmus.resolve())}
    done = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"no wheel: {done.stderr.strip().rpartition(chr(10))[2]}")
    (wheel,) = output.glob("*.whl")
    return wheel


def write_checksums(folder: Path) -> Path:
    """Write `folder`/SHA256SUMS over all other files in it, as `sha256sum --check` and `shasum --check` read it."""
    files = sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and p.name != CHECKSUMS)
    lines = (f"{hashlib.sha256((folder / name).read_bytes()).hexdigest()}  {name}\n" for name in files)
    (folder / CHECKSUMS).write_text("".join(lines), encoding="utf-8", newline="\n")
    return folder / CHECKSUMS


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    print(make_wheel(folder, folder))
    print(write_checksums(folder))
