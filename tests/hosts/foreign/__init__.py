"""Simulation hosts that others wrote, one module each. A module says of its host

    NAME, PACKAGE       what it is called, and the registry and name that it comes from
    INTERFACES          what of FMI it plays: pairs such as ("2.0", "CS"), ("3.0", "ME")
    FEEDING             how it gives inputs to an FMU
    DEFECTS             {(edition, interface): what is wrong with the host itself there, as seen}
    missing()           what this machine lacks to run it, "" if nothing
    version()           the version that runs
    PREPARED            where it has to be fetched or built: what is done for it, from where and for how long
    is_prepared(), prepare()   whether that was done before; does it, once for all its runs
    play(task)          runs the FMU, which it is handed unchanged; yields (time, values of OUTPUTS)

and of a checker NAME, PACKAGE, EDITIONS, missing(), version() and check(fmu), the list of what it reports.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType

import fmpy
from fmpy.model_description import ModelDescription

from tests.hosts.drives import INPUTS, STEP, STEPS, Drive

HOSTS = (
    "fmpy_host", "fmpy_euler", "ecos", "libcosim", "container", "container_sequential", "fmi_sim",
    "fmi_sim_without_units", "maestro", "fmi4j", "casadi_host", "fmuloader_host",
)  # fmt: skip
CHECKERS = ("fmpy_validate", "fmutool", "vdmcheck")
TOOLS = Path(__file__).resolve().parents[3] / "build" / "hosts"  # what is built or resolved for a host
LONG_NAMES = {"CS": "CoSimulation", "ME": "ModelExchange"}

Rows = Iterator[tuple[float, Sequence[float]]]


class HostError(RuntimeError):
    """The host did not run; the message is what it said."""


@dataclass(frozen=True)
class Task:
    """One FMU, one interface of it, one drive; `folder` is the host's to write into."""

    fmu: Path
    edition: str
    interface: str
    drive: Drive
    folder: Path

    @cached_property
    def description(self) -> ModelDescription:
        return fmpy.read_model_description(str(self.fmu))

    def references(self, names: Sequence[str]) -> list[int]:
        """Value references."""
        known = {variable.name: variable.valueReference for variable in self.description.modelVariables}
        return [known[name] for name in names]

    @cached_property
    def times(self) -> list[float]:
        """The communication points, from 0 on."""
        return [i * STEP for i in range(STEPS + 1)]

    def input_table(self, path: Path, separator: str = ",", quote: str = "") -> Path:
        """Writes the inputs at all communication points as CSV, each number with all its digits."""
        lines = [separator.join(("time", *(f"{quote}{name}{quote}" for name in INPUTS)))]
        lines += [separator.join(repr(float(v)) for v in (t, *self.drive.inputs(t))) for t in self.times]
        path.write_text("\n".join(lines) + "\n", encoding="ascii")
        return path


def load(name: str) -> ModuleType:
    """A module of HOSTS or CHECKERS; it imports its host's package only when it runs it."""
    return importlib.import_module(f"{__name__}.{name}")


def interfaces(fmu: Path) -> list[tuple[str, str]]:
    """What of FMI a file offers, as pairs of INTERFACES."""
    description = fmpy.read_model_description(str(fmu), validate=False)
    offered = {"CS": description.coSimulation, "ME": description.modelExchange}
    return [(description.fmiVersion[:3], name) for name, interface in offered.items() if interface is not None]


# ---- what several modules need -------------------------------------------------------------------


def missing_package(name: str) -> str:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return f"the Python package {name}"
    return ""


def missing_programs(*names: str) -> str:
    return " and ".join(name for name in names if shutil.which(name) is None)


def run(*command: object, cwd: Path | None = None, log: Path | None = None) -> str:
    """What a program printed, or wrote into ``log``; raises HostError with its first line that speaks of an error where
    it failed.
    """
    words = [str(word) for word in command]
    if log is None:
        done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, errors="replace")
        out, said = done.stdout, done.stderr.strip() or done.stdout.strip()
    else:
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("w") as file:
            done = subprocess.run(words, cwd=cwd, stdout=file, stderr=subprocess.STDOUT)
        out = said = log.read_text(errors="replace").strip()
    if done.returncode != 0:
        lines = said.splitlines()
        errors = [line.strip() for line in lines if re.search("error|exception", line, re.IGNORECASE)]
        first = (errors or lines[-1:] or ["nothing was said"])[0]
        raise HostError(f"{Path(words[0]).name} ended with {done.returncode}: {first}")
    return out
