"""Stands between the validator and a process for FMUs, so that all of it can be ended. Not on Windows.

    python keeper.py CONTROL COMMAND...

Runs COMMAND, which gets this program's standard streams, in a session of its own. CONTROL is the number of a socket:
"ended STATUS" is written to it when the command has ended (negative: by that signal). When the other side shuts it
down, or is gone, everything below this process is killed and "left N" written: so many had outlived the command. On
Linux all that the command ever started is below, for orphans come to this process whatever group or session they
moved to; elsewhere an orphan that left the command's session is not found.
"""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil

IS_LINUX = sys.platform == "linux"
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36  # linux/prctl.h
LARGEST_FILE = 4 << 30  # bytes that the command can write into one file
GIVING_UP = 10.0  # s after which what cannot be killed (another user's, or stuck in the kernel) is left


def as_command() -> None:
    """In the new process, before it becomes the command."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    least = LARGEST_FILE if hard == resource.RLIM_INFINITY else min(LARGEST_FILE, hard)
    resource.setrlimit(resource.RLIMIT_FSIZE, (least, hard))
    if IS_LINUX:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)  # where this program was killed
        with suppress(OSError):
            Path("/proc/self/oom_score_adj").write_text("1000")  # where memory runs out, it goes first


def reap(command: int, control: socket.socket) -> None:
    """Until there is no child, neither own nor adopted."""
    with suppress(ChildProcessError):
        while True:
            pid, status = os.wait()
            if pid == command:
                with suppress(OSError):
                    control.sendall(b"ended %d\n" % os.waitstatus_to_exitcode(status))


def below(pid: int) -> set[psutil.Process]:
    """What runs below a process."""
    found = set()
    with suppress(psutil.Error):
        for process in psutil.Process(pid).children(recursive=True):
            with suppress(psutil.Error):
                if process.status() != psutil.STATUS_ZOMBIE:
                    found.add(process)
    return found


def end_all(find: Callable[[], set[psutil.Process]]) -> None:
    """Kill what is found, again and again until nothing is."""
    stopped: set[psutil.Process] = set()
    deadline = time.monotonic() + GIVING_UP
    while (living := find()) and time.monotonic() < deadline:
        number = signal.SIGKILL if living <= stopped else signal.SIGSTOP  # first none can start another
        for process in living if number == signal.SIGKILL else living - stopped:
            with suppress(psutil.Error):
                process.send_signal(number)
        if number == signal.SIGKILL:
            time.sleep(0.01)
        stopped |= living


def main(control_number: str, *command: str) -> None:
    control = socket.socket(fileno=int(control_number))
    if IS_LINUX:
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)
    process = subprocess.Popen(command, start_new_session=True, preexec_fn=as_command)  # noqa: PLW1509 no thread yet
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):  # the command's pipes end when the command does
        os.dup2(nothing, stream)
    threading.Thread(target=reap, args=(process.pid, control), daemon=True).start()
    with suppress(OSError):
        while control.recv(64):
            pass
    left = sum(1 for each in below(os.getpid()) if each.pid != process.pid)
    end_all(lambda: below(os.getpid()))
    if not IS_LINUX:
        with suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
    with suppress(OSError):
        control.sendall(b"left %d\n" % left)
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
