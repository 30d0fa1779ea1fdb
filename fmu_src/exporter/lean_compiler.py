"""`make run`: the compiler without what only other systems and languages need, which is 40 % of it.

ziglang brings headers and sources of the C libraries of all systems that it knows, and C++. To build and run the FMUs
on this machine, those of its system suffice, and WebAssembly's. `make test` and `make dist`, which build for every
platform, install all of it again; compiler.run_compiler says so where headers are missing.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from .compiler import HEADERS, SYSTEMS, Platform, compiler_library, host_platform

ELSEWHERE = ("libcxx", "libcxxabi", "libtsan", "docs", "init", "build-web")  # C++, sanitizers, zig's own projects
LIBRARIES = {"linux": {"glibc"}, "windows": {"mingw"}, "darwin": {"darwin"}}  # the sources that a system needs
WEB_ASSEMBLY = {"wasi", "musl"}


def superfluous(target: Platform, library: Path) -> list[Path]:
    """The folders of the compiler's library that compiling C for `target` does not read."""
    system = SYSTEMS[target.suffix]
    folders = [library / name for name in ELSEWHERE]
    kept = {"include", *LIBRARIES[system], *WEB_ASSEMBLY}
    folders += [path for path in (library / "libc").iterdir() if path.name not in kept]
    needed, kept = {system, *LIBRARIES[system]}, {HEADERS["wasi"], "generic-musl"}
    folders += [
        path for path in (library / "libc" / "include").iterdir()
        if path.name not in kept and not needed & set(path.name.split("-"))
    ]  # fmt: skip
    return [folder for folder in folders if folder.is_dir()]


if __name__ == "__main__":
    for folder in superfluous(host_platform(), compiler_library()):
        shutil.rmtree(folder)
