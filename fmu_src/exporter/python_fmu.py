"""PythonFMU's library without what touches memory already given back; documentation/python_fmus.md has the story.

At exit: PythonFMU (0.6.5 to 0.7.0) keeps its state in a static std::shared_ptr, which on Linux is destroyed twice, by
the C++ runtime and then by the library's own last destructor, onLibraryUnload. Here the array of destructors
(.fini_array) is cut short by that entry.

After an exception of the slave: handle_py_exception gives back the references to class, slave and log and keeps the
pointers, which the next call, reset or free then uses. Here it keeps the references, which the instance's destructor
gives back. Likewise a reset gives back the log before it makes a new slave, which may raise; here it forgets the
pointer as well.

A library that does not look exactly so is refused: nobody has looked at it yet.
"""

from __future__ import annotations

import re
import shutil
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ..formats.python_fmu import (
    DESTRUCTOR,
    FINALIZER,
    FORGET_ON_LINUX,
    FORGET_ON_WINDOWS,
    GIVE_BACK,
    VERSIONS,
    pattern,
)

if TYPE_CHECKING:
    import lief  # else where it is used: it takes a second, and few commands mend

POINTER = 8  # bytes
# All of the destructor's code: endbr64, then a jump to FINALIZER (four bytes of distance follow).
CODE, CODE_SIZE = bytes.fromhex("f30f1efa e9"), 9
ELF, PE = b"\x7fELF", b"MZ"
# On Linux: PySlaveInstance::handle_py_exception, in namespace pythonfmu or in none, and PySlaveInstance::initialize,
# which from 0.6.8 on is inlined into what Reset runs.
HANDLER = re.compile(r"_ZNK(9pythonfmu)?15PySlaveInstance19handle_py_exceptionE[^.]*")
RESET = re.compile(
    r"_ZN9pythonfmu15PySlaveInstance10initializeE16PyGILState_STATE"
    r"|_ZNSt17_Function_handlerI.*ZN15PySlaveInstance5ResetEvE.*_M_invokeE[^.]*"
)
NO_HANDLER, NO_RESET = "handle_py_exception gives back something else", "a reset gives back something else"
# On Windows handle_py_exception calls cleanPyObject, which writes the log and gives the references back, before it
# calls PyErr_Fetch. Mended: clearLogBuffer, which writes the log.
CALL = "48 8b cb e8 ?? ?? ?? ?? 4c 8d 44 24 ?? 48 8d 54 24 ?? 48 8d 4c 24 ?? ff 15"
DISTANCE = 4  # from the beginning of CALL to the distance of what is called
LOOKED_AT = 0x80  # bytes of a function on Windows, whose sizes are not told


class PythonFmuError(ValueError):
    """A library that is not PythonFMU's as it is known; the message says which and what is different."""


def mended(content: dict[str, bytes]) -> dict[str, bytes]:
    """Those of an FMU's files that have to be replaced, by name in the archive: empty where it was mended before.

    content: the files of an FMU that PythonFMU built. Raises PythonFmuError where there is a library that is not
    known, or none at all.
    """
    replaced, is_found = {}, False
    for name in sorted(content):
        if not name.startswith("binaries/") or name.endswith("/"):
            continue
        if not content[name].startswith((ELF, PE)):
            raise PythonFmuError(
                f"{name}: neither a library for Linux nor for Windows; PythonFMU is known to have no other"
            )
        is_found = True
        library = mended_library(content[name], name)
        if library != content[name]:
            replaced[name] = library
    if not is_found:
        raise PythonFmuError("no library of PythonFMU in binaries/: nothing to mend")
    return replaced


def mended_library(library: bytes, name: str) -> bytes:
    """PythonFMU's library without both faults, of the same size; unchanged where it was mended before.

    name: for messages. Raises PythonFmuError.
    """
    import lief

    lief.logging.disable()
    return mended_on_windows(library, name) if library.startswith(PE) else mended_on_linux(library, name)


