"""The other side of probe.py: jobs to a process that may do anything, which then costs that job alone.

Every wait has a deadline; what is printed is read and dropped but for its end; memory is watched; and nothing that an
FMU has started runs on (keeper.py).
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import queue
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import psutil

from .probe import CLOSED
from .text import printable

PROBE, KEEPER = Path(__file__).with_name("probe.py"), Path(__file__).with_name("keeper.py")
IS_WINDOWS = sys.platform == "win32"
NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)  # of Windows
GRACE = 1.0  # s beyond its limit, for a process that does not even end itself
ENDING = 5.0  # s for the process to end when it has no more to do: the library unloads
KILLING = 15.0  # s for keeper.py to end everything
STARTING = 120.0  # s for Python to start and to import, on a machine that has much else to do
SOON = 0.3  # s after the end of a process for what it has written last
WATCHING = 0.25  # s between two looks at the memory
MARK = "LINKAGE_FMU_PROBE"  # in the environment of an FMU's processes: which probe's they are
FORGED = "the FMU wrote into the pipe for answers to its host"
PRINTED = 4096  # bytes kept of what was printed last
ANSWER = 1 << 30  # bytes of an answer, at most


class ProbeError(RuntimeError):
    """A job did not come to an answer; the message says how it ended and in which FMI function."""


class OutOfTime(RuntimeError):
    """The time for all jobs together is over."""


class BrokenInstallation(RuntimeError):
    """The process for FMUs does not start: nothing is said about an FMU."""


class Probe:
    """A process for jobs, started when first needed and again after it died.

    folder: for its files; "work" in it is its working folder, and that for temporary files
    limit: seconds that one job may take
    memory: bytes that the process and all that it starts may hold
    until: time.monotonic() at which no job goes on
    """

    def __init__(self, folder: Path, limit: float, memory: float = math.inf, until: float = math.inf) -> None:
        self.limit, self.memory, self.until = limit, memory, until
        self._mark = uuid.uuid4().hex
        self.outlived = 0  # processes that an FMU started and that ran on when the probe had ended
        self._folder, self._trace = folder, folder / "trace"
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start the process without waiting for it."""
        if self._process is not None:
            return
        work = self._folder / "work"
        work.mkdir(parents=True, exist_ok=True)
        self._trace.unlink(missing_ok=True)
        self._is_ready, self._printed, self._control, self._left = False, b"", None, 0
        self._events: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()  # a line's bytes, an exit status
        self._jobs: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        command = [sys.executable, str(PROBE), str(self._trace)]
        environment = os.environ | {name: str(work) for name in ("TMPDIR", "TMP", "TEMP")} | {MARK: self._mark}
        pipes: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
        if IS_WINDOWS:
            self._process = subprocess.Popen(
                command, bufsize=0, cwd=work, env=environment, **pipes,
                creationflags=NEW_GROUP,
            )  # fmt: skip
        else:
            self._control, other = socket.socketpair()
            with other:
                self._process = subprocess.Popen(
                    [sys.executable, str(KEEPER), str(other.fileno()), *command], bufsize=0, cwd=work, env=environment,
                    **pipes, pass_fds=[other.fileno()], start_new_session=True,
                )  # fmt: skip
        self._threads: list[threading.Thread] = []
        for target in (self._feed, self._read_answers, self._read_end, self._read_printed):
            self._printing = threading.Thread(target=target, args=(self._process,), daemon=True)
            self._printing.start()
            self._threads.append(self._printing)

    def do(self, job: str, **fields: Any) -> Any:
        """The job's answer; raises ProbeError where there is none, OutOfTime, BrokenInstallation."""
        self.start()
        if not self._is_ready:
            failure = self._wait(STARTING, lambda line: line == b"ready\n")
            if failure is not None:
                said = self._last_line()
                self._end()
                raise BrokenInstallation(f"the process in which FMUs run does not start{said and ': ' + said}")
            self._is_ready = True
        seconds = min(self.limit, self.until - time.monotonic())
        if seconds <= 0:
            raise OutOfTime
        self._printed = b""
        number = uuid.uuid4().hex  # what an FMU cannot know: a line without it is not the probe's
        self._jobs.put(json.dumps({"do": job, "limit": seconds, "number": number, **fields}).encode() + b"\n")
        answer: dict[str, Any] = {}

        def is_answer(line: bytes) -> bool:
            answer.update(json.loads(line))
            return answer.pop("number", None) == number and len(answer) == 1

        failure = self._wait(seconds + GRACE, is_answer)
        if failure is not None:
            problem = self._problem(failure)
            self._end()
            if time.monotonic() >= self.until and "no answer" in problem:
                raise OutOfTime
            raise ProbeError(problem)
        if "problem" in answer:
            raise ProbeError(answer["problem"])
        return answer["answer"]

    def _wait(self, seconds: float, take: Callable[[bytes], bool]) -> str | None:
        """Gives the next line of the process to `take`. Where there is none: what happened, "" where nothing did."""
        deadline = time.monotonic() + seconds
        is_mute, status = False, None
        while (left := deadline - time.monotonic()) > 0:
            try:
                event, value = self._events.get(timeout=min(left, WATCHING))
            except queue.Empty:
                if (held := self._memory()) > self.memory:
                    return f"it held {gib(held)} of memory: more than the {gib(self.memory)} that it may"
                continue
            if event == "line":
                if status is not None:
                    self._events.put(("ended", status))  # an answer, and then the end: that is for the next job
                try:
                    return None if take(value) else FORGED
                except (ValueError, TypeError, RecursionError):
                    return FORGED
            if event == "ended":
                status = value
            is_mute = is_mute or event == "mute"
            if status is not None and is_mute:
                return ending(status)
            # The two come at nearly the same time, unless another process holds the pipe, or the FMU has closed it.
            deadline = min(deadline, time.monotonic() + (GRACE if is_mute else SOON))
        if status is not None:
            return ending(status)
        return ending(CLOSED) if is_mute else ""

    def _problem(self, failure: str) -> str:
        """What `_wait` returned, with the function and with what was printed."""
        self._printing.join(SOON)
        trace = ""
        with contextlib.suppress(OSError), self._trace.open(errors="replace") as file:
            trace = file.read(1 << 16)
        function = re.search(r" in (fmi[23]\w+)$", trace, re.MULTILINE)
        place = f" in {function[1]}" if function else " while the binary was loaded" if "LoadLibrary" in trace else ""
        if not failure or trace.startswith("Timeout"):
            failure = f"no answer within {self.limit:g} s"
        said = self._last_line()
        return f"{failure}{place}" + (f'; it printed: "{said}"' if said else "")

    def _last_line(self) -> str:
        """The end of what it printed."""
        lines = self._printed.decode("utf-8", "replace").strip().splitlines()
        return printable(lines[-1][-200:]) if lines else ""

    def _memory(self) -> int:
        """Bytes that the process and all below it hold; where that is too much, what they share counts once."""
        if self._process is None:
            return 0
        processes = []
        with contextlib.suppress(psutil.Error):
            process = psutil.Process(self._process.pid)
            processes = [process, *process.children(recursive=True)]
        held = total(processes, lambda each: each.memory_info().rss)
        if held <= self.memory:
            return held
        return total(processes, lambda each: getattr(each.memory_full_info(), "pss", each.memory_info().rss))

    def close(self) -> None:
        """Let the process end by itself, with what it has loaded, and then end all that is left."""
        if self._process is None:
            return
        self._jobs.put(None)
        deadline = time.monotonic() + ENDING
        with contextlib.suppress(queue.Empty):
            while (left := deadline - time.monotonic()) > 0:
                if self._events.get(timeout=left)[0] == "ended":
                    break
        self._end()
        self.outlived += self._left

    def _end(self) -> None:
        """End the process and all that it has started, at once."""
        process = self._process
        if process is None:
            return
        if self._control is None:
            with contextlib.suppress(psutil.Error):
                for each in psutil.Process(process.pid).children(recursive=True):
                    with contextlib.suppress(psutil.Error):
                        each.kill()
            process.kill()
        else:
            with contextlib.suppress(OSError):  # it is gone already
                self._control.shutdown(socket.SHUT_WR)
        deadline = time.monotonic() + KILLING
        while process.poll() is None and time.monotonic() < deadline and not is_stopped(process.pid):
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(WATCHING)
        if self._control is not None and process.returncode != 0:  # the FMU has stopped or killed keeper.py
            from .keeper import below, end_all

            end_all(lambda: below(process.pid) | marked(self._mark))
        process.kill()
        process.wait()
        self._jobs.put(None)
        for thread in self._threads:
            thread.join(GRACE)
        if not any(thread.is_alive() for thread in self._threads):  # or else one reads what cannot be ended
            for file in (process.stdin, process.stdout, process.stderr, self._control):
                if file is not None:
                    file.close()
        self._process = None

    def remove(self) -> None:
        """End everything at once."""
        self._end()

    # ---- threads: each serves one pipe, so that no pipe can keep `do` waiting -----------------------

    def _feed(self, process: subprocess.Popen[bytes]) -> None:
        pipe = opened(process.stdin)
        with contextlib.suppress(OSError):  # nobody reads any more
            while (job := self._jobs.get()) is not None:
                rest = memoryview(job)
                while rest:
                    rest = rest[os.write(pipe.fileno(), rest) :]
        with contextlib.suppress(OSError):
            pipe.close()

    def _read_answers(self, process: subprocess.Popen[bytes]) -> None:
        pipe = opened(process.stdout)
        kept: list[bytes] = []
        size = 0
        while chunk := os.read(pipe.fileno(), 1 << 16):
            if size > ANSWER:
                self._events.put(("line", b""))
                return
            *ends, rest = chunk.split(b"\n")
            for end in ends:
                self._events.put(("line", b"".join([*kept, end, b"\n"])))
                kept, size = [], 0
            kept.append(rest)
            size += len(rest)
        self._events.put(("mute", None))

    def _read_printed(self, process: subprocess.Popen[bytes]) -> None:
        pipe = opened(process.stderr)
        while chunk := os.read(pipe.fileno(), 1 << 16):
            self._printed = (self._printed + chunk)[-PRINTED:]

    def _read_end(self, process: subprocess.Popen[bytes]) -> None:
        if self._control is None:
            self._events.put(("ended", process.wait()))
            return
        status = -signal.SIGKILL  # keeper.py was killed, and took the process with it
        with contextlib.suppress(OSError), self._control.makefile("r") as lines:
            for line in lines:
                word, _, number = line.partition(" ")
                if word == "left":
                    self._left = int(number)
                else:
                    status = int(number)
                    self._events.put(("ended", status))
        self._events.put(("ended", status))


def is_stopped(pid: int) -> bool:
    with contextlib.suppress(psutil.Error):
        return bool(psutil.Process(pid).status() == psutil.STATUS_STOPPED)
    return False


def marked(mark: str) -> set[psutil.Process]:
    """Processes of an FMU, wherever they have gone."""
    found = set()
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            if process.environ().get(MARK) == mark and process.status() != psutil.STATUS_ZOMBIE:
                found.add(process)
    return found


def opened(pipe: IO[bytes] | None) -> IO[bytes]:
    assert pipe is not None  # every process here has all three
    return pipe


def ending(status: int) -> str:
    """How a process ended."""
    if status == CLOSED:
        return "the FMU closed files of the process that it runs in"
    if status < 0:
        return f"the process died of {signal_name(-status)}"
    return f"the FMU ended the process, exit status {status:#x}"


def signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def total(processes: list[psutil.Process], size: Callable[[psutil.Process], int]) -> int:
    held = 0
    for each in processes:
        with contextlib.suppress(psutil.Error):
            held += size(each)
    return held


def gib(size: float) -> str:
    return f"{size / (1 << 30):.3g} GiB"
