"""The FMU under test: its archive, its unpacked files, its description, and the runs that the checks share."""

from __future__ import annotations

import errno
import math
import shutil
import subprocess
import tempfile
import time
import uuid
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable
from lxml import etree

from .process import IS_WINDOWS, OutOfTime, Probe, ProbeError

CO_SIMULATION, MODEL_EXCHANGE = "CoSimulation", "ModelExchange"
STEPS = 100  # of a run, at most
WATCHED = 500  # variables, at most
LARGEST = 256 << 20  # bytes of XML or HTML, which take ten times as many in memory
DEEPEST = 100  # folders in folders of an archive
EXCITATION = 0.01  # of an input, relative to its nominal value


# The machine's fault and not the archive's, where a file cannot be written.
OF_THE_MACHINE = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EMFILE, errno.ENFILE, errno.ENOMEM,
                  errno.EACCES, errno.EPERM, errno.EFBIG}  # fmt: skip


Otherwise = TypeVar("Otherwise")


class NotApplicable(Exception):
    """A check says why it does not apply to this FMU."""


class Consequence(NotApplicable):
    """A check cannot be run for something that another one reports."""


class NotJudged(NotApplicable):
    """A check that would apply is not run here: that is no pass."""


class Advice(str):
    """A problem that only makes an FMU less portable: a warning. A plain str is what the standard forbids: an error."""


@dataclass(frozen=True)
class Options:
    """limit: seconds that one run of the FMU may take; total: seconds for all its checks; memory: bytes that its
    process may hold; unpacked, entries: bytes and files of its archive, at most; glibc: the oldest version that its
    hosts have; skip: checks; strict: advice counts as an error.
    """

    limit: float = 30.0
    total: float = 600.0
    memory: float = 4 * 2.0**30
    unpacked: float = 4 * 2.0**30
    entries: int = 100_000
    glibc: tuple[int, int] = (2, 17)
    skip: frozenset[str] = frozenset()
    strict: bool = False


