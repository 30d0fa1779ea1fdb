"""What the tests of the exporter share."""

from __future__ import annotations

import os
import shutil
import struct
import zipfile
from pathlib import Path

import pytest

from fmu_src.exporter.build import build_fmu
from fmu_src.exporter.compiler import PLATFORMS
from tests.conftest import PROJECT_ROOT


@pytest.fixture(scope="session", params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request) -> int:
    """The FMI version of what follows."""
    return request.param


@pytest.fixture(scope="session")
def all_platforms_fmu(fmi, tmp_path_factory) -> Path:
    """The FMU for every platform, cross-compiled once; the compiler keeps what it has done for the next time."""
    return build_fmu(fmi, tmp_path_factory.mktemp("all platforms"), PLATFORMS.values())


@pytest.fixture(scope="session")
def all_platforms(fmi, all_platforms_fmu, tmp_path_factory) -> dict[str, Path]:
    """The binaries in it by the platform's name."""
    folder = tmp_path_factory.mktemp("binaries")
    with zipfile.ZipFile(all_platforms_fmu) as archive:
        archive.extractall(folder)
    files = {}
    for name, platform in PLATFORMS.items():
        place = platform.other_folder if fmi == 3 or name == "aarch64-linux" else platform.folder
        files[name] = folder / "binaries" / place / f"TransplanterLinkage{platform.suffix}"
    if fmi == 2:  # macOS for both processors is one file
        fat = files["x86_64-macos"].read_bytes()
        for number, name in enumerate(("x86_64-macos", "aarch64-macos")):
            offset, size = struct.unpack_from(">II", fat, 8 + 20 * number + 8)
            files[name] = folder / f"{name}.dylib"
            files[name].write_bytes(fat[offset : offset + size])
    return files


@pytest.fixture
def project_copy(tmp_path) -> Path:
    """The sources in another folder, with other file times, to build from and to change."""
    copy = tmp_path / "else where"
    skipped = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PROJECT_ROOT / "fmu_src", copy / "fmu_src", ignore=skipped, copy_function=shutil.copyfile)
    for name in ("LICENSE", "README.md"):
        shutil.copyfile(PROJECT_ROOT / name, copy / name)
    for path in copy.rglob("*"):
        os.utime(path, (1e9, 1e9))
    return copy
