"""FMI4j: FMUs on the Java virtual machine. FMI 2.0 (and 1.0); the small host around it is Fmi4jHost.java."""

from __future__ import annotations

from pathlib import Path

from tests.hosts.drives import OUTPUTS
from tests.hosts.foreign import Rows, Task
from tests.hosts.foreign.java import class_path, is_resolved, java, missing, prepared  # noqa: F401 - of this host too

NAME, PACKAGE = "FMI4j", "Maven Central info.laht.fmi4j:fmi-import"
INTERFACES = {("2.0", "CS"), ("2.0", "ME")}
FEEDING = "set at each step"
DEFECTS: dict = {}
VERSION = "0.38.0"
LIBRARIES = (f"info.laht.fmi4j:fmi-import:{VERSION}",)
PREPARED = prepared(*LIBRARIES)


def is_prepared() -> bool:
    return is_resolved(*LIBRARIES)


def version() -> str:
    return VERSION


def prepare() -> None:
    class_path(*LIBRARIES)


def play(task: Task) -> Rows:
    table, result = task.input_table(task.folder / "inputs.csv"), task.folder / "result.csv"
    source = Path(__file__).with_name("Fmi4jHost.java")
    java(class_path(*LIBRARIES), source, task.fmu, task.interface, table, ",".join(OUTPUTS), result)
    for line in result.read_text().splitlines():
        time, *values = map(float, line.split(","))
        yield time, values