class Subject:
    """What the checks ask about one FMU. It keeps a folder and two processes until `remove`."""

    def __init__(self, path: Path, options: Options) -> None:
        self.path, self.options = path, options
        self._until = time.monotonic() + options.total
        # The name before the folder, so that no interruption leaves one behind. A space, as users' folders have.
        self._place = Path(tempfile.gettempdir()).resolve() / f"validate {uuid.uuid4().hex[:12]}"
        self.probe, self.other_probe = (
            Probe(self._place / name, options.limit, options.memory, self._until) for name in ("run 1", "run 2")
        )
        self._answers: dict[tuple[str, ...], Any] = {}

    def close(self) -> int:
        """Let the processes end by themselves; returns how many others, started by the FMU, ran on."""
        for probe in (self.probe, self.other_probe):
            probe.close()
        return self.probe.outlived + self.other_probe.outlived

    def remove(self) -> None:
        """End the processes and delete the folder."""
        for probe in (self.probe, self.other_probe):
            probe.remove()
        with suppress(RecursionError):
            shutil.rmtree(self._place, ignore_errors=True)
        if self._place.exists() and not IS_WINDOWS:  # the FMU has locked it, or made folders in folders without end
            for command in (["chmod", "-R", "u+rwx"], ["rm", "-rf"]):
                subprocess.run([*command, "--", self._place], stderr=subprocess.DEVNULL, check=False)

    def be_on_time(self) -> None:
        """Raises OutOfTime."""
        if time.monotonic() >= self._until:
            raise OutOfTime

    # ---- files -----------------------------------------------------------------------------------

    @cached_property
    def folder(self) -> Path:
        """Where it is unpacked, as zipfile does it: nothing lands outside, whatever the archive says. Raises OSError
        where the machine is to blame.
        """
        place = self._place / "fmu"
        name = ""
        try:
            with zipfile.ZipFile(self.path) as archive:
                entries = archive.infolist()
                if excess := self.excess(entries):
                    raise Consequence(f"{excess}: it is not unpacked")
                for entry in entries:
                    if entry.filename == "modelDescription.xml":
                        require_size(entry.filename, entry.file_size)
                for entry in entries:
                    self.be_on_time()
                    name = entry.orig_filename
                    if name.count("/") > DEEPEST:
                        raise Consequence(f"{short(name)} lies more than {DEEPEST} folders deep: it is not unpacked")
                    archive.extract(entry, place)
        except (OutOfTime, NotApplicable):
            raise
        except Exception as problem:  # names that no file can have, a file where a folder should be, damage of any kind
            if is_of_the_machine(problem):
                raise
            reason = (problem.strerror if isinstance(problem, OSError) else None) or str(problem)
            raise Consequence(f"the archive cannot be unpacked: {short(name)}: {reason}") from None
        place.mkdir(parents=True, exist_ok=True)
        return place

    def excess(self, entries: list[zipfile.ZipInfo]) -> str | None:
        """By how much the archive is larger than `options` allow: taken for a bomb."""
        options, size = self.options, sum(entry.file_size for entry in entries)
        if len(entries) > options.entries:
            return f"it has {len(entries)} entries, {options.entries} are allowed (--entries)"
        if size > options.unpacked:
            allowed = f"{options.unpacked / 2**30:.3g} are allowed (--unpacked)"
            return f"unpacked it would have {size / 2**30:.3g} GiB, {allowed}"
        return None

    @cached_property
    def files(self) -> set[str]:
        """Names of the unpacked files, parts separated by "/"."""
        return {file.relative_to(self.folder).as_posix() for file in self.folder.rglob("*") if file.is_file()}

    def read(self, name: str) -> bytes:
        """A file that is to be parsed."""
        path = self.folder / name
        require_size(name, path.stat().st_size)
        return path.read_bytes()

    @cached_property
    def description(self) -> ModelDescription:
        folder = str(self.folder)
        try:
            return fmpy.read_model_description(folder, validate=False)
        except Exception:  # noqa: BLE001 fmpy raises plain Exceptions, its XML library errors of its own
            raise Consequence("the description cannot be read") from None

    @cached_property
    def root(self) -> Any:
        """The description as its XML has it, for what fmpy drops."""
        return etree.parse(str(self.folder / "modelDescription.xml")).getroot()

    @property
    def is_fmi2(self) -> bool:
        version: str = self.description.fmiVersion
        return version.startswith("2.")

    @cached_property
    def binaries(self) -> list[str]:
        """The shared libraries that the description promises, of all platforms: "binaries/linux64/Model.so"."""
        names = {interface.modelIdentifier for interface in self.interfaces.values()}
        return sorted(
            file for file in self.files
            if file.startswith("binaries/") and file.count("/") == 2
            and Path(file).stem in names and Path(file).suffix in (".so", ".dll", ".dylib")
        )  # fmt: skip

    def inspected(self, binary: str) -> dict[str, Any]:
        """What probe.py finds in a binary; raises ProbeError."""
        found: dict[str, Any] = self._once(
            ("inspect", binary), lambda: self.probe.do("inspect", file=str(self.folder / binary))
        )
        return found

    # ---- interfaces ------------------------------------------------------------------------------

    @cached_property
    def interfaces(self) -> dict[str, Any]:
        """The interface types by the name that fmpy gives them."""
        if self.description.fmiVersion[:2] not in ("2.", "3."):
            raise NotJudged(f"FMI {self.description.fmiVersion} is not judged here, only FMI 2.0 and 3.0")
        given = {CO_SIMULATION: self.description.coSimulation, MODEL_EXCHANGE: self.description.modelExchange,
                 "ScheduledExecution": self.description.scheduledExecution}  # fmt: skip
        return {kind: interface for kind, interface in given.items() if interface is not None}

    def demand(self, kind: str, fmi2_name: str, fmi3_name: str) -> None:
        """Raises NotApplicable where a capability is not declared. (fmpy drops some of FMI 3.0's.)"""
        name = fmi2_name if self.is_fmi2 else fmi3_name
        if self.root.find(kind).get(name) not in ("true", "1"):
            raise NotApplicable(f"{name} is not declared")

    # ---- runs ------------------------------------------------------------------------------------

    @cached_property
    def course(self) -> dict[str, Any]:
        """The run that all checks share: the default experiment's first steps, with every continuous input moved a
        little, so that something happens and no model is driven out of its range.
        """
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
        rows: list[list[str]] = self.outcome_of_run(kind)["rows"]
        return rows

    def outcome_of_run(self, kind: str) -> dict[str, Any]:
        """Rows and times of the shared run, and whether the FMU ended it; raises ProbeError."""
        outcome: dict[str, Any] = self._once(("run", kind), lambda: self.ask(kind, "run", course=self.course))
        return outcome

    def ask(self, kind: str, job: str, **fields: Any) -> Any:
        return self._ask(self.probe, kind, job, fields)

    def ask_other(self, kind: str, job: str, **fields: Any) -> Any:
        """The same in the other process."""
        return self._ask(self.other_probe, kind, job, fields)

    def _ask(self, probe: Probe, kind: str, job: str, fields: dict[str, Any]) -> Any:
        try:
            return probe.do(job, folder=str(self.folder), kind=kind, **fields)
        except ProbeError:  # its instance is still there, and may be the only one that a process can have
            if self.interfaces[kind].canBeInstantiatedOnlyOncePerProcess:
                probe.close()
            raise

    def _once(self, key: tuple[str, ...], make: Callable[[], Any]) -> Any:
        if key not in self._answers:
            self._answers[key] = make()
        return self._answers[key]


