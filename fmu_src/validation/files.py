"""Checks of what lies in the archive: nothing of the FMU runs. Each yields its problems as sentences."""

from __future__ import annotations

import hashlib
import posixpath
import re
import stat
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import fmpy
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3ScheduledExecution, FMU3Slave
from fmpy.model_description import ModelDescription, ValidationError
from lxml import etree, html

from ..formats import ls_wasm
from ..formats.python_fmu import DESTRUCTOR, FINALIZER, VERSIONS, keeps_what_it_gave_back
from .process import OutOfTime
from .subject import (
    CO_SIMULATION,
    MODEL_EXCHANGE,
    Advice,
    Consequence,
    NotApplicable,
    NotJudged,
    Subject,
    is_of_the_machine,
    limits_of,
    number,
    short,
)
from .units import disagreements

SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
ENCRYPTED, SIZES_BEHIND, DEFLATED, OLDEST_UNZIP = 1, 8, zipfile.ZIP_DEFLATED, 20
KNOWN_FOLDERS = {"binaries", "documentation", "extra", "resources", "sources", "terminalsAndIcons", "icons"}
KNOWN_FILES = {"modelDescription.xml", "model.png"}  # at the top; the picture is FMI 2.0's
FUNCTIONS = {
    CO_SIMULATION: (FMU2Slave,),
    MODEL_EXCHANGE: (FMU2Model,),
    3: (FMU3Model, FMU3Slave, FMU3ScheduledExecution),  # since FMI 3.0.1 all functions, whatever the interface type
}
LEFT_BY_LINKERS = {"_init", "_fini", "__bss_start", "_edata", "_end", "__dso_handle", "_mh_dylib_header"}
# PEP 599 (manylinux2014): what every Linux brings along, without the graphical ones.
LINUX_LIBRARIES = re.compile(
    r"(libc\.so\.6|libm\.so\.6|libdl\.so\.2|librt\.so\.1|libpthread\.so\.0|libutil\.so\.1|libresolv\.so\.2"
    r"|libnsl\.so\.1|libgcc_s\.so\.1|libstdc\+\+\.so\.6|ld-linux.*\.so\.\d)"
)
# What Windows itself brings along; runtimes of compilers, which are installed with programs, are not among them.
WINDOWS_LIBRARIES = re.compile(
    r"(advapi32|api-ms-win-[\w-]+|avrt|bcrypt|bcryptprimitives|cabinet|cfgmgr32|comctl32|comdlg32|combase|crypt32"
    r"|cryptbase|d2d1|d3d\d+|d3dcompiler_\d+|dbghelp|dhcpcsvc6?|dnsapi|dsound|dwmapi|dwrite|dxgi|ext-ms-win-[\w-]+"
    r"|fwpuclnt|gdi32|gdiplus|glu32|hid|httpapi|imagehlp|imm32|iphlpapi|kernel32|kernelbase|mf|mfplat|mpr|mscoree|msimg32"
    r"|mswsock|msvcrt|ncrypt|netapi32|normaliz|ntdll|odbc32|ole32|oleacc|oleaut32|opengl32|pdh|powrprof|propsys|psapi"
    r"|rasapi32|rpcrt4|rstrtmgr|secur32|setupapi|shcore|shell32|shlwapi|sspicli|tdh|ucrtbase|urlmon|user32|userenv"
    r"|usp10|uxtheme|version|wevtapi|windowscodecs|winhttp|wininet|winmm|winscard|winspool|wintrust|winusb|wldap32"
    r"|ws2_32|wsock32|wtsapi32|xinput\w+|xmllite)\.(dll|drv)", re.IGNORECASE,
)  # fmt: skip
MACOS_LIBRARIES = re.compile(r"(/usr/lib/|/System/Library/).*")
LIBRARIES = {"ELF": LINUX_LIBRARIES, "PE": WINDOWS_LIBRARIES, "Mach-O": MACOS_LIBRARIES}
# A folder below binaries/ to the format and the processors that its files are for.
PROCESSORS = {"x86_64": {"X86_64", "AMD64"}, "aarch64": {"AARCH64", "ARM64"}, "x86": {"I386", "X86"},
              "i686": {"I386", "X86"}, "aarch32": {"ARM", "ARMNT"}}  # fmt: skip
