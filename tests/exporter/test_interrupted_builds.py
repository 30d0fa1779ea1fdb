"""Builds that meet one another, a full disk or an early end: each file is whole or as it was, nothing is left."""

from __future__ import annotations

import errno
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from fmu_src import cli
from fmu_src.exporter.archive import put_in_place, write_archive
from tests.conftest import PROJECT_ROOT

CONTENT = {"modelDescription.xml": b"<x/>", "a": b"1" * 1000, "b": b"2" * 1000}


class Meeting(dict):
    """Content; when its entry "b" is read, another writer writes to the same place, from begin to end."""

    def __init__(self, path: Path, depth: int) -> None:
        super().__init__(CONTENT)
        self.path, self.depth = path, depth

    def __getitem__(self, name: str) -> bytes:
        if name == "b" and self.depth:
            write_archive(self.path, Meeting(self.path, self.depth - 1))
        return super().__getitem__(name)


def names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def test_writers_that_meet(tmp_path):
    path = tmp_path / "one.fmu"
    write_archive(path, Meeting(path, 3))
    write_archive(tmp_path / "other.fmu", CONTENT)
    assert path.read_bytes() == (tmp_path / "other.fmu").read_bytes()
    assert names(tmp_path) == ["one.fmu", "other.fmu"]


def test_two_builds_into_one_folder(tmp_path):
    """The command, twice at once: both end well, and what lies there is what one makes."""
    command = [Path(sys.executable).with_name("linkage-fmu"), "build", "--output", "out"]
    both = [subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(2)]
    for process in both:
        _, said = process.communicate(timeout=600)
        assert process.returncode == 0, said.decode()
    assert cli.main(["build", "--output", str(tmp_path / "alone")]) == 0
    assert names(tmp_path / "out") == names(tmp_path / "alone")
    for name in names(tmp_path / "alone"):
        if (tmp_path / "alone" / name).is_file():
            assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes(), name


@pytest.mark.parametrize("problem", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("is_there", [False, True])
def test_nothing_is_left_of_what_failed(tmp_path, monkeypatch, is_there, problem):
    path = tmp_path / "folder" / "a.fmu"
    if is_there:
        write_archive(path, {"a": b"old"})
    before, writes = path.read_bytes() if is_there else None, []
    write = zipfile.ZipFile.writestr

    def fail(archive, entry, data, *rest):
        writes.append(entry.filename)
        if len(writes) == 2:
            raise problem
        write(archive, entry, data, *rest)

    monkeypatch.setattr(zipfile.ZipFile, "writestr", fail)
    with pytest.raises(type(problem)) as raised:
        write_archive(path, CONTENT)
    assert isinstance(problem, KeyboardInterrupt) or raised.value.filename == str(path)
    assert len(writes) == 2 and names(path.parent) == (["a.fmu"] if is_there else [])
    assert not is_there or path.read_bytes() == before


def test_the_command_on_a_full_disk(tmp_path, monkeypatch, capsys):
    """It says which file, and leaves none behind."""
    full = OSError(errno.ENOSPC, "No space left on device")

    def fail(*_):
        raise full

    monkeypatch.setattr(zipfile.ZipFile, "writestr", fail)
    assert cli.main(["build", "--output", str(tmp_path)]) == 1
    said = capsys.readouterr().err
    assert "No space left on device" in said and "TransplanterLinkage.fmu" in said
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit to the size of files")
def test_a_file_that_cannot_grow(tmp_path):
    """By the system itself, which ends a write in the middle: a limit to the size of files stands for the disk's."""
    script = (
        "import os, pathlib, resource; from fmu_src.exporter.archive import write_archive;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000));"
        "write_archive(pathlib.Path('new') / 'a.fmu', {str(i): os.urandom(20_000) for i in range(10)})"
    )
    command, environment = [sys.executable, "-c", script], {"PYTHONPATH": str(PROJECT_ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "File too large" in done.stderr and "a.fmu" in done.stderr
    assert names(tmp_path) == ["new"]


def test_the_place_is_as_the_user_wants_files(tmp_path):
    """Not only its owner's, as temporary files are."""
    (tmp_path / "plain").write_text("")
    with put_in_place(tmp_path / "made") as unfinished:
        unfinished.write_text("")
    assert (tmp_path / "made").stat().st_mode == (tmp_path / "plain").stat().st_mode
