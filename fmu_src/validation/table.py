"""The checks, in the order in which they are run, and how one FMU is put through them."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from . import files, ours, runs
from .process import BrokenInstallation, OutOfTime, ProbeError
from .subject import (
    CO_SIMULATION,
    MODEL_EXCHANGE,
    Advice,
    Consequence,
    NotApplicable,
    NotJudged,
    Options,
    Subject,
    is_of_the_machine,
)  # fmt: skip
from .text import printable

PASSED, WARNED, FAILED, SKIPPED, UNJUDGED = "passed", "warned", "failed", "skipped", "not judged"
MOST_PROBLEMS = 1000  # of one check


@dataclass(frozen=True)
class Check:
    """`test` yields problems, for an FMU or for each of its interface types: an error each, or where it is an Advice a
    warning. `needs` are checks that must have passed before, with warnings or without. `fmi2` and `fmi3` are sections
    of FMI 2.0.4 and 3.0.1, or the source where FMI says nothing.
    """

    name: str
    proves: str
    fmi2: str
    fmi3: str
    test: Callable[..., Iterator[str]]
    needs: tuple[str, ...] = ()
    of_interface: bool = False


@dataclass
class Result:
    """What a check came to: problems (errors), advice (warnings), or the reason for which it was skipped (it does not
    apply) or not judged (it would apply). Texts are printable.
    """

    check: Check
    kind: str | None = None
    problems: list[str] = field(default_factory=list)
    advice: list[str] = field(default_factory=list)
    skipped: str | None = None
    unjudged: str | None = None
    is_consequence: bool = False  # skipped for what another check says
    seconds: float = 0.0

    @property
    def outcome(self) -> str:
        if self.problems:
            return FAILED
        if self.unjudged:
            return UNJUDGED
        return WARNED if self.advice else SKIPPED if self.skipped else PASSED

    @property
    def title(self) -> str:
        short = {CO_SIMULATION: "CS", MODEL_EXCHANGE: "ME", "ScheduledExecution": "SE"}
        return self.check.name if self.kind is None else f"{self.check.name} ({short[self.kind]})"


def static(name: str, proves: str, fmi2: str, fmi3: str, test: Callable[..., Iterator[str]]) -> Check:
    return Check(name, proves, fmi2, fmi3, test)


def live(name: str, proves: str, fmi2: str, fmi3: str, test: Callable[..., Iterator[str]], *needs: str) -> Check:
    return Check(name, proves, fmi2, fmi3, test, needs, of_interface=True)


PEP = "PEP 599"
CHECKS = (
    static("archive", "unpacks whole, everywhere, into its folder", "2.3", "2.5", files.archive),
    static("description", "modelDescription.xml as fmpy validates it", "2.2", "2.4", files.description),
    static("value-references", "no two variables share what can be set", "2.2.7", "2.4", files.value_references),
    static("variables", "numbers in the description agree", "2.2.7", "2.4.7", files.variables),
    static("units", "their names say what their definitions do", "2.2.2", "2.4.4", files.units),
    static("files", "all files that others name are there", "2.3", "2.5", files.files),
    static("terminals", "terminals and icons name what is there", "-", "2.4", files.terminals),
    static("binaries", "each is there, for its system and processor", "2.3", "2.5", files.binaries),
    static("functions", "every function of the standard is exported", "2.3", "2.5", files.functions),
    static("symbols", "nothing else is exported that could clash", "2.1.1", "2.2", files.symbols),
    static("libraries", "needed ones are on every machine, or inside", PEP, "2.5", files.libraries),
    static("glibc", "runs with a glibc as old as --glibc", PEP, PEP, files.glibc),
    static("heap-at-exit", "no library known to corrupt its host at exit", "-", "-", files.heap_at_exit),
    static("heap-after-error", "nor one known to do so after an error", "-", "-", files.heap_after_error),
    live("load", "the binary loads, and is of this FMI version", "2.1.4", "2.3", runs.load),
    live("instance", "made with the description's token", "2.1.5", "2.3", runs.instance, "load"),
    live("token", "no instance with any other", "2.1.5", "2.3", runs.token, "instance"),
    live("start-values", "the same in description and binary", "2.2.7", "2.4", runs.start_values, "instance"),
    live("run", "default experiment: no error, finite values", "3.2, 4.2", "3.2, 4.2", runs.run, "instance"),
    live("independent", "its time is the host's", "2.2.7", "2.4.7", runs.independent, "run"),
    live("ranges", "what changes stays between min and max", "2.2.7", "2.4.7", runs.ranges, "run"),
    live("states", "as declared, alike by all functions, moving", "3.2", "3.2", runs.states, "run"),
    live("dependencies", "outputs follow what they are said to, as said", "2.2.8", "2.4.8", runs.dependencies, "run"),
    live("determinism", "another process computes the same bits", "-", "-", runs.determinism, "run"),
    live("instances", "a second instance beside it changes nothing", "2.1.5", "2.3", runs.instances, "run"),
    live("reset", "after a reset it runs as if new", "2.1.6", "2.3", runs.reset, "run"),
    live("state-replay", "a restored state goes on with the same bits", "2.1.8", "2.2", runs.state_replay, "run"),
    live("serialized-state", "so does one taken to another process", "2.1.8", "2.2", runs.serialized_state, "run"),
    live("derivatives", "directional ones are what differences give", "2.1.9", "2.2", runs.derivatives, "run"),
    live("adjoint", "so are the adjoint ones", "-", "2.2.11", runs.adjoint, "run"),
    live("input-derivatives", "can be set, and have an effect", "4.2.1", "-", runs.input_derivatives, "run"),
    live("output-derivatives", "the slopes of the outputs", "4.2.1", "4.2.1", runs.output_derivatives, "run"),
    live("variable-step", "it takes steps of several lengths", "4.2.2", "4.2.1", runs.variable_step, "run"),
    live("event-mode", "it can be entered between steps", "-", "4.2.1", runs.event_mode, "run"),
    live("intermediate-update", "it calls back, and can return early", "-", "4.2.2", runs.intermediate_update, "run"),
    live("log", "declared categories, text in UTF-8", "2.1.5", "2.3.1", runs.log, "run"),
    live("memory", "none is lost with an instance", "2.1.5", "2.3.1", runs.memory, "instance"),
    live("reference-results", "it reproduces the results that it carries", "-", "-", runs.reference_results, "run"),
    static("interface", "variables and token are this project's", "-", "-", ours.interface),
    live("kinematics", "the tip is where the linkage is at step's end", "-", "-", ours.kinematics, "run"),
    static("processes", "what it starts ends with its host", "2.1.5", "2.3", runs.processes),
)
NAMES = tuple(check.name for check in CHECKS)
NAMES_OF_LIVE = tuple(check.name for check in CHECKS if check.of_interface)


def validate(path: Path, options: Options, begun: Callable[[str], None] = lambda _: None) -> list[Result]:
    """All checks on one FMU. `begun` is told each check's title. Raises OSError where the file
    cannot be read or the machine has no room for it, BrokenInstallation where no FMU can be run here.
    """
    require_file(path)
    results: list[Result] = []
    fmu = Subject(path, options)
    try:
        for probe, of_checks in ((fmu.probe, NAMES_OF_LIVE), (fmu.other_probe, ("determinism", "serialized-state"))):
            if not options.skip.issuperset(of_checks):
                probe.start()  # it gets ready while the files are looked at
        for check in CHECKS:
            for kind in kinds_of(fmu, check):
                result = Result(check, kind)
                begun(result.title)
                put_through(fmu, result, results)
                results.append(result)
    finally:
        try:
            fmu.remove()
        except KeyboardInterrupt:
            fmu.remove()
            raise
    if not any(result.problems or result.unjudged for result in results):
        for result in results:
            if result.is_consequence:  # of what a check would have said that was left out
                result.unjudged = result.skipped
    return results


def require_file(path: Path) -> None:
    """Raises OSError where there is none to be read, or something that would be read for ever."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "is no regular file", str(path))
    path.open("rb").close()


