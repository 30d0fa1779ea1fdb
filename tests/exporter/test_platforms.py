"""One build for all platforms: the folders that hosts look into, and in each what its system loads."""

from __future__ import annotations

import platform
import struct
import zipfile
from pathlib import Path

import fmpy
import pytest
from elftools.elf.elffile import ELFFile
from lxml import etree

from fmu_src.exporter import compiler
from fmu_src.exporter.compiler import PLATFORMS, CompileError, compile_library, host_platform
from fmu_src.exporter.mach_o import universal
from fmu_src.formats.ls_wasm import MANIFEST
from tests.harness import host, host3

FUNCTIONS = {2: {*host.FUNCTIONS, *host.MODEL_EXCHANGE_FUNCTIONS}, 3: {*host3.FUNCTIONS}}

FOLDERS = {
    # FMI 2.0.4, section 2.3 for the first three, macOS for both processors; the fourth has no name there but FMI 3.0's
    2: {("linux64", ".so"), ("win64", ".dll"), ("darwin64", ".dylib"), ("aarch64-linux", ".so")},
    # FMI 3.0, section 2.5.1.4: platform tuples
    3: {("x86_64-linux", ".so"), ("aarch64-linux", ".so"), ("x86_64-windows", ".dll"),
        ("x86_64-darwin", ".dylib"), ("aarch64-darwin", ".dylib"), ("wasm32-wasip2", ".wasm")},  # the last: FMI-LS-WASM
}  # fmt: skip
MACH_O_64 = 0xFEEDFACF
MACH_O_LIBRARY = 6


def test_all_are_there(all_platforms_fmu, interface, fmi):
    with zipfile.ZipFile(all_platforms_fmu) as archive:
        binaries = {name for name in archive.namelist() if name.startswith("binaries/")}
    assert binaries == {f"binaries/{folder}/{interface.model.name}{suffix}" for folder, suffix in FOLDERS[fmi]}


