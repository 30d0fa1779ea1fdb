"""The FMU container again, with its FMUs stepped one after the other (Gauss-Seidel): the linkage is given the inputs
of the step's end, and told so by crank.at_step_end.
"""

from __future__ import annotations

from tests.hosts.foreign import Rows, Task, container
from tests.hosts.foreign.container import DEFECTS, INTERFACES, NAME, PACKAGE, missing, version  # noqa: F401 - of this host too

FEEDING = "partner FMU, sequential"


def play(task: Task) -> Rows:
    return container.play(task, sequential=True)
