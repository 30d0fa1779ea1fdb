"""linkage-fmu validate: a whole FMU passes every check, and for each check there is an FMU that it refuses.

The broken ones are copies of the built FMU, or of a small one (small_fmu.c), with one thing wrong.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from junitparser import JUnitXml

from fmu_src.cli import main
from fmu_src.exporter.archive import write_archive
from fmu_src.exporter.compiler import host_platform
from fmu_src.formats import ls_wasm
from fmu_src.validation import process
from fmu_src.validation.subject import Options
from fmu_src.validation.table import CHECKS, FAILED, NAMES, PASSED, SKIPPED, UNJUDGED, WARNED, Result, validate
from tests.conftest import PROJECT_ROOT
from tests.validation import small_fmu

TWIN = PROJECT_ROOT / "build" / "twin" / "TransplanterLinkageTwin.fmu"
EDITIONS = ("2.0", "3.0")
Files = dict[str, bytes]
# To save time, most tests leave out checks that have nothing to do with what is broken.
IN_FILES = ("archive", "value-references", "files", "terminals", "interface")
INSTANCE = ("load", "instance")
OF_CO_SIMULATION = ("input-derivatives", "output-derivatives", "variable-step", "event-mode", "intermediate-update")
IN_BINARIES = ("binaries", "functions", "symbols", "libraries", "glibc")


@pytest.fixture
def checked(tmp_path) -> Callable[..., dict[str, Result]]:
    """Validates files as one FMU; the results by title, "run (CS)"."""

    def check(files: Files | Path, only: tuple[str, ...] = NAMES, **options) -> dict[str, Result]:
        path = files if isinstance(files, Path) else tmp_path / "Checked.fmu"
        if path is not files:
            write_archive(path, files)
        options.setdefault("skip", frozenset(NAMES) - {*only})
        return {result.title: result for result in validate(path, Options(**options))}

    return check


@pytest.fixture
def built(fmu_file) -> Files:
    with zipfile.ZipFile(fmu_file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def changed(files: Files, name: str, old: str, new: str) -> Files:
    """A copy with `old` replaced in one file, which must have it."""
    assert old.encode() in files[name], old
    return files | {name: files[name].replace(old.encode(), new.encode(), 1)}


def refused(results: dict[str, Result], *names: str) -> str:
    """What is said against the FMU, once it is clear that these checks refuse it and no others do.

    "run (CS)" is a check of one interface type, "run" that of each type that the FMU has.
    """
    wanted = [title for title, result in results.items() if title in names or result.check.name in names]
    assert wanted or not names
    assert [title for title, result in results.items() if result.outcome == FAILED] == wanted, {
        title: result.problems for title, result in results.items() if result.problems
    }
    return "\n".join(problem for title in wanted for problem in results[title].problems)


def warned(results: dict[str, Result], *names: str) -> str:
    """What is advised, once it is clear that these checks warn and no check refuses."""
    wanted = [title for title, result in results.items() if title in names or result.check.name in names]
    assert [title for title, result in results.items() if result.outcome not in (PASSED, SKIPPED)] == wanted, {
        title: result.problems + result.advice for title, result in results.items()
    }
    assert all(results[title].outcome == WARNED for title in wanted)
    return "\n".join(advice for title in wanted for advice in results[title].advice)


# ---- whole FMUs ----------------------------------------------------------------------------------


@pytest.mark.parametrize("file", sorted((PROJECT_ROOT / "build").glob("fmi*/*.fmu")), ids=lambda file: file.parent.name)
def test_the_built_fmus_pass_every_check(checked, file):
    results = checked(file)
    refused(results)
    assert {title for title, result in results.items() if result.outcome == SKIPPED} <= {
        "terminals", "ranges (CS)", "ranges (ME)", *(f"{name} (ME)" for name in OF_CO_SIMULATION),
        *(("adjoint (CS)", "adjoint (ME)", "event-mode (CS)", "intermediate-update (CS)") if file.parent.name == "fmi2"
          else ("value-references", "input-derivatives (CS)")),
    }  # fmt: skip
    assert {result.check.name for result in results.values()} == {check.name for check in CHECKS}


@pytest.mark.parametrize("edition", EDITIONS)
def test_a_foreign_fmu(checked, edition):
    """Both interface types are run; what needs our interface is skipped, with the reason."""
    results = checked(small_fmu.content(edition))
    refused(results)
    for title in ("run (CS)", "run (ME)", "serialized-state (CS)", "serialized-state (ME)", "derivatives (ME)"):
        assert results[title].outcome == PASSED, results[title]
    for title in ("interface", "kinematics (CS)", "kinematics (ME)"):
        assert results[title].outcome == SKIPPED and "interface" in results[title].skipped
    assert all(result.skipped for result in results.values() if result.outcome == SKIPPED)


def test_the_twin(checked):
    """What PythonFMU makes is foreign code around our interface: less portable binaries, and the right values. (Its
    version 0.7.0 keeps every instance; that is told under memory.)
    """
    results = checked(TWIN, tuple({*NAMES} - {"memory"}))
    said = warned(results, "symbols", "libraries", "glibc", "token (CS)", "dependencies (CS)")
    assert "PySlaveInstance" in said and "python3.dll" in said and "glibc 2.32" in said and "any token" in said
    assert results["kinematics (CS)"].outcome == PASSED


FMI1 = b"""<fmiModelDescription fmiVersion="1.0" modelName="Old" modelIdentifier="Old" guid="{old}"
    numberOfContinuousStates="0" numberOfEventIndicators="0"><ModelVariables/></fmiModelDescription>"""


def test_what_is_not_run_here(checked):
    """FMI 1.0, and scheduled execution alone: not judged, which is no pass. Where there is another type, that is."""
    results = checked({"modelDescription.xml": FMI1})
    assert all(result.outcome == UNJUDGED for result in results.values() if result.check.of_interface)
    assert "FMI 1.0 is not judged here" in results["run"].unjudged
    scheduled = small_fmu.content("3.0")
    xml = re.sub(rb"<ModelExchange.*?/>\s*<CoSimulation.*?/>", b'<ScheduledExecution modelIdentifier="Small"/>',
                 scheduled["modelDescription.xml"], flags=re.DOTALL)  # fmt: skip
    results = checked(scheduled | {"modelDescription.xml": xml}, (*IN_BINARIES, *INSTANCE, "run"))
    assert results["functions"].outcome == PASSED
    assert results["run (SE)"].unjudged == "ScheduledExecution is not run here"
    both = xml.replace(b"<ScheduledExecution", b'<CoSimulation modelIdentifier="Small"/><ScheduledExecution')
    results = checked(scheduled | {"modelDescription.xml": both}, (*INSTANCE, "run"))
    refused(results)
    assert results["run (SE)"].outcome == SKIPPED and results["run (CS)"].outcome == PASSED


@pytest.mark.parametrize("xml", [b"<html/>", b"", b"<fmiModelDescription/>"])
def test_what_left_out_checks_would_say_is_no_pass(checked, xml):
    """Nothing can be judged where there is no description, whoever says so."""
    files = small_fmu.content("2.0") | {"modelDescription.xml": xml}
    results = checked(files, ("archive", "run"))
    assert results["run"].unjudged == "the description cannot be read" and results["archive"].outcome == PASSED
    results = checked(files, ("archive", "description", "run"))
    refused(results, "description")
    if xml:
        (problem,) = results["description"].problems
        assert problem.endswith("not fmiModelDescription with an fmiVersion")


def test_no_interface_type(checked):
    files = small_fmu.content("3.0")
    xml = re.sub(rb"<ModelExchange.*?/>\s*<CoSimulation.*?/>", b"", files["modelDescription.xml"], flags=re.DOTALL)
    results = checked(files | {"modelDescription.xml": xml}, ("description", *INSTANCE))
    assert "no interface type" in refused(results, "description")
    assert results["load"].skipped == "it has no interface type"


# ---- broken files --------------------------------------------------------------------------------


def with_entry(path: Path, files: Files, name: str, data: bytes = b"x", **attributes) -> Path:
    """An archive with one more entry, as zipfile would not write it by itself."""
    write_archive(path, files)
    with zipfile.ZipFile(path, "a") as archive:
        entry = zipfile.ZipInfo("placeholder", (1980, 1, 1, 0, 0, 0))
        entry.filename = entry.orig_filename = name
        for attribute, value in attributes.items():
            setattr(entry, attribute, value)
        archive.writestr(entry, data, compress_type=attributes.get("compress_type"))
    return path


@pytest.mark.parametrize(
    ("name", "attributes", "reason"),
    [
        ("../../evil.sh", {}, "leads out of the folder"),
        ("/etc/evil", {}, "leads out of the folder"),
        ("C:/evil", {}, "leads out of the folder"),
        ("resources/../../evil", {}, "leads out of the folder"),
        ("resources\\table.csv", {}, "backslash"),
        ("resources/größe.csv", {}, "not ASCII"),
        ("resources/THERE.txt", {}, "one file on Windows"),
        ("resources/there.txt", {}, "is there 2 times"),
        ("resources/link", {"external_attr": 0o120777 << 16, "create_system": 3}, "symbolic link"),
        ("resources/packed", {"compress_type": zipfile.ZIP_BZIP2}, "method 12"),
        ("resources/a:b.txt", {}, "no file on Windows can have"),
        ("resources/con.txt", {}, "no file on Windows can have"),
        ("resources/end. ", {}, "no file on Windows can have"),
        ("resources/a\x1b[31mb", {}, "no file on Windows can have"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_names_and_packing(checked, tmp_path, built, name, attributes, reason):
    path = with_entry(tmp_path / "Odd.fmu", built | {"resources/there.txt": b"1"}, name, **attributes)
    is_warning = not name.isascii() or "Windows can have" in reason
    said = (warned if is_warning else refused)(checked(path, IN_FILES), "archive")
    assert repr(name) in said and reason in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["Odd.fmu"], "something landed outside"


def test_damaged_content(tmp_path, checked, built):
    path = tmp_path / "Damaged.fmu"
    write_archive(path, built)
    data = bytearray(path.read_bytes())
    place = data.index(b"modelDescription.xml") + 2000  # in the packed bytes of the first entry
    data[place] ^= 0xFF
    path.write_bytes(data)
    results = checked(path)
    assert results["archive"].outcome == FAILED
    assert all(
        result.outcome == SKIPPED for title, result in results.items() if title not in ("archive", "description")
    )


def test_an_archive_that_cannot_be_unpacked(checked, built):
    """A file where a folder should be: all else is skipped, and that is no pass."""
    results = checked(built | {"resources": b"a file", "resources/table.csv": b"1"}, IN_FILES)
    assert "the archive cannot be unpacked" in refused(results, "archive")


def test_an_archive_that_claims_too_much(checked, built):
    """Not unpacked."""
    results = checked(built, IN_FILES, unpacked=1000)
    assert "unpacked it would have" in refused(results, "archive")
    assert "it is not unpacked" in results["files"].skipped and results["files"].is_consequence


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('unit="rad"', 'unit="furlong"', "furlong"),
        ('fmiVersion="2.0"', 'fmiVersion="2.0" colour="red"', "colour"),
        ("<Outputs>", "<Outputs><!-- -->", None),
        ('name="crank.w"', 'name="crank w"', "crank w"),
        ('name="crank.w"', 'name="crank.a"', "not unique"),
    ],
)
def test_description(checked, built, old, new, reason):
    results = checked(changed(built, "modelDescription.xml", old, new), ("archive", "description"))
    if reason is None:
        refused(results)
    else:
        assert reason in refused(results, "description")


LEGAL = ("a", "_a1.B[2,13].c", "der(a.b[1],2)", "der(a)", "'a b.c'", r"'it\'s'", "a.'x+y'[1]", "'['")
ILLEGAL = (
    "1a",
    "a.",
    "a..b",
    "a[0",
    "a[-1]",
    "a b",
    "der(der(a))",
    "der(a,)",
    "'a",
    "''",
    "größe",
    "a-b",
    "a[1].[2]",
    "",
)


@pytest.mark.parametrize("edition", EDITIONS)
def test_structured_names(checked, edition, monkeypatch):
    """As the standard's grammar has them; fmpy's parser, which takes milliseconds a name, is not asked."""
    monkeypatch.setattr("fmpy.validation._validate_variable_names", None)
    for name in LEGAL + ILLEGAL:
        attribute = f'name="{name}"'
        results = checked(
            changed(small_fmu.content(edition), "modelDescription.xml", 'name="k"', attribute), ("description",)
        )
        said = "\n".join(results["description"].problems)
        assert ("is no name of the naming convention structured" in said) == (name in ILLEGAL), (name, said)


def test_flat_names(checked):
    files = changed(small_fmu.content("2.0"), "modelDescription.xml", '"structured"', '"flat"')
    for name, is_right in (("1 größe\u00a0{x}", True), ("a&#10;b", False)):
        results = checked(changed(files, "modelDescription.xml", 'name="k"', f'name="{name}"'), ("description",))
        assert (results["description"].outcome == PASSED) == is_right, results["description"].problems


def test_double_value_references(checked, built):
    results = checked(changed(built, "modelDescription.xml", 'valueReference="4"', 'valueReference="3"'), IN_FILES)
    said = "\n".join(results["value-references"].problems)
    assert "value reference 3: crank.w, crank.a" in said
    assert results["interface"].problems == ["crank.a: value reference 3, not 4"]


def test_double_value_references_in_fmi3(checked):
    files = changed(small_fmu.content("3.0"), "modelDescription.xml", 'valueReference="2"', 'valueReference="1"')
    files = changed(files, "modelDescription.xml", 'dependencies="1 2 3"', 'dependencies="1 3"')
    results = checked(files, ("description",))
    assert any('"k"' in problem and "same value reference" in problem for problem in results["description"].problems)


DOCUMENT = b"""<html><body><a href="more.html#a">more</a> <a href="https://fmi-standard.org">FMI</a>
<img src="a%20b.png"></body></html>"""


def test_missing_document(checked, built):
    files = built | {
        "documentation/index.html": DOCUMENT,
        "documentation/a b.png": b"",
        "documentation/more.html": b"<p>",
        "documentation/empty.html": b"",
        "documentation/comment.html": b"<!-- to be written -->",
    }
    refused(checked(files, IN_FILES))
    del files["documentation/more.html"]
    assert "more.html#a, which is missing" in refused(checked(files, IN_FILES), "files")


def test_missing_source(checked, built):
    refused(checked(built, IN_FILES))
    del built["sources/TransplanterLinkage.c"]
    assert "sources/TransplanterLinkage.c" in refused(checked(built, IN_FILES), "files")


MANIFEST = """<fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest"
fmi-ls:fmi-ls-name="org.example.notes" fmi-ls:fmi-ls-version="1.0.0" fmi-ls:fmi-ls-description="notes">
<Related type="text/plain" source="note.txt" role="document" checksumType="SHA-256"
checksum="98ea6e4f216f2fb4b69fff9b3a44842c38686ca685f3f55dc48c5d3fb1107be4"/></fmiReferences>"""


def test_manifest(checked, built):
    folder = "extra/org.example.notes"
    files = built | {f"{folder}/fmi-ls-manifest.xml": MANIFEST.encode(), f"{folder}/note.txt": b"hi\n"}
    refused(checked(files, IN_FILES))
    assert "note.txt has changed" in refused(checked(files | {f"{folder}/note.txt": b"ho\n"}, IN_FILES), "files")
    moved = {name.replace("example.notes", "example.other"): data for name, data in files.items()}
    assert "of the layered standard org.example.notes" in refused(checked(moved, IN_FILES), "files")
    del files[f"{folder}/note.txt"]
    assert "lists note.txt, which is missing" in refused(checked(files, IN_FILES), "files")


TERMINALS = """<fmiTerminalsAndIcons fmiVersion="3.0"><GraphicalRepresentation>
<CoordinateSystem x1="0" y1="0" x2="1" y2="1" suggestedScalingFactorTo_mm="1"/>
<Icon x1="0" y1="0" x2="1" y2="1"/></GraphicalRepresentation>
<Terminals><Terminal name="port" matchingRule="bus">
<TerminalMemberVariable variableKind="signal" variableName="u" memberName="u"/></Terminal></Terminals>
</fmiTerminalsAndIcons>"""


def test_terminals(checked):
    name = "terminalsAndIcons/terminalsAndIcons.xml"
    files = small_fmu.content("3.0") | {name: TERMINALS.encode()}
    results = checked(files, IN_FILES)
    refused(results)
    assert results["terminals"].outcome == PASSED
    unknown = changed(files, name, 'variableName="u"', 'variableName="v"')
    assert "no variable v" in refused(checked(unknown, IN_FILES), "terminals")
    assert "line 4" in refused(checked(changed(files, name, "matchingRule", "rule"), IN_FILES), "terminals")


# ---- broken binaries -----------------------------------------------------------------------------


def binary_of(files: Files) -> str:
    (name,) = [name for name in files if name.startswith("binaries/")]
    return name


def test_missing_binary(checked, built):
    """Nothing for this machine is no pass, whatever else is there; and a folder promises what the description names."""
    binary = built.pop(binary_of(built))
    built = {name: content for name, content in built.items() if not name.startswith("sources/")}
    said = refused(checked(built, (*IN_BINARIES, "load")), "binaries", "load")
    assert "neither binaries nor sources" in said and "nothing for this machine" in said
    results = checked(built | {"binaries/linux64/Other.so": binary}, (*IN_BINARIES, *INSTANCE, "run"))
    assert "no TransplanterLinkage" in "\n".join(results["binaries"].problems)
    assert results["run (CS)"].skipped == "needs load to pass"


@pytest.mark.parametrize("fmi", [2], indirect=True)  # as the FMU that they are put into
def test_binary_of_another_platform(checked, built, all_platforms):
    """Windows' in the folder of Linux, and the other processor's."""
    name = binary_of(built)
    said = refused(
        checked(built | {name: all_platforms["x86_64-windows"].read_bytes()}, (*IN_BINARIES, "load")),
        "binaries",
        "load",
    )
    assert "is a PE file" in said
    other = "aarch64-linux" if host_platform().name.startswith("x86_64") else "x86_64-linux"
    said = refused(
        checked(built | {name: all_platforms[other].read_bytes()}, (*IN_BINARIES, "load")), "binaries", "load"
    )
    assert "not for" in said
    garbage = checked(built | {name: b"\x7fELF" + bytes(range(256)) * 8}, (*IN_BINARIES, "load"))
    assert garbage["binaries"].outcome == FAILED and garbage["load (CS)"].outcome == FAILED


def test_all_platforms(checked, all_platforms_fmu):
    """ELF, PE and Mach-O of both processors pass as well."""
    refused(checked(all_platforms_fmu, IN_BINARIES))


def test_component(checked, built):
    """FMI-LS-WASM: a component and its manifest; a module of WebAssembly is none."""
    manifest = {ls_wasm.MANIFEST: b"<a/>"}
    component = {f"binaries/{ls_wasm.FOLDER}/TransplanterLinkage.wasm": ls_wasm.COMPONENT}
    assert checked(built | component | manifest, IN_BINARIES)["binaries"].outcome == PASSED
    assert "manifest.xml is missing" in warned(checked(built | component, IN_BINARIES), "binaries")
    module = dict.fromkeys(component, b"\0asm\x01\0\0\0")
    assert "is no WebAssembly component" in refused(checked(built | module | manifest, IN_BINARIES), "binaries")
    other = {f"binaries/{ls_wasm.FOLDER}/Other.wasm": ls_wasm.COMPONENT}
    assert "has no TransplanterLinkage" in refused(checked(built | other | manifest, IN_BINARIES), "binaries")


def test_function_that_is_declared_and_missing(checked):
    files = small_fmu.content("2.0", None, "-DLACKS_DIRECTIONAL_DERIVATIVE")
    results = checked(files, (*IN_BINARIES, "load"))
    assert "lacks fmi2GetDirectionalDerivative" in "\n".join(results["functions"].problems)
    assert results["load (CS)"].outcome == FAILED


def test_foreign_symbol(checked):
    files = small_fmu.content("2.0", None, "-DFOREIGN_SYMBOL")
    assert "exports helper" in warned(checked(files, IN_BINARIES), "symbols")
    assert "exports helper" in refused(checked(files, IN_BINARIES, strict=True), "symbols")


@pytest.mark.skipif(sys.platform != "linux", reason="glibc is Linux's")
def test_newer_glibc(checked):
    target = re.sub(r"2\.17$", "2.34", host_platform().target)
    files = small_fmu.content("2.0", None, "-DNEW_GLIBC", target=target)
    assert "needs glibc 2.34; 2.17 was to be enough" in warned(checked(files, IN_BINARIES), "glibc")
    refused(checked(files, IN_BINARIES, glibc=(2, 34)))


@pytest.mark.skipif(sys.platform != "linux", reason="the linker's options are Linux's")
def test_libraries(checked):
    """One that no machine has, one beside the binary that is not looked for there, and a path of the builder."""
    files = small_fmu.content("2.0", None, "-Wl,-rpath,/opt/builder/lib")
    assert "/opt/builder/lib" in warned(checked(files, IN_BINARIES), "libraries")
    name, data = binary_of(files), small_fmu.library("2.0")
    assert data.count(b"libc.so.6\0") == 1
    results = checked(files | {name: data.replace(b"libc.so.6\0", b"libq.so.6\0")}, (*IN_BINARIES, "load"))
    assert "needs libq.so.6: neither in the FMU" in "\n".join(results["libraries"].advice)
    assert "libq.so.6" in "\n".join(results["load (CS)"].problems)
    beside = {name: data.replace(b"libc.so.6\0", b"libq.so.6\0"), "binaries/linux64/libq.so.6": data}
    assert "RPATH is not $ORIGIN" in "\n".join(checked(files | beside, IN_BINARIES)["libraries"].advice)


# ---- broken behaviour ----------------------------------------------------------------------------


@pytest.mark.parametrize(("edition", "kind"), [("2.0", "CS"), ("2.0", "ME"), ("3.0", "CS"), ("3.0", "ME")])
def test_crash(checked, edition, kind):
    """It costs one check its result, and the validator nothing. The function is named, and the signal."""
    results = checked(small_fmu.content(edition, "crash"), (*INSTANCE, "run", "determinism"))
    function = f"fmi{edition[0]}{'DoStep' if kind == 'CS' else 'SetContinuousStates'}"
    assert results[f"run ({kind})"].problems == [f"the process died of SIGSEGV in {function}"]
    assert results[f"determinism ({kind})"].skipped == "needs run to pass"
    refused(results, "run (CS)", "run (ME)")


def test_hang(checked):
    """It is ended: without the limit this test never would be."""
    results = checked(small_fmu.content("2.0", "hang"), (*INSTANCE, "run"), limit=1.5)
    assert refused(results, "run (CS)") == "no answer within 1.5 s in fmi2DoStep"


@pytest.mark.skipif(sys.platform == "win32", reason="stops a process by a signal")
def test_a_process_that_cannot_even_end_itself(checked, monkeypatch):
    monkeypatch.setattr(process, "GRACE", 0.5)
    results = checked(small_fmu.content("2.0", "stop"), (*INSTANCE, "run"), limit=2.0)
    assert refused(results, "run (CS)").startswith("no answer within 2 s")


@pytest.mark.parametrize(
    ("defect", "titles", "reason"),
    [
        ("crash-at-start", ["instance (CS)", "instance (ME)"],
         "died of SIGSEGV in fmi2Instantiate"),
        ("abort", ["run (CS)"], "died of SIGABRT in fmi2DoStep"),
        ("exit", ["run (CS)"], 'the FMU ended the process, exit status 0x3; it printed: "no license"'),
        ("error", ["run (CS)"], "fmi2DoStep failed with status 3 (error)"),
        ("nan", ["run (CS)", "run (ME)"], "y is nan at 0.35 s"),
        ("start", ["start-values (CS)", "start-values (ME)"], "k starts with 2 in the description and with 3.0"),
        ("process", ["determinism (CS)", "determinism (ME)"], "a second run gives y = "),
        ("reset", ["reset (CS)", "reset (ME)"], "a run after a reset gives y = "),
        ("state", ["state-replay (CS)", "state-replay (ME)"], "the run from the restored state gives y = "),
        ("slope", ["derivatives (CS)", "derivatives (ME)"], "d(y)/d(u) is given as 0; differences give 2.0"),
    ],
)  # fmt: skip
def test_behaviour(checked, defect, titles, reason):
    only = {*INSTANCE, "token", "start-values", "run", *(title.split()[0] for title in titles)}
    assert reason in refused(checked(small_fmu.content("2.0", defect), tuple(only)), *titles)


def test_token_that_is_not_checked(checked):
    said = warned(checked(small_fmu.content("2.0", "token"), (*INSTANCE, "token")), "token")
    assert "accepts any token" in said


def test_state_that_only_its_own_process_understands(checked):
    results = checked(small_fmu.content("3.0", "serialized"), (*INSTANCE, "run", "state-replay", "serialized-state"))
    assert "the run in another process gives" in refused(results, "serialized-state (CS)", "serialized-state (ME)")


def test_instances_that_share(checked):
    """Each run counts the steps of all: nothing else can be said of such an FMU."""
    results = checked(small_fmu.content("2.0", "shared"), (*INSTANCE, "run", "instances"))
    assert "a run beside a second instance gives y" in "\n".join(results["instances (CS)"].problems)
    assert results["instances (ME)"].outcome == FAILED


def test_wrong_start_value(checked, built):
    files = changed(built, "modelDescription.xml", 'start="0.105"', 'start="0.106"')
    said = refused(checked(files), "start-values", "interface", "kinematics")
    assert "geometry.L2 starts with 0.106 in the description and with 0.105 in the binary" in said


def test_a_check_that_stops(checked, built):
    """What a check was not made for is a finding, and the others go on."""
    files = changed(built, "modelDescription.xml", 'start="0.105"', 'start="long"')
    results = checked(files, (*INSTANCE, "start-values", "interface"))
    said = refused(results, "start-values", "interface")
    assert "this check stopped: ValueError" in said and "geometry.L2: start long, not 0.105" in said


def test_token_of_another_interface(checked, built):
    xml = built["modelDescription.xml"].decode()
    guid = re.search(r'guid="(.*?)"', xml)[1]
    results = checked(changed(built, "modelDescription.xml", guid, "{8c4e810f-3df3-4a00-8276-176fa3c9f000}"))
    assert "Failed to instantiate" in "\n".join(results["instance (CS)"].problems)
    assert (
        results["interface"].outcome == FAILED and "is not that of this interface" in results["interface"].problems[0]
    )


def test_tip_that_is_one_step_late(checked, project_copy):
    """Our sources with one thing wrong: the component uses the crank as it is given, not as it is after the step."""
    crank = project_copy / "fmu_src" / "component" / "crank.c"
    source = crank.read_text()
    assert source.count("motion_after(motion, h)") == 1
    crank.write_text(source.replace("motion_after(motion, h)", "motion"))
    build = "import sys; from fmu_src.cli import main; sys.exit(main(['build', '--output', 'out']))"
    done = subprocess.run([sys.executable, "-c", build], cwd=project_copy, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    results = checked(
        project_copy / "out" / "fmi2" / "TransplanterLinkage.fmu", (*INSTANCE, "run", "interface", "kinematics")
    )
    said = refused(results, "kinematics (CS)")
    assert "tip.x is " in said and "off the exact" in said


REFERENCE = "extra/org.fmi-standard.fmi-ls-ref"


def test_reference_results_that_are_others(checked, built):
    """One number of the exact results changed, the manifest without its checksums; then with them."""
    table, manifest = f"{REFERENCE}/published_cycle_ref.csv", f"{REFERENCE}/fmi-ls-manifest.xml"
    lines = built[table].decode().splitlines()
    cells = lines[20].split(",")
    column = lines[0].split(",").index("tip.x")
    cells[column] = repr(float(cells[column]) + 1e-6)
    files = built | {table: "\n".join([*lines[:20], ",".join(cells), *lines[21:], ""]).encode()}
    only = (*INSTANCE, "files", "run", "reference-results")
    assert "changed since the manifest" in refused(checked(files, only), "files", "reference-results")
    files[manifest] = re.sub(rb' checksum="\w+"', b"", files[manifest])
    said = refused(checked(files, only), "reference-results")
    assert re.search(r"published_cycle: tip.x is off by 1e-06 at 0.\d+ s; .* is allowed", said)


@pytest.mark.parametrize("edition", EDITIONS)
def test_reference_results_of_a_foreign_fmu(checked, edition):
    """No tolerances, a variable that there is not, a run with another parameter."""
    manifest = """<fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest"
        fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-ref" fmi-ls:fmi-ls-version="1.0.0" fmi-ls:fmi-ls-description="">
        <Related type="application/x-ma-hs-experiments" source="run.exp" role="experiment"/></fmiReferences>"""
    experiment = """<Experiments name="runs"><Experiment name="rise"><TransientSimulation stopTime="0.5"/>
        <Stimuli source="in.csv"/><References source="ref.csv"/></Experiment></Experiments>"""
    times, x, rows = [0.05 * index for index in range(11)], 0.5, []
    for index, time_ in enumerate(times):
        rows.append((time_, 2 * x + (1 + times[max(index - 1, 0)]) ** 2))  # u = 1 + t, as it was before the step
        x += 0.05 * (1 + time_ - x)
    files = small_fmu.content(edition) | {
        f"{REFERENCE}/fmi-ls-manifest.xml": manifest.encode(),
        f"{REFERENCE}/run.exp": experiment.encode(),
        f"{REFERENCE}/in.csv": b"time,u\n0,1\n1,2\n",
        f"{REFERENCE}/ref.csv": "\n".join(["time,y", *(f"{t!r},{y!r}" for t, y in rows)]).encode(),
    }
    only = (*INSTANCE, "run", "reference-results")
    results = checked(files, only)
    assert results["reference-results (CS)"].outcome == PASSED, results["reference-results (CS)"]
    results = checked(files | {"resources/defect.txt": b"start"}, only)
    assert "rise: y is off by" in "\n".join(results["reference-results (CS)"].problems)
    results = checked(changed(files, f"{REFERENCE}/ref.csv", "time,y", "time,w"), only)
    assert results["reference-results (CS)"].problems == ["rise: no variable w"]


# ---- what comes out ------------------------------------------------------------------------------


def test_junit(tmp_path, fmu_file, capsys):
    broken = small_fmu.write(tmp_path / "Broken.fmu", small_fmu.content("2.0", "error"))
    report = tmp_path / "reports" / "fmu.xml"
    assert main(["validate", str(fmu_file), str(broken), "--junit", str(report), "--skip", "glibc"]) == 1
    good, bad = JUnitXml.fromfile(str(report))
    assert (good.name, bad.name) == (str(fmu_file), str(broken))
    assert {case.classname for case in bad} == {str(broken.with_suffix(""))}
    assert good.failures == 0 and good.tests >= len(CHECKS) and bad.failures == 1 and bad.skipped > 5
    (failed,) = [case for case in bad if case.result and not case.is_skipped]
    assert failed.name == "run (CS)" and "fmi2DoStep" in failed.result[0].message
    (glibc,) = [case for case in good if case.name == "glibc"]
    assert glibc.is_skipped and glibc.result[0].message == "as asked for"
    said = capsys.readouterr().out
    assert "run (CS)" in said and "fmi2DoStep failed" in said and "1 failed" in said


def test_junit_of_two_fmus_of_one_name(tmp_path, fmu_files):
    report = tmp_path / "fmu.xml"
    skip = [word for name in NAMES if name != "archive" for word in ("--skip", name)]
    assert main(["validate", *map(str, fmu_files.values()), "--junit", str(report), *skip]) == 0
    cases = [(suite.name, case.classname, case.name) for suite in JUnitXml.fromfile(str(report)) for case in suite]
    assert len({suite for suite, _, _ in cases}) == 2 and len({case[1:] for case in cases}) == len(cases)


def test_json(tmp_path, capsys):
    """The whole answer on standard output, and nothing else there; the same in a file."""
    broken = small_fmu.write(tmp_path / "Broken.fmu", small_fmu.content("2.0", "error", "-DFOREIGN_SYMBOL"))
    old, none = small_fmu.write(tmp_path / "Old.fmu", {"modelDescription.xml": FMI1}), tmp_path / "none.fmu"
    arguments = ["validate", str(broken), str(old), str(none), "--skip", "description", "--skip", "binaries", "--json"]
    assert main([*arguments, "-"]) == 2
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert (found["version"], found["exit_status"]) == (1, 2)
    first, second, third = found["fmus"]
    assert [fmu["outcome"] for fmu in found["fmus"]] == [FAILED, UNJUDGED, UNJUDGED]
    checks = {(check["check"], check["interface"]): check for check in first["checks"]}
    run = checks["run", "CoSimulation"]
    assert run["outcome"] == FAILED and "fmi2DoStep" in run["errors"][0] and run["reason"] is None
    assert checks["symbols", None]["outcome"] == WARNED and "exports helper" in checks["symbols", None]["warnings"][0]
    assert checks["reset", "CoSimulation"]["reason"] == "needs run to pass"
    assert any("FMI 1.0" in (check["reason"] or "") for check in second["checks"])
    assert third["checks"] == [] and "No such file" in third["unreadable"] and "none.fmu" in captured.err
    assert main([*arguments, str(tmp_path / "results.json")]) == 2
    assert [fmu["path"] for fmu in json.loads((tmp_path / "results.json").read_text())["fmus"]] == [
        str(broken), str(old), str(none),
    ]  # fmt: skip


def test_quiet(tmp_path, capsys):
    good = small_fmu.write(tmp_path / "Good.fmu", small_fmu.content("2.0"))
    skip = [word for name in NAMES if name not in (*INSTANCE, "run", "symbols") for word in ("--skip", name)]
    assert main(["validate", str(good), "-q", *skip]) == 0
    assert capsys.readouterr().out == ""
    odd = small_fmu.write(tmp_path / "Odd.fmu", small_fmu.content("2.0", None, "-DFOREIGN_SYMBOL"))
    assert main(["validate", str(good), str(odd), "-q", *skip]) == 0
    name, *said = capsys.readouterr().out.splitlines()
    assert name == str(odd) and len(said) == 1 and "symbols" in said[0] and "warned" in said[0]
    assert main(["validate", str(odd), "-q", "--strict", *skip]) == 1
    assert "failed" in capsys.readouterr().out


def test_a_bad_archive_is_said_in_a_line(tmp_path, capsys):
    (tmp_path / "Bad.fmu").write_bytes(b"no archive")
    assert main(["validate", str(tmp_path / "Bad.fmu")]) == 1
    _, row, counts = capsys.readouterr().out.splitlines()
    assert row.startswith("archive") and "no readable ZIP archive" in row and counts.startswith("1 failed, ")


def test_nothing_was_judged(tmp_path, capsys):
    old = small_fmu.write(tmp_path / "Old.fmu", {"modelDescription.xml": FMI1})
    assert main(["validate", str(old), "--skip", "description", "--skip", "binaries"]) == 2
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("FMI 1.0 is not judged here, only FMI 2.0 and 3.0") == 1


def test_list(capsys):
    assert main(["validate", "--list"]) == 0
    said = capsys.readouterr().out
    assert all(check.name in said for check in CHECKS)


@pytest.mark.parametrize(
    "arguments",
    [[], ["--skip", "everything", "x.fmu"], ["--timeout", "0", "x.fmu"], ["--timeout", "soon", "x.fmu"],
     ["--glibc", "new", "x.fmu"], ["--limit", "0", "x.fmu"], ["--entries", "0", "x.fmu"], ["--memory", "-1", "x.fmu"]],
)  # fmt: skip
def test_usage(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["validate", *arguments])
    assert ended.value.code == 2 and "usage" in capsys.readouterr().err


def test_nothing_is_left_behind(tmp_path, fmu_file):
    """No unpacked FMU, no process."""
    command = [Path(sys.executable).with_name("linkage-fmu"), "validate", fmu_file]
    done = subprocess.run(
        command, capture_output=True, text=True, env=os.environ | {"TMPDIR": str(tmp_path)}, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert list(tmp_path.iterdir()) == []