def test_the_manifest_of_the_component(all_platforms_fmu, fmu_files, fmi):
    """Where there is a component, and there alone: attributes as the schema of FMI 3.0's manifests has them."""
    with zipfile.ZipFile(all_platforms_fmu) as archive:
        assert (MANIFEST in archive.namelist()) == (fmi == 3)
        if fmi == 3:
            root = etree.fromstring(archive.read(MANIFEST))
            schema = etree.parse(Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3LayeredStandardManifest.xsd")
            space, declared = schema.getroot().get("targetNamespace"), schema.findall("{*}attribute")
            assert set(root.keys()) == {f"{{{space}}}{attribute.get('name')}" for attribute in declared}
            assert root.get(f"{{{space}}}fmi-ls-name") == "org.modelica.fmi-ls-wasm"
    with zipfile.ZipFile(fmu_files[fmi]) as archive:
        assert not [name for name in archive.namelist() if "wasm" in name]


def test_the_licence_of_what_windows_carries(all_platforms_fmu, fmu_files, fmi):
    """The start-up code of mingw-w64 is in the DLL; its licence asks to be told."""
    name = "documentation/licenses/mingw-w64.txt"
    with zipfile.ZipFile(all_platforms_fmu) as archive:
        assert b"mingw-w64 project" in archive.read(name)
    with zipfile.ZipFile(fmu_files[fmi]) as archive:
        assert (name in archive.namelist()) == any(n.endswith(".dll") for n in archive.namelist())


@pytest.mark.parametrize(("name", "machine"), [("x86_64-linux", "EM_X86_64"), ("aarch64-linux", "EM_AARCH64")])
def test_linux(all_platforms, name, machine):
    with all_platforms[name].open("rb") as file:
        elf = ELFFile(file)
        assert (elf.header.e_type, elf.header.e_machine, elf.elfclass) == ("ET_DYN", machine, 64)


def test_windows(all_platforms, fmi):
    """A 64-bit DLL that exports the functions of FMI and imports the system's libraries alone."""
    content = all_platforms["x86_64-windows"].read_bytes()
    assert content[:2] == b"MZ"
    header = struct.unpack_from("<I", content, 0x3C)[0]
    machine, _, _, _, _, _, characteristics = struct.unpack_from("<HHIIIHH", content, header + 4)
    assert content[header : header + 4] == b"PE\0\0" and machine == 0x8664 and characteristics & 0x2000
    exports, imports = pe_tables(content, header)
    assert exports == FUNCTIONS[fmi]
    assert all(name.lower().startswith(("api-ms-win-crt-", "kernel32", "ntdll", "msvcrt")) for name in imports), imports


def pe_tables(content: bytes, header: int) -> tuple[set[str], set[str]]:
    """Names of exported functions and of imported DLLs."""
    count, optional_size = struct.unpack_from("<H12xH", content, header + 6)
    optional = header + 24
    sections = [struct.unpack_from("<8xIIII", content, optional + optional_size + 40 * i) for i in range(count)]

    def place(address: int) -> int:
        """Where in the file lies what is loaded at this address."""
        for size, start, raw_size, raw in sections:
            if start <= address < start + max(size, raw_size):
                return raw + address - start
        raise ValueError(f"no section holds {address:#x}")

    def text(address: int) -> str:
        start = place(address)
        return content[start : content.index(b"\0", start)].decode()

    export_table, _, import_table = struct.unpack_from("<III", content, optional + 112)
    names, names_address = struct.unpack_from("<I4xI", content, place(export_table) + 24)
    exports = {text(struct.unpack_from("<I", content, place(names_address) + 4 * i)[0]) for i in range(names)}
    imports, entry = set(), place(import_table)
    while (dll := struct.unpack_from("<I", content, entry + 12)[0]) != 0:
        imports.add(text(dll))
        entry += 20
    return exports, imports


@pytest.mark.parametrize(("name", "processor"), [("x86_64-macos", 0x01000007), ("aarch64-macos", 0x0100000C)])
def test_macos(all_platforms, name, processor, fmi):
    """A 64-bit library for the processor, which needs the system's library alone."""
    content = all_platforms[name].read_bytes()
    magic, cpu, _, kind, commands = struct.unpack_from("<IIIII", content)
    assert (magic, cpu, kind) == (MACH_O_64, processor, MACH_O_LIBRARY)
    needed, place, signed = set(), 32, False
    for _ in range(commands):
        command, size = struct.unpack_from("<II", content, place)
        signed = signed or command == 0x1D  # LC_CODE_SIGNATURE
        if command == 0xC:  # LC_LOAD_DYLIB
            start = place + struct.unpack_from("<I", content, place + 8)[0]
            needed.add(content[start : content.index(b"\0", start)].decode())
        place += size
    assert needed == {"/usr/lib/libSystem.B.dylib"}
    assert signed or processor != 0x0100000C, "macOS loads nothing unsigned on its own processors"
    for function in FUNCTIONS[fmi]:
        assert f"_{function}\0".encode() in content


def macho(processor: int, size: int, fill: bytes = b"x") -> bytes:
    return struct.pack("<III", MACH_O_64, processor, 3).ljust(size, fill)


def test_universal_binary():
    """<mach-o/fat.h>: big-endian header; each library whole, on a page of its own, x86_64 first."""
    x86, arm = macho(0x01000007, 20000, b"i"), macho(0x0100000C, 100, b"a")
    made = universal([arm, x86])
    assert made == universal([x86, arm])
    assert struct.unpack_from(">II", made) == (0xCAFEBABE, 2)
    entries = [struct.unpack_from(">IIIII", made, 8 + 20 * k) for k in range(2)]
    assert [entry[0] for entry in entries] == [0x01000007, 0x0100000C] and [entry[1] for entry in entries] == [3, 3]
    for library, (_, _, offset, size, bits) in zip((x86, arm), entries, strict=True):
        assert bits == 14 and offset % (1 << bits) == 0 and made[offset : offset + size] == library
    assert len(made) == entries[1][2] + len(arm)


@pytest.mark.parametrize(
    ("libraries", "said"),
    [
        ([macho(7, 50), macho(7, 60)], "two libraries for one processor"),
        ([macho(7, 50), b"\x7fELF" + bytes(60)], "no 64-bit Mach-O"),
        ([b""], "no 64-bit Mach-O"),
    ],
)
def test_no_universal_binary(libraries, said):
    with pytest.raises(ValueError, match=said):
        universal(libraries)


# ---- which platform this is ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("system", "machine", "name"),
    [
        ("Linux", "x86_64", "x86_64-linux"),
        ("Linux", "aarch64", "aarch64-linux"),
        ("Windows", "AMD64", "x86_64-windows"),
        ("Darwin", "x86_64", "x86_64-macos"),
        ("Darwin", "arm64", "aarch64-macos"),
    ],
)
def test_host_platform(monkeypatch, system, machine, name):
    monkeypatch.setattr(platform, "system", lambda: system)
    monkeypatch.setattr(platform, "machine", lambda: machine)
    assert host_platform().name == name


def test_a_machine_without_a_platform(monkeypatch):
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    with pytest.raises(CompileError, match="riscv64"):
        host_platform()


# ---- the compiler --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("int f(void) { return 1 }", "expected"),
        ("static int f(void) { return 1; }", "unused"),
        ("int f(void) { return 1; }", "prototype"),
    ],
)
def test_no_warning_passes(tmp_path, code, said):
    """Errors and warnings stop the build, and the compiler's words reach the user."""
    source = tmp_path / "bad.c"
    source.write_text(code)
    with pytest.raises(CompileError, match=said):
        compile_library((source,), tmp_path / "bad.so", host_platform())


def test_only_what_is_marked_is_exported(tmp_path):
    source = tmp_path / "two.c"
    source.write_text(
        "int hidden(void); int shown(void); int hidden(void) { return 1; }\n"
        '__attribute__((visibility("default"))) int shown(void) { return 2; }\n'
    )
    compile_library((source,), tmp_path / "two.so", PLATFORMS["x86_64-linux"])
    with (tmp_path / "two.so").open("rb") as file:
        names = {symbol.name for symbol in ELFFile(file).get_section_by_name(".dynsym").iter_symbols()}
    assert "shown" in names and "hidden" not in names


def test_every_source_is_compiled():
    """A new .c file of the linkage or the component must join those that are included together."""
    folders = [Path(compiler.__file__).parents[1] / name for name in ("linkage", "component")]
    included = compiler.FMU_SOURCE[2].with_name("one_file.h").read_text(encoding="utf-8")
    for source in (file for folder in folders for file in folder.glob("*.c")):
        assert f'#include "../{source.parent.name}/{source.name}"' in included
