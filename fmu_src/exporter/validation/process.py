"""The other side of probe.py: jobs to a process that may crash or hang, which then costs that job alone."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

PROBE = Path(__file__).with_name("probe.py")
GRACE = 5.0  # s beyond its limit, for a process that does not even end itself
STARTING = 120.0  # s for Python to start and to import, on a machine that has much else to do


class ProbeError(RuntimeError):
    """A job did not come to an answer; the message says how it ended and in which FMI function."""


class Probe:
    """A process for jobs, started when first needed and again after it died.

    limit: seconds that one job may take.
    """

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self._process: subprocess.Popen[str] | None = None
        self._is_ready = self._was_killed = False
        self._folder = tempfile.TemporaryDirectory()
        self._trace = Path(self._folder.name) / "trace"
        self._printed = Path(self._folder.name) / "printed"

    def start(self) -> None:
        """Start the process without waiting for it."""
        if self._process is None:
            with self._printed.open("w") as printed:
                self._process = subprocess.Popen(
                    [sys.executable, str(PROBE), str(self._trace)], encoding="utf-8",
                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=printed,
                )  # fmt: skip
            self._is_ready = False

    def do(self, job: str, **fields):
        """The job's answer; raises ProbeError where there is none."""
        self.start()
        if not self._is_ready:
            if not self._answer_within(STARTING):
                raise ProbeError(self._why_it_ended())
            self._is_ready = True
        try:
            self._process.stdin.write(json.dumps({"do": job, "limit": self.limit, **fields}) + "\n")
            self._process.stdin.flush()
        except OSError:  # it has died since: the answer will say so
            pass
        line = self._answer_within(self.limit + GRACE)
        if not line:
            raise ProbeError(self._why_it_ended())
        answer = json.loads(line)
        if "problem" in answer:
            raise ProbeError(answer["problem"])
        return answer["answer"]

    def _answer_within(self, seconds: float) -> str:
        """A line from the process; "" where it ended or had to be killed."""
        self._was_killed = False
        killer = threading.Timer(seconds, self._kill)
        killer.start()
        line = self._process.stdout.readline()
        killer.cancel()
        return line if line.endswith("\n") else ""

    def close(self) -> None:
        if self._process is not None:
            try:
                self._process.stdin.close()
            except OSError:  # nobody has read what was written last
                pass
            try:
                self._process.wait(GRACE)
            except subprocess.TimeoutExpired:  # a library whose ending hangs
                self._process.kill()
                self._process.wait()
            self._process.stdout.close()
            self._process = None

    def remove(self) -> None:
        self.close()
        self._folder.cleanup()

    def _kill(self) -> None:
        self._was_killed = True
        self._process.kill()

    def _why_it_ended(self) -> str:
        status = self._process.wait()
        self.close()
        trace = self._trace.read_text(errors="replace")
        function = re.search(r" in (fmi[23]\w+)$", trace, re.MULTILINE)
        place = f" in {function[1]}" if function else " while the binary was loaded" if "LoadLibrary" in trace else ""
        printed = self._printed.read_text(errors="replace").strip().splitlines()
        said = f'; it printed: "{printed[-1][:200]}"' if printed else ""
        if trace.startswith("Timeout") or self._was_killed:
            return f"no answer within {self.limit:g} s{place}{said}"
        if status < 0:
            return f"the process died of {signal_name(-status)}{place}{said}"
        return f"the FMU ended the process, exit status {status:#x}{place}{said}"


def signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
