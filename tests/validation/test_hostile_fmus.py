"""FMUs that do to their host what they can (hostile.h): judged or named in time, and nothing of them is left.

`python -m tests.validation.hostile` prints the times.
"""

from __future__ import annotations

import errno
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import uuid
import zipfile
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from junitparser import JUnitXml

from fmu_src.cli import main
from fmu_src.validation import process, subject
from fmu_src.validation.keeper import LARGEST_FILE
from fmu_src.validation.process import BrokenInstallation, OutOfTime, Probe, ProbeError
from fmu_src.validation.subject import Options, Subject
from fmu_src.validation.table import FAILED, NAMES, PASSED, SKIPPED, validate
from tests.validation import hostile, small_fmu
from tests.validation.hostile import MARK, left_running

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the FMUs are written for POSIX")
LIMIT = 1.5
SOON = 20.0  # s: a bound against hanging, for a machine that has much else to do
ALONE = [word for name in NAMES if name not in ("load", "instance", "run") for word in ("--skip", name)]
COMMAND = Path(sys.executable).with_name("linkage-fmu")


@pytest.fixture
def temporary(tmp_path, monkeypatch) -> Path:
    """The folder for temporary files, and a mark by which processes are known."""
    folder = tmp_path / "temporary files"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setenv(MARK, uuid.uuid4().hex)
    return folder


def assert_nothing_left(temporary: Path, seconds: float = 5.0) -> None:
    """A process that was killed from outside may take a moment to clean up."""
    deadline = time.monotonic() + seconds
    while (left := [*left_running(), *temporary.iterdir()]) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert left == []


def whole(path: Path) -> Path:
    return small_fmu.write(path, small_fmu.content("2.0"))


# ---- one FMU -------------------------------------------------------------------------------------


@pytest.mark.parametrize("how", hostile.SAID)
def test_hostile_fmu(tmp_path, temporary, monkeypatch, how):
    users = tmp_path / "the user's folder"
    users.mkdir()
    monkeypatch.chdir(users)
    monkeypatch.setattr(process, "KILLING", 600.0)  # nothing waits for it
    limit = 60.0 if how in ("allocates", "shares") else LIMIT  # filling memory takes the time that it takes
    results = hostile.judge(hostile.write(tmp_path / "Hostile.fmu", how), limit)
    run = results["run (CS)"]
    if hostile.SAID[how]:
        assert run.outcome == FAILED and hostile.SAID[how] in run.problems[0]
    else:
        assert run.outcome == PASSED, run.problems
    if how == "daemon":
        (advice,) = results["processes"].advice
        assert "processes that it had started ran on after its host had ended" in advice
    else:
        assert results["processes"].outcome == PASSED
    assert all("\033" not in text and "\x9b" not in text for text in run.problems)
    assert run.seconds < limit + SOON
    assert_nothing_left(temporary)
    assert list(users.iterdir()) == []


