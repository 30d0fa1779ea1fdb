"""FMUs with one thing wrong each, and the check of `linkage-fmu validate` that must say so: a catalogue.

    python -m tests.validation.mutants        writes fmu_src/documentation/mutants.md from it

Most are small_fmu.c's FMU with another description, or with a defect that the C source knows; some are this project's
own FMUs with another description. test_mutants.py runs them all.
"""

from __future__ import annotations

import re
import warnings
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import fmpy

from fmu_src.exporter.archive import write_archive
from fmu_src.validation.table import CHECKS
from tests.validation import small_fmu

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "fmu_src" / "documentation" / "mutants.md"
ERROR, WARNING = "error", "warning"
XML = "modelDescription.xml"
EDITIONS = ("2.0", "3.0")
Files = dict[str, bytes]


@dataclass(frozen=True)
class Mutant:
    """what: what is wrong with it. fmu: of which FMU it is made. write: makes the file. check: title of the result that
    must say `says` (a regular expression), at this level.
    """

    name: str
    what: str
    fmu: str
    write: Callable[[Path], None]
    check: str
    says: str
    level: str = ERROR

    @property
    def checks(self) -> set[str]:
        """Names of the check and of those that it needs."""
        needs = {check.name: check.needs for check in CHECKS}
        found, new = set(), {self.check.split(" (")[0]}
        while new:
            found |= new
            new = {need for name in new for need in needs[name]} - found
        return found


MUTANTS: list[Mutant] = []


def add(
    name: str, what: str, fmu: str, content: Callable[[], Files], check: str, says: str, level: str = ERROR
) -> None:
    MUTANTS.append(Mutant(name, what, fmu, lambda path: write_archive(path, content()), check, says, level))


def replaced(files: Files, *changes: tuple[str, str]) -> Files:
    """With other text in the description, which must have the old one; "" is none."""
    text = files[XML].decode()
    for old, new in changes:
        if old not in text:
            raise AssertionError(f"{old!r} is not in the description")
        text = text.replace(old, new, 1)
    return files | {XML: text.encode()}


def described(
    edition: str, name: str, what: str, changes: Iterable[tuple[str, str]], check: str, says: str, level: str = ERROR
) -> None:
    """The small FMU with another description."""
    fmu = f"small, FMI {edition}"
    add(name, what, fmu, lambda: replaced(small_fmu.content(edition), *changes), check, says, level)


def with_files(edition: str, name: str, what: str, more: Files, check: str, says: str, level: str = ERROR) -> None:
    """The small FMU with more files, or with others."""
    add(name, what, f"small, FMI {edition}", lambda: small_fmu.content(edition) | more, check, says, level)


def defective(
    defect: str, what: str, check: str, says: str, level: str = ERROR, editions: tuple[str, ...] = EDITIONS
) -> None:
    """The small FMU whose binary has a defect."""
    for edition in editions:
        add(f"{defect}-{edition[0]}", what, f"small, FMI {edition}",
            lambda edition=edition: small_fmu.content(edition, defect), check.replace("fmiN", f"fmi{edition[0]}"),
            says.replace("fmiN", f"fmi{edition[0]}"), level)  # fmt: skip


def compiled(edition: str, name: str, what: str, options: tuple[str, ...], check: str, says: str, level: str = ERROR):
    """The small FMU, compiled otherwise."""
    add(name, what, f"small, FMI {edition}", lambda: small_fmu.content(edition, None, *options), check, says, level)


@cache
def built(version: int) -> Files:
    with zipfile.ZipFile(ROOT / "build" / f"fmi{version}" / "TransplanterLinkage.fmu") as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def ours(version: int, name: str, what: str, changes, check: str, says: str, level: str = ERROR) -> None:
    """The project's FMU with another description; a change's old text may be a regular expression."""

    def content() -> Files:
        text = built(version)[XML].decode()
        for old, new in changes:
            text, times = re.subn(old, new, text, count=1)
            if not times:
                raise AssertionError(f"{old!r} is not in the description")
        return built(version) | {XML: text.encode()}

    add(name, what, f"ours, FMI {version}.0", content, check, says, level)


def packed(name: str, what: str, entry: str, says: str, level: str = ERROR, data: bytes = b"x", **attributes) -> None:
    """The small FMU with one more entry, as no packer should write it."""

    def write(path: Path) -> None:
        write_archive(path, small_fmu.content("2.0") | {"resources/there.txt": b"1"})
        info = zipfile.ZipInfo("placeholder", (1980, 1, 1, 0, 0, 0))
        info.filename = info.orig_filename = entry
        for attribute, value in attributes.items():
            setattr(info, attribute, value)
        with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as archive:
            warnings.simplefilter("ignore")
            archive.writestr(info, data, compress_type=attributes.get("compress_type"))

    MUTANTS.append(Mutant(name, what, "small, FMI 2.0", write, "archive", says, level))


