"""Calls a PythonFMU slave in every way in which it may raise, and goes on.

    python -m tests.soak.exceptions FOLDER ROUNDS

FOLDER holds the unpacked FMU of raising.py. In each round each call raises once, with a collection of cycles after it;
then the instance works as before, is reset, and is freed, in every other round without a reset. The process ends with
status 0 where each answer is as it must be, and by a signal where freed objects are touched. It is a host of a few
lines, quick under valgrind.
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from collections.abc import Callable
from pathlib import Path

from .slaves import LOGGER, Callbacks, library_of

OK, FATAL = 0, 4
MESSAGES: list[bytes] = []
CALLBACKS = Callbacks(LOGGER(lambda *said: MESSAGES.append(said[4])))
TIME, STEP = ctypes.c_double(0), ctypes.c_double(0.01)
TYPES = {"Real": ctypes.c_double, "Integer": ctypes.c_int, "Boolean": ctypes.c_int, "String": ctypes.c_char_p}


def check(is_right: bool, what: object) -> None:
    if not is_right:
        sys.exit(f"{what}; said: {MESSAGES[-3:]}")


class Slave:
    """An instance; each call returns its FMI status."""

    def __init__(self, folder: Path) -> None:
        self.library, token = library_of(folder)
        self.arguments = (b"slave", 1, token, (folder / "resources").as_uri().encode(), ctypes.byref(CALLBACKS), 0, 1)
        self.state, self.size = ctypes.c_void_p(), ctypes.c_size_t(0)
        self.bytes = ctypes.create_string_buffer(10_000)
        self.instance: ctypes.c_void_p | None = None

    def make(self) -> int:
        made = self.library.fmi2Instantiate(*self.arguments)
        self.instance = ctypes.c_void_p(made)
        return OK if made else FATAL

    def call(self, function: str, *arguments: object) -> int:
        return getattr(self.library, f"fmi2{function}")(self.instance, *arguments)

    def access(self, way: str, kind: str) -> int:
        """Get or set the variable of this type: the references count from 0 in the order of TYPES."""
        reference = (ctypes.c_uint * 1)(list(TYPES).index(kind))
        value = (TYPES[kind] * 1)(b"other") if kind == "String" else (TYPES[kind] * 1)(1)
        return self.call(f"{way}{kind}", reference, ctypes.c_size_t(1), value)

    def free(self) -> None:
        if self.instance:
            self.library.fmi2FreeInstance(self.instance)

    def calls(self) -> dict[str, Callable[[], int]]:
        """By the name of the slave's method, in an order in which FMI allows them."""
        state, size = self.state, self.size
        accesses = {
            f"{way.lower()}_{kind.lower()}": lambda way=way, kind=kind: self.access(way, kind)
            for way in ("Set", "Get")
            for kind in TYPES
        }
        return {
            "setup_experiment": lambda: self.call("SetupExperiment", 0, TIME, TIME, 0, TIME),
            "enter_initialization_mode": lambda: self.call("EnterInitializationMode"),
            **accesses,
            "exit_initialization_mode": lambda: self.call("ExitInitializationMode"),
            "do_step": lambda: self.call("DoStep", TIME, STEP, 1),
            "_get_fmu_state": lambda: self.call("GetFMUstate", ctypes.byref(state)),
            "_set_fmu_state": lambda: self.call("SetFMUstate", state),
            "_fmu_state_to_bytes": lambda: (
                self.call("SerializedFMUstateSize", state, ctypes.byref(size))
                or self.call("SerializeFMUstate", state, self.bytes, size)
            ),
            "_fmu_state_from_bytes": lambda: self.call("DeSerializeFMUstate", self.bytes, size, ctypes.byref(state)),
            "terminate": lambda: self.call("Terminate"),
        }


def raises(name: str, call: Callable[[], int]) -> None:
    """It does, the host hears of it, and nothing is left that a collection of cycles would stumble over."""
    MESSAGES.clear()
    os.environ["RAISES"] = name
    status = call()
    del os.environ["RAISES"]
    gc.collect()
    check(status == FATAL, f"{name} raised, and the status was {status}")
    check(any(b"py exception" in said for said in MESSAGES), f"{name} raised, and nobody was told")


def works(name: str, call: Callable[[], int]) -> None:
    status = call()
    check(status == OK, f"{name} returned {status} after an exception")


def one_round(slave: Slave, with_reset: bool) -> None:
    raises("__init__", slave.make)
    works("instantiate", slave.make)
    for name, call in slave.calls().items():
        raises(name, call)
        works(name, call)
        slave.call("FreeFMUstate", ctypes.byref(slave.state)) if name == "_fmu_state_from_bytes" else None
    if with_reset:
        raises("__init__", lambda: slave.call("Reset"))
        check(slave.access("Get", "Real") == FATAL, "there was a slave after a reset that made none")
        works("reset", lambda: slave.call("Reset"))
        raises("get_real", lambda: slave.access("Get", "Real"))
        works("reset", lambda: slave.call("Reset"))
        for name, call in slave.calls().items():
            works(name, call)
        raises("__init__", lambda: slave.call("Reset"))
    slave.free()
    gc.collect()


if __name__ == "__main__":
    for number in range(int(sys.argv[2])):
        one_round(Slave(Path(sys.argv[1])), with_reset=number % 2 == 0)
