"""PythonFMU's library without the destructor that counts down a reference in memory already given back.

PythonFMU (0.6.5 to 0.7.0) keeps its state in a static std::shared_ptr. At exit() the C++ runtime destroys it; after
that the loader runs the library's own destructors (.fini_array), and one of them, onLibraryUnload, sets the destroyed
pointer to nullptr: it decrements a counter inside a freed block, and the process may abort. Here the array is cut short
by that entry, its last. The state is then destroyed once, by the C++ runtime. documentation/python_fmus.md has the
whole story.

A library that does not look exactly so is refused: nobody has looked at it yet.
"""

from __future__ import annotations

import shutil
import struct
import zipfile
from pathlib import Path

import lief

from ..formats.python_fmu import DESTRUCTOR, FINALIZER, VERSIONS

POINTER = 8  # bytes
# All of the destructor's code: endbr64, then a jump to FINALIZER (four bytes of distance follow).
CODE, CODE_SIZE = bytes.fromhex("f30f1efa e9"), 9
ELF, PE = b"\x7fELF", b"MZ"


class PythonFmuError(ValueError):
    """A library that is not PythonFMU's as it is known; the message says which and what is different."""


def mended(content: dict[str, bytes]) -> dict[str, bytes]:
    """Those of an FMU's files that have to be replaced, by name in the archive: empty where it was mended before.

    content: the files of an FMU that PythonFMU built. Raises PythonFmuError where there is a library that is not
    known, or none for Linux. Windows' library is right as it is: its DllMain is hidden in an anonymous namespace, so
    that nothing calls the finalizer.
    """
    replaced, is_found = {}, False
    for name in sorted(content):
        if not name.startswith("binaries/") or name.endswith("/") or content[name].startswith(PE):
            continue
        if not content[name].startswith(ELF):
            raise PythonFmuError(
                f"{name}: neither a library for Linux nor for Windows; PythonFMU is known to have no other"
            )
        is_found = True
        library = mended_library(content[name], name)
        if library != content[name]:
            replaced[name] = library
    if not is_found:
        raise PythonFmuError("no library of PythonFMU for Linux in binaries/: nothing to mend")
    return replaced


def mended_library(library: bytes, name: str) -> bytes:
    """PythonFMU's library for Linux without the destructor; unchanged where it was mended before.

    name: for messages. Of the bytes one changes, in DT_FINI_ARRAYSZ. Raises PythonFmuError.
    """
    tags = lief.ELF.DynamicEntry.TAG
    lief.logging.disable()
    binary = lief.ELF.parse(list(library))
    if binary is None or FINALIZER not in {symbol.name for symbol in binary.exported_symbols}:
        raise PythonFmuError(f"{name}: not PythonFMU's library of {VERSIONS}: it exports no {FINALIZER}")
    found = [symbol for symbol in binary.symtab_symbols if symbol.name == DESTRUCTOR]
    entries = list(binary.dynamic_entries)
    array, size = (
        next((entry for entry in entries if entry.tag == tag), None) for tag in (tags.FINI_ARRAY, tags.FINI_ARRAYSZ)
    )
    if len(found) != 1 or array is None or size is None:
        raise unknown(name, "it has no destructor onLibraryUnload")
    (destructor,) = found
    code = bytes(binary.get_content_from_virtual_address(destructor.value, CODE_SIZE))
    if destructor.size != CODE_SIZE or not code.startswith(CODE):
        raise unknown(name, f"onLibraryUnload does more than to jump to {FINALIZER}")
    relative = lief.ELF.Relocation.TYPE.X86_64_RELATIVE
    functions = {entry.address: entry.addend for entry in binary.dynamic_relocations if entry.type == relative}
    places = [place for place, function in functions.items() if function == destructor.value]
    end = array.value + size.value
    if size.value == POINTER and places == [end]:
        return library
    if size.value != 2 * POINTER or places != [end - POINTER]:
        raise unknown(name, "onLibraryUnload is not the last of two destructors")
    place = next(s for s in binary.segments if s.type == lief.ELF.Segment.TYPE.DYNAMIC).file_offset
    place += struct.calcsize("<qQ") * entries.index(size) + struct.calcsize("<q")
    before, after = (struct.pack("<Q", value) for value in (size.value, size.value - POINTER))
    if library[place : place + len(before)] != before:
        raise unknown(name, "its dynamic section is not where its header says")
    return library[:place] + after + library[place + len(after) :]


def unknown(name: str, difference: str) -> PythonFmuError:
    return PythonFmuError(
        f"{name}: not PythonFMU's library of {VERSIONS}: {difference}. Whether it still corrupts the heap at exit "
        "is not known, so it is not touched and not shipped; those versions can be mended"
    )


def mend_fmu(fmu: Path) -> list[str]:
    """Mend an FMU that PythonFMU built, in place; returns the libraries that were replaced.

    Every other file keeps its bytes, time and place; the same FMU gives the same bytes. The file is replaced whole or
    not at all, and not touched where it was mended before. Raises PythonFmuError, OSError.
    """
    try:
        with zipfile.ZipFile(fmu) as archive:
            entries = [(entry, archive.read(entry)) for entry in archive.infolist()]
        replaced = mended({entry.filename: data for entry, data in entries})
    except zipfile.BadZipFile as problem:
        raise PythonFmuError(f"{fmu}: no FMU: {problem}") from problem
    except PythonFmuError as problem:
        raise PythonFmuError(f"{fmu}: {problem}") from problem
    if replaced:
        unfinished = fmu.with_name(fmu.name + ".part")
        try:
            with zipfile.ZipFile(unfinished, "w") as archive:
                for entry, data in entries:
                    archive.writestr(entry, replaced.get(entry.filename, data))
            shutil.copymode(fmu, unfinished)
            unfinished.replace(fmu)
        finally:
            unfinished.unlink(missing_ok=True)
    return sorted(replaced)
