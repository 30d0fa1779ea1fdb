"""The checks, in the order in which they are run, and how one FMU is put through them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from . import files, ours, runs
from .process import ProbeError
from .subject import CO_SIMULATION, MODEL_EXCHANGE, NotApplicable, Options, Subject

PASSED, FAILED, SKIPPED = "passed", "failed", "skipped"


@dataclass(frozen=True)
class Check:
    """`test` yields problems, for an FMU or for each of its interface types; `needs` are checks that must have passed
    before. `fmi2` and `fmi3` are sections of FMI 2.0.4 and 3.0.1, or the source where FMI says nothing."""

    name: str
    proves: str
    fmi2: str
    fmi3: str
    test: Callable[..., Iterator[str]]
    needs: tuple[str, ...] = ()
    of_interface: bool = False


@dataclass
class Result:
    """What a check came to: problems, or the reason for which it was skipped."""

    check: Check
    kind: str | None = None
    problems: list[str] = field(default_factory=list)
    skipped: str | None = None
    seconds: float = 0.0

    @property
    def outcome(self) -> str:
        return FAILED if self.problems else SKIPPED if self.skipped else PASSED

    @property
    def title(self) -> str:
        short = {CO_SIMULATION: "CS", MODEL_EXCHANGE: "ME", "ScheduledExecution": "SE"}
        return self.check.name if self.kind is None else f"{self.check.name} ({short[self.kind]})"


def static(name: str, proves: str, fmi2: str, fmi3: str, test: Callable) -> Check:
    return Check(name, proves, fmi2, fmi3, test)


def live(name: str, proves: str, fmi2: str, fmi3: str, test: Callable, *needs: str) -> Check:
    return Check(name, proves, fmi2, fmi3, test, needs, of_interface=True)


PEP = "PEP 599"
CHECKS = (
    static("archive", "unpacks whole, everywhere, into its folder", "2.3", "2.5", files.archive),
    static("description", "modelDescription.xml as fmpy validates it", "2.2", "2.4", files.description),
    static("value-references", "no two variables share what can be set", "2.2.7", "2.4", files.value_references),
    static("files", "all files that others name are there", "2.3", "2.5", files.files),
    static("terminals", "terminals and icons name what is there", "-", "2.4", files.terminals),
    static("binaries", "each is there, for its system and processor", "2.3", "2.5", files.binaries),
    static("functions", "every function of the standard is exported", "2.3", "2.5", files.functions),
    static("symbols", "nothing else is exported that could clash", "2.1.1", "2.2", files.symbols),
    static("libraries", "needed ones are on every machine, or inside", PEP, "2.5", files.libraries),
    static("glibc", "runs with a glibc as old as --glibc", PEP, PEP, files.glibc),
    live("load", "the binary loads, and is of this FMI version", "2.1.4", "2.3", runs.load),
    live("instance", "made with the description's token", "2.1.5", "2.3", runs.instance, "load"),
    live("token", "no instance with any other", "2.1.5", "2.3", runs.token, "instance"),
    live("start-values", "the same in description and binary", "2.2.7", "2.4", runs.start_values, "instance"),
    live("run", "default experiment: no error, finite values", "3.2, 4.2", "3.2, 4.2", runs.run, "instance"),
    live("determinism", "another process computes the same bits", "-", "-", runs.determinism, "run"),
    live("instances", "a second instance beside it changes nothing", "2.1.5", "2.3", runs.instances, "run"),
    live("reset", "after a reset it runs as if new", "2.1.6", "2.3", runs.reset, "run"),
    live("state-replay", "a restored state goes on with the same bits", "2.1.8", "2.2", runs.state_replay, "run"),
    live("serialized-state", "so does one taken to another process", "2.1.8", "2.2", runs.serialized_state, "run"),
    live("derivatives", "directional ones are what differences give", "2.1.9", "2.2", runs.derivatives, "run"),
    live("reference-results", "it reproduces the results that it carries", "-", "-", runs.reference_results, "run"),
    static("interface", "variables and token are this project's", "-", "-", ours.interface),
    live("kinematics", "the tip is where the linkage is at step's end", "-", "-", ours.kinematics, "run"),
)
NAMES = tuple(check.name for check in CHECKS)
NAMES_OF_LIVE = tuple(check.name for check in CHECKS if check.of_interface)


def validate(path: Path, options: Options, begun: Callable[[str], None] = lambda _: None) -> list[Result]:
    """All checks on one FMU. `begun` is told each check's title. Raises OSError where the file cannot be read."""
    path.open("rb").close()
    results: list[Result] = []
    with Subject(path, options) as fmu:
        for probe, of_checks in ((fmu.probe, NAMES_OF_LIVE), (fmu.other_probe, ("determinism", "serialized-state"))):
            if not options.skip.issuperset(of_checks):
                probe.start()  # it gets ready while the files are looked at
        for check in CHECKS:
            for kind in kinds_of(fmu, check):
                result = Result(check, kind)
                begun(result.title)
                put_through(fmu, result, results)
                results.append(result)
    return results


def kinds_of(fmu: Subject, check: Check) -> list[str | None]:
    if not check.of_interface:
        return [None]
    try:
        return list(fmu.interfaces) or [None]
    except NotApplicable:
        return [None]


def put_through(fmu: Subject, result: Result, before: list[Result]) -> None:
    """Fill in `result`."""
    check, begin = result.check, time.perf_counter()
    needed = {other.check.name: other for other in before if other.kind == result.kind and other.outcome != PASSED}
    lacking = [needed[name] for name in check.needs if name in needed and name not in fmu.options.skip]
    try:
        if check.name in fmu.options.skip:
            raise NotApplicable("as asked for")
        for other in lacking:
            raise NotApplicable(f"needs {other.check.name} to pass" if other.problems else other.skipped)
        if check.of_interface and result.kind not in (CO_SIMULATION, MODEL_EXCHANGE):
            kinds = ", ".join(fmu.interfaces) or "an FMU without an interface type"
            raise NotApplicable(f"{result.kind or kinds} is not run here")
        for problem in check.test(fmu, result.kind) if check.of_interface else check.test(fmu):
            result.problems.append(problem)
    except NotApplicable as reason:
        result.skipped = str(reason)
    except ProbeError as problem:
        result.problems.append(str(problem))
    except Exception as problem:  # fmpy and the XML libraries on what they were not made for: a finding as well
        result.problems.append(f"this check stopped: {type(problem).__name__}: {problem}")
    result.seconds = time.perf_counter() - begin