SYSTEMS = {"linux": "ELF", "windows": "PE", "darwin": "Mach-O"}
FMI2_FOLDERS = {"linux64": ("linux", "x86_64"), "linux32": ("linux", "i686"), "win64": ("windows", "x86_64"),
                "win32": ("windows", "i686"), "darwin64": ("darwin", "x86_64")}  # fmt: skip


def archive(fmu: Subject) -> Iterator[str]:
    """Names that unpack alike everywhere, contents as their checksums say."""
    try:
        with zipfile.ZipFile(fmu.path) as opened:
            entries = opened.infolist()
            if excess := fmu.excess(entries):
                yield excess
                return
            for entry in entries:
                for problem in entry_problems(entry):
                    yield type(problem)(f"{entry.orig_filename!r} {problem}")
            names = [entry.orig_filename for entry in entries]
            lower: dict[str, str] = {}
            for name in names:
                if lower.setdefault(name.lower(), name) != name:
                    yield f"{name!r} and {lower[name.lower()]!r} are one file on Windows and macOS"
            for name, times in sorted(Counter(names).items()):
                if times > 1:
                    yield f"{name!r} is there {times} times"
            for entry in entries:
                if is_damaged(fmu, opened, entry):
                    yield f"{entry.orig_filename!r} is damaged: its checksum is another"
                    break
            if "modelDescription.xml" not in names:
                yield "modelDescription.xml is missing at the top"
    except OutOfTime:
        raise
    except Exception as problem:  # zipfile on what it was not made for: whatever it raises, the archive is to blame
        if is_of_the_machine(problem):
            raise
        yield f"no readable ZIP archive: {str(problem) or type(problem).__name__}"
        return
    try:
        fmu.folder  # noqa: B018 unpacks it
    except NotJudged:
        raise
    except Consequence as reason:
        yield str(reason)


