"""compile_commands.json: every C file of the product compiles by its entry, with the headers that it names."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_src.exporter.compile_commands import PROJECT, compile_commands
from fmu_src.exporter.compiler import PLATFORMS, host_platform

ENTRIES = {
    Path(str(entry["file"])).relative_to(PROJECT).as_posix(): entry for entry in compile_commands(host_platform())
}


def test_every_c_file_has_one_entry():
    listed = subprocess.run(["git", "ls-files", "*.c"], cwd=PROJECT, capture_output=True, text=True, check=True)
    assert set(listed.stdout.split()) <= set(ENTRIES)
    assert len(ENTRIES) == len(compile_commands(host_platform()))
    json.dumps(ENTRIES)


def compiled(entry: dict, folder: Path) -> subprocess.CompletedProcess[str]:
    """Compile by an entry, its compiler replaced by ours, which takes the same options."""
    options = entry["arguments"]
    assert options[0] == "clang" and options[-1] == entry["file"]
    command = [sys.executable, "-m", "ziglang", "clang", *options[1:], "-o", str(folder / "out.o")]
    return subprocess.run(command, cwd=entry["directory"], capture_output=True, text=True)


@pytest.mark.parametrize("file", [name for name in ENTRIES if name.startswith("fmu_src/")])
def test_it_compiles(file, tmp_path):
    done = compiled(ENTRIES[file], tmp_path)
    assert done.returncode == 0 and (tmp_path / "out.o").is_file(), done.stderr


def test_its_warnings_are_errors(tmp_path):
    source = tmp_path / "wrong.c"
    source.write_text("int twice(double x);\nint twice(double x) { return 2 * x; }\n", encoding="utf-8")
    entry = ENTRIES["fmu_src/linkage/linkage.c"]
    entry = entry | {"file": str(source), "arguments": [*entry["arguments"][:-1], str(source)]}
    done = compiled(entry, tmp_path)
    assert done.returncode != 0 and "implicit conversion turns floating-point number into integer" in done.stderr


def test_headers_are_there_and_of_the_platform():
    for name, platform in PLATFORMS.items():
        options = compile_commands(platform)[0]["arguments"]
        folders = [Path(after) for option, after in itertools.pairwise(options) if option == "-isystem"]
        assert len(folders) >= 3 and all(folder.is_dir() for folder in folders), name
        assert any((folder / "stdint.h").is_file() for folder in folders), name