def patched(name: str, what: str, says: str, patch: Callable[[bytearray], None]) -> None:
    """The small FMU's archive with other bytes."""

    def write(path: Path) -> None:
        write_archive(path, small_fmu.content("2.0"))
        data = bytearray(path.read_bytes())
        patch(data)
        path.write_bytes(data)

    MUTANTS.append(Mutant(name, what, "small, FMI 2.0", write, "archive", says))


# ---- the archive ---------------------------------------------------------------------------------


def set_in_headers(offset: int, value: int, name: bytes = b"modelDescription.xml") -> Callable[[bytearray], None]:
    """Sets 16 bits in the local and the central header of an entry; `offset` as in the local one."""

    def patch(data: bytearray) -> None:
        for signature, more, length in ((b"PK\x03\x04", 0, 30), (b"PK\x01\x02", 2, 46)):
            start = data.index(name) - length
            while bytes(data[start : start + 4]) != signature:
                start = data.index(name, start + length + 1) - length
            data[start + offset + more : start + offset + more + 2] = value.to_bytes(2, "little")

    return patch


def spoil(data: bytearray) -> None:
    data[data.index(b"modelDescription.xml") + 400] ^= 0xFF


packed("leads-out", "an entry leads out of the folder", "../../evil.sh", "leads out of the folder")
packed("absolute", "an entry has an absolute name", "/etc/evil", "leads out of the folder")
packed("drive", "an entry names a drive", "C:/evil", "leads out of the folder")
packed("backslash", "a backslash in a name", "resources\\table.csv", "backslash")
packed("not-ascii", "a name that is not ASCII", "resources/größe.csv", "not ASCII", WARNING)
packed("two-cases", "two names that differ in case", "resources/THERE.txt", "one file on Windows")
packed("twice", "a name that is there twice", "resources/there.txt", "is there 2 times")
packed("link", "a symbolic link", "resources/link", "symbolic link",
       external_attr=0o120777 << 16, create_system=3)  # fmt: skip
packed("bzip2", "packed by another method", "resources/packed", "method 12", compress_type=zipfile.ZIP_BZIP2)
patched("size-behind", "stored with general purpose bit 3", "general purpose bit 3",
        lambda data: (set_in_headers(8, 0)(data), set_in_headers(6, 8)(data))[0])  # fmt: skip
patched("encrypted", "an entry is encrypted", "is encrypted", set_in_headers(6, 1))
patched("zip-4.5", "needs version 4.5 of ZIP", "needs version 4.5", set_in_headers(4, 45))
patched("damaged", "a byte of an entry is another", "is damaged|no readable", spoil)
patched(
    "no-archive", "no ZIP archive at all", "no readable ZIP archive", lambda data: data.__setitem__(slice(None), b"x")
)
add("no-description", "no modelDescription.xml", "small, FMI 2.0",
    lambda: {name: data for name, data in small_fmu.content("2.0").items() if name != XML},
    "archive", "modelDescription.xml is missing")  # fmt: skip

# ---- the description -----------------------------------------------------------------------------

described("2.0", "unknown-unit", "a unit that is not defined", [('unit="m" displayUnit="mm"', 'unit="furlong"')],
          "description", "furlong")  # fmt: skip
described("2.0", "unknown-display-unit", "a display unit that is not defined", [('displayUnit="mm"', 'displayUnit="cm"')],
          "description", "display unit \"cm\"")  # fmt: skip