def require_size(name: str, size: int) -> None:
    """Raises NotJudged for what would fill the memory."""
    if size > LARGEST:
        mib = 1 << 20
        raise NotJudged(f"{name} has {size / mib:.0f} MiB; above {LARGEST / mib:.0f} MiB it is not read here")


def is_of_the_machine(problem: Exception) -> bool:
    return isinstance(problem, OSError) and problem.errno in OF_THE_MACHINE


def short(name: str) -> str:
    """A foreign name as it can be shown: quoted, and not longer than a line."""
    shown = repr(name)
    return shown if len(shown) <= 60 else f"{shown[:40]}…{shown[-19:]}"


def number(text: str | None, otherwise: Otherwise) -> float | Otherwise:
    """The number that a text says, or else what is to stand for it."""
    try:
        return otherwise if text is None else float(text)
    except ValueError:
        return otherwise


def limits_of(variable: Any) -> tuple[float, float]:
    """min and max of a variable, or else of its type; or of a type."""
    if variable.type in ("Boolean", "String", "Binary", "Clock", "Enumeration"):
        return -math.inf, math.inf
    of_type = getattr(variable, "declaredType", None)
    least = variable.min if variable.min is not None else getattr(of_type, "min", None)
    most = variable.max if variable.max is not None else getattr(of_type, "max", None)
    return number(least, -math.inf), number(most, math.inf)


def can_be_moved(variable: ModelVariable) -> bool:
    return (
        variable.causality == "input" and variable.variability == "continuous" and not variable.shape
        and variable.type in ("Real", "Float64", "Float32")
    )  # fmt: skip


def excited(variable: ModelVariable, order: int, part: float) -> float:
    """The start value and a small wave around it, another for each input, within the declared range."""
    nominal = abs(number(variable.nominal, 1.0)) or 1.0
    value = number(variable.start, 0.0) + EXCITATION * nominal * math.sin(2 * math.pi * part * (1 + 0.1 * order))
    least, most = number(variable.min, -math.inf), number(variable.max, math.inf)
    return float(min(max(value, least), most))
