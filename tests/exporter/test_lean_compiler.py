"""The compiler of `make run`: smaller, makes the same binary of this machine, and says what it cannot."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fmu_src.exporter import compiler
from fmu_src.exporter.compiler import FMU_SOURCE, PLATFORMS, CompileError, compile_library, host_platform
from fmu_src.exporter.lean_compiler import superfluous

LIBRARY = compiler.compiler_library()


def test_other_systems_and_languages_are_superfluous():
    gone = {name: {p.relative_to(LIBRARY).as_posix() for p in superfluous(t, LIBRARY)} for name, t in PLATFORMS.items()}
    for name, folders in gone.items():
        assert {"libcxx", "libc/include/generic-freebsd"} <= folders, name
        assert not {"libc/wasi", "libc/musl", "libc/include/wasm-wasi-musl", "libc/include/generic-musl"} & folders
        systems = {s for s in ("linux", "windows", "darwin") if f"libc/include/any-{s}-any" not in folders}
        assert systems == {compiler.SYSTEMS[PLATFORMS[name].suffix]}
    assert gone["x86_64-linux"] == gone["aarch64-linux"]


@pytest.fixture(scope="module")
def lean(tmp_path_factory) -> Path:
    """A copy of the compiler, by links, without what is superfluous."""
    package = LIBRARY.parent
    copy = tmp_path_factory.mktemp("lean") / "ziglang"
    gone = set(superfluous(host_platform(), LIBRARY))
    for folder, folders, files in os.walk(package):
        folders[:] = [name for name in folders if Path(folder, name) not in gone]
        target = copy / Path(folder).relative_to(package)
        target.mkdir(parents=True)
        for name in files:
            os.link(Path(folder, name), target / name)
    return copy


def test_the_same_binary_comes_out(lean, tmp_path):
    target = host_platform()
    whole, small = (tmp_path / folder / f"linkage{target.suffix}" for folder in ("whole", "small"))
    compile_library((FMU_SOURCE[2],), whole, target)
    script = (
        "import sys; from pathlib import Path; from fmu_src.exporter import compiler as c; "
        "assert c.compiler_library() == Path(sys.argv[1]) / 'lib', c.compiler_library(); "
        "c.compile_library((c.FMU_SOURCE[2],), Path(sys.argv[2]), c.host_platform())"
    )
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(lean.parent), str(compiler.SOURCE_ROOT.parent)]),
        "ZIG_GLOBAL_CACHE_DIR": str(tmp_path / "cache"),  # nothing that the whole one made helps
    }
    done = subprocess.run(
        [sys.executable, "-c", script, str(lean), str(small)], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert small.read_bytes() == whole.read_bytes()


def test_it_says_what_it_cannot(lean, tmp_path, monkeypatch):
    monkeypatch.setattr(compiler, "compiler_library", lambda: lean / "lib")
    other = next(target for target in PLATFORMS.values() if target.suffix != host_platform().suffix)
    with pytest.raises(CompileError, match=rf"{other.name}: .*for this machine alone: .*make test"):
        compile_library((FMU_SOURCE[2],), tmp_path / f"x{other.suffix}", other)
