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

PROJECT_ROOT = Path(__file__).resolve().parent.parent
FMU_FILE = PROJECT_ROOT / "build" / "fmi2" / "TransplanterLinkage.fmu"
HOSTS = Path(__file__).with_name("hosts")


@pytest.fixture(scope="session")
def interface() -> Interface:
    return load_interface()


@pytest.fixture(scope="session")
def fmu_file() -> Path:
    """The FMU as the build left it."""
    if not FMU_FILE.exists():
        pytest.fail(f"{FMU_FILE.relative_to(PROJECT_ROOT)} is missing: run make build", pytrace=False)
    return FMU_FILE


@pytest.fixture(scope="session")
def fmu(fmu_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Fmu:
    """The FMU, unpacked once, with the callbacks that tests/fmi/host.py gives to it."""
    folder = tmp_path_factory.mktemp("fmu")
    fmpy.extract(str(fmu_file), str(folder))
    platform = host_platform()
    callbacks = tmp_path_factory.mktemp("hosts") / f"callbacks{platform.suffix}"
    compile_library((HOSTS / "callbacks.c",), callbacks, platform)
    return Fmu(fmu_file, folder, callbacks)


CATEGORIES = {OK: "logEvents", WARNING: "logStatusWarning", DISCARD: "logStatusDiscard", ERROR: "logStatusError"}


@pytest.fixture
def new(fmu: Fmu) -> Iterator[Callable[..., Instance]]:
    """Makes instances, with the arguments of Instance, and frees them after the test.

    Whatever the test is about: each message logged has an instance's name, the category of its status, and a text
    that says which function it is from (FMI 2.0.4, section 2.1.5).
    """
    made: list[Instance] = []

    def make(name: str = "linkage", **options) -> Instance:
        made.append(Instance(fmu, name, **options))
        return made[-1]

    yield make
    for instance in made:
        instance.free()
        for message in instance.messages:
            assert message.instance and message.category == CATEGORIES[message.status], message
            assert re.fullmatch(r"fmi2\w+: [^\s%].{8,}", message.text), message


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
