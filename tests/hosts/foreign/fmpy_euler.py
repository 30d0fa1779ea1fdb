"""FMPy again, with its other solver around Model Exchange: Euler's method, in the steps of the inputs."""

from __future__ import annotations

from tests.hosts.foreign import Rows, Task, fmpy_host
from tests.hosts.foreign.fmpy_host import NAME, PACKAGE, missing, version  # noqa: F401 - of this host too

INTERFACES = {("2.0", "ME"), ("3.0", "ME")}
FEEDING = "table, Euler"
DEFECTS: dict = {}


def play(task: Task) -> Rows:
    return fmpy_host.play(task, solver="Euler")
