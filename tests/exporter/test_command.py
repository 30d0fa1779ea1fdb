"""linkage-fmu on the command line: what it does, and what it says where it cannot."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from fmu_src import cli
from fmu_src.cli import main
from fmu_src.exporter.compiler import CompileError, host_platform


def linkage_fmu(*arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """The installed command in a process of its own."""
    command = [Path(sys.executable).with_name("linkage-fmu"), *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_build(tmp_path):
    """All that a user needs, in the folder named; nothing beside it."""
    done = linkage_fmu("build", "--output", "out put", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    built = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert built >= {"out put/fmi2/TransplanterLinkage.fmu", "out put/fmi2/one_turn.csv"}
    assert all(path.startswith("out put/") for path in built)
    for path in built:
        assert path.rpartition("/")[2] in done.stdout.replace("\n", "")
    assert host_platform().name in done.stdout


def test_info(fmu_file, capsys):
    assert main(["info", str(fmu_file)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for word in ("TransplanterLinkage", "FMI 2.0", "crank.at_step_end", "geometry.theta9", host_platform().folder):
        assert word in said


def test_info_of_fmi3(fmu_files, capsys):
    """What each interface type offers."""
    assert main(["info", str(fmu_files[3])]) == 0
    said = " ".join(capsys.readouterr().out.split())
    for word in ("FMI 3.0", "Model Exchange: states", "event mode", "intermediate update", "adjoint", "der(machine.s)"):
        assert word in said
    assert host_platform().other_folder in said
    assert said.count("directional derivatives") == 2  # of both interface types, as the description declares


def test_validate(fmu_file, capsys):
    """More in test_validation.py."""
    assert main(["validate", str(fmu_file)]) == 0
    assert "0 failed" not in (said := capsys.readouterr().out) and "passed" in said and "failed" not in said


def test_generate_check(capsys):
    assert main(["generate", "--check"]) == 0
    assert capsys.readouterr().out == ""


# ---- where it cannot -----------------------------------------------------------------------------


def test_unknown_platform(tmp_path):
    done = linkage_fmu("build", "--platform", "sparc-solaris", folder=tmp_path)
    assert done.returncode == 2
    assert "sparc-solaris" in done.stderr and "x86_64-linux" in done.stderr
    assert "Traceback" not in done.stderr and list(tmp_path.iterdir()) == []


def test_no_command(tmp_path):
    done = linkage_fmu(folder=tmp_path)
    assert done.returncode == 2 and "usage" in done.stderr and "Traceback" not in done.stderr


def broken(kind: str, folder: Path, fmu_file: Path) -> Path:
    """A file that is no FMU."""
    path = folder / f"{kind}.fmu"
    if kind == "no zip":
        path.write_bytes(b"not a zip file at all")
    elif kind == "cut off":
        path.write_bytes(fmu_file.read_bytes()[:5000])
    elif kind == "empty":
        path.write_bytes(b"")
    elif kind == "no description":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("binaries/linux64/x.so", b"")
    elif kind == "no XML":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", "<fmiModelDescription fmiVersion='2.0'")
    elif kind == "folder":
        path.mkdir()
    return path


@pytest.mark.parametrize("command", ["info", "validate"])
@pytest.mark.parametrize("kind", ["missing", "no zip", "cut off", "empty", "no description", "no XML", "folder"])
def test_no_fmu(tmp_path, fmu_file, capsys, kind, command):
    """A message with the file's name, status 1, and 2 where validate finds nothing to judge; no traceback, which main()
    would let through as an exception.
    """
    path = broken(kind, tmp_path, fmu_file)
    assert main([command, str(path)]) == (2 if command == "validate" and kind in ("missing", "folder") else 1)
    captured = capsys.readouterr()
    said = (captured.out + captured.err).replace("\n", "")
    assert path.name in said and (command == "info" or kind in ("missing", "folder") or "failed" in said)


def test_validate_goes_on(tmp_path, fmu_file, capsys):
    """What fmpy finds in a bad description, a file that is not there, and a good FMU after them."""
    bad = tmp_path / "bad.fmu"
    with zipfile.ZipFile(fmu_file) as old, zipfile.ZipFile(bad, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b'unit="rad"', b'unit="furlong"', 1))
    assert main(["validate", str(bad), str(tmp_path / "none.fmu"), str(fmu_file)]) == 2
    captured = capsys.readouterr()
    assert "furlong" in captured.out and "none.fmu" in captured.err
    assert captured.out.index("failed") < captured.out.index(fmu_file.name)


def test_output_that_is_a_file(tmp_path, capsys):
    (tmp_path / "taken").write_text("a file")
    assert main(["build", "--output", str(tmp_path / "taken")]) == 1
    assert "taken" in capsys.readouterr().err


def test_what_the_compiler_says_is_passed_on(monkeypatch, capsys):
    def fails(*_):
        raise CompileError("x86_64-linux:\nlinkage.c:1:1: error: expected ';'")

    monkeypatch.setattr(cli, "build_fmu", fails)
    assert main(["build"]) == 1
    assert "linkage.c:1:1" in capsys.readouterr().err
