"""A process that had the twin or a partner in it leaves its heap alone when it ends."""

from __future__ import annotations

import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest

from fmu_src.cli import main
from fmu_src.exporter.build import build_twin
from fmu_src.exporter.compiler import compile_library, host_platform
from fmu_src.exporter.python_fmu import PythonFmuError, mend_fmu, mended, mended_library
from fmu_src.validation.process import PROBE
from fmu_src.validation.subject import Options
from fmu_src.validation.table import NAMES_OF_LIVE, PASSED, WARNED, validate
from tests.soak import heap_at_exit
from tests.soak.heap_at_exit import PARTNERS, TWIN, own_library, processes, run, unmended, unmended_system

SOAK = Path(heap_at_exit.__file__).parent
linux = pytest.mark.skipif(
    host_platform().name != "x86_64-linux", reason="the fault is in PythonFMU's library for Linux on x86_64 alone"
)
SHIPPED = pytest.mark.parametrize("fmu", [TWIN, *PARTNERS], ids=lambda fmu: fmu.stem)


def content(fmu: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def library_of(fmu: Path, suffix: str = ".so") -> bytes:
    (library,) = (data for name, data in content(fmu).items() if name.endswith(suffix))
    return library


@pytest.fixture(scope="module")
def original() -> bytes:
    """PythonFMU's own library."""
    return own_library(".so")


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The twin with it."""
    return unmended(TWIN, tmp_path_factory.mktemp("faulty"))


@pytest.fixture(scope="module")
def freed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """An environment in which touching what C++ gave back ends the process at once: freed.c."""
    library = tmp_path_factory.mktemp("freed") / "freed.so"
    compile_library((SOAK / "freed.c",), library, host_platform())
    return {"LD_PRELOAD": str(library)}


# ---- what ships ----------------------------------------------------------------------------------


@SHIPPED
def test_what_ships_is_mended(fmu: Path, original: bytes):
    """1 byte differs for the exit; for exceptions 23 on Linux, 21 on Windows."""
    for own, bytes_changed in ((original, 24), (own_library(".dll"), 21)):
        suffix = ".so" if own is original else ".dll"
        shipped = library_of(fmu, suffix)
        assert shipped == mended_library(own, "its own")
        assert sum(a != b for a, b in zip(shipped, own, strict=True)) == bytes_changed
    assert mended(content(fmu)) == {}


@linux
@pytest.mark.parametrize("title", processes())
def test_each_process_ends_well(title: str, freed: dict[str, str], tmp_path: Path):
    done = run(processes()[title], tmp_path, **freed)
    assert done.returncode == 0, done.stderr


@linux
def test_with_pythonfmus_own_library_it_does_not(faulty: Path, freed: dict[str, str], tmp_path: Path):
    """Else the test above could not fail."""
    done = run(processes(faulty)["the twin in fmpy"], tmp_path, **freed)
    assert done.returncode == -signal.SIGSEGV, done.stderr


def test_the_validator_tells_them_apart(faulty: Path):
    """What ships is silent, PythonFMU's own library is named with the cure; nothing of it is run."""
    skip = frozenset(NAMES_OF_LIVE)
    for fmu, outcome in ((TWIN, PASSED), (faulty, WARNED)):
        found = {each.title: each for each in validate(fmu, Options(skip=skip)) if each.title.startswith("heap-")}
        assert {each.outcome for each in found.values()} == {outcome}
    (at_exit,), after_error = found["heap-at-exit"].advice, found["heap-after-error"].advice
    assert "linux64" in at_exit and "linkage-fmu mend" in at_exit
    assert [place in line for place, line in zip(("linux64", "win64"), after_error, strict=True)] == [True, True]
    assert all("linkage-fmu mend" in line for line in after_error)


def under_valgrind(fmus: list[Path], folder: Path) -> str:
    """What valgrind says of a process that loads, steps and frees them, start-up of the interpreter aside."""
    for fmu in fmus:
        fmpy.extract(str(fmu), str(folder / fmu.stem))
    log = folder / "valgrind.log"
    command = [
        "valgrind", "--undef-value-errors=no", f"--suppressions={SOAK / 'interpreter.supp'}", f"--log-file={log}",
        "--error-exitcode=99", sys.executable, "-B", str(SOAK / "slaves.py"), *(str(folder / f.stem) for f in fmus),
    ]  # fmt: skip
    done = run(command, folder, PYTHONMALLOC="malloc")  # each object its own block
    assert done.returncode in (0, 99), done.stderr
    return log.read_text()


valgrind = pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")


@linux
@valgrind
def test_valgrind_finds_no_invalid_access(tmp_path: Path):
    said = under_valgrind([TWIN, *PARTNERS], tmp_path)
    assert "ERROR SUMMARY: 0 errors" in said, said


@linux
@valgrind
def test_valgrind_finds_that_of_pythonfmus_own_library(tmp_path: Path, faulty: Path):
    said = under_valgrind([faulty], tmp_path)
    assert "finalizePythonInterpreter" in said and "inside a block of size 128 free'd" in said


# ---- slaves that others built --------------------------------------------------------------------


@linux
def test_a_scene_lets_go_of_a_faulty_partner(freed: dict[str, str], tmp_path: Path):
    done = run(processes(system=unmended_system(tmp_path))["a short row"], tmp_path, **freed)
    assert done.returncode == 0, done.stderr


@linux
def test_the_validators_process_ends_well(faulty: Path, freed: dict[str, str], tmp_path: Path):
    folder = fmpy.extract(str(faulty), str(tmp_path / "fmu"))
    job = {"number": 1, "do": "instance", "folder": str(folder), "kind": "CoSimulation", "limit": 60}
    done = subprocess.run(
        [sys.executable, str(PROBE), str(tmp_path / "trace")], input=json.dumps(job) + "\n",
        env=os.environ | freed, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0 and '"answer"' in done.stdout, done.stdout + done.stderr


def test_mend_command(
    faulty: Path, original: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str], fmu_file: Path
):
    """In place; all else keeps its bytes, times and order; the same again from the same; once is enough."""
    copies = [tmp_path / name for name in ("one.fmu", "two.fmu")]
    for copy in copies:
        shutil.copy(faulty, copy)
    native, missing = tmp_path / "native.fmu", tmp_path / "none.fmu"
    shutil.copy(fmu_file, native)
    assert main(["mend", *map(str, (native, missing, *copies))]) == 1
    said = capsys.readouterr()
    assert "native.fmu" in said.err and "finalizePythonInterpreter" in said.err and "none.fmu" in said.err
    assert said.out.count("mended binaries/linux64/") == 2
    assert native.read_bytes() == fmu_file.read_bytes()
    assert copies[0].read_bytes() == copies[1].read_bytes()
    with zipfile.ZipFile(faulty) as old, zipfile.ZipFile(copies[0]) as new:
        assert [(e.filename, e.date_time, e.external_attr) for e in old.infolist()] == [
            (e.filename, e.date_time, e.external_attr) for e in new.infolist()
        ]
    before, after = content(faulty), content(copies[0])
    libraries = {
        f"binaries/{place}/TransplanterLinkageTwin.{end}" for place, end in (("linux64", "so"), ("win64", "dll"))
    }
    assert {name for name in before if before[name] != after[name]} == libraries
    assert library_of(copies[0]) == mended_library(original, "its own")
    time = copies[0].stat().st_mtime_ns
    assert main(["mend", str(copies[0])]) == 0 and "was mended before" in capsys.readouterr().out
    assert copies[0].stat().st_mtime_ns == time and not list(tmp_path.glob("*.part"))


# ---- libraries that nobody has looked at ---------------------------------------------------------


def changed(library: bytes, what: str) -> bytes:
    """PythonFMU's library as another version of it might be."""
    array = struct.pack("<qQqQ", 26, 0x44250, 28, 16)  # DT_FINI_ARRAY, DT_FINI_ARRAYSZ
    old, new = {
        "another name": (b"_ZN12_GLOBAL__N_115onLibraryUnloadEv", b"_ZN12_GLOBAL__N_115onLibraryClosedEv"),
        "no finalizer": (b"finalizePythonInterpreter", b"finalizePythonInterpretor"),
        "another code": (bytes.fromhex("f30f1efae937dcffff"), bytes.fromhex("f30f1efae837dcffff")),
        "more destructors": (array, array[:24] + struct.pack("<Q", 24)),
        "other destructors": (array, array[:8] + struct.pack("<Q", 0x44248) + array[16:]),
        "no destructors": (array[16:24], struct.pack("<q", 0x6FFFFEF5 + 10)),
        # three references are counted down, the first unless it is immortal
        "another handler": (
            bytes.fromhex("498b7d684885ff74118b0785c0780b"),
            bytes.fromhex("498b7d684885ff74118b0785c0790b"),
        ),
        "no handler": (b"19handle_py_exceptionE", b"19handle_py_exceptiomE"),
        # before the slave's arguments are made (xor edi, edi), also where an instance is made
        "another reset": (bytes.fromhex("83e80189070f848801000031ff"), bytes.fromhex("83e80289070f848801000031ff")),
    }[what]
    assert library.count(old) >= 1
    return library.replace(old, new)


CHANGES = {
    "another name": "it has no destructor onLibraryUnload",
    "no finalizer": "it exports no finalizePythonInterpreter",
    "another code": "onLibraryUnload does more than to jump to finalizePythonInterpreter",
    "more destructors": "onLibraryUnload is not the last of two destructors",
    "other destructors": "onLibraryUnload is not the last of two destructors",
    "no destructors": "it has no destructor onLibraryUnload",
    "another handler": "handle_py_exception gives back something else",
    "no handler": "handle_py_exception gives back something else",
    "another reset": "a reset gives back something else",
}
WINDOWS = {
    "no finalizer": (b"finalizePythonInterpreter", b"finalizePythonInterpretor", "it exports no finalizePython"),
    "no handler": (
        b"?handle_py_exception@PySlaveInstance", b"?handle_py_exceptiom@PySlaveInstance",
        "it exports no single PySlaveInstance::handle_py_exception",
    ),
    "another handler": (
        bytes.fromhex("488bcbe8fce4ffff"), bytes.fromhex("488bcae8fce4ffff"),
        "handle_py_exception gives back something else",
    ),
    "another call": (
        bytes.fromhex("488bcbe8fce4ffff"), bytes.fromhex("488bcbe8fde4ffff"),
        "handle_py_exception calls something else than cleanPyObject",
    ),
    "another reset": (
        bytes.fromhex("83e801890175 06ff15dd4f0000 33c9"), bytes.fromhex("83e802890175 06ff15dd4f0000 33c9"),
        "a reset gives back something else",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("what", "said"), CHANGES.items())
def test_an_unknown_library_is_refused(what: str, said: str, original: bytes):
    with pytest.raises(PythonFmuError, match=f"^lib.so: not PythonFMU's library of 0.6.5 to 0.7.0: {said}"):
        mended_library(changed(original, what), "lib.so")


@pytest.mark.parametrize(("old", "new", "said"), WINDOWS.values(), ids=WINDOWS)
def test_an_unknown_library_for_windows_is_refused(old: bytes, new: bytes, said: str):
    library = own_library(".dll")
    assert library.count(old) == 1
    with pytest.raises(PythonFmuError, match=f"^lib.dll: not PythonFMU's library of 0.6.5 to 0.7.0: {said}"):
        mended_library(library.replace(old, new), "lib.dll")


@pytest.mark.parametrize(
    ("library", "said"),
    [
        (b"\x7fELF" + bytes(100), "it exports no finalizePythonInterpreter"),
        (b"\xcf\xfa\xed\xfe" + bytes(100), "neither a library for Linux nor for Windows"),
        (b"", "neither a library for Linux nor for Windows"),
        (b"MZ", "it exports no finalizePythonInterpreter"),
    ],
    ids=["broken", "macOS", "empty", "broken, Windows"],
)
def test_no_library_that_is_known(library: bytes, said: str):
    with pytest.raises(PythonFmuError, match=said):
        mended({"binaries/any/lib": library, "binaries/any/": b"", "resources/x.so": b"\x7fELF"})


def test_no_library():
    with pytest.raises(PythonFmuError, match="no library of PythonFMU in binaries/"):
        mended({"binaries/any/": b"", "resources/x.so": b"\x7fELF"})


def test_no_zip(tmp_path: Path):
    (tmp_path / "x.fmu").write_bytes(b"no zip")
    with pytest.raises(PythonFmuError, match=r"x\.fmu: no FMU"):
        mend_fmu(tmp_path / "x.fmu")


def test_an_fmu_that_cannot_be_written_stays(faulty: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    fmu = tmp_path / "x.fmu"
    shutil.copy(faulty, fmu)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "writestr", full)
    with pytest.raises(OSError, match="No space left"):
        mend_fmu(fmu)
    assert fmu.read_bytes() == faulty.read_bytes() and list(tmp_path.iterdir()) == [fmu]


def test_the_build_refuses_an_unknown_pythonfmu(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, original: bytes):
    """A PythonFMU with another library in it, as a later version would be; no twin is written."""
    import pythonfmu

    skipped = shutil.ignore_patterns("__pycache__", "tests")
    other = shutil.copytree(Path(pythonfmu.__file__).parent, tmp_path / "other" / "pythonfmu", ignore=skipped)
    (library,) = other.rglob("*.so")
    library.unlink()  # a link to the installed one, perhaps
    library.write_bytes(changed(original, "other destructors"))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "other"))
    with pytest.raises(PythonFmuError, match=r"TransplanterLinkageTwin\.so: not PythonFMU's library of 0\.6\.5"):
        build_twin(tmp_path / "out")
    assert not (tmp_path / "out").exists()
