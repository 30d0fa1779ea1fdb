"""PythonFMU's library, 0.6.5 to 0.7.0: by what it is known, and by what its two faults are seen.

At exit, on Linux: the library's last destructor, DESTRUCTOR, calls FINALIZER, which counts down a reference in memory
that was given back before. After an exception of the slave, everywhere: PySlaveInstance::handle_py_exception gives back
the references to class, slave and log and keeps the pointers, and so does Reset where the slave's __init__ raises.

documentation/python_fmus.md has the whole story, exporter/python_fmu.py the cure. Machine code (x86-64) is written in
hexadecimal digits: ?? is any byte, ss the place of a pointer in the object.
"""

from __future__ import annotations

import re

DESTRUCTOR = "_ZN12_GLOBAL__N_115onLibraryUnloadEv"  # (anonymous namespace)::onLibraryUnload()
FINALIZER = "finalizePythonInterpreter"
VERSIONS = "0.6.5 to 0.7.0"

# Count a reference down, unless it is null or immortal, and go elsewhere where none is left: compilers' two ways.
_DOWN = (
    "48 85 ff 74 11 8b 07 85 c0 78 0b 83 e8 01 89 07 0f 84 ?? ?? ?? ??",  # 0.7.0
    "48 85 ff 74 14 48 8b 07 85 c0 78 0d 48 83 e8 01 48 89 07 0f 84 ?? ?? ?? ??",
)
_ARGUMENTS = "48 8d 74 24 ?? 48 8d 54 24 ?? 48 8d 7c 24 ??"  # of PyErr_Fetch

# In handle_py_exception on Linux: three references are counted down. Mended: each passes for immortal, js made jmp.
GIVE_BACK = {
    before: before.replace(" 78 ", " eb ")
    for before in (
        " ".join(f"{load} {down}" for _ in range(3)) + f" {_ARGUMENTS}"
        for load, down in (
            ("49 8b 7d ??", _DOWN[0]),  # 0.7.0
            ("49 8b 7d ??", _DOWN[1]),  # 0.6.7 to 0.6.9
            ("49 8b 7c 24 ??", _DOWN[1]),
        )
    )
}

# In PySlaveInstance::initialize, which Reset calls: the reference to the log is counted down, then the slave is made
# (PyTuple_New for its arguments). Mended: the pointer is exchanged for null first.
FORGET_ON_LINUX = {
    f"48 8b 7b ss {_DOWN[0]} 31 ff e8": "31 ff 48 87 7b ss 48 85 ff 74 0f 8b 07 85 c0 78 09 83 2f 01 "
    "0f 84 ?? ?? ?? ?? 31 ff e8",  # 0.7.0
    f"48 8b 7b ss {_DOWN[1]} 31 ff e8": "31 ff 48 87 7b ss 48 85 ff 74 12 8b 07 85 c0 78 0c 48 83 2f 01 66 90 "
    "0f 84 ?? ?? ?? ?? 31 ff e8",
}
FORGET_ON_WINDOWS = {
    "48 8b 4b ss 48 85 c9 74 13 8b 01 85 c0 78 0d 83 e8 01 89 01 75 06 ff 15 ?? ?? ?? ?? 33 c9 ff 15": "31 c9 "
    "48 87 4b ss 48 85 c9 74 11 8b 01 85 c0 78 0b 83 29 01 75 06 ff 15 ?? ?? ?? ?? 33 c9 ff 15",  # 0.7.0
    "48 8b 4b ss 48 85 c9 74 11 83 39 00 7c 0c 48 83 29 01 75 06 ff 15 ?? ?? ?? ?? 33 c9 ff 15": "31 c9 "
    "48 87 4b ss 48 85 c9 74 0f 83 39 00 7c 0a ff 09 75 06 ff 15 ?? ?? ?? ?? 33 c9 ff 15",
}


def pattern(code: str) -> re.Pattern[bytes]:
    """Finds machine code; the group is the pointer's place."""
    wild = {"??": b".", "ss": b"(.)"}
    return re.compile(b"".join(wild.get(byte) or re.escape(bytes.fromhex(byte)) for byte in code.split()), re.DOTALL)


def keeps_what_it_gave_back(library: bytes) -> bool:
    """Whether PythonFMU's library touches freed objects after an exception of the slave."""
    return any(pattern(code).search(library) for code in (*GIVE_BACK, *FORGET_ON_WINDOWS))