for edition in EDITIONS:
    n = edition[0]
    described(edition, f"unknown-attribute-{n}", "an attribute that FMI does not know",
              [('modelName="Small"', 'modelName="Small" colour="red"')], "description", "colour")  # fmt: skip
    described(edition, f"illegal-name-{n}", "a name that is none of the structured convention",
              [('name="k"', 'name="k k"')], "description", "k k")  # fmt: skip
    described(edition, f"double-name-{n}", "two variables of one name", [('name="k"', 'name="u"')], "description",
              "not unique")  # fmt: skip
    described(edition, f"no-start-{n}", "an input without a start value",
              [('causality="input"><Real start="1"/>', 'causality="input"><Real/>') if n == "2" else
               ('causality="input" start="1"', 'causality="input"')], "description", "no start value")  # fmt: skip
    described(edition, f"combination-{n}", "causality and variability that do not go together",
              [('causality="output"', 'causality="output" variability="fixed"')], "description", "illegal|not allowed")  # fmt: skip
    described(edition, f"min-above-max-{n}", "a min above the max", [('min="-1000" max="1000"', 'min="1000" max="-1000"')],
              "variables", "y: its min 1000 is above its max -1000")  # fmt: skip
    described(edition, f"start-above-{n}", "a start above the max", [('max="50"', 'max="0.25"')], "variables",
              "x starts with 0.5, outside -50 to 0.25")  # fmt: skip
    described(edition, f"start-below-{n}", "a start below the min", [('min="-50"', 'min="0.75"')], "variables",
              "x starts with 0.5, outside 0.75 to 50")  # fmt: skip
    described(edition, f"nominal-zero-{n}", "a nominal value of 0", [('unit="m" displayUnit', 'nominal="0" unit="m" displayUnit')
              if n == "2" else ('unit="m"\n', 'unit="m" nominal="0"\n')], "variables", "x: its nominal value is 0")  # fmt: skip
    described(edition, f"stop-before-start-{n}", "an experiment that stops before it starts",
              [('startTime="0" stopTime="1"', 'startTime="2" stopTime="1"')], "variables", "stops at 1 s, before it starts at 2 s")  # fmt: skip
    described(edition, f"negative-step-{n}", "an experiment with a negative step", [('stepSize="0.05"', 'stepSize="-0.05"')],
              "variables", "has the stepSize -0.05")  # fmt: skip
    described(edition, f"zero-tolerance-{n}", "an experiment with the tolerance 0", [('stepSize="0.05"', 'tolerance="0"')],
              "variables", "has the tolerance 0")  # fmt: skip
    described(edition, f"bytes-without-state-{n}", "states that can be serialized and not be got",
              [(' canGetAndSetFMU' + ("state" if n == "2" else "State") + '="true"', "")], "variables",
              "canSerializeFMU[sS]tate without canGetAndSetFMU")  # fmt: skip
    described(edition, f"derivative-of-input-{n}", "a derivative that points to no state",
              [('derivative="4"', 'derivative="2"') if n == "2" else ('derivative="3"', 'derivative="1"')], "variables",
              r"der\(x\) is declared as the derivative of u, which is no state")  # fmt: skip
    described(edition, f"derivative-of-parameter-{n}", "a derivative of a parameter",
              [('derivative="4"', 'derivative="3"') if n == "2" else ('derivative="3"', 'derivative="2"')], "variables",
              r"der\(x\) is declared as the derivative of k, which is no state")  # fmt: skip
    described(edition, f"derivative-of-itself-{n}", "a derivative of itself",
              [('derivative="4"', 'derivative="6"') if n == "2" else ('derivative="3"', 'derivative="5"')], "variables",
              r"der\(x\) is declared as its own derivative")  # fmt: skip
    described(edition, f"derivative-of-nothing-{n}", "a derivative of a variable that there is not",
              [('derivative="4"', 'derivative="99"') if n == "2" else ('derivative="3"', 'derivative="99"')], "description",
              "99")  # fmt: skip
    described(edition, f"derivative-of-output-{n}", "a derivative that points to an output that is no state",
              [('derivative="4"', 'derivative="5"') if n == "2" else ('derivative="3"', 'derivative="4"')], "states (ME)",
              "y is .* read as a variable, and .* by the functions")  # fmt: skip
    described(edition, f"reinit-of-parameter-{n}", "reinit on a parameter",
              [('<Real start="2"/>', '<Real start="2" reinit="true"/>') if n == "2" else
               ('start="2"/>', 'start="2" reinit="true"/>')], "variables", "k has reinit, and is no continuous state")  # fmt: skip
    described(edition, f"display-factor-{n}", "a display unit with the factor 100", [('factor="1000"', 'factor="100"')],
              "units", "display unit mm of m is declared with the factor 100, not 1000", WARNING)  # fmt: skip
    described(edition, f"exponent-{n}", "m/s as m.s-2", [('m="1" s="-1"', 'm="1" s="-2"')], "units",
              "the unit m/s is declared as m.s-2", WARNING)  # fmt: skip
    described(edition, f"base-factor-{n}", "a base unit with a factor", [('<BaseUnit m="1"/>', '<BaseUnit m="1" factor="0.001"/>')],
              "units", "the unit m is declared with the factor 0.001, not 1", WARNING)  # fmt: skip
    described(edition, f"display-dimension-{n}", "a display unit of another dimension", [('name="mm"', 'name="kg"'),
              ('displayUnit="mm"', 'displayUnit="kg"')], "units", "kg is no multiple of m", WARNING)  # fmt: skip
    described(edition, f"other-start-{n}", "another start value than the binary's",
              [('<Real start="2"/>', '<Real start="2.5"/>') if n == "2" else ('fixed" start="2"', 'fixed" start="2.5"')],
              "start-values (CS)", "k starts with 2.5 in the description and with 2.0 in the binary")  # fmt: skip
    described(edition, f"other-text-{n}", "another text than the binary's", [('Set me!', 'Set it!')], "start-values (ME)",
              "label starts with Set it! in the description and with Set me! in the binary")  # fmt: skip
    described(edition, f"lacks-input-{n}", "the dependency on an input is missing",
              [('dependencies="2 4" dependenciesKind="dependent fixed"', 'dependencies="4" dependenciesKind="fixed"') if n == "2" else
               ('dependencies="1 3" dependenciesKind="dependent fixed"', 'dependencies="3" dependenciesKind="fixed"')],
              "dependencies (ME)", "y follows u in Continuous-Time Mode, which its dependencies do not name")  # fmt: skip
    described(edition, f"lacks-state-{n}", "the dependency of a derivative on a state is missing",
              [('dependencies="2 4" dependenciesKind="constant constant"', 'dependencies="2" dependenciesKind="constant"') if n == "2" else
               ('dependencies="1 3" dependenciesKind="constant constant"', 'dependencies="1" dependenciesKind="constant"')],
              "dependencies (ME)", r"der\(x\) follows x in Continuous-Time Mode, which its dependencies do not name")  # fmt: skip
    described(edition, f"lacks-parameter-{n}", "the initial dependency on a parameter is missing",
              [('dependencies="2 3 4"', 'dependencies="2 4"') if n == "2" else ('dependencies="1 2 3"', 'dependencies="1 3"')],
              "dependencies (CS)", "y follows k in Initialization Mode, which its dependencies do not name")  # fmt: skip
    for kind in ("constant", "fixed"):
        described(edition, f"called-{kind}-{n}", f"a dependency that is no {kind} factor, called one",
                  [('"dependent fixed"', f'"{kind} fixed"')], "dependencies (ME)",
                  f"y: its factor of u is declared {kind}, and is")  # fmt: skip
    described(edition, f"needless-dependency-{n}", "a dependency that has no effect",
              [('<Unknown index="6" dependencies="2 4"/>', '<Unknown index="6" dependencies="2 3 4"/>') if n == "2" else
               ('<InitialUnknown valueReference="5" dependencies="1 3"/>', '<InitialUnknown valueReference="5" dependencies="1 2 3"/>')],
              "dependencies (CS)", r"der\(x\) is declared to depend on k, which changed nothing", WARNING)  # fmt: skip
    described(edition, f"kinds-too-few-{n}", "fewer kinds than dependencies", [('"dependent fixed"', '"dependent"')],
              "description", "do not match|number of elements")  # fmt: skip
    described(edition, f"output-not-in-structure-{n}", "an output that the model structure lacks",
              [('<Outputs><Unknown index="5" dependencies="2 4" dependenciesKind="dependent fixed"/></Outputs>', '') if n == "2" else
               ('<Output valueReference="4" dependencies="1 3" dependenciesKind="dependent fixed"/>', '')],
              "description", "exactly one entry for each variable")  # fmt: skip
    described(edition, f"initial-unknown-missing-{n}", "an initial unknown that the model structure lacks",
              [('<Unknown index="6" dependencies="2 4"/>', '') if n == "2" else
               ('<InitialUnknown valueReference="5" dependencies="1 3"/>', '')], "description", "InitialUnknowns")  # fmt: skip
