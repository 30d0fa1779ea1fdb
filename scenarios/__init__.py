"""What a user would run. At its end, a process of the scenarios lets go of PythonFMU slaves that others built."""

from __future__ import annotations

import atexit
import ctypes
import sys


class _Loaded(ctypes.Structure):
    """The begin of struct dl_phdr_info of link.h."""

    _fields_ = [("address", ctypes.c_void_p), ("name", ctypes.c_char_p)]


_VISIT = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(_Loaded), ctypes.c_size_t, ctypes.c_void_p)
_ONLY_IF_LOADED = 4  # RTLD_NOLOAD of Linux


@atexit.register
def let_go_of_python_fmus() -> None:
    """Have PythonFMU's libraries destroy their state now, as they offer, in case it is one of 0.6.5 to 0.7.0.

    Of these the state is else destroyed twice, by exit() and by their own destructor after it, and the process may
    abort with a corrupt heap. Both then find nothing left to destroy. All other endings are as ever, and so is the
    exit status. Linux alone has the fault.
    """
    if sys.platform != "linux":
        return
    names: list[bytes] = []
    visit = _VISIT(lambda library, *_: names.append(library.contents.name or b"") or 0)
    ctypes.CDLL(None).dl_iterate_phdr(visit, None)
    for name in filter(None, names):
        try:
            library = ctypes.CDLL(name.decode("utf-8", "surrogateescape"), mode=_ONLY_IF_LOADED)
        except OSError:  # not of a file, as linux-vdso.so.1
            continue
        if hasattr(library, "finalizePythonInterpreter"):
            library.finalizePythonInterpreter()
