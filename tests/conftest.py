"""Fixtures that every room of the tests may use."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import pytest

from fmu_src.exporter.compiler import compile_library, compile_program, host_platform
from fmu_src.interface import Interface, load_interface
from tests.fmi.host import DISCARD, ERROR, OK, WARNING, Fmu, Instance
from tests.fmi.host3 import Fmu3

PROJECT_ROOT = Path(__file__).resolve().parent.parent
FMU_FILES = {version: PROJECT_ROOT / "build" / f"fmi{version}" / "TransplanterLinkage.fmu" for version in (2, 3)}
BOTH_VERSIONS = pytest.mark.parametrize("version", FMU_FILES, ids=lambda version: f"fmi{version}")
HOSTS = Path(__file__).with_name("hosts")


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
    """The FMUs, unpacked once, with the callbacks that tests/fmi/host.py gives to FMI 2.0's."""
    platform = host_platform()
    callbacks = tmp_path_factory.mktemp("hosts") / f"callbacks{platform.suffix}"
    compile_library((HOSTS / "callbacks.c",), callbacks, platform)
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
def compile_host(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Compiles a program of tests/hosts by its name; returns the executable."""
    folder = tmp_path_factory.mktemp("programs")

    def compile_one(name: str) -> Path:
        program = folder / name
        if not program.exists():
            compile_program((HOSTS / f"{name}.c",), program, host_platform(), "-rdynamic", "-ldl")
        return program

    return compile_one
