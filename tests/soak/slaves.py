"""A host of a few lines, quick under valgrind: python slaves.py FOLDER...

FOLDER holds an unpacked FMU of PythonFMU (FMI 2.0, co-simulation). All are loaded into this process, set up, stepped
once and freed, so that nothing of theirs is left when it ends.
"""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path
from xml.etree import ElementTree

LOGGER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)


class Callbacks(ctypes.Structure):
    """fmi2CallbackFunctions; PythonFMU allocates and steps without them."""

    _fields_ = [
        ("logger", LOGGER),
        *((name, ctypes.c_void_p) for name in ("allocateMemory", "freeMemory", "stepFinished", "environment")),
    ]


CALLBACKS = Callbacks(LOGGER(lambda *_: None))
START, STEP = ctypes.c_double(0), ctypes.c_double(0.01)


def library_of(folder: Path) -> tuple[ctypes.CDLL, bytes]:
    """The library in an unpacked FMU, loaded, and the FMU's token."""
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    name = root.find("CoSimulation").get("modelIdentifier")
    place, suffix = ("win64", "dll") if sys.platform == "win32" else ("linux64", "so")
    library = ctypes.CDLL(str(folder / "binaries" / place / f"{name}.{suffix}"))
    library.fmi2Instantiate.restype = ctypes.c_void_p
    return library, root.get("guid").encode()


def run(folder: Path) -> None:
    library, token = library_of(folder)
    instance = library.fmi2Instantiate(
        b"slave", 1, token, (folder / "resources").as_uri().encode(), ctypes.byref(CALLBACKS), 0, 0
    )
    assert instance, f"{folder.name} gives no instance"
    instance = ctypes.c_void_p(instance)
    for function, *arguments in (
        ("fmi2SetupExperiment", 0, START, START, 0, START),
        ("fmi2EnterInitializationMode",),
        ("fmi2ExitInitializationMode",),
        ("fmi2DoStep", START, STEP, 1),
        ("fmi2Terminate",),
    ):
        status = getattr(library, function)(instance, *arguments)
        assert status == 0, f"{folder.name}: {function} returned {status}"
    library.fmi2FreeInstance(instance)


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        run(Path(argument))
