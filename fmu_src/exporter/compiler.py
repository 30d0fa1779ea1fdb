"""The C sources compiled into the shared library of an FMU, for any platform from any other.

The compiler is `ziglang` from PyPI: clang with the libraries of each platform. Nothing that is
built is run here.
"""

from __future__ import annotations

import platform
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import fmpy

from ..formats import ls_wasm

SOURCE_ROOT = Path(__file__).resolve().parent.parent
FMI_HEADERS = Path(fmpy.__file__).parent / "c-code"

LINKAGE_SOURCES = tuple(sorted((SOURCE_ROOT / "linkage").glob("*.c")))
COMPONENT_SOURCES = tuple(sorted((SOURCE_ROOT / "component").glob("*.c")))
FMU_SOURCE = {version: SOURCE_ROOT / "fmi" / f"fmi{version}_fmu.c" for version in (2, 3)}  # includes all the others

WEB_ASSEMBLY_SOURCE = SOURCE_ROOT / "fmi" / "web_assembly.c"  # besides, for WebAssembly alone

# C99 and the strictest common warnings; no warning passes.
WARNINGS = (
    "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Wundef",
    "-Wstrict-prototypes", "-Wmissing-prototypes", "-Werror",
)  # fmt: skip
# IEEE arithmetic as written, so that every platform rounds alike: no fused multiply-add, no
# reassociation. errno is not read, which lets sqrt be one instruction and sin, cos one call.
# Loops run over a handful of values: vectorizing and unrolling them costs more than it saves, and
# pairs that were stored one by one are slow to load as vectors.
ARITHMETIC = (
    "-O2", "-ffp-contract=off", "-fno-math-errno", "-fno-vectorize", "-fno-slp-vectorize", "-fno-unroll-loops",
    "-fomit-frame-pointer", "-fno-sanitize=all",
)  # fmt: skip


class CompileError(RuntimeError):
    """The compiler refused; the message is what it said."""


@dataclass(frozen=True)
class Platform:
    """A platform as FMI and the compiler know it.

    folder: its name in FMI 2.0, which knows one processor family a system (FMI 2.0.4, section 2.3);
    other_folder: its name in FMI 3.0 (section 2.5.1), and in FMI 2.0 where that one is taken.
    """

    name: str
    folder: str
    other_folder: str
    target: str
    suffix: str


PLATFORMS = {
    p.name: p
    for p in (
        # glibc 2.17 of 2012: every Linux that a simulation host still runs on
        Platform("x86_64-linux", "linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so"),
        Platform("aarch64-linux", "linux64", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        Platform("x86_64-windows", "win64", "x86_64-windows", "x86_64-windows-gnu", ".dll"),
        Platform("x86_64-macos", "darwin64", "x86_64-darwin", "x86_64-macos.11.0", ".dylib"),
        Platform("aarch64-macos", "darwin64", "aarch64-darwin", "aarch64-macos.11.0", ".dylib"),
    )
}


# No shared library: one module of 32-bit addresses for any machine, called by what runs it, in a page or elsewhere.
WEB_ASSEMBLY = Platform(ls_wasm.FOLDER, ls_wasm.FOLDER, ls_wasm.FOLDER, "wasm32-wasi", ls_wasm.SUFFIX)
MODULE_STACK = 1 << 20  # bytes; the compiler's own 16 MiB would be each module's least memory

# By the suffix of their libraries, the system and the headers that only the compiler for it has.
SYSTEMS = {".so": "linux", ".dll": "windows", ".dylib": "darwin", ".wasm": "wasi"}
HEADERS = {"linux": "any-linux-any", "windows": "any-windows-any", "darwin": "any-darwin-any", "wasi": "wasm-wasi-musl"}


def compiler_library() -> Path:
    """Where the compiler has the headers and sources of the C libraries."""
    import ziglang

    return Path(ziglang.__file__).parent / "lib"


def host_platform() -> Platform:
    """The platform that this Python runs on; raises CompileError where it is none of PLATFORMS."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    system = {"darwin": "macos"}.get(platform.system().lower(), platform.system().lower())
    name = f"{machine}-{system}"
    if name not in PLATFORMS:
        raise CompileError(f"this machine is {name}; FMUs are built for {', '.join(PLATFORMS)}")
    return PLATFORMS[name]


def compile_library(sources: tuple[Path, ...], library: Path, target: Platform, *options: str) -> None:
    """Compile C sources into a shared library that shows only what is marked as exported."""
    library.parent.mkdir(parents=True, exist_ok=True)
    by_system = {
        ".so": ("-fPIC",),
        ".dll": (),
        # else the library would carry the path that it was written to
        ".dylib": ("-fPIC", f"-Wl,-install_name,@rpath/{library.name}"),
    }
    run_compiler(
        target, "-shared", *by_system[target.suffix], "-fvisibility=hidden", "-s",
        *options, "-o", str(library), *map(str, sources),
    )  # fmt: skip


def compile_module(sources: tuple[Path, ...], module: Path, exports: Iterable[str], *options: str) -> None:
    """Compile C sources into a WebAssembly module, to be called and not to be run (a reactor).

    It exports its memory, the functions named, those of the C library too (malloc, free), and `_initialize`, to be
    called first; it imports what the sources declare as imported, nothing else. The same sources give the same bytes.
    """
    module.parent.mkdir(parents=True, exist_ok=True)
    run_compiler(
        WEB_ASSEMBLY, "-mexec-model=reactor", "-fvisibility=hidden", "-s", f"-Wl,-z,stack-size={MODULE_STACK}",
        *(f"-Wl,--export={name}" for name in exports), *options, "-o", str(module), *map(str, sources),
    )  # fmt: skip


def compile_program(sources: tuple[Path, ...], program: Path, target: Platform, *options: str) -> None:
    """Compile C sources into a program, for tests and benchmarks."""
    program.parent.mkdir(parents=True, exist_ok=True)
    run_compiler(target, *options, "-o", str(program), *map(str, sources))


def mingw_license() -> bytes:
    """Of the start-up code that each Windows library carries along."""
    return (compiler_library() / "libc" / "mingw" / "COPYING").read_bytes()


def run_compiler(target: Platform, *options: str) -> None:
    """Run it with the options of this project besides; raises CompileError with what it said where it refuses."""
    if not (compiler_library() / "libc" / "include" / HEADERS[SYSTEMS[target.suffix]]).is_dir():
        raise CompileError(
            f"{target.name}: the compiler that `make run` installs is for this machine alone: "
            "`make test` and `make dist` install the whole one, as does pip install --force-reinstall ziglang"
        )
    libraries = () if target.suffix == ".dll" else ("-lm",)
    command = [
        sys.executable, "-m", "ziglang", "cc", "-target", target.target, *WARNINGS, *ARITHMETIC,
        "-I", str(SOURCE_ROOT), "-isystem", str(FMI_HEADERS), *options, *libraries,
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise CompileError(f"{target.name}:\n{done.stderr.strip()}")
