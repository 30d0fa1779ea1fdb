"""PythonFMU's library for Linux, 0.6.5 to 0.7.0: by what it is known, and that it corrupts the heap at exit.

The library's last destructor, DESTRUCTOR, calls FINALIZER, which counts down a reference in memory that was given back
before. documentation/python_fmus.md has the whole story, exporter/python_fmu.py the cure.
"""

DESTRUCTOR = "_ZN12_GLOBAL__N_115onLibraryUnloadEv"  # (anonymous namespace)::onLibraryUnload()
FINALIZER = "finalizePythonInterpreter"
VERSIONS = "0.6.5 to 0.7.0"
