"""The sources in the archive: what it describes, compiled by other compilers, is the component, bit for bit."""

from __future__ import annotations

import math
import random
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from elftools.elf.elffile import ELFFile
from fmpy.build import build_platform_binary
from lxml import etree

from fmu_src.exporter.compiler import FMI_HEADERS, SOURCE_ROOT
from fmu_src.exporter.sources import SCHEMA
from tests.harness.host import Fmu, Instance, bits
from tests.harness.host3 import FUNCTIONS

COMPILERS = {"gcc": ["gcc"], "clang": ["clang"], "zig cc": [sys.executable, "-m", "ziglang", "cc"]}
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Werror"]
VERSIONS = (2, 3)
OVERRIDE = "-DFMI{}_OVERRIDE_FUNCTION_PREFIX"  # what an importer says that makes a shared library


@pytest.fixture(params=VERSIONS, ids=["fmi2", "fmi3"])
def version(request) -> int:
    """Both, wherever a test of this file asks for an FMU."""
    return request.param


@pytest.fixture
def sources(fmu: Fmu) -> Path:
    return fmu.folder / "sources"


def described(fmu: Fmu) -> list[str]:
    """The files that the FMU tells an importer to compile."""
    (configuration,) = {tuple(name for files in configuration.sourceFileSets for name in files.sourceFiles)
                        for configuration in fmu.description.buildConfigurations}  # fmt: skip
    return list(configuration)


def elsewhere(fmu: Fmu, folder: Path) -> Fmu:
    """A copy without a binary."""
    shutil.copytree(fmu.folder, folder, dirs_exist_ok=True)
    other = replace(fmu, folder=folder)
    other.library.unlink()
    return other


