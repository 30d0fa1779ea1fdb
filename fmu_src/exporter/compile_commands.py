"""compile_commands.json: how each C file is compiled, for clangd, clang-tidy and editors (`make compile-commands`).

The format is LLVM's JSON compilation database. The headers are those of our compiler and of fmpy, so an editor needs
no compiler and no headers of its own.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from .compiler import (
    ARITHMETIC,
    FMI_HEADERS,
    SOURCE_ROOT,
    WARNINGS,
    WEB_ASSEMBLY,
    WEB_ASSEMBLY_SOURCE,
    CompileError,
    Platform,
    host_platform,
)

PROJECT = SOURCE_ROOT.parent
FOLDERS = ("fmu_src", "scenarios", "tests")
FILE = PROJECT / "compile_commands.json"


def c_files(project: Path = PROJECT) -> list[Path]:
    """The C sources of the project."""
    return sorted(path for folder in FOLDERS for path in (project / folder).rglob("*.c"))


def system_headers(target: Platform) -> list[str]:
    """The folders in which our compiler looks for headers of C and of the system, in its order."""
    command = [sys.executable, "-m", "ziglang", "cc", "-target", target.target, "-E", "-v", "-x", "c", "-"]
    done = subprocess.run(command, input="", cwd=PROJECT, capture_output=True, text=True)
    lines = done.stderr.splitlines()
    try:
        first, last = lines.index("#include <...> search starts here:") + 1, lines.index("End of search list.")
    except ValueError:
        raise CompileError(f"the compiler does not tell its headers:\n{done.stderr.strip()}") from None
    return [str((PROJECT / line.strip()).resolve()) for line in lines[first:last]]


def options_of(target: Platform) -> list[str]:
    """The command line for `target`, without the file."""
    headers = [option for folder in system_headers(target) for option in ("-isystem", folder)]
    triple, _, glibc = target.target.partition("-gnu.2.")
    triple = f"{triple}-gnu" if glibc else triple.replace("wasm32-wasi", "wasm32-wasip1")  # as clang has renamed it
    options = ["clang", "-target", triple, "-nostdinc", *WARNINGS, *ARITHMETIC]
    return [*options, "-I", str(SOURCE_ROOT), "-isystem", str(FMI_HEADERS), *headers]


def compile_commands(target: Platform) -> list[dict[str, object]]:
    """One entry for each C file, as clang takes it."""
    options = dict.fromkeys(c_files(), options_of(target)) | {WEB_ASSEMBLY_SOURCE: options_of(WEB_ASSEMBLY)}
    return [
        {"directory": str(PROJECT), "file": str(path), "arguments": [*before, "-c", str(path)]}
        for path, before in options.items()
    ]


if __name__ == "__main__":
    FILE.write_text(json.dumps(compile_commands(host_platform()), indent=1) + "\n", encoding="utf-8")
    print(FILE)
