"""Checks of what lies in the archive: nothing of the FMU runs. Each yields its problems as sentences."""

from __future__ import annotations

import hashlib
import posixpath
import re
import stat
import zipfile
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlsplit

import fmpy
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3ScheduledExecution, FMU3Slave
from fmpy.validation import validate_fmu
from lxml import etree, html

from .subject import CO_SIMULATION, LARGEST, MODEL_EXCHANGE, UNREADABLE, NotApplicable, Subject

SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
ENCRYPTED, DEFLATED, OLDEST_UNZIP = 1, zipfile.ZIP_DEFLATED, 20
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
WINDOWS_LIBRARIES = re.compile(
    r"(kernel32|user32|advapi32|shell32|ole32|oleaut32|ws2_32|wsock32|gdi32|ntdll|msvcrt|ucrtbase|bcrypt|crypt32"
    r"|shlwapi|version|winmm|iphlpapi|rpcrt4|secur32|userenv|psapi|dbghelp|api-ms-win-[\w-]+)\.dll", re.IGNORECASE,
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
            for entry in entries:
                for problem in entry_problems(entry):
                    yield f"{entry.orig_filename!r} {problem}"
            names = [entry.orig_filename for entry in entries]
            lower: dict[str, str] = {}
            for name in names:
                if lower.setdefault(name.lower(), name) != name:
                    yield f"{name!r} and {lower[name.lower()]!r} are one file on Windows and macOS"
            for name in sorted({name for name in names if names.count(name) > 1}):
                yield f"{name!r} is there {names.count(name)} times"
            if sum(entry.file_size for entry in entries) > LARGEST:
                yield f"unpacked it would have {sum(entry.file_size for entry in entries) / (1 << 30):.0f} GiB"
            elif damaged := opened.testzip():
                yield f"{damaged!r} is damaged: its checksum is another"
            if "modelDescription.xml" not in names:
                yield "modelDescription.xml is missing at the top"
    except UNREADABLE as problem:
        yield f"no readable ZIP archive: {problem}"
        return
    try:
        fmu.folder  # noqa: B018: unpacks it
    except NotApplicable as reason:
        yield str(reason)


def entry_problems(entry: zipfile.ZipInfo) -> Iterator[str]:
    name = entry.orig_filename
    if "\\" in name:
        yield "has a backslash in its name: only slashes separate folders"
    if not name.isascii():
        yield "has a name that is not ASCII: hosts unpack it under another one"
    if name.startswith("/") or re.match(r"[A-Za-z]:", name) or ".." in re.split(r"[/\\]", name):
        yield "leads out of the folder that the FMU is unpacked to"
    if stat.S_ISLNK(entry.external_attr >> 16):
        yield "is a symbolic link"
    if entry.flag_bits & ENCRYPTED:
        yield "is encrypted"
    if entry.compress_type not in (zipfile.ZIP_STORED, DEFLATED):
        yield f"is packed by method {entry.compress_type}: only 0 (store) and 8 (deflate) are FMI's"
    if entry.extract_version > OLDEST_UNZIP:
        yield f"needs version {entry.extract_version / 10} of ZIP to unpack: FMI demands 2.0 at most"


def description(fmu: Subject) -> Iterator[str]:
    """Everything that fmpy finds."""
    problems = validate_fmu(str(fmu.folder))
    yield from problems


def value_references(fmu: Subject) -> Iterator[str]:
    """FMI 2.0: variables with one reference are one variable, so at most one of them may be set or has a start."""
    if not fmu.is_fmi2:
        raise NotApplicable("FMI 3.0 knows no such aliases; fmpy reports doubles under description")
    sets: dict[tuple, list] = {}
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
            page = html.document_fromstring((fmu.folder / name).read_bytes() or b"<html/>")
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
        root = etree.fromstring((fmu.folder / name).read_bytes())
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
        elif related.get("checksum"):
            algorithm = (related.get("checksumType") or "SHA3-256").lower().replace("sha-", "sha").replace("-", "_")
            found = hashlib.new(algorithm, (fmu.folder / target).read_bytes()).hexdigest()
            if found != related.get("checksum").lower():
                yield f"{name}: {source} has changed: its {related.get('checksumType') or 'SHA3-256'} is another"


def terminals(fmu: Subject) -> Iterator[str]:
    """Terminals and icons: the schema, and that what they name is there."""
    name = next((f"{folder}/terminalsAndIcons.xml" for folder in ("terminalsAndIcons", "icons")
                 if f"{folder}/terminalsAndIcons.xml" in fmu.files), None)  # fmt: skip
    if name is None:
        raise NotApplicable("it has no terminalsAndIcons.xml")
    try:
        root = etree.fromstring((fmu.folder / name).read_bytes())
    except etree.XMLSyntaxError as problem:
        yield f"{name}: {problem}"
        return
    schema = etree.XMLSchema(file=str(SCHEMAS / "fmi3TerminalsAndIcons.xsd"))
    if not schema.validate(root):
        yield from (f"{name}, line {entry.line}: {entry.message}" for entry in schema.error_log)
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
    folders = {name.split("/")[1] for name in fmu.files if name.startswith("binaries/") and name.count("/") > 1}
    has_sources = any(name.startswith("sources/") for name in fmu.files)
    if not folders and not has_sources:
        yield "it has neither binaries nor sources"
    for folder in sorted(folders):
        system, processor = FMI2_FOLDERS.get(folder) or reversed(re.split("-", folder + "-")[:2])
        for kind, interface in fmu.interfaces.items():
            stem = f"binaries/{folder}/{interface.modelIdentifier}"
            there = [
                f"{stem}{suffix}"
                for suffix in (".so", ".dll", ".dylib", ".lib", ".a")
                if f"{stem}{suffix}" in fmu.files
            ]
            if not there:
                yield f"binaries/{folder} has no {interface.modelIdentifier} for {kind}"
        for binary in (name for name in fmu.binaries if name.startswith(f"binaries/{folder}/")):
            found = fmu.inspected(binary)
            if system in SYSTEMS and found["format"] != SYSTEMS[system]:
                yield f"{binary} is a {found['format']} file, not one for {system}"
            elif processor in PROCESSORS and not PROCESSORS[processor] & set(found["machines"]):
                yield f"{binary} is for {', '.join(found['machines'])}, not for {processor}"


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
            yield f"{binary} exports {listed(foreign)}"


def libraries(fmu: Subject) -> Iterator[str]:
    """What every machine has, or what lies beside the binary and is found there."""
    for binary in some_binaries(fmu):
        found, folder = fmu.inspected(binary), posixpath.dirname(binary)
        beside = [name for name in found["needed"] if f"{folder}/{posixpath.basename(name)}" in fmu.files]
        allowed = LIBRARIES[found["format"]]
        if lacking := [name for name in found["needed"] if name not in beside and not allowed.fullmatch(name)]:
            yield f"{binary} needs {listed(lacking)}: neither in the FMU nor on every machine"
        if beside and found["format"] == "ELF" and not any("ORIGIN" in path for path in found["paths"]):
            yield f"{binary} needs {listed(beside)} beside it, and looks elsewhere: its RPATH is not $ORIGIN"
        if elsewhere := [path for path in found["paths"] if "ORIGIN" not in path]:
            yield f"{binary} looks for libraries in {listed(elsewhere)}, of the machine that built it"


def glibc(fmu: Subject) -> Iterator[str]:
    """The newest version of glibc that a Linux binary asks for."""
    linux = [binary for binary in some_binaries(fmu) if fmu.inspected(binary)["format"] == "ELF"]
    if not linux:
        raise NotApplicable("it has no Linux binary")
    for binary in linux:
        asked = [name.removeprefix("GLIBC_") for name in fmu.inspected(binary)["versions"] if name.startswith("GLIBC_")]
        newest = max((version(name) for name in asked if version(name)), default=(0, 0))
        if newest > fmu.options.glibc:
            yield f"{binary} needs glibc {dotted(newest)}; {dotted(fmu.options.glibc)} was to be enough"


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