described("2.0", "two-independent", "two independent variables",
          [('name="z" valueReference="6" causality="local" initial="calculated"', 'name="z" valueReference="6" causality="independent"')],
          "variables", "time, z are all independent")  # fmt: skip
described("2.0", "alias-of-input", "an input that shares its reference", [('valueReference="2"', 'valueReference="1"')],
          "value-references", "value reference 1: u, k")  # fmt: skip
described("2.0", "dangling-2", "a structure that names a variable that there is not", [('index="6"', 'index="66"')],
          "description", "Unknown .line .*names the variable 66, which there is not")  # fmt: skip
described("3.0", "dangling-3", "a structure that names a variable that there is not",
          [('dependencies="1 2 3"', 'dependencies="1 2 33"')], "description",
          "InitialUnknown .line .*names the variable 33, which there is not")  # fmt: skip
described("3.0", "double-reference", "two variables of one reference",
          [('name="z" valueReference="6"', 'name="z" valueReference="1"'), ('<EventIndicator valueReference="6"/>', "")],
          "description", "same value reference")  # fmt: skip
described("3.0", "no-independent", "no independent variable",
          [('causality="independent" variability="continuous"', 'causality="local" variability="continuous"')],
          "description", "independent variable")  # fmt: skip
described("3.0", "early-without-update", "early returns without intermediate updates",
          [('providesIntermediateUpdate="true"', "")], "variables",
          "canReturnEarlyAfterIntermediateUpdate without providesIntermediateUpdate")  # fmt: skip
described("3.0", "negative-internal-step", "a negative step of its own",
          [('hasEventMode="true"', 'hasEventMode="true" fixedInternalStepSize="-0.01"')], "variables",
          "fixedInternalStepSize -0.01")  # fmt: skip
described("2.0", "type-limits", "a start outside the limits of its type",
          [("  <LogCategories>", '  <TypeDefinitions><SimpleType name="T"><Real max="1.5"/></SimpleType></TypeDefinitions>\n  <LogCategories>'), ('<Real start="2"/>', '<Real declaredType="T" start="2"/>')], "variables",
          "k starts with 2, outside -inf to 1.5")  # fmt: skip