def mended_on_linux(library: bytes, name: str) -> bytes:
    """Both faults; of the bytes of 0.7.0 24 change."""
    import lief

    binary = lief.ELF.parse(list(library))
    if binary is None or FINALIZER not in {symbol.name for symbol in binary.exported_symbols}:
        raise PythonFmuError(f"{name}: not PythonFMU's library of {VERSIONS}: it exports no {FINALIZER}")
    library = without_destructor(library, binary, name)
    for function, changes, difference in ((HANDLER, GIVE_BACK, NO_HANDLER), (RESET, FORGET_ON_LINUX, NO_RESET)):
        found = {(s.value, s.size) for s in binary.symtab_symbols if s.size and function.fullmatch(str(s.name))}
        if len(found) != 1:
            raise unknown(name, difference)
        ((address, size),) = found
        place = binary.virtual_address_to_offset(address)
        if not isinstance(place, int) or not (changed := exchanged(library, place, size, changes)):
            raise unknown(name, difference)
        library = changed
    return library


def mended_on_windows(library: bytes, name: str) -> bytes:
    """What is wrong after an exception; at exit nothing is: DllMain is hidden in an anonymous namespace, so that
    nothing calls the finalizer.
    """
    import lief

    binary = lief.PE.parse(list(library))
    exported = {str(function.name): function.address for function in binary.exported_functions} if binary else {}
    if binary is None or FINALIZER not in exported:
        raise PythonFmuError(f"{name}: not PythonFMU's library of {VERSIONS}: it exports no {FINALIZER}")
    names = ("handle_py_exception", "initialize", "cleanPyObject", "clearLogBuffer")
    found = {
        each: [address for symbol, address in exported.items() if symbol.startswith(f"?{each}@PySlaveInstance@")]
        for each in names
    }
    if odd := [each for each in names if len(found[each]) != 1]:
        raise unknown(name, f"it exports no single PySlaveInstance::{odd[0]}")
    handler, reset, cleans, logs = (found[each][0] for each in names)

    place = binary.rva_to_offset(handler)
    calls = [call.start() for call in pattern(CALL).finditer(library[place : place + LOOKED_AT])]
    if len(calls) != 1:
        raise unknown(name, NO_HANDLER)
    distance, after = place + calls[0] + DISTANCE, handler + calls[0] + DISTANCE + struct.calcsize("<i")
    called = after + struct.unpack_from("<i", library, distance)[0]
    if called not in (cleans, logs):
        raise unknown(name, "handle_py_exception calls something else than cleanPyObject")
    library = written(library, distance, struct.pack("<i", logs - after))
    if not (changed := exchanged(library, binary.rva_to_offset(reset), LOOKED_AT, FORGET_ON_WINDOWS)):
        raise unknown(name, NO_RESET)
    return changed


def exchanged(library: bytes, begin: int, size: int, changes: Mapping[str, str]) -> bytes | None:
    """With the one piece of code within `size` bytes from `begin` that is in `changes` exchanged for what is beside
    it; unchanged where that is there. None where neither is.
    """
    for before, after in changes.items():
        for code, is_done in ((before, False), (after, True)):
            found = list(pattern(code).finditer(library, begin, begin + size))
            if len(found) == 1:
                return library if is_done else written(library, found[0].start(), filled(after, found[0]))
    return None


def filled(code: str, found: re.Match[bytes]) -> bytes:
    """The code with what was found where it is open: each ?? as it was in the same place."""
    old = found[0]
    place = found[1] if found.re.groups else b""
    return b"".join(
        old[i : i + 1] if byte == "??" else place if byte == "ss" else bytes.fromhex(byte)
        for i, byte in enumerate(code.split())
    )


def written(library: bytes, place: int, code: bytes) -> bytes:
    return library[:place] + code + library[place + len(code) :]


def without_destructor(library: bytes, binary: lief.ELF.Binary, name: str) -> bytes:
    """Without the entry of onLibraryUnload: one byte changes, in DT_FINI_ARRAYSZ."""
    import lief

    tags = lief.ELF.DynamicEntry.TAG
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
    return written(library, place, after)


def unknown(name: str, difference: str) -> PythonFmuError:
    return PythonFmuError(
        f"{name}: not PythonFMU's library of {VERSIONS}: {difference}. Whether it still corrupts the heap "
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