def kinds_of(fmu: Subject, check: Check) -> list[str | None]:
    if not check.of_interface:
        return [None]
    try:
        return list(fmu.interfaces) or [None]
    except (NotApplicable, OutOfTime):
        return [None]


def put_through(fmu: Subject, result: Result, before: list[Result]) -> None:
    """Fill in `result`."""
    check, begin = result.check, time.perf_counter()
    held = (PASSED, WARNED)
    needed = {other.check.name: other for other in before if other.kind == result.kind and other.outcome not in held}
    lacking = [needed[name] for name in check.needs if name in needed and name not in fmu.options.skip]
    try:
        if check.name in fmu.options.skip:
            raise NotApplicable("as asked for")
        for other in lacking:
            if other.unjudged:
                raise NotJudged(other.unjudged)
            if other.problems:
                raise Consequence(f"needs {other.check.name} to pass")
            raise Consequence(other.skipped) if other.is_consequence else NotApplicable(other.skipped)
        if check.of_interface and result.kind not in (CO_SIMULATION, MODEL_EXCHANGE):
            require_kind(fmu, result.kind)
        fmu.be_on_time()
        for problem in check.test(fmu, result.kind) if check.of_interface else check.test(fmu):
            is_advice = isinstance(problem, Advice) and not fmu.options.strict
            (result.advice if is_advice else result.problems).append(printable(problem))
            if len(result.problems) + len(result.advice) >= MOST_PROBLEMS:
                result.problems.append(f"this check stopped after {MOST_PROBLEMS} problems")
                break
    except NotJudged as reason:
        result.unjudged = printable(str(reason))
    except NotApplicable as reason:
        result.skipped, result.is_consequence = printable(str(reason)), isinstance(reason, Consequence)
    except OutOfTime:
        result.unjudged = f"the {fmu.options.total:g} s for all checks of an FMU are over (--limit)"
    except ProbeError as problem:
        result.problems.append(printable(str(problem)))
    except BrokenInstallation:
        raise
    except Exception as problem:  # fmpy and the XML libraries on what they were not made for: a finding as well
        if is_of_the_machine(problem):
            raise
        result.problems.append(printable(f"this check stopped: {type(problem).__name__}: {problem}"))
    result.seconds = time.perf_counter() - begin


def require_kind(fmu: Subject, kind: str | None) -> None:
    """Raises NotApplicable for an interface type that is not run here, NotJudged where the FMU has no other."""
    if not fmu.interfaces:
        raise Consequence("it has no interface type")
    reason = f"{kind} is not run here"
    raise NotApplicable(reason) if {CO_SIMULATION, MODEL_EXCHANGE} & set(fmu.interfaces) else NotJudged(reason)