described("2.0", "other-identifier", "a model identifier that no binary has",
          [('modelIdentifier="Small"', 'modelIdentifier="Other"')], "binaries", "has no Other for ModelExchange")  # fmt: skip

# ---- files ---------------------------------------------------------------------------------------

MANIFEST = b"""<fmiReferences xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest"
fmi-ls:fmi-ls-name="org.example.notes" fmi-ls:fmi-ls-version="1.0.0" fmi-ls:fmi-ls-description="notes">
<Related type="text/plain" source="note.txt" role="document"/></fmiReferences>"""
TERMINALS = """<fmiTerminalsAndIcons fmiVersion="3.0"><GraphicalRepresentation>
<CoordinateSystem x1="0" y1="0" x2="1" y2="1" suggestedScalingFactorTo_mm="1"/>
<Icon x1="0" y1="0" x2="1" y2="1"/></GraphicalRepresentation>
<Terminals><Terminal name="port" matchingRule="bus">
<TerminalMemberVariable variableKind="signal" variableName="u" memberName="u"/></Terminal></Terminals>
</fmiTerminalsAndIcons>"""
NOTES = "extra/org.example.notes"
TERMINALS_FILE = "terminalsAndIcons/terminalsAndIcons.xml"

with_files("2.0", "strange-folder", "a folder that FMI does not know", {"private/notes.txt": b"1"}, "files",
           "private/notes.txt: outside the folders", WARNING)  # fmt: skip
with_files("2.0", "dead-link", "documentation that links to nothing",
           {"documentation/index.html": b'<html><body><a href="more.html">more</a></body></html>'}, "files",
           "links to more.html, which is missing")  # fmt: skip
with_files("3.0", "icon-without-png", "a vector icon without a bitmap", {"terminalsAndIcons/icon.svg": b"<svg/>"}, "files",
           "icon.svg needs .*icon.png")  # fmt: skip
with_files("3.0", "license-without-entry", "licenses without their entry",
           {"documentation/licenses/other.txt": b"free"}, "files", "has no license.txt")  # fmt: skip
with_files("3.0", "manifest-file-missing", "a manifest that lists what is missing", {f"{NOTES}/fmi-ls-manifest.xml": MANIFEST},
           "files", "lists note.txt, which is missing")  # fmt: skip
with_files("3.0", "manifest-elsewhere", "a manifest in another standard's folder",
           {"extra/org.example.other/fmi-ls-manifest.xml": MANIFEST, "extra/org.example.other/note.txt": b"hi"}, "files",
           "of the layered standard org.example.notes")  # fmt: skip
with_files("3.0", "manifest-checksum", "a file that is not what its manifest says",
           {f"{NOTES}/fmi-ls-manifest.xml": MANIFEST.replace(b'role="document"', b'role="document" checksum="00"'),
            f"{NOTES}/note.txt": b"hi"}, "files", "note.txt has changed")  # fmt: skip
with_files("3.0", "terminal-of-nothing", "a terminal of a variable that there is not",
           {TERMINALS_FILE: TERMINALS.replace('variableName="u"', 'variableName="v"').encode()}, "terminals",
           "no variable v")  # fmt: skip
with_files("3.0", "terminals-schema", "a terminal that the schema forbids",
           {TERMINALS_FILE: TERMINALS.replace("matchingRule", "rule").encode()}, "terminals", "line 4")  # fmt: skip
add("no-binary", "neither binaries nor sources", "small, FMI 2.0", lambda: {XML: small_fmu.content("2.0")[XML]},
    "binaries", "neither binaries nor sources")  # fmt: skip
with_files("2.0", "other-format", "a file of another system in a folder of binaries",
           {"binaries/win64/Small.dll": b"MZ, and nothing else"}, "binaries", "neither an ELF, a PE nor a Mach-O|win64")  # fmt: skip
compiled("2.0", "lacks-function", "a function of the standard is not exported", ("-DLACKS_DIRECTIONAL_DERIVATIVE",),
         "functions", "lacks fmi2GetDirectionalDerivative")  # fmt: skip
compiled(
    "2.0", "foreign-symbol", "another name is exported", ("-DFOREIGN_SYMBOL",), "symbols", "exports helper", WARNING
)
compiled("2.0", "other-version-2", "a binary of another FMI version", ('-DBINARY_VERSION="1.0"',), "load (CS)",
         "the binary says that it is FMI 1.0")  # fmt: skip
compiled("3.0", "other-version-3", "a binary of another FMI version", ('-DBINARY_VERSION="2.0"',), "load (CS)",
         "the binary says that it is FMI 2.0")  # fmt: skip
