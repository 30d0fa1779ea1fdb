"""Fixtures that every room of the tests may use."""

from __future__ import annotations

import os
import re
import shutil
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import pytest
from filelock import FileLock

from fmu_src.exporter.build import build_fmu
from fmu_src.exporter.compiler import PLATFORMS, WEB_ASSEMBLY, compile_library, compile_program, host_platform
from fmu_src.interface import Interface, load_interface
from tests.harness.host import DISCARD, ERROR, OK, WARNING, Fmu, Instance
from tests.harness.host3 import Fmu3

PROJECT_ROOT = Path(__file__).resolve().parent.parent
FMU_FILES = {version: PROJECT_ROOT / "build" / f"fmi{version}" / "TransplanterLinkage.fmu" for version in (2, 3)}
BOTH_VERSIONS = pytest.mark.parametrize("version", FMU_FILES, ids=lambda version: f"fmi{version}")
HARNESS = Path(__file__).with_name("harness")
HARD_CASES = PROJECT_ROOT / "scenarios" / "speed_vs_error" / "hard_cases"


# The files that take longest, the longest first: begun first, no processor waits for one of them alone at the end.
LONGEST = (
    "validation/test_validation.py",
    "scenarios/test_hard_cases.py",
    "scenarios/test_sweep.py",
    "scenarios/test_speed_vs_error.py",
    "twin/test_heap_at_exit.py",
    "scenarios/test_field_row.py",
    "fmi/test_web_assembly.py",
    "twin/test_linkage.py",
    "tooling/test_terminal_widths.py",
    "exporter/test_dist.py",
)


@pytest.hookimpl(trylast=True)  # after pytest's own order, by fixtures
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The order in which files are given to processes, by --dist loadfile --no-loadscope-reorder."""
    rank = {PROJECT_ROOT / "tests" / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path, len(rank)))


@pytest.fixture(scope="session")
def interface() -> Interface:
    return load_interface()


@pytest.fixture(scope="session")
def fmu_files() -> dict[int, Path]:
    """The FMUs as the build left them, by FMI version."""
    for file in FMU_FILES.values():
        if not file.exists():
            pytest.fail(f"{file.relative_to(PROJECT_ROOT)} is missing: run make build", pytrace=False)
    return FMU_FILES


@pytest.fixture(scope="session")
def fmu_file(fmu_files: dict[int, Path]) -> Path:
    """That of FMI 2.0."""
    return fmu_files[2]


@pytest.fixture(scope="session")
def fmus(fmu_files: dict[int, Path], tmp_path_factory: pytest.TempPathFactory) -> dict[int, Fmu]:
    """The FMUs, unpacked once, with the callbacks that tests/harness/host.py gives to FMI 2.0's."""
    platform = host_platform()
    callbacks = tmp_path_factory.mktemp("hosts") / f"callbacks{platform.suffix}"
    compile_library((HARNESS / "callbacks.c",), callbacks, platform)
    unpacked = {}
    for version, file in fmu_files.items():
        folder = tmp_path_factory.mktemp(f"fmi{version}")
        fmpy.extract(str(file), str(folder))
        unpacked[version] = (Fmu3 if version == 3 else Fmu)(file, folder, callbacks)
    return unpacked


@pytest.fixture
def version() -> int:
    """The FMI version of what `fmu` and `new` give; BOTH_VERSIONS makes a test run over both."""
    return 2


@pytest.fixture
def fmu(fmus: dict[int, Fmu], version: int) -> Fmu:
    return fmus[version]


CATEGORIES = {OK: "logEvents", WARNING: "logStatusWarning", DISCARD: "logStatusDiscard", ERROR: "logStatusError"}


@pytest.fixture
def new(fmu: Fmu) -> Iterator[Callable[..., Instance]]:
    """Makes instances, with the arguments of Instance, and frees them after the test.

    Whatever the test is about: each message logged has an instance's name, the category of its status, and a text
    that says which function it is from (FMI 2.0.4, section 2.1.5).
    """
    made: list[Instance] = []

    def make(name: str = "linkage", **options) -> Instance:
        made.append(fmu.instance(name, **options))
        return made[-1]

    yield make
    for instance in made:
        instance.free()
        for message in instance.messages:
            assert message.instance and message.category == CATEGORIES[message.status], message
            assert re.fullmatch(rf"fmi{fmu.description.fmiVersion[0]}\w+: [^\s%].{{8,}}", message.text), message


@pytest.fixture(scope="session")
def compile_host(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Compiles a program of tests/harness by its name; returns the executable."""
    folder = tmp_path_factory.mktemp("programs")

    def compile_one(name: str, room: Path = HARNESS) -> Path:
        program = folder / name
        if not program.exists():
            options = ("-I", str(PROJECT_ROOT), "-rdynamic", "-ldl")
            compile_program((room / f"{name}.c",), program, host_platform(), *options)
        return program

    return compile_one


@pytest.fixture(scope="session", params=[2, 3], ids=["fmi2", "fmi3"])
def fmi(request) -> int:
    """The FMI version of what follows."""
    return request.param


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory) -> Path:
    """A folder that all processes of this run of the tests have in common."""
    folder = tmp_path_factory.getbasetemp()
    return folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder


@pytest.fixture(scope="session")
def all_platforms_fmu(fmi, shared_folder) -> Path:
    """The FMU for every platform, cross-compiled once, by the first process that wants it."""
    folder = shared_folder / "all platforms"
    with FileLock(f"{folder} {fmi}.lock"):
        finished = list((folder / f"fmi{fmi}").glob("*.fmu"))
        return finished[0] if finished else build_fmu(fmi, folder, [*PLATFORMS.values(), WEB_ASSEMBLY])


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


def copy_project(folder: Path) -> Path:
    """The sources in another folder, with other file times, to build from and to change."""
    copy = folder / "else where"
    skipped = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PROJECT_ROOT / "fmu_src", copy / "fmu_src", ignore=skipped, copy_function=shutil.copyfile)
    for name in ("LICENSE", "README.md"):
        shutil.copyfile(PROJECT_ROOT / name, copy / name)
    for path in copy.rglob("*"):
        os.utime(path, (1e9, 1e9))
    return copy


@pytest.fixture
def project_copy(tmp_path) -> Path:
    return copy_project(tmp_path)