def is_damaged(fmu: Subject, archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bool:
    try:
        with archive.open(entry) as file:
            fmu.be_on_time()
            while file.read(1 << 20):
                fmu.be_on_time()
    except RuntimeError:  # a method or a password that zipfile does not have; there is no time
        raise
    except Exception as problem:  # each method of packing has its own
        if is_of_the_machine(problem):
            raise
        return True
    return False


def entry_problems(entry: zipfile.ZipInfo) -> Iterator[str]:
    name = entry.orig_filename
    if "\\" in name:
        yield "has a backslash in its name: only slashes separate folders"
    if not name.isascii():
        yield Advice("has a name that is not ASCII: some hosts unpack it under another one")
    if name.startswith("/") or re.match(r"[A-Za-z]:", name) or ".." in re.split(r"[/\\]", name):
        yield "leads out of the folder that the FMU is unpacked to"
    elif not name:
        yield "is no name"
    elif NOT_ON_WINDOWS.search(name):
        yield Advice("is a name that no file on Windows can have")
    if stat.S_ISLNK(entry.external_attr >> 16):
        yield "is a symbolic link"
    if entry.flag_bits & ENCRYPTED:
        yield "is encrypted"
    if entry.flag_bits & SIZES_BEHIND and entry.compress_type == zipfile.ZIP_STORED:
        yield "is stored with general purpose bit 3 set, its size behind it: only deflated entries may be"
    if entry.compress_type not in (zipfile.ZIP_STORED, DEFLATED):
        yield f"is packed by method {entry.compress_type}: only 0 (store) and 8 (deflate) are FMI's"
    if entry.extract_version > OLDEST_UNZIP:
        yield f"needs version {entry.extract_version / 10} of ZIP to unpack: FMI demands 2.0 at most"


NOT_ON_WINDOWS = re.compile(
    r'[\x00-\x1f<>:"|?*]|[. ](/|$)|(^|/)(con|prn|aux|nul|com[1-9]|lpt[1-9])(\.[^/]*)?(/|$)', re.IGNORECASE
)
B_NAME = r"""(?:[A-Za-z_][A-Za-z_0-9]*|'(?:[A-Za-z_0-9!#$%&()*+,\-./:;<>=?@\[\]^{}|~ ]|\\['"?\\abfnrtv])+')"""
IDENTIFIER = rf"{B_NAME}(?:\[[0-9]+(?:,[0-9]+)*\])?(?:\.{B_NAME}(?:\[[0-9]+(?:,[0-9]+)*\])?)*"
FLAT = re.compile(r"[^\r\n\t]*")
STRUCTURED = re.compile(rf"{IDENTIFIER}|der\({IDENTIFIER}(?:,[0-9]+)?\)")  # the standard's grammar is regular
# What fmpy says of what `dangling` names
CRYPTIC = re.compile(r"-?\d+|list index out of range|'NoneType' object has no attribute 'startswith'")


def dangling(folder: Path) -> Iterator[str]:
    """No description at all; references in it to variables that there are not."""
    try:
        root = etree.parse(str(folder / "modelDescription.xml")).getroot()
    except (OSError, etree.XMLSyntaxError):
        return  # fmpy says so
    edition = root.get("fmiVersion")
    if root.tag != "fmiModelDescription" or edition is None:
        yield f"its root element is {str(root.tag)[:40]}: not fmiModelDescription with an fmiVersion"
        return
    is_fmi2 = edition.startswith("2")
    there = root.findall("ModelVariables/*")
    known = (
        {str(index) for index in range(1, len(there) + 1)} if is_fmi2 else {one.get("valueReference") for one in there}
    )
    own = "index" if is_fmi2 else "valueReference"
    for element in root.iterfind("ModelStructure//*"):
        if isinstance(element.tag, str) and element.get(own) is not None:
            for word in (element.get(own), *(element.get("dependencies") or "").split()):
                if word not in known:
                    yield f"{element.tag} (line {element.sourceline}) names the variable {word}, which there is not"
    if not is_fmi2:
        for variable in there:
            words = (variable.get("clocks") or "").split()
            words += [word for one in variable.findall("Dimension") if (word := one.get("valueReference")) is not None]
            for word in words:
                if word not in known:
                    place = f"{variable.get('name')} (line {variable.sourceline})"
                    yield f"{place} names the variable {word}, which there is not"


def found_by_fmpy(folder: Path) -> list[str]:
    """All that fmpy validates but the variables' names, with which its parser takes milliseconds each."""
    try:
        fmpy.read_model_description(str(folder), validate=True, validate_model_structure=True)
    except ValidationError as problem:
        return list(problem.problems)
    except Exception as problem:  # noqa: BLE001 plain ones of fmpy's, errors of its XML library
        return [str(problem)]
    return []


def odd_names(description: ModelDescription) -> Iterator[str]:
    """Names of variables against the naming convention (FMI 2.0.4, section 2.2.9; FMI 3.0.2, section 2.4.7.5)."""
    convention = description.variableNamingConvention
    for variable in description.modelVariables:
        rule = STRUCTURED if convention == "structured" else FLAT
        if not rule.fullmatch(variable.name):
            place = f"{short(variable.name)} (line {variable.sourceline})"
            yield f"{place} is no name of the naming convention {convention}"


def description(fmu: Subject) -> Iterator[str]:
    """Everything that fmpy finds, and an interface type."""
    if not (fmu.folder / "modelDescription.xml").is_file():
        raise Consequence("there is none, as the archive's check says")
    problems = [
        *dangling(fmu.folder),
        *(problem for problem in found_by_fmpy(fmu.folder) if not CRYPTIC.fullmatch(problem)),
    ]
    if not problems:
        problems += odd_names(fmu.description)
    yield from problems
    if not problems and not fmu.interfaces:
        yield "it offers no interface type: neither co-simulation nor model exchange nor scheduled execution"


def value_references(fmu: Subject) -> Iterator[str]:
    """FMI 2.0: variables with one reference are one variable, so at most one of them may be set or has a start."""
    if not fmu.is_fmi2:
        raise NotApplicable("FMI 3.0 knows no such aliases; fmpy reports doubles under description")
    sets: dict[tuple[str, int], list[Any]] = {}
    for variable in fmu.description.modelVariables:
        base = {"Enumeration": "Integer"}.get(variable.type, variable.type)
        sets.setdefault((base, variable.valueReference), []).append(variable)
    for (_, reference), members in sets.items():
        named = f"value reference {reference}: {', '.join(variable.name for variable in members)}"
        settable = [v for v in members if v.causality in ("input", "parameter")]
        if len(settable) > 1 or (settable and len(members) > len(settable)):
            yield f"{named}: an input or a parameter is a variable of its own, no alias"
        elif len([v for v in members if v.start is not None and v.variability != "constant"]) > 1:
            yield f"{named}: more than one has a start value"
        elif len({v.variability == "constant" for v in members}) > 1:
            yield f"{named}: a constant shares it with what is none"
        if len({v.unit for v in members}) > 1:
            yield f"{named}: the units differ"


def variables(fmu: Subject) -> Iterator[str]:
    """Numbers that contradict one another, attributes where they must not be."""
    kinds, description = fmu.interfaces, fmu.description  # FMI 1.0 has none that are judged
    root = fmu.root
    for variable in (*description.typeDefinitions, *description.modelVariables):
        yield from contradictions(variable)
    states = [unknown.variable.derivative for unknown in description.derivatives]
    for unknown, state in zip(description.derivatives, states, strict=True):
        if state is None:
            continue  # fmpy says so, under description
        if state.causality not in ("local", "output") or state.variability != "continuous":
            yield f"{unknown.variable.name} is declared as the derivative of {state.name}, which is no state"
        elif state is unknown.variable:
            yield f"{state.name} is declared as its own derivative"
        if states.count(state) > 1 and states.index(state) == description.derivatives.index(unknown):
            yield f"{state.name} has {states.count(state)} derivatives in the model structure"
    for variable in description.modelVariables:
        base = variable.derivative
        if base is not None and base not in states and base.variability != "continuous":
            yield f"{variable.name} is declared as the derivative of {base.name}, which is no continuous variable"
    if len(independent := [v.name for v in description.modelVariables if v.causality == "independent"]) > 1:
        yield f"{listed(independent)} are all independent: there is one such variable"
    names = {state.name for state in states if state is not None}
    for element in root.find("ModelVariables").iter():
        if isinstance(element.tag, str) and element.get("reinit") in ("true", "1"):
            name = element.get("name") or element.getparent().get("name")
            if name not in names:
                yield f"{name} has reinit, and is no continuous state"
    yield from experiment_problems(fmu)
    for kind in kinds:
        given = root.find(kind)
        for promise, needed in IMPLIED.items():
            if given.get(promise) in ("true", "1") and given.get(needed) not in ("true", "1"):
                yield f"{kind} declares {promise} without {needed}"
        if number(given.get("fixedInternalStepSize"), 1.0) <= 0:
            yield f"{kind} declares fixedInternalStepSize {given.get('fixedInternalStepSize')}: it must be positive"


IMPLIED = {"canSerializeFMUstate": "canGetAndSetFMUstate", "canSerializeFMUState": "canGetAndSetFMUState",
           "canReturnEarlyAfterIntermediateUpdate": "providesIntermediateUpdate"}  # fmt: skip


def contradictions(variable: Any) -> Iterator[str]:
    """min, max, nominal and start of a variable, or of a type."""
    least, most = limits_of(variable)
    name = variable.name
    if least > most:
        yield f"{name}: its min {least:g} is above its max {most:g}"
    if number(getattr(variable, "nominal", None), 1.0) == 0:
        yield f"{name}: its nominal value is 0"
    start = getattr(variable, "start", None)
    if start is None or variable.type in ("Boolean", "String", "Binary", "Clock", "Enumeration"):
        return
    for word in start.split():
        if not least <= number(word, least) <= most and least <= most:
            yield f"{name} starts with {word}, outside {least:g} to {most:g}"
            break


def experiment_problems(fmu: Subject) -> Iterator[str]:
    settings = fmu.description.defaultExperiment
    if settings is None:
        return
    start, stop = number(settings.startTime, 0.0), number(settings.stopTime, None)
    if stop is not None and stop < start:
        yield f"the default experiment stops at {stop:g} s, before it starts at {start:g} s"
    for what in ("stepSize", "tolerance"):
        if number(getattr(settings, what), 1.0) <= 0:
            yield f"the default experiment has the {what} {getattr(settings, what)}: it must be positive"


def units(fmu: Subject) -> Iterator[str]:
    """Units whose names say one thing and whose definitions another."""
    if not fmu.interfaces or not fmu.description.unitDefinitions:
        raise NotApplicable("it defines no units")
    for unit in fmu.description.unitDefinitions:
        yield from map(Advice, disagreements(unit))


def files(fmu: Subject) -> Iterator[str]:
    """Sources, documentation, icons and what a manifest lists."""
    for configuration in fmu.description.buildConfigurations:
        for sources in configuration.sourceFileSets:
            for name in sources.sourceFiles:
                if f"sources/{name}" not in fmu.files:
                    yield f"sources/{name}, listed as a source, is missing"
            for name in sources.includeDirectories:
                if not (fmu.folder / "sources" / name).is_dir():
                    yield f"sources/{name}, listed as a folder of headers, is missing"
    strangers = sorted(
        name
        for name in fmu.files
        if name not in KNOWN_FILES and ("/" not in name or name.split("/")[0] not in KNOWN_FOLDERS)
    )
    if strangers:
        yield Advice(f"{listed(strangers)}: outside the folders that the standard knows")
    yield from dead_links(fmu)
    for image in ("documentation/diagram", "icons/icon", "terminalsAndIcons/icon"):
        if f"{image}.svg" in fmu.files and f"{image}.png" not in fmu.files:
            yield f"{image}.svg needs {image}.png beside it"
    licenses = {name for name in fmu.files if name.startswith("documentation/licenses/")}
    entries = {f"documentation/licenses/license.{suffix}" for suffix in ("spdx", "txt", "html")}
    if licenses and not fmu.is_fmi2 and not licenses & entries:
        yield "documentation/licenses has no license.txt, license.html or license.spdx to begin with"
    for name in sorted(fmu.files):
        if re.fullmatch(r"extra/[^/]+/fmi-ls-manifest\.xml", name):
            yield from manifest_problems(fmu, name)


def dead_links(fmu: Subject) -> Iterator[str]:
    """Relative links in the documentation that lead nowhere."""
    for name in sorted(fmu.files):
        if name.startswith("documentation/") and name.endswith((".html", ".htm")):
            try:
                page: Any = html.document_fromstring(fmu.read(name))
            except etree.ParserError:  # no element in it, and so no link
                continue
            for _, attribute, link, _ in page.iterlinks():
                parts = urlsplit(link.strip())
                if parts.scheme or parts.netloc or not parts.path or attribute == "xmlns":
                    continue
                target = posixpath.normpath(posixpath.join(posixpath.dirname(name), unquote(parts.path)))
                if target not in fmu.files and not (fmu.folder / target).is_dir():
                    yield f"{name} links to {link}, which is missing"


def manifest_problems(fmu: Subject, name: str) -> Iterator[str]:
    """A layered standard's manifest: its own name, the files that it lists and their checksums."""
    folder = posixpath.dirname(name)
    try:
        root = etree.fromstring(fmu.read(name))
    except etree.XMLSyntaxError as problem:
        yield f"{name}: {problem}"
        return
    declared = root.get("{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-name")
    if declared != posixpath.basename(folder):
        yield f"{name} is of the layered standard {declared}, and lies in {folder}"
    for related in root.iter("Related"):
        source = related.get("source") or ""
        if urlsplit(source).scheme:
            continue
        target = posixpath.normpath(posixpath.join(folder, unquote(source)))
        if target not in fmu.files:
            yield f"{name} lists {source}, which is missing"
            continue
        for given in related.iter():  # attributes of it in newer versions of FMI-LS-REF, before of an annotation
            if wanted := given.get("checksum"):
                algorithm = (given.get("checksumType") or "SHA3-256").lower().replace("sha-", "sha").replace("-", "_")
                if digest(fmu.folder / target, algorithm) != wanted.lower():
                    yield f"{name}: {source} has changed: its {given.get('checksumType') or 'SHA3-256'} is another"


def digest(path: Path, algorithm: str) -> str:
    found = hashlib.new(algorithm)
    with path.open("rb") as file:
        while chunk := file.read(1 << 20):
            found.update(chunk)
    return found.hexdigest()


def terminals(fmu: Subject) -> Iterator[str]:
    """Terminals and icons: the schema, and that what they name is there."""
    name = next((f"{folder}/terminalsAndIcons.xml" for folder in ("terminalsAndIcons", "icons")
                 if f"{folder}/terminalsAndIcons.xml" in fmu.files), None)  # fmt: skip
    if name is None:
        raise NotApplicable("it has no terminalsAndIcons.xml")
    try:
        root = etree.fromstring(fmu.read(name))
    except etree.XMLSyntaxError as problem:
        yield f"{name}: {problem}"
        return
    schema = etree.XMLSchema(file=str(SCHEMAS / "fmi3TerminalsAndIcons.xsd"))
    if not schema.validate(root):
        log: Any = schema.error_log
        yield from (f"{name}, line {entry.line}: {entry.message}" for entry in log)
    known = {variable.name for variable in fmu.description.modelVariables}
    for member in root.iter("TerminalMemberVariable", "TerminalStreamMemberVariable"):
        for attribute in ("variableName", "inStreamVariableName", "outStreamVariableName"):
            if member.get(attribute) and member.get(attribute) not in known:
                yield f"{name}, line {member.sourceline}: no variable {member.get(attribute)}"
    for element in root.iter():
        base = element.get("iconBaseName")
        if base and f"{posixpath.dirname(name)}/{base}.png" not in fmu.files:
            yield f"{name}, line {element.sourceline}: {base}.png is missing"


def binaries(fmu: Subject) -> Iterator[str]:
    """Each platform's folder has what the description names, of the format and the processor that it is for."""
    kinds = fmu.interfaces
    folders = {name.split("/")[1] for name in fmu.files if name.startswith("binaries/") and name.count("/") > 1}
    has_sources = any(name.startswith("sources/") for name in fmu.files)
    if not folders and not has_sources:
        yield "it has neither binaries nor sources"
    for folder in sorted(folders):
        if folder == ls_wasm.FOLDER:
            yield from component_problems(fmu)
            continue
        system, processor = FMI2_FOLDERS.get(folder) or reversed(re.split("-", folder + "-")[:2])
        for kind, interface in kinds.items():
            stem = f"binaries/{folder}/{interface.modelIdentifier}"
            there = [
                f"{stem}{suffix}"
                for suffix in (".so", ".dll", ".dylib", ".lib", ".a")
                if f"{stem}{suffix}" in fmu.files
            ]
            if not there:
                lacking = f"binaries/{folder} has no {interface.modelIdentifier} for {kind}"
                yield lacking if system in SYSTEMS else Advice(f"{lacking}, and is no platform's folder")
        for binary in (name for name in fmu.binaries if name.startswith(f"binaries/{folder}/")):
            found = fmu.inspected(binary)
            if system in SYSTEMS and found["format"] != SYSTEMS[system]:
                yield f"{binary} is a {found['format']} file, not one for {system}"
            elif processor in PROCESSORS and not PROCESSORS[processor] & set(found["machines"]):
                yield f"{binary} is for {', '.join(found['machines'])}, not for {processor}"


def component_problems(fmu: Subject) -> Iterator[str]:
    """Of an FMU with a folder for WebAssembly: a component, and the manifest that tells of it."""
    for kind, interface in fmu.interfaces.items():
        name = f"binaries/{ls_wasm.FOLDER}/{interface.modelIdentifier}{ls_wasm.SUFFIX}"
        if name not in fmu.files:
            yield f"{posixpath.dirname(name)} has no {interface.modelIdentifier} for {kind}"
        elif not (fmu.folder / name).read_bytes().startswith(ls_wasm.COMPONENT):
            yield f"{name} is no WebAssembly component"
    if ls_wasm.MANIFEST not in fmu.files:
        yield Advice(f"{ls_wasm.MANIFEST} is missing: by it hosts tell that there is a component")


def promised_functions(fmu: Subject) -> set[str]:
    """What a binary of this FMU must export."""
    if not fmu.is_fmi2:
        return {name for class_ in FUNCTIONS[3] for name in dir(class_) if name.startswith("fmi3")}
    return {name for kind in fmu.interfaces for class_ in FUNCTIONS.get(kind, ()) for name in dir(class_)
            if name.startswith("fmi2")}  # fmt: skip


def functions(fmu: Subject) -> Iterator[str]:
    """Every function of the standard, also those for what the FMU does not offer: hosts may rely on them."""
    for binary in some_binaries(fmu):
        if missing := sorted(promised_functions(fmu) - set(fmu.inspected(binary)["exports"])):
            yield f"{binary} lacks {listed(missing)}"


def symbols(fmu: Subject) -> Iterator[str]:
    """Names beyond FMI's meet those of a second FMU, or of the host, where libraries share one name space."""
    for binary in some_binaries(fmu):
        exports = set(fmu.inspected(binary)["exports"]) - LEFT_BY_LINKERS
        if foreign := sorted(name for name in exports if not re.match(r"fmi[23][A-Z]", name)):
            yield Advice(f"{binary} exports {listed(foreign)}")


def libraries(fmu: Subject) -> Iterator[str]:
    """What every machine has, or what lies beside the binary and is found there."""
    for binary in some_binaries(fmu):
        found, folder = fmu.inspected(binary), posixpath.dirname(binary)
        beside = [name for name in found["needed"] if f"{folder}/{posixpath.basename(name)}" in fmu.files]
        allowed = LIBRARIES[found["format"]]
        if lacking := [name for name in found["needed"] if name not in beside and not allowed.fullmatch(name)]:
            yield Advice(f"{binary} needs {listed(lacking)}: neither in the FMU nor on every machine")
        if beside and found["format"] == "ELF" and not any("ORIGIN" in path for path in found["paths"]):
            yield Advice(f"{binary} needs {listed(beside)} beside it, and looks elsewhere: its RPATH is not $ORIGIN")
        if elsewhere := [path for path in found["paths"] if "ORIGIN" not in path]:
            yield Advice(f"{binary} looks for libraries in {listed(elsewhere)}, of the machine that built it")


def glibc(fmu: Subject) -> Iterator[str]:
    """The newest version of glibc that a Linux binary asks for."""
    linux = [binary for binary in some_binaries(fmu) if fmu.inspected(binary)["format"] == "ELF"]
    if not linux:
        raise NotApplicable("it has no Linux binary")
    for binary in linux:
        asked = [name.removeprefix("GLIBC_") for name in fmu.inspected(binary)["versions"] if name.startswith("GLIBC_")]
        newest = max((found for name in asked if (found := version(name))), default=(0, 0))
        if newest > fmu.options.glibc:
            yield Advice(f"{binary} needs glibc {dotted(newest)}; {dotted(fmu.options.glibc)} was to be enough")


def heap_at_exit(fmu: Subject) -> Iterator[str]:
    """PythonFMU's library writes into memory that was given back, when the process of its host ends."""
    for binary in some_binaries(fmu):
        found = fmu.inspected(binary)
        if FINALIZER in found["exports"] and DESTRUCTOR in found.get("destructors", ()):
            harm = "corrupts the heap when its host's process ends, which may abort that"
            yield Advice(f"{binary}, of PythonFMU {VERSIONS}, {harm}: linkage-fmu mend takes it out")


def heap_after_error(fmu: Subject) -> Iterator[str]:
    """PythonFMU's library uses objects that it gave back, after an exception of the slave."""
    for binary in some_binaries(fmu):
        is_of_python_fmu = FINALIZER in fmu.inspected(binary)["exports"]
        if is_of_python_fmu and keeps_what_it_gave_back((fmu.folder / binary).read_bytes()):
            harm = "uses freed objects after an error in its slave, which may end its host by a signal"
            yield Advice(f"{binary}, of PythonFMU {VERSIONS}, {harm}: linkage-fmu mend takes it out")


def some_binaries(fmu: Subject) -> list[str]:
    if not fmu.binaries:
        raise NotApplicable("it has no binary")
    return fmu.binaries


def version(text: str) -> tuple[int, int] | None:
    """(2, 17) of "2.17"."""
    numbers = re.match(r"(\d+)\.(\d+)", text)
    return (int(numbers[1]), int(numbers[2])) if numbers else None


def dotted(numbers: tuple[int, int]) -> str:
    return ".".join(map(str, numbers))


def listed(names: list[str], most: int = 4) -> str:
    """The first names, each in at most 40 characters, and how many more there are."""
    some = ", ".join(name if len(name) <= 40 else f"{name[:39]}…" for name in names[:most])
    return some + (f" and {len(names) - most} more" if len(names) > most else "")