compiled(
    "2.0",
    "other-types",
    "types that are not the default",
    ('-DTYPES_PLATFORM="dsp"',),
    "load (ME)",
    "its types are 'dsp'",
)
add("no-binary-here", "no binary for this machine", "small, FMI 2.0",
    lambda: {XML: small_fmu.content("2.0")[XML], "sources/Small.c": b"int none;"}, "load (CS)",
    f"nothing for this machine, {fmpy.platform}")  # fmt: skip

# ---- this project's interface --------------------------------------------------------------------

for version in (2, 3):
    ours(version, f"our-display-factor-{version}", "a display unit with the factor 100",
         [('name="mm" factor="1000.0"', 'name="mm" factor="100.0"')], "interface",
         "unit m: display unit mm with the factor 100.0, not 1000")  # fmt: skip
    ours(version, f"our-exponent-{version}", "m/s as m.s-2", [('<Unit name="m/s">\\s*<BaseUnit m="1" s="-1"/>',
         '<Unit name="m/s"><BaseUnit m="1" s="-2"/>')], "interface", "unit m/s: m.s-2")  # fmt: skip
    unknown = 'index="10"' if version == 2 else 'Output valueReference="10"'
    ours(version, f"our-dependency-{version}", "a missing dependency",
         [(f'{unknown} dependencies="2 3" dependenciesKind="dependent dependent"',
           f'{unknown} dependencies="2" dependenciesKind="dependent"')], "interface",
         "tip.vx depends on crank.w: not declared, not dependent")  # fmt: skip
    ours(version, f"our-dependency-run-{version}", "a missing dependency, told from runs",
         [(f'{unknown} dependencies="2 3" dependenciesKind="dependent dependent"',
           f'{unknown} dependencies="2" dependenciesKind="dependent"')], "dependencies (ME)",
         "tip.vx follows crank.w in Continuous-Time Mode")  # fmt: skip
    ours(version, f"our-kind-{version}", "a wrong dependency kind",
         [(f'{unknown} dependencies="2 3" dependenciesKind="dependent dependent"',
           f'{unknown} dependencies="2 3" dependenciesKind="constant dependent"')], "interface",
         "tip.vx depends on crank.phi: constant, not dependent")  # fmt: skip
    ours(version, f"our-kind-run-{version}", "a wrong dependency kind, told from runs",
         [(f'{unknown} dependencies="2 3" dependenciesKind="dependent dependent"',
           f'{unknown} dependencies="2 3" dependenciesKind="constant dependent"')], "dependencies (ME)",
         "tip.vx: its factor of crank.phi is declared constant")  # fmt: skip
    ours(version, f"our-range-{version}", "another range", [(r'(name="geometry.L2"[\s\S]*?max=")[^"]*', r"\g<1>1")], "interface",
         "geometry.L2: range")  # fmt: skip
ours(2, "our-start", "another start value", [('start="0.105"', 'start="0.106"')], "interface", "start 0.106, not 0.105")
ours(2, "our-start-run", "another start value than the binary's", [('start="0.105"', 'start="0.106"')], "start-values (CS)",
     "geometry.L2 starts with 0.106 in the description and with 0.105 in the binary")  # fmt: skip
ours(2, "our-reference", "another value reference", [('valueReference="4"', 'valueReference="3"')], "interface",
     "crank.a: value reference 3, not 4")  # fmt: skip
ours(
    2,
    "our-unit",
    "another unit",
    [('unit="rad/s2" displayUnit="deg/s2"', 'unit="rad/s"')],
    "interface",
    "crank.a: unit rad/s",
)
ours(2, "our-token", "another token", [('guid="{.', 'guid="{~')], "interface", "is not that of this interface")
ours(2, "our-derivative", "a derivative of another output", [('derivative="21"', 'derivative="8"')], "interface",
     r"der\(machine.s\): derivative of tip.x, not machine.s")  # fmt: skip
ours(
    3,
    "our-name",
    "a variable of another name",
    [('name="crank.a"', 'name="crank.b"')],
    "interface",
    "crank.a is missing",
)

# ---- the binary ----------------------------------------------------------------------------------

defective("no-instance", "no instance is made", "instance (CS)", "Failed to instantiate")
defective("free", "it crashes when freed", "instance (ME)", "died of SIGSEGV in fmiNFreeInstance")
defective("crash", "it crashes in a step", "run (CS)", "died of SIGSEGV in fmiNDoStep")
defective("abort", "it aborts", "run (CS)", "died of SIGABRT in fmiNDoStep")
defective(
    "exit", "it ends its host", "run (CS)", 'the FMU ended the process, exit status 0x3; it printed: "no license"'
)
defective("error", "a step fails", "run (CS)", r"fmiNDoStep failed with status 3 \(error\)")
defective(
    "setup", "the experiment cannot be set up", "start-values (CS)", "fmi2SetupExperiment failed", editions=("2.0",)
)
defective("enter", "Initialization Mode cannot be entered", "start-values (CS)", "fmiNEnterInitializationMode failed")
defective("leave", "Initialization Mode cannot be left", "start-values (ME)", "fmiNExitInitializationMode failed")
defective("terminate", "it cannot be terminated", "run (ME)", "fmiNTerminate failed")
defective("nan", "an output that is no number", "run (CS)", "y is nan at 0.35 s")
defective("infinite", "an output that is not finite", "run (ME)", "y is inf at 0.35 s")
defective("endless", "an event iteration without end", "run (ME)", "the event iteration at 0 s does not end")
defective("standing-end", "steps that return OK and stand still", "run (CS)", "stopped at 0 s instead of 0.05 s",
          editions=("3.0",))  # fmt: skip