def test_what_it_prints_is_not_kept(tmp_path, temporary):
    """Neither on the disk nor in memory: the FMU prints hundreds of MB a second."""
    path = hostile.write(tmp_path / "Prints.fmu", "prints")
    on_disk, in_memory = [], []
    arguments = ["validate", path, "--timeout", "3", *ALONE]
    with subprocess.Popen([COMMAND, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as command:
        watched = psutil.Process(command.pid)
        while command.poll() is None:
            with suppress(OSError, psutil.Error):
                on_disk.append(sum(file.stat().st_size for file in temporary.rglob("*") if file.is_file()))
                in_memory.append(watched.memory_info().rss)
            time.sleep(0.05)
    assert command.returncode == 1
    assert max(on_disk) < sum(map(len, small_fmu.content("2.0").values())) + (1 << 20)
    assert max(in_memory) < 300 << 20


def test_no_more_than_the_end_of_what_it_prints_is_kept(tmp_path, temporary, monkeypatch):
    kept, last_line = [], Probe._last_line

    def counted(probe: Probe) -> str:
        kept.append(len(probe._printed))
        return last_line(probe)

    monkeypatch.setattr(Probe, "_last_line", counted)
    hostile.judge(hostile.write(tmp_path / "Prints.fmu", "prints-one-line"), LIMIT)
    assert 0 < max(kept) <= process.PRINTED


def test_time_for_all_checks(tmp_path, temporary, capsys):
    """What is not run for want of time is no pass."""
    sleeps, good = hostile.write(tmp_path / "Sleeps.fmu", "sleeps"), whole(tmp_path / "Whole.fmu")
    status = main(["validate", str(sleeps), str(good), "--timeout", "100", "--limit", "8", *ALONE])
    said = " ".join(capsys.readouterr().out.split())
    assert status == 2 and "the 8 s for all checks of an FMU are over (--limit)" in said
    assert said.index("not judged") < said.index("Whole.fmu") < said.rindex("passed")
    assert_nothing_left(temporary)


def test_the_limit_of_a_job_ends_with_it(tmp_path, temporary):
    """The process waits for its next job longer than one may take, and is still there."""
    probe = Probe(tmp_path / "probe", 2.0)
    with pytest.raises(ProbeError):
        probe.do("load", folder=str(tmp_path), kind="CoSimulation")
    (before,) = (each.pid for each in left_running() if "probe.py" in " ".join(each.cmdline()[:2]))
    time.sleep(2.5)
    with pytest.raises(ProbeError, match="modelDescription"):
        probe.do("load", folder=str(tmp_path), kind="CoSimulation")
    assert psutil.pid_exists(before) and before in {each.pid for each in left_running()}
    probe.remove()
    assert_nothing_left(temporary)


@pytest.mark.skipif(sys.platform != "linux", reason="what is asked for is in /proc")
def test_what_an_fmu_may_do_to_the_machine(tmp_path, temporary):
    """No core file, no file without end; and where memory runs out, its process goes first."""
    probe, before = Probe(tmp_path / "probe", 60.0), psutil.Process().rlimit(psutil.RLIMIT_CORE)
    psutil.Process().rlimit(psutil.RLIMIT_CORE, (before[1], before[1]))
    try:
        probe.start()
    finally:
        psutil.Process().rlimit(psutil.RLIMIT_CORE, before)
    with pytest.raises(ProbeError):
        probe.do("load", folder=str(tmp_path), kind="CoSimulation")
    (process_of_fmu,) = (each for each in left_running() if "probe.py" in " ".join(each.cmdline()[:2]))
    assert process_of_fmu.rlimit(psutil.RLIMIT_CORE)[0] == 0
    assert 0 < process_of_fmu.rlimit(psutil.RLIMIT_FSIZE)[0] <= LARGEST_FILE
    assert Path(f"/proc/{process_of_fmu.pid}/oom_score_adj").read_text() == "1000\n"
    probe.remove()
    assert_nothing_left(temporary)


# ---- the command ---------------------------------------------------------------------------------


def begun(tmp_path: Path, *arguments: str | Path) -> subprocess.Popen[str]:
    """The command at work on its second FMU, which sleeps, after a whole one."""
    good, sleeps = whole(tmp_path / "Whole.fmu"), hostile.write(tmp_path / "Sleeps.fmu", "sleeps")

    def as_from_a_terminal() -> None:  # a shell that starts the tests in the background has them ignore Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    command = subprocess.Popen(
        [COMMAND, "validate", good, sleeps, "--timeout", "100", *ALONE, *arguments], text=True, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=as_from_a_terminal,  # noqa: PLW1509 - the tests have no threads
    )  # fmt: skip
    for line in command.stdout:
        if line.startswith("6 passed"):
            break
    deadline = time.monotonic() + 60
    while not any("probe.py" in " ".join(each.cmdline()) for each in left_running()) and time.monotonic() < deadline:
        time.sleep(0.05)
    return command


@pytest.mark.parametrize(
    ("number", "at_once"),
    [(signal.SIGINT, False), (signal.SIGINT, True), (signal.SIGTERM, False), (signal.SIGHUP, False)],
)
def test_it_is_ended(tmp_path, temporary, number, at_once):
    """In the middle of a run, or while that begins; with what was judged until then."""
    report, results = tmp_path / "fmu.xml", tmp_path / "fmu.json"
    command = begun(tmp_path, "--junit", report, "--json", results)
    if not at_once:
        time.sleep(3)
    assert all(os.getsid(each.pid) != command.pid for each in left_running() if each.pid != command.pid)
    if number == signal.SIGINT:
        os.killpg(command.pid, number)  # as a terminal does
    else:
        command.send_signal(number)
    command.send_signal(number)
    out, err = command.communicate(timeout=SOON)
    assert command.returncode == 128 + number
    assert err.strip().splitlines()[-1] == f"linkage-fmu: ended by {number.name}; 1 of 2 FMUs were judged"
    assert "Traceback" not in out + err
    (suite,) = JUnitXml.fromfile(str(report))
    assert suite.name == str(tmp_path / "Whole.fmu") and suite.errors == suite.failures == 0
    (fmu,) = json.loads(results.read_text())["fmus"]
    assert fmu["outcome"] == PASSED
    assert_nothing_left(temporary, 0)


def test_it_is_ended_while_it_cleans_up(tmp_path, temporary, monkeypatch):
    """It is done with the last check, and begins anew to clean up."""
    path, rmtree, calls = whole(tmp_path / "Whole.fmu"), shutil.rmtree, []

    def interrupted(*arguments, **options):
        calls.append(arguments)
        if len(calls) == 1:
            raise KeyboardInterrupt
        rmtree(*arguments, **options)

    monkeypatch.setattr(shutil, "rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt):
        validate(path, Options(skip=frozenset(NAMES) - {"archive"}))
    assert_nothing_left(temporary, 0)


@pytest.mark.parametrize("after", range(5))
def test_it_is_ended_while_a_process_starts(tmp_path, temporary, monkeypatch, after):
    """Before its process is there, or before one of the threads that serve it is."""
    path, start, calls = whole(tmp_path / "Whole.fmu"), threading.Thread.start, []

    def interrupted(thread: threading.Thread) -> None:
        calls.append(thread)
        if len(calls) == after:
            raise KeyboardInterrupt
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    if not after:
        monkeypatch.setattr(subprocess, "Popen", Interrupting)
    with pytest.raises(KeyboardInterrupt):
        validate(path, Options())
    assert_nothing_left(temporary)


class Interrupting:
    """A process that is ended while it starts."""

    def __init__(self, *_: object, **__: object) -> None:
        raise KeyboardInterrupt


def test_it_is_killed(tmp_path, temporary):
    """It can do nothing then, but no process is left."""
    command = begun(tmp_path)
    command.kill()
    command.communicate(timeout=SOON)
    deadline = time.monotonic() + SOON
    while left_running() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert left_running() == []


def test_two_at_once(tmp_path, temporary):
    """They share the FMU and the report."""
    path, report = whole(tmp_path / "Whole.fmu"), tmp_path / "fmu.xml"
    commands = [
        subprocess.Popen([COMMAND, "validate", path, "--junit", report, *ALONE], stdout=subprocess.DEVNULL)
        for _ in range(2)
    ]
    assert [command.wait(120) for command in commands] == [0, 0]
    assert JUnitXml.fromfile(str(report)).failures == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["Whole.fmu", "fmu.xml", "temporary files"]
    assert_nothing_left(temporary)


# ---- the machine ---------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EFBIG, errno.EMFILE])
def test_full_disk(tmp_path, temporary, capsys, monkeypatch, number):
    """There is room for one of two. A limit is no fault of the FMU either."""
    first, second = whole(tmp_path / "First.fmu"), whole(tmp_path / "Second.fmu")
    extract, calls = zipfile.ZipFile.extract, []

    def once_full(archive, entry, place):
        calls.append(entry)
        if len(calls) == 1:
            raise OSError(number, os.strerror(number), str(place))
        return extract(archive, entry, place)

    monkeypatch.setattr(zipfile.ZipFile, "extract", once_full)
    report = tmp_path / "fmu.xml"
    assert main(["validate", str(first), str(second), "--junit", str(report), *ALONE]) == 2
    captured = capsys.readouterr()
    assert f"First.fmu: {os.strerror(number)}" in captured.err and "6 passed" in captured.out
    lost, good = JUnitXml.fromfile(str(report))
    assert (lost.errors, lost.tests, good.errors) == (1, 1, 0)
    assert_nothing_left(temporary)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is full is Linux's")
@pytest.mark.parametrize("what", ["--junit", "--json", "stdout"])
def test_reports_on_a_full_disk(tmp_path, temporary, what):
    path, report = whole(tmp_path / "Whole.fmu"), tmp_path / "fmu.xml"
    arguments = ["--junit", report] if what == "stdout" else [what, "/dev/full"]
    with Path("/dev/full" if what == "stdout" else os.devnull).open("w") as out:
        done = subprocess.run(
            [COMMAND, "validate", path, *arguments, *ALONE], stdout=out, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert (
        "No space left on device" in done.stderr
        and ("standard output" if what == "stdout" else "/dev/full") in done.stderr
    )
    assert what != "stdout" or JUnitXml.fromfile(str(report)).errors == 0


def test_a_report_is_written_whole_or_not_at_all(tmp_path, temporary, capsys, monkeypatch):
    """Where the disk is full in the middle of it, the one of before is still there, and nothing beside it."""
    path, report = whole(tmp_path / "Whole.fmu"), tmp_path / "reports" / "fmu.json"
    report.parent.mkdir()
    report.write_text("of before")

    def half(place: Path, content: bytes) -> None:
        with place.open("wb") as file:
            file.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(place))

    monkeypatch.setattr(Path, "write_bytes", half)
    assert main(["validate", str(path), "--json", str(report), "--skip", "instance", *ALONE]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert list(report.parent.iterdir()) == [report] and report.read_text() == "of before"


def test_folders_that_cannot_be_written(tmp_path, temporary, capsys, monkeypatch):
    path = whole(tmp_path / "Whole.fmu")
    (tmp_path / "a file").touch()
    assert main(["validate", str(path), "--junit", str(tmp_path / "a file" / "fmu.xml"), *ALONE]) == 2
    captured = capsys.readouterr()
    assert "6 passed" in captured.out and "a file" in captured.err
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "a file"))
    assert main(["validate", str(path), *ALONE]) == 2
    assert "Whole.fmu: Not a directory: " in capsys.readouterr().err


def test_a_pipe_is_not_read(tmp_path, temporary, capsys):
    os.mkfifo(tmp_path / "Pipe.fmu")
    assert main(["validate", str(tmp_path / "Pipe.fmu")]) == 2
    assert "Pipe.fmu: is no regular file" in capsys.readouterr().err


def test_odd_file_names(tmp_path, temporary):
    """No UTF-8, and one that would colour the terminal."""
    names = [b"Fr\xfchling.fmu", b"\x1b[31mred\x07.fmu"]
    paths = [whole(tmp_path / os.fsdecode(name)) for name in names]
    report, results = tmp_path / "fmu.xml", tmp_path / "fmu.json"
    command = [COMMAND, "validate", *paths, "--junit", report, "--json", results, *ALONE]
    done = subprocess.run(command, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"\x1b" not in done.stdout and b"\xfc" not in done.stdout
    suites = [suite.name for suite in JUnitXml.fromfile(str(report))]
    assert [name.rpartition("/")[2] for name in suites] == ["Fr?hling.fmu", "?[31mred?.fmu"]
    assert [fmu["path"] for fmu in json.loads(results.read_text())["fmus"]] == suites


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams(tmp_path, temporary, closed):
    """As some schedulers start commands."""
    paths, report = [whole(tmp_path / name) for name in ("First.fmu", "Second.fmu")], tmp_path / "fmu.xml"
    command = shlex.join(map(str, [COMMAND, "validate", *paths, "--junit", report, *ALONE]))
    done = subprocess.run(["sh", "-c", f"{command} {closed}"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "6 passed" in done.stdout or ">&-" in closed.split()
    assert [(suite.tests > 6, suite.errors) for suite in JUnitXml.fromfile(str(report))] == [(True, 0)] * 2


@pytest.mark.parametrize("path", ["", ".", "..", "/"])
def test_a_folder_is_no_fmu(temporary, capsys, path):
    assert main(["validate", path]) == 2
    assert f"{Path(path)}: Is a directory" in capsys.readouterr().err


def test_broken_installation(tmp_path, temporary, capsys, monkeypatch):
    """The FMU is not to blame."""
    broken = tmp_path / "probe.py"
    broken.write_text("import a_module_that_is_nowhere")
    monkeypatch.setattr(process, "PROBE", broken)
    path = whole(tmp_path / "Whole.fmu")
    with pytest.raises(BrokenInstallation):
        validate(path, Options())
    assert main(["validate", str(path)]) == 2
    assert "does not start: ModuleNotFoundError: No module named 'a_module_that_is_nowhere'" in capsys.readouterr().err
    assert_nothing_left(temporary)


# ---- archives ------------------------------------------------------------------------------------


def test_many_entries(tmp_path, temporary):
    path = whole(tmp_path / "Many.fmu")
    with zipfile.ZipFile(path, "a") as archive:
        for number in range(3000):
            archive.writestr(f"resources/{number}.txt", b"")
    skip = frozenset(NAMES) - {"archive"}
    assert validate(path, Options(skip=skip))[0].outcome == PASSED
    (result,) = (result for result in validate(path, Options(skip=skip, entries=3001)) if result.outcome != SKIPPED)
    assert result.problems == ["it has 3002 entries, 3001 are allowed (--entries)"]
    assert_nothing_left(temporary)


def with_entry(path: Path, name: str) -> Path:
    """With one more entry, of whatever name."""
    with zipfile.ZipFile(whole(path), "a") as archive:
        info = zipfile.ZipInfo("placeholder")
        info.filename = info.orig_filename = name
        archive.writestr(info, b"x")
    return path


@pytest.mark.parametrize(
    ("name", "says"),
    [("", "'' is no name"),
     ("resources/" + 200 * "n/" + "x", "more than 100 folders deep"),
     ("resources/" + 300 * "n", "File name too long"),
     ("modelDescription.xml/x", "cannot be unpacked: 'modelDescription.xml/x': ")],
)  # fmt: skip
def test_names_that_no_file_can_have(tmp_path, temporary, capsys, name, says):
    """The entry is named, and the other FMU is judged."""
    paths = [with_entry(tmp_path / "Odd.fmu", name), whole(tmp_path / "Whole.fmu")]
    assert main(["validate", *map(str, paths), *ALONE[2:]]) == 1  # with the first of all checks, archive
    said = " ".join(capsys.readouterr().out.split())
    assert says in said and "7 passed" in said
    assert_nothing_left(temporary)


def test_an_entry_that_unpacks_to_nothing(tmp_path, temporary):
    """Each method of packing has its own errors."""
    path = whole(tmp_path / "Damaged.fmu")
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("resources/table", b"x" * 500, zipfile.ZIP_LZMA)
    data = bytearray(path.read_bytes())
    data[data.index(b"resources/table") + len(b"resources/table") + 4] = 0xFF  # the properties of LZMA
    path.write_bytes(data)
    results = {result.title: result for result in validate(path, Options(skip=frozenset(NAMES) - {"archive"}))}
    assert "'resources/table' is damaged" in "\n".join(results["archive"].problems)


def test_a_bomb(tmp_path, temporary):
    """64 MiB of zeros in 64 KB; and one that lies about its size."""
    path = whole(tmp_path / "Bomb.fmu")
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive, archive.open("resources/zeros", "w") as file:
        for _ in range(64):
            file.write(bytes(1 << 20))
    skip = frozenset(NAMES) - {"archive"}
    results = validate(path, Options(skip=skip, unpacked=2.0**25))
    assert results[0].problems == ["unpacked it would have 0.0625 GiB, 0.0312 are allowed (--unpacked)"]
    data = path.read_bytes()
    path.write_bytes(data.replace((1 << 26).to_bytes(4, "little"), (1 << 10).to_bytes(4, "little")))
    results = validate(path, Options(skip=skip, unpacked=2.0**25))
    assert "'resources/zeros' is damaged" in results[0].problems[0]
    assert_nothing_left(temporary)


def test_time_for_a_large_entry(tmp_path, temporary, monkeypatch):
    """It is looked at for each part that is read, not for the entry alone."""
    path = whole(tmp_path / "Large.fmu")
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("resources/zeros", bytes(64 << 20))
    looks: list[Subject] = []

    def is_over_at_the_end(fmu: Subject) -> None:
        looks.append(fmu)
        if len(looks) > 50:
            raise OutOfTime

    monkeypatch.setattr(Subject, "be_on_time", is_over_at_the_end)
    result = validate(path, Options(skip=frozenset(NAMES) - {"archive"}))[0]
    assert result.unjudged and "are over (--limit)" in result.unjudged


@pytest.mark.parametrize(
    ("name", "check"),
    [("documentation/index.html", "files"), ("extra/org.example/fmi-ls-manifest.xml", "files"),
     ("terminalsAndIcons/terminalsAndIcons.xml", "terminals")],
)  # fmt: skip
def test_other_files_that_would_fill_the_memory(tmp_path, temporary, monkeypatch, name, check):
    files = small_fmu.content("2.0")
    monkeypatch.setattr(subject, "LARGEST", len(files["modelDescription.xml"]))
    path = small_fmu.write(tmp_path / "Large.fmu", files | {name: b"<p/>" + bytes(10_000)})
    results = {result.title: result for result in validate(path, Options(skip=frozenset(NAMES) - {check}))}
    assert f"{name} has 0 MiB; above 0 MiB it is not read here" in (results[check].unjudged or "")


def test_a_description_that_would_fill_the_memory(tmp_path, temporary, capsys, monkeypatch):
    monkeypatch.setattr(subject, "LARGEST", 1000)
    path = whole(tmp_path / "Whole.fmu")
    assert main(["validate", str(path)]) == 2
    assert "modelDescription.xml has 0 MiB; above 0 MiB it is not read here" in " ".join(
        capsys.readouterr().out.split()
    )
