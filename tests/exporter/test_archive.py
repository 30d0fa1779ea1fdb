"""The archive: what is in it, and that the same sources give the same bytes, whenever and wherever built."""

from __future__ import annotations

import subprocess
import sys
import time
import zipfile

import pytest

from fmu_src.exporter.archive import write_archive
from fmu_src.exporter.build import build_fmu, carried
from fmu_src.exporter.compiler import host_platform
from fmu_src.exporter.model_description import FMI3, NATIVE, model_description_xml
from fmu_src.exporter.sources import source_content
from tests.conftest import PROJECT_ROOT


@pytest.mark.parametrize(("version", "edition"), [(2, NATIVE), (3, FMI3)])
def test_contents(fmu_files, interface, version, edition):
    """FMI 2.0.4, section 2.3: description, a binary, what comes with them; nothing of this machine."""
    with zipfile.ZipFile(fmu_files[version]) as archive:
        names = archive.namelist()
        binaries = [name for name in names if name.startswith("binaries/")]
        platform = host_platform()
        folder = platform.folder if version == 2 else platform.other_folder
        assert f"binaries/{folder}/{interface.model.name}{platform.suffix}" in binaries
        mingw = {"documentation/licenses/mingw-w64.txt"} if any(name.endswith(".dll") for name in binaries) else set()
        assert set(names) == {*carried(interface, edition), *source_content(interface, version), *binaries, *mingw}
        assert archive.read("modelDescription.xml") == model_description_xml(interface, edition), (
            "built from another interface.toml"
        )
        assert archive.read("documentation/licenses/license.txt") == (PROJECT_ROOT / "LICENSE").read_bytes()
        assert archive.testzip() is None
        for name in names:
            assert str(PROJECT_ROOT).encode() not in archive.read(name), f"{name} holds a path of this machine"


def test_the_description_comes_first_and_all_has_one_time(fmu_file):
    with zipfile.ZipFile(fmu_file) as archive:
        entries = archive.infolist()
    assert entries[0].filename == "modelDescription.xml"
    assert [entry.filename for entry in entries[1:]] == sorted(entry.filename for entry in entries[1:])
    assert {entry.date_time for entry in entries} == {(1980, 1, 1, 0, 0, 0)}
    for entry in entries:
        may_run = entry.external_attr >> 16 & 0o111
        assert bool(may_run) == entry.filename.startswith("binaries/")


def test_write_archive_knows_neither_clock_nor_order(tmp_path, monkeypatch):
    content = {"binaries/x.so": b"1" * 1000, "modelDescription.xml": b"<x/>", "a.txt": b"2"}
    write_archive(tmp_path / "first.fmu", content)
    monkeypatch.setattr(time, "time", lambda: 2e9)
    write_archive(tmp_path / "folder" / "second.fmu", dict(reversed(content.items())))
    first, second = (tmp_path / "first.fmu").read_bytes(), (tmp_path / "folder" / "second.fmu").read_bytes()
    assert first == second
    assert sorted(path.name for path in tmp_path.rglob("*.*")) == ["first.fmu", "second.fmu"], "nothing left over"


def test_an_archive_that_fails_leaves_the_old_one(tmp_path):
    """Written beside it, then put in its place."""
    path = tmp_path / "a.fmu"
    write_archive(path, {"a": b"old"})
    before = path.read_bytes()
    with pytest.raises(TypeError):
        write_archive(path, {"a": b"new", "b": None})
    assert path.read_bytes() == before


def test_the_same_bytes_from_another_folder(fmu_file, project_copy, tmp_path):
    """The sources copied elsewhere, with other file times, built from another working directory."""
    script = (
        "import sys; from pathlib import Path; sys.path.insert(0, sys.argv[1]); from fmu_src.exporter import build;"
        "assert build.compiler.SOURCE_ROOT.parent == Path(sys.argv[1]).resolve();"
        "build.build_fmu(2, Path('out'), [build.compiler.host_platform()])"
    )
    done = subprocess.run([sys.executable, "-c", script, project_copy], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    built = tmp_path / "out" / "fmi2" / fmu_file.name
    again = build_fmu(2, tmp_path / "again", [host_platform()])
    assert built.read_bytes() == again.read_bytes()

    with zipfile.ZipFile(built) as new, zipfile.ZipFile(fmu_file) as old:
        for name in new.namelist():
            assert new.read(name) == old.read(name), f"{name}: build/ is older than the sources: run make build"