defective(
    "early-for-ever", "early returns that do not get ahead", "run (CS)", "returned early 1000 times", editions=("3.0",)
)
defective("standing-time", "a time that stands still", "independent (CS)", "time is 0 s where the host is at 0.05 s")
defective("late-time", "a time that is one step late", "independent (CS)", "time is 0 s where the host is at 0.05 s")
defective("standing-state", "a state that stands still", "states (CS)", r"x stands still in a run, though der\(x\) is")
defective("high", "an output above its max", "ranges (CS)", "y is 1001 at 0.35 s, outside -1000 to 1000")
defective("low", "an output below its min", "ranges (ME)", "y is -1001 at 0.35 s, outside -1000 to 1000")
defective("other-rate", "GetDerivatives gives another value than the variable", "states (ME)",
          r"der\(x\) is 0.5 read as a variable, and 0.51 by the functions")  # fmt: skip
defective("other-state", "GetContinuousStates gives another value than the variable", "states (ME)",
          "x is 0.5 read as a variable, and 0.51 by the functions")  # fmt: skip
defective("nominal", "a state whose nominal value is 0", "states (ME)", "the nominal value of the state x is 0")
defective("fewer-indicators", "fewer event indicators than declared", "run (ME)",
          "fmiNGetEventIndicators fills 0 values where 1 are declared")  # fmt: skip
defective("more-indicators", "more event indicators than declared", "run (ME)",
          "fmiNGetEventIndicators fills 2 values where 1 are declared")  # fmt: skip
described("2.0", "undeclared-indicator-2", "an event indicator that is not declared",
          [('numberOfEventIndicators="1"', 'numberOfEventIndicators="0"')], "states (ME)", "no event indicator is declared")  # fmt: skip
described("3.0", "undeclared-indicator-3", "an event indicator that is not declared",
          [('<EventIndicator valueReference="6"/>', "")], "states (ME)", "0 event indicators are declared; the binary says 1")  # fmt: skip
defective("count-of-indicators", "another number of event indicators", "states (ME)",
          "1 event indicators are declared; the binary says 0", editions=("3.0",))  # fmt: skip
defective("count-of-states", "another number of states", "states (ME)", "1 continuous states are declared; the binary says 2",
          editions=("3.0",))  # fmt: skip
defective("start", "another start value", "start-values (ME)", "k starts with 2 in the description and with 3.0")
defective("text", "another text at the start", "start-values (CS)", "label starts with Set me! .* with Set him!")
defective("token", "any token is accepted", "token (CS)", "accepts any token", WARNING)
defective("process", "other results in another process", "determinism (CS)", "a second run gives y = ")
defective(
    "shared", "instances that share what they should not", "instances (CS)", "a run beside a second instance gives y"
)
defective("second", "no second instance is made", "instances (ME)", "Failed to instantiate")
defective("reset", "a reset that leaves a state", "reset (CS)", "a run after a reset gives y = ")
defective("reset-error", "a reset that fails", "reset (ME)", "fmiNReset failed")
defective(
    "state", "a restored state that lacks something", "state-replay (ME)", "the run from the restored state gives y = "
)
defective("serialized", "a serialized state that another process cannot use", "serialized-state (CS)",
          "the run in another process gives y = ")  # fmt: skip
defective(
    "slope",
    "directional derivatives that are 0",
    "derivatives (CS)",
    r"d\(y\)/d\(u\) is given as 0; differences give 2.0",
)
defective("slope-sign", "directional derivatives of the other sign", "derivatives (ME)",
          r"d\(y\)/d\(u\) is given as -2.0\d*; differences give 2.0")  # fmt: skip
defective("slope-error", "directional derivatives that fail", "derivatives (CS)", "fmiNGetDirectionalDerivative failed")
defective("slope-of-rate", "a wrong directional derivative of a rate", "derivatives (ME)",
          r"d\(der\(x\)\)/d\(u\) is given as 0; differences give 1")  # fmt: skip
defective(
    "adjoint",
    "adjoint derivatives of the other sign",
    "adjoint (CS)",
    r"d\(y\)/d\(u\) is given as -2",
    editions=("3.0",),
)
defective(
    "adjoint-error",
    "adjoint derivatives that fail",
    "adjoint (CS)",
    "fmi3GetAdjointDerivative failed",
    editions=("3.0",),
)
defective("hidden", "a rate that follows a parameter that it should not", "dependencies (CS)",
          r"der\(x\) follows k in Initialization Mode, which its dependencies do not name")  # fmt: skip
