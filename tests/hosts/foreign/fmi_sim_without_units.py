"""fmi-sim again, where it cannot read the FMU as it is: with the attributes `unit` and `displayUnit`, which it refuses,
taken out of the description of an FMI 3.0 FMU. The binary is the same.
"""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace

from fmu_src.exporter.archive import write_archive
from tests.hosts.foreign import Rows, Task, fmi_sim
from tests.hosts.foreign.fmi_sim import LOG, NAME, PACKAGE, PREPARED, is_prepared, missing, prepare, version  # noqa: F401 - of this host too

INTERFACES = {("3.0", "CS"), ("3.0", "ME")}
FEEDING = "table, FMU without units"
DEFECTS: dict = {}
DESCRIPTION = "modelDescription.xml"


def play(task: Task) -> Rows:
    with zipfile.ZipFile(task.fmu) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    content[DESCRIPTION] = re.sub(rb' (unit|displayUnit)="[^"]*"', b"", content[DESCRIPTION])
    changed = task.folder / task.fmu.name
    write_archive(changed, content)
    return fmi_sim.play(replace(task, fmu=changed))
