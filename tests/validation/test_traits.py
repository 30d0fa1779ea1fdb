"""FMUs that are odd and right: none of them is refused. Small ones with what Reference-FMUs and others have."""

from __future__ import annotations

import re

import pytest

from fmu_src.validation.files import WINDOWS_LIBRARIES
from fmu_src.validation.subject import Options
from fmu_src.validation.table import FAILED, NAMES, PASSED, Result, validate
from tests.validation import small_fmu

XML = "modelDescription.xml"
REPEATED = ("run", "determinism", "instances", "reset", "state-replay", "serialized-state")
CLOCK = b'<Clock name="tick" valueReference="8" causality="local" intervalVariability="triggered"/>\n    '


@pytest.fixture
def passed(tmp_path, shared_probes):
    """All checks, none of which may fail or be stopped short; the results by title."""

    def check(files: dict[str, bytes]) -> dict[str, Result]:
        path = small_fmu.write(tmp_path / "Odd.fmu", files)
        results = {result.title: result for result in validate(path, Options())}
        assert not [(title, result.problems) for title, result in results.items() if result.outcome == FAILED]
        return results

    return check


def assert_passed(results: dict[str, Result], *titles: str) -> None:
    assert {title: results[title].outcome for title in titles} == dict.fromkeys(titles, PASSED)


@pytest.mark.parametrize("edition", ["2.0", "3.0"])
def test_one_that_asks_to_end_the_simulation(passed, edition):
    """As Reference-FMUs' Stair does (FMI 2.0.4, sections 3.2.2 and 4.2.3; FMI 3.0.2, sections 2.3.5 and 4.2.1)."""
    results = passed(small_fmu.content(edition, "ends"))
    assert_passed(results, *(f"{name} ({kind})" for name in REPEATED for kind in ("CS", "ME")), "variable-step (CS)")


@pytest.mark.parametrize("trait", ["lags", "early"])
def test_one_that_stops_elsewhere_than_at_the_communication_point(passed, trait):
    """With own steps that do not divide the host's, and with early returns (FMI 3.0.2, section 4.2.1)."""
    assert_passed(passed(small_fmu.content("3.0", trait)), *(f"{name} (CS)" for name in REPEATED), "independent (CS)")


def test_one_with_clocks(passed):
    """It can be had with Event Mode alone (FMI 3.0.2, section 4.2.1: eventModeUsed)."""
    files = small_fmu.content("3.0", "clocks")
    text = files[XML].replace(b'<String name="label', CLOCK + b'<String name="label')
    results = passed(files | {XML: text})
    assert_passed(results, "instance (CS)", *(f"{name} (CS)" for name in REPEATED), "event-mode (CS)")


@pytest.mark.parametrize("edition", ["2.0", "3.0"])
def test_one_that_can_be_instantiated_only_once(tmp_path, edition):
    """The check that stumbles leaves an instance behind, which costs the others nothing."""
    files = small_fmu.content(edition, "once-slope-error")
    xml = re.sub(rb"<(CoSimulation|ModelExchange) ", rb'<\1 canBeInstantiatedOnlyOncePerProcess="true" ', files[XML])
    path = small_fmu.write(tmp_path / "Once.fmu", files | {XML: xml})
    skip = frozenset(NAMES) - {"load", "instance", "run", "instances", "derivatives", "variable-step", "log"}
    results = validate(path, Options(skip=skip))
    assert {result.check.name for result in results if result.outcome == FAILED} == {"derivatives"}
    assert {result.check.name for result in results if result.outcome == PASSED} >= {"run", "variable-step", "log"}


@pytest.mark.parametrize("edition", ["2.0", "3.0"])
def test_one_that_cannot_begin_with_inputs_that_were_moved(passed, edition):
    """What was tried in Initialization Mode is not where the FMU must begin."""
    results = passed(small_fmu.content(edition, "strict"))
    assert_passed(results, "derivatives (CS)", "dependencies (CS)", "start-values (ME)", "run (CS)")


@pytest.mark.parametrize("edition", ["2.0", "3.0"])
def test_one_with_a_text(passed, edition):
    """Its start value is compared as it is, without quotes."""
    assert_passed(passed(small_fmu.content(edition)), "start-values (CS)", "start-values (ME)")


@pytest.mark.parametrize("name", ["WINTRUST.dll", "COMCTL32.dll", "COMDLG32.dll", "NETAPI32.dll", "dhcpcsvc.DLL",
                                  "KERNEL32.dll", "api-ms-win-crt-heap-l1-1-0.dll", "WINSPOOL.DRV"])  # fmt: skip
def test_libraries_of_windows_itself(name):
    assert WINDOWS_LIBRARIES.fullmatch(name)


@pytest.mark.parametrize("name", ["python3.dll", "MSVCP140.dll", "VCRUNTIME140.dll", "libgcc_s_seh-1.dll", "other.dll"])
def test_libraries_that_must_be_brought_along(name):
    assert not WINDOWS_LIBRARIES.fullmatch(name)
