"""The results of `linkage-fmu validate`: a table for people, JUnit XML and JSON for machines."""

from __future__ import annotations

import io
import json
import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from junitparser import Error, Failure, JUnitXml, Skipped, TestCase, TestSuite
from rich.table import Table
from rich.text import Text

from .table import CHECKS, FAILED, PASSED, SKIPPED, UNJUDGED, WARNED, Result
from .text import printable

STYLES = {PASSED: "green", WARNED: "yellow", FAILED: "bold red", UNJUDGED: "bold red", SKIPPED: "dim"}
MOST = 10  # problems that the table shows of one check
JSON_VERSION = 1


@dataclass
class Judged:
    """What came out for one FMU; `unreadable` says why nothing did."""

    path: Path
    results: list[Result] = field(default_factory=list)
    unreadable: str | None = None

    @property
    def name(self) -> str:
        """The path as it was given."""
        return printable(str(self.path))

    @property
    def outcome(self) -> str:
        """The worst of its checks."""
        outcomes = {result.outcome for result in self.results}
        if self.unreadable is not None:
            return UNJUDGED
        return next((outcome for outcome in (FAILED, UNJUDGED, WARNED) if outcome in outcomes), PASSED)

    @property
    def seconds(self) -> float:
        return sum(result.seconds for result in self.results)


def exit_status(judged: list[Judged]) -> int:
    """0: no check failed; 1: one did; 2: what should have been judged was not, and no check of another FMU tells."""
    outcomes = {one.outcome for one in judged}
    if any(one.unreadable is not None for one in judged):
        return 2
    return 1 if FAILED in outcomes else 2 if UNJUDGED in outcomes else 0


def result_table(results: list[Result], only_problems: bool = False) -> Table:
    """A row a check: what came out, and why. Checks that were left out for one reason share a row; those that were for
    what another check says have none.
    """
    table = Table(box=None, pad_edge=False, show_header=False)
    shared: dict[tuple[str, str], list[str]] = {}
    for result in results:
        said = result.problems + result.advice
        if not said and (reason := result.unjudged or result.skipped):
            if not result.is_consequence:
                shared.setdefault((result.outcome, reason), []).append(result.title)
            continue
        if only_problems and not said:
            continue
        more = len(said) - MOST
        text = "\n".join(said[:MOST] + ([f"and {more} more"] if more > 0 else [])) or result.check.proves
        table.add_row(Text(result.title), Text(result.outcome, STYLES[result.outcome]), Text(text))
    for (outcome, reason), titles in shared.items():
        if outcome == UNJUDGED or not only_problems:
            named = titles[0] if len(titles) == 1 else f"{len(titles)} checks"
            listed = "" if outcome == UNJUDGED or len(titles) == 1 else f": {', '.join(titles)}"
            table.add_row(Text(named), Text(outcome, STYLES[outcome]), Text(reason + listed, STYLES[outcome]))
    return table


def summary(results: list[Result]) -> str:
    counts = Counter(result.outcome for result in results)
    named = ", ".join(f"{counts[outcome]} {outcome}" for outcome in STYLES if counts[outcome])
    return f"{named}, {sum(result.seconds for result in results):.1f} s"


def check_table() -> Table:
    """What there is, for --list."""
    table = Table("check", "proves that", "FMI 2.0.4", "FMI 3.0.1", box=None, pad_edge=False)
    for check in CHECKS:
        table.add_row(check.name, Text(check.proves), check.fmi2, check.fmi3)
    return table


def junit(judged: list[Judged]) -> bytes:
    """One suite an FMU, one case a check; suites and classes carry the path, for FMUs of one name."""
    xml = JUnitXml("linkage-fmu validate")
    for one in judged:
        suite = TestSuite(one.name)
        class_ = printable(str(one.path.with_suffix("") if one.path.name else one.path))
        for result in one.results:
            case = TestCase(result.title, classname=class_, time=round(result.seconds, 3))
            if result.problems:
                case.result = [Failure("\n".join(result.problems))]
            elif result.unjudged:
                case.result = [Error(result.unjudged)]
            elif result.skipped:
                case.result = [Skipped(result.skipped)]
            if result.advice:
                case.system_out = "\n".join(f"warning: {advice}" for advice in result.advice)
            suite.add_testcase(case)
        if one.unreadable is not None:
            case = TestCase("judged at all", classname=class_)
            case.result = [Error(one.unreadable)]
            suite.add_testcase(case)
        xml.add_testsuite(suite)
    xml.update_statistics()  # type: ignore[no-untyped-call]  # of junitparser
    file = io.BytesIO()
    xml.write(file, pretty=True)
    return file.getvalue()


def as_json(judged: list[Judged], status: int) -> bytes:
    """The same; documentation/validating.md has the fields."""
    fmus = [
        {
            "path": one.name,
            "outcome": one.outcome,
            "unreadable": one.unreadable,
            "seconds": round(one.seconds, 3),
            "checks": [
                {
                    "check": result.check.name,
                    "interface": result.kind,
                    "outcome": result.outcome,
                    "errors": result.problems,
                    "warnings": result.advice,
                    "reason": result.unjudged or result.skipped,
                    "seconds": round(result.seconds, 3),
                }
                for result in one.results
            ],
        }
        for one in judged
    ]
    return json.dumps({"version": JSON_VERSION, "exit_status": status, "fmus": fmus}, indent=1).encode() + b"\n"


def write(path: Path, content: bytes) -> None:
    """Whole or not at all, whatever else writes there. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists() and not path.is_file():  # /dev/stdout, say
        path.write_bytes(content)
        return
    writing = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        writing.write_bytes(content)
        writing.replace(path)
    finally:
        writing.unlink(missing_ok=True)
