"""The results of `linkage-fmu validate` as a table for people and as JUnit XML for machines."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from junitparser import Failure, JUnitXml, Skipped, TestCase, TestSuite
from rich.table import Table
from rich.text import Text

from .table import CHECKS, FAILED, PASSED, SKIPPED, Result

STYLES = {PASSED: "green", FAILED: "bold red", SKIPPED: "dim"}
MOST = 10  # problems that the table shows of one check


def result_table(results: list[Result]) -> Table:
    """One row a check: what came out, and why."""
    table = Table(box=None, pad_edge=False, show_header=False)
    for result in results:
        text = result.check.proves
        if result.problems:
            more = len(result.problems) - MOST
            text = "\n".join(result.problems[:MOST] + ([f"and {more} more"] if more > 0 else []))
        elif result.skipped:
            text = result.skipped
        style = STYLES[result.outcome]
        table.add_row(Text(result.title), Text(result.outcome, style), Text(text, style if result.skipped else ""))
    return table


def summary(results: list[Result]) -> str:
    counts = Counter(result.outcome for result in results)
    named = ", ".join(f"{counts[outcome]} {outcome}" for outcome in (PASSED, FAILED, SKIPPED) if counts[outcome])
    return f"{named}, {sum(result.seconds for result in results):.1f} s"


def check_table() -> Table:
    """What there is, for --list."""
    table = Table("check", "proves that", "FMI 2.0.4", "FMI 3.0.1", box=None, pad_edge=False)
    for check in CHECKS:
        table.add_row(check.name, Text(check.proves), check.fmi2, check.fmi3)
    return table


def write_junit(path: Path, results: dict[Path, list[Result]]) -> None:
    """One suite an FMU, one case a check."""
    xml = JUnitXml("linkage-fmu validate")
    for fmu, of_one in results.items():
        suite = TestSuite(fmu.name)
        for result in of_one:
            case = TestCase(result.title, classname=fmu.stem, time=round(result.seconds, 3))
            if result.problems:
                case.result = [Failure("\n".join(map(printable, result.problems)))]
            elif result.skipped:
                case.result = [Skipped(printable(result.skipped))]
            suite.add_testcase(case)
        xml.add_testsuite(suite)
    xml.update_statistics()
    path.parent.mkdir(parents=True, exist_ok=True)
    xml.write(str(path), pretty=True)


def printable(text: str) -> str:
    """Without the control characters that XML cannot hold."""
    return "".join(character if character.isprintable() or character in "\n\t" else "?" for character in text)
