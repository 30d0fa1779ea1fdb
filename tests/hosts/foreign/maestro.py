"""Maestro, of the INTO-CPS Association: a co-simulation orchestrator in Java."""

from __future__ import annotations

import csv
import json

from tests.hosts.drives import INPUTS, OUTPUTS, STEP, STEPS
from tests.hosts.foreign import Rows, Task
from tests.hosts.foreign.java import class_path, is_resolved, java, missing, prepared  # noqa: F401 - of this host too
from tests.hosts.foreign.partner import build_partner

NAME, PACKAGE = "Maestro", "Maven Central org.into-cps.maestro:maestro"
INTERFACES = {("2.0", "CS"), ("3.0", "CS")}
FEEDING = "partner FMU, parallel"
# Seen in the stack's trace: Fmi3ScalarVariable.hashCode through HashMap to itself, whatever the stack's size.
DEFECTS = {("3.0", "CS"): "its hash of a variable of FMI 3.0 calls itself without end, while the FMU is read"}
VERSION = "3.1.1"
# commons-io: the version that Maven chooses by itself is too old for commons-compress, and Maestro stops
LIBRARIES = (f"org.into-cps.maestro:maestro:{VERSION}", "commons-io:commons-io:2.16.1")
PREPARED = prepared(*LIBRARIES)


def is_prepared() -> bool:
    return is_resolved(*LIBRARIES)


def version() -> str:
    return VERSION


def prepare() -> None:
    class_path(*LIBRARIES)


def play(task: Task) -> Rows:
    drive = build_partner(task.drive, task.folder / "drive.fmu")
    model = {
        "fmus": {"{drive}": str(drive), "{linkage}": str(task.fmu)},
        "connections": {f"{{drive}}.d.{name}": [f"{{linkage}}.l.{name}"] for name in INPUTS},
        "parameters": {},
        "logVariables": {"{linkage}.l": list(OUTPUTS)},
        "startTime": 0.0,
        "endTime": (STEPS + 0.5) * STEP,  # it adds up its steps, and does not begin one that would end too late
        "reportProgress": False,
        "loggingOn": False,
        "algorithm": {"type": "fixed-step", "size": STEP},
    }
    (task.folder / "model.json").write_text(json.dumps(model))
    arguments = ("import", "sg1", "model.json", "-output", "out", "-i")
    java(class_path(*LIBRARIES), "org.intocps.maestro.Main", *arguments, cwd=task.folder)
    with (task.folder / "out" / "outputs.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            yield float(row["time"]), [float(row[f"{{linkage}}.l.{name}"]) for name in OUTPUTS]