@pytest.fixture(params=[*COMPILERS, "fmpy's cmake"])
def compiled(request, fmu: Fmu, version: int, tmp_path) -> Fmu:
    """The FMU with a binary of another compiler, made from its sources alone, somewhere else."""
    command = COMPILERS.get(request.param, ["cmake"])
    if shutil.which(command[0]) is None:
        pytest.skip(f"there is no {request.param}")
    other = elsewhere(fmu, tmp_path / "compiled")
    if command == ["cmake"]:
        build_platform_binary(other.folder)
        return other
    options = [*STRICT, "-O1", "-shared", "-fPIC", OVERRIDE.format(version), "-isystem", str(FMI_HEADERS)]
    files = [str(other.folder / "sources" / name) for name in described(other)]
    done = subprocess.run(
        [*command, *options, "-o", str(other.library), *files, "-lm"], capture_output=True, text=True
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return other


def life(instance: Instance) -> list[str]:
    """What it answers, to the bit, to a host that does about everything with it."""
    chance = random.Random(6)
    instance.initialize({"geometry.L1": 0.051, "crank.phi": 0.3, "crank.w": 5.0, "machine.v": 0.4, "tip.fy": 30.0})
    answers, phi = instance.outputs(), 0.3
    for k in range(300):
        step = 1e-3 * (1 + k % 3)
        w = 6.8 * (1 + 0.1 * math.sin(k / 20))
        phi += w * step
        given = {"crank.phi": phi, "tip.fx": chance.uniform(-50, 50), "machine.v": 0.4 + chance.uniform(-0.1, 0.1)}
        if k % 100 < 50:
            given |= {"crank.w": w, "crank.a": chance.uniform(-9, 9)}
        instance.step(instance.last_successful_time(), step, given)
        answers += instance.outputs()
        answers += instance.get_derivatives(("tip.ax", 1), ("tip.ay", 2), ("crank.tau", 1))
        answers += instance.sensitivity(["tip.x", "tip.ay", "crank.tau"], {"crank.phi": 1.0, "crank.w": 0.5})
    return bits(answers)


def test_bit_for_bit(fmu, compiled):
    """Against the binary shipped, through everything that computes."""
    with fmu.instance() as shipped, compiled.instance() as other:
        assert compiled.library.read_bytes() != fmu.library.read_bytes()
        expected = life(shipped)
        assert life(other) == expected
        state = shipped.serialize()
        assert other.deserialize(state).serialize() == state, "a saved state is one in the other"


def test_what_is_described_is_what_is_there(fmu, sources, interface):
    """One file to compile, and all that it includes: nothing is missing, nothing lies idle."""
    assert described(fmu) == [f"{interface.model.name}.c"]
    there = {path.relative_to(sources).as_posix() for path in sources.rglob("*") if path.is_file()}
    there -= {"buildDescription.xml"}
    importers = {path.name for path in FMI_HEADERS.glob("*.h")}
    assert not {Path(name).name for name in there} & importers, "they are the importer's"
    for name in there - set(described(fmu)):
        assert (sources / name).read_bytes() == (SOURCE_ROOT / name).read_bytes(), name
    done = subprocess.run(
        [sys.executable, "-m", "ziglang", "cc", "-M", "-isystem", str(FMI_HEADERS), *described(fmu)],
        cwd=sources, capture_output=True, text=True, check=True,
    )  # fmt: skip
    words = done.stdout.replace("\\\n", " ").split()[1:]
    used = {(sources / word).resolve() for word in words if not word.startswith("/")}
    assert used == {(sources / name).resolve() for name in there}


def test_names_for_a_program_of_several_fmus(sources, version):
    """With headers that know prefixes (FMI 3.0's do, and those of FMI 2.0.2 and newer) each function has one."""
    text = (sources / "TransplanterLinkage.c").read_text(encoding="utf-8")
    command = [sys.executable, "-m", "ziglang", "cc", "-E", "-P", *STRICT, "-x", "c", "-"]
    asked = text.partition('#include "')[0] + f"\nFMI{version}_FUNCTION_PREFIX\n"

    def prefix(*options: str) -> str:
        done = subprocess.run([*command, *options], input=asked, capture_output=True, text=True, check=True)
        return done.stdout.split()[-1]

    assert prefix() == "TransplanterLinkage_"
    assert prefix(f"-DFMI{version}_FUNCTION_PREFIX=Mine_") == "Mine_"
    assert prefix(OVERRIDE.format(version)) == f"FMI{version}_FUNCTION_PREFIX", "not defined"


def test_linked_into_a_program(fmus, tmp_path):
    """FMI 3.0's sources as an object: every function has the model's name, nothing else is outside."""
    program = tmp_path / "one.o"
    command = [sys.executable, "-m", "ziglang", "cc", *STRICT, "-c", "-isystem", str(FMI_HEADERS), "-o", str(program)]
    subprocess.run([*command, *described(fmus[3])], cwd=fmus[3].folder / "sources", check=True)
    with program.open("rb") as file:
        table = ELFFile(file).get_section_by_name(".symtab")
        names = {
            s.name
            for s in table.iter_symbols()
            if s["st_info"]["bind"] == "STB_GLOBAL" and s["st_shndx"] != "SHN_UNDEF"
        }
    assert names == {f"TransplanterLinkage_{function}" for function in FUNCTIONS}


def test_where_each_version_describes_them(fmus, interface):
    """FMI 2.0: in each interface type. FMI 3.0: in buildDescription.xml, valid by its schema."""
    description = etree.parse(str(fmus[2].folder / "modelDescription.xml"))
    for interface_type in ("ModelExchange", "CoSimulation"):
        assert len(description.findall(f"{interface_type}/SourceFiles/File")) == 1
    assert not (fmus[2].folder / "sources" / "buildDescription.xml").exists()
    root = etree.parse(str(fmus[3].folder / "sources" / "buildDescription.xml")).getroot()
    etree.XMLSchema(etree.parse(str(SCHEMA))).assertValid(root)
    (configuration,) = root
    assert configuration.get("modelIdentifier") == interface.model.name
    assert configuration.find("SourceFileSet").get("language") == "C99"