defective("nonlinear", "a rate whose factor of an input changes", "dependencies (ME)",
          r"der\(x\): its factor of u is declared constant, and is")  # fmt: skip
defective("bent", "a rate whose factor of a state changes", "dependencies (ME)",
          r"der\(x\): its factor of x is declared constant, and is")  # fmt: skip
defective("deaf-rate", "a rate that does not follow an input", "dependencies (ME)",
          r"der\(x\) is declared to depend on u, which changed nothing in Continuous-Time Mode", WARNING)  # fmt: skip
defective("input-slope", "input derivatives without effect", "input-derivatives (CS)",
          "fmi2SetRealInputDerivatives says OK, and no variable follows", editions=("2.0",))  # fmt: skip
defective("input-slope-error", "input derivatives that fail", "input-derivatives (CS)",
          "fmi2SetRealInputDerivatives failed", editions=("2.0",))  # fmt: skip
GET = {"2.0": "fmi2GetRealOutputDerivatives failed", "3.0": "fmi3GetOutputDerivatives failed"}
for edition in EDITIONS:
    defective(
        "output-slope-error",
        "output derivatives that fail",
        "output-derivatives (CS)",
        GET[edition],
        editions=(edition,),
    )
defective(
    "output-slope-zero",
    "output derivatives that are 0",
    "output-derivatives (CS)",
    "every first derivative is 0, though y",
)
defective("output-slope-sign", "output derivatives of the other sign", "output-derivatives (CS)",
          "the first derivative of y is given as")  # fmt: skip
defective("output-slope-nan", "output derivatives that are no numbers", "output-derivatives (CS)",
          "derivative 1 of y is not finite")  # fmt: skip
defective(
    "only-one-length",
    "steps of another length that fail",
    "variable-step (CS)",
    r"fmiNDoStep failed with status 3 \(error\)",
)
defective("own-length", "steps of its own length, whatever is asked for", "variable-step (CS)",
          "time is .* s where the host is at")  # fmt: skip
defective(
    "event-mode", "Event Mode that cannot be entered", "event-mode (CS)", "fmi3EnterEventMode failed", editions=("3.0",)
)
defective(
    "step-mode", "Event Mode that cannot be left", "event-mode (CS)", "fmi3EnterStepMode failed", editions=("3.0",)
)
defective(
    "no-update", "it never calls back", "intermediate-update (CS)", "the binary never called back", editions=("3.0",)
)
defective("early-update", "it calls back for a time outside the step", "intermediate-update (CS)",
          "it called back for -1 s in a step from 0 s to 0.05 s", editions=("3.0",))  # fmt: skip
defective("no-return", "it does not return early", "intermediate-update (CS)", "no step returned early when it was asked to",
          editions=("3.0",))  # fmt: skip
defective(
    "category",
    "a log category that is not declared",
    "log (CS)",
    "the category 'logNothing', which LogCategories",
    WARNING,
)
defective("no-category", "messages without a category", "log (CS)", "was called without a category", WARNING)
defective("latin-1", "messages that are no UTF-8", "log (CS)", "a message that is no UTF-8: 'zur")
defective("logging", "debug logging that cannot be set", "log (ME)", "fmiNSetDebugLogging failed")
defective("leak", "much memory is lost with every instance", "memory (CS)", r"every instance leaves some 1\d{5} bytes")
defective(
    "small-leak", "memory is lost with every instance", "memory (ME)", r"every instance leaves some \d+ bytes", WARNING
)


# ---- the page ------------------------------------------------------------------------------------


def page() -> str:
    """mutants.md: every kind once, with the FMI versions that it was tried in."""
    kinds: dict[tuple[str, str, str], list[str]] = {}
    for mutant in MUTANTS:
        kinds.setdefault((mutant.what, mutant.check.split(" (")[0], mutant.level), []).append(mutant.fmu)
    rows = [
        f"| {what} | {', '.join(dict.fromkeys(fmus))} | `{check}` | {level} |"
        for (what, check, level), fmus in kinds.items()
    ]
    return f"""# What `linkage-fmu validate` catches

An FMU with one thing wrong, and the check that says so: {len(MUTANTS)} of them, {len(kinds)} kinds. "small" is an FMU of
a few lines of C (`tests/validation/small_fmu.c`), "ours" this project's with another description. Each is made and
checked by `tests/validation/test_mutants.py`, which also sees that the check gives the right reason; the same FMUs
without the mistake pass every check. An error fails; a warning fails with `--strict`.

| what is wrong | in | caught by | as |
|---|---|---|---|
{chr(10).join(rows)}

This page is written by `python -m tests.validation.mutants`.
"""


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
