"""The FMU under test: its archive, its unpacked files, its description, and the runs that the checks share."""

from __future__ import annotations

import math
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable
from lxml import etree

from ...interface import Interface, load_interface
from .process import Probe

CO_SIMULATION, MODEL_EXCHANGE = "CoSimulation", "ModelExchange"
STEPS = 100  # of a run, at most
WATCHED = 500  # variables, at most
LARGEST = 4 << 30  # bytes unpacked: what claims more is taken for a bomb
UNREADABLE = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)  # of zipfile
EXCITATION = 0.01  # of an input, relative to its nominal value


class NotApplicable(Exception):
    """A check says why it does not apply to this FMU."""


@dataclass(frozen=True)
class Options:
    """limit: seconds that one run of the FMU may take; glibc: the oldest version that its hosts have; skip: checks."""

    limit: float = 30.0
    glibc: tuple[int, int] = (2, 17)
    skip: frozenset[str] = frozenset()


class Subject:
    """What the checks ask about one FMU. Use it as a context: it keeps a folder and two processes."""

    def __init__(self, path: Path, options: Options) -> None:
        self.path, self.options = path, options
        self.probe, self.other_probe = Probe(options.limit), Probe(options.limit)
        self._answers: dict[tuple, object] = {}

    def __enter__(self) -> Subject:
        self._place = Path(tempfile.mkdtemp(prefix="validate ")).resolve()  # a space in it, as users' folders have
        return self

    def __exit__(self, *_) -> None:
        for probe in (self.probe, self.other_probe):
            probe.remove()
        shutil.rmtree(self._place, ignore_errors=True)

    # ---- files -----------------------------------------------------------------------------------

    @cached_property
    def folder(self) -> Path:
        """Where it is unpacked, as zipfile does it: nothing lands outside, whatever the archive says."""
        try:
            with zipfile.ZipFile(self.path) as archive:
                if sum(entry.file_size for entry in archive.infolist()) > LARGEST:
                    raise NotApplicable("the archive is too large to unpack")
                archive.extractall(self._place)
        except UNREADABLE:
            raise NotApplicable("the archive cannot be read") from None
        except OSError as problem:  # names that no file can have, a file where a folder should be
            raise NotApplicable(f"the archive cannot be unpacked: {problem.strerror}") from None
        return self._place

    @cached_property
    def files(self) -> set[str]:
        """Names of the unpacked files, parts separated by "/"."""
        return {file.relative_to(self.folder).as_posix() for file in self.folder.rglob("*") if file.is_file()}

    @cached_property
    def description(self) -> ModelDescription:
        try:
            return fmpy.read_model_description(str(self.folder), validate=False)
        except NotApplicable:
            raise
        except Exception:  # fmpy raises plain Exceptions, its XML library errors of its own
            raise NotApplicable("the description cannot be read") from None

    @property
    def is_fmi2(self) -> bool:
        return self.description.fmiVersion.startswith("2.")

    @cached_property
    def binaries(self) -> list[str]:
        """The shared libraries that the description promises, of all platforms: "binaries/linux64/Model.so"."""
        names = {interface.modelIdentifier for interface in self.interfaces.values()}
        return sorted(
            file for file in self.files
            if file.startswith("binaries/") and file.count("/") == 2
            and Path(file).stem in names and Path(file).suffix in (".so", ".dll", ".dylib")
        )  # fmt: skip

    def inspected(self, binary: str) -> dict:
        """What probe.py finds in a binary; raises ProbeError."""
        return self._once(("inspect", binary), lambda: self.probe.do("inspect", file=str(self.folder / binary)))

    # ---- interfaces ------------------------------------------------------------------------------

    @cached_property
    def interfaces(self) -> dict:
        """The interface types by the name that fmpy gives them."""
        if self.description.fmiVersion[:2] not in ("2.", "3."):
            raise NotApplicable(f"FMI {self.description.fmiVersion} is not judged here, only FMI 2.0 and 3.0")
        given = {CO_SIMULATION: self.description.coSimulation, MODEL_EXCHANGE: self.description.modelExchange,
                 "ScheduledExecution": self.description.scheduledExecution}  # fmt: skip
        return {kind: interface for kind, interface in given.items() if interface is not None}

    def demand(self, kind: str, fmi2_name: str, fmi3_name: str) -> None:
        """Raises NotApplicable where a capability is not declared. (fmpy drops some of FMI 3.0's.)"""
        name = fmi2_name if self.is_fmi2 else fmi3_name
        root = etree.parse(str(self.folder / "modelDescription.xml"))
        if root.find(kind).get(name) not in ("true", "1"):
            raise NotApplicable(f"{name} is not declared")

    # ---- our own interface -----------------------------------------------------------------------

    @property
    def ours(self) -> Interface:
        """The interface of this project; raises NotApplicable where the FMU has another."""
        interface = load_interface()
        if not {variable.name for variable in self.description.modelVariables} >= {"crank.phi", "tip.x", "geometry.L1"}:
            raise NotApplicable(f"an FMU of its own interface, not {interface.model.name}'s")
        return interface

    # ---- runs ------------------------------------------------------------------------------------

    @cached_property
    def course(self) -> dict:
        """The run that all checks share: the default experiment's first steps, with every continuous input moved a
        little, so that something happens and no model is driven out of its range."""
        settings = self.description.defaultExperiment
        start = number(getattr(settings, "startTime", None), 0.0)
        stop = number(getattr(settings, "stopTime", None), start + 1.0)
        span = stop - start if stop > start else 1.0
        step = number(getattr(settings, "stepSize", None), 0.0)
        for interface in self.interfaces.values():
            step = step or number(getattr(interface, "fixedInternalStepSize", None), 0.0)
        if not step > 0:
            step = span / STEPS
        count = min(max(round(span / step), 2), STEPS)
        moved = [variable for variable in self.description.modelVariables if can_be_moved(variable)]
        inputs = {
            variable.name: [excited(variable, order, index / count) for index in range(count)]
            for order, variable in enumerate(moved)
        }
        return {"names": self.watched, "start": start, "step": step, "count": count, "inputs": inputs}

    @cached_property
    def watched(self) -> list[str]:
        """Outputs, then all else that changes in a run."""
        changing = [
            variable for variable in self.description.modelVariables
            if variable.causality in ("output", "local", "independent") and variable.variability != "constant"
            and variable.type not in ("Binary", "Clock")
        ]  # fmt: skip
        changing.sort(key=lambda variable: variable.causality != "output")
        return [variable.name for variable in changing[:WATCHED]]

    def run(self, kind: str) -> list[list[str]]:
        """What is watched after each step of the shared run; raises ProbeError."""
        return self._once(("run", kind), lambda: self.ask(kind, "run", course=self.course)["rows"])

    def ask(self, kind: str, job: str, **fields):
        return self.probe.do(job, folder=str(self.folder), kind=kind, **fields)

    def ask_other(self, kind: str, job: str, **fields):
        """The same in the other process."""
        return self.other_probe.do(job, folder=str(self.folder), kind=kind, **fields)

    def _once(self, key: tuple, make: Callable):
        if key not in self._answers:
            self._answers[key] = make()
        return self._answers[key]


def number(text: str | None, otherwise):
    """The number that a text says, or else what is to stand for it."""
    try:
        return otherwise if text is None else float(text)
    except ValueError:
        return otherwise


def can_be_moved(variable: ModelVariable) -> bool:
    return (
        variable.causality == "input" and variable.variability == "continuous" and not variable.shape
        and variable.type in ("Real", "Float64", "Float32")
    )  # fmt: skip


def excited(variable: ModelVariable, order: int, part: float) -> float:
    """The start value and a small wave around it, another for each input, within the declared range."""
    nominal = abs(number(variable.nominal, 1.0)) or 1.0
    value = number(variable.start, 0.0) + EXCITATION * nominal * math.sin(2 * math.pi * part * (1 + 0.1 * order))
    return min(max(value, number(variable.min, -math.inf)), number(variable.max, math.inf))
