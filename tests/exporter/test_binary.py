"""The Linux binary: it exports the FMI functions alone, and needs nothing but an old libc."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from elftools.elf.dynamic import DynamicSection
from elftools.elf.elffile import ELFFile
from elftools.elf.gnuversions import GNUVerNeedSection

from tests.harness import host, host3

FUNCTIONS = {2: {*host.FUNCTIONS, *host.MODEL_EXCHANGE_FUNCTIONS}, 3: {*host3.FUNCTIONS}}

OLDEST_LIBC = (2, 17)  # of 2012
LIBRARIES = {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}


@pytest.fixture(scope="module", params=["x86_64-linux", "aarch64-linux"])
def library(request, all_platforms) -> Path:
    return all_platforms[request.param]


@pytest.fixture
def elf(library):
    with library.open("rb") as file:
        yield ELFFile(file)


def test_exports_are_the_functions_of_fmi(elf, fmi):
    """Nothing else: two FMUs in one process must not meet in a name."""
    exported = {
        symbol.name
        for symbol in elf.get_section_by_name(".dynsym").iter_symbols()
        if symbol["st_shndx"] != "SHN_UNDEF" and symbol["st_info"]["bind"] in ("STB_GLOBAL", "STB_WEAK")
    }
    assert exported == FUNCTIONS[fmi]


def test_needed_libraries(elf):
    (dynamic,) = [section for section in elf.iter_sections() if isinstance(section, DynamicSection)]
    needed = {tag.needed for tag in dynamic.iter_tags("DT_NEEDED")}
    assert needed <= LIBRARIES
    assert not [tag.entry.d_tag for tag in dynamic.iter_tags() if tag.entry.d_tag in ("DT_RPATH", "DT_RUNPATH")]


def test_no_symbol_is_newer_than_the_oldest_libc(elf):
    versions = {
        version.name
        for section in elf.iter_sections()
        if isinstance(section, GNUVerNeedSection)
        for _, entries in section.iter_versions()
        for version in entries
    }
    assert versions
    for version in versions:
        numbers = re.fullmatch(r"GLIBC_(\d+)\.(\d+)(\.\d+)?", version)
        assert numbers and tuple(map(int, numbers.groups()[:2])) <= OLDEST_LIBC, version


def test_nothing_that_instances_could_share(elf):
    """No variable that can be written to: whatever changes belongs to an instance."""
    writable = {
        section.name: section["sh_size"]
        for section in elf.iter_sections()
        if section["sh_flags"] & 1 and section["sh_size"] and section.name not in (".dynamic", ".got", ".got.plt")
    }
    # constants with addresses in them, which the loader writes and then protects
    assert set(writable) <= {".data.rel.ro", ".relro_padding"}


def test_no_names_of_the_machine_that_built_it(library):
    content = library.read_bytes()
    for word in (b"/home/", b"/tmp/", b".c\0", b"/fmu_src/"):
        assert word not in content


def test_stack_is_not_executable(elf):
    (stack,) = [segment for segment in elf.iter_segments() if segment["p_type"] == "PT_GNU_STACK"]
    assert not stack["p_flags"] & 1
