"""The explorer: fmu_src/explorer as one HTML file, with the FMI 3.0 FMU in it as WebAssembly. It asks for nothing else.

The scripts are modules of JavaScript; here they become one, each after those that it imports, so that browsers read
the page from a disk, where they load no other. Names, units, ranges, starts and texts come from interface.toml.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import json
import re
import tempfile
import zipfile
import zlib
from pathlib import Path

from ..interface import Interface, Output, Parameter, Variable
from .compiler import FMU_SOURCE, SOURCE_ROOT, compile_module
from .reference import definitions
from .version import project_version

FOLDER = SOURCE_ROOT / "explorer"
MAIN = "main.js"
PAGE = "explorer.html"  # in documentation/ of an FMU
GIVEN = b'id="given">'  # behind it, a design that is open from the start
LARGEST = 300_000  # bytes of a page
MASSES = "with_masses"  # of the experiments that the FMU carries
# What the page calls: of the C library, of host.c, of FMI.
FUNCTIONS = (
    "malloc", "free", "page_logger", "fmi3InstantiateCoSimulation", "fmi3Reset", "fmi3EnterInitializationMode",
    "fmi3ExitInitializationMode", "fmi3GetFloat64", "fmi3SetFloat64", "fmi3SetBoolean", "fmi3DoStep",
    "fmi3GetAdjointDerivative",
)  # fmt: skip
IMPORT = re.compile(r'^import (?:\{[^}]*\} from )?"\./([\w.]+)";\n', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:async )?(?:function|class|const|let)\b)", re.MULTILINE)
DECLARED = re.compile(r"^(?:async )?(?:function|class|const|let) (?:([\w$]+)|\[([\w$, ]+)\])", re.MULTILINE)
PLACE = re.compile(r"\{(policy|style|interface|kernel|script)\}")


class PageError(ValueError):
    """The explorer's files do not make a page; the message names the file."""


def page(interface: Interface) -> bytes:
    """The page as it lies in an FMU's documentation."""
    parts = {
        "style": "\n" + _source("style.css"),
        "script": "\n" + script(FOLDER),
        "interface": described(interface).replace("<", "\\u003c"),
        "kernel": base64.b64encode(zlib.compress(kernel(), 9)).decode(),
    }
    if "</script" in parts["script"] or "</style" in parts["style"]:
        raise PageError("a script or style would end within itself")
    parts["policy"] = policy(parts["script"], parts["style"])
    content = PLACE.sub(lambda found: parts[found[1]], _source("page.html")).encode()
    if len(content) > LARGEST:
        raise PageError(f"the page has {len(content)} bytes, of at most {LARGEST}")
    return content


def policy(script_text: str, style_text: str) -> str:
    """What the browser is to allow: this script, this style, WebAssembly; no connection of any kind."""

    def digest(text: str) -> str:
        return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()

    return (
        f"default-src 'none'; script-src 'sha256-{digest(script_text)}' 'wasm-unsafe-eval'; "
        f"style-src 'sha256-{digest(style_text)}'; base-uri 'none'; form-action 'none'"
    )


def script(folder: Path) -> str:
    """All modules as one, each after those that it imports. Raises PageError where they do not fit together."""
    found: dict[str, str] = {}
    being_read: list[str] = []

    def read(name: str) -> None:
        if name in found:
            return
        if name in being_read:
            raise PageError(f"{name}: the modules {' and '.join(being_read)} import one another")
        if not (folder / name).is_file():
            raise PageError(f"{being_read[-1]} imports {name}, which is not there")
        being_read.append(name)
        text = (folder / name).read_text(encoding="utf-8")
        for imported in IMPORT.findall(text):
            read(imported)
        being_read.pop()
        body = EXPORT.sub("", IMPORT.sub("", text))
        if re.search(r"^(?:import|export)\b", body, re.MULTILINE):
            raise PageError(f"{name}: an import or export of another form than the page's maker reads")
        found[name] = body.replace("// @ts-check\n", "", 1)

    read(MAIN)
    owner: dict[str, str] = {}
    for name, body in found.items():
        declared = [part.strip() for one, many in DECLARED.findall(body) for part in (one or many).split(",")]
        for each in declared:
            if owner.setdefault(each, name) != name:
                raise PageError(f"{name} declares {each}, as {owner[each]} does: in one script they are the same")
    return "\n".join(f"// ---- {name}\n{body}" for name, body in found.items())


def described(interface: Interface) -> str:
    """interface.toml for the page, what the paper publishes, and the masses of the FMU's example, as JSON."""
    (masses,) = (of for of in definitions(interface) if of.name == MASSES)
    return json.dumps(
        {
            "model": {
                "name": interface.model.name,
                "token": interface.token,
                "version": project_version(),
                "turnsPerMinute": interface.model.turns_per_minute,
                "plantSpacing": interface.model.plant_spacing,
            },
            "units": {
                name: {
                    "display": unit.display[0] if unit.display else name,
                    "factor": unit.display[1] if unit.display else 1.0,
                    "exponents": unit.exponents,
                }
                for name, unit in interface.units.items()
            },
            "variables": [_variable(v) for v in interface.variables],
            "published": json.loads(_source("published.json")),
            "masses": {"text": masses.description, "values": masses.parameters},
        },
        ensure_ascii=False,
        separators=(",", ":"),
    )


def _variable(v: Variable) -> dict[str, object]:
    entry: dict[str, object] = {"name": v.name, "kind": v.kind, "reference": v.value_reference, "text": v.text}
    if v.unit is not None:
        entry["unit"] = v.unit.name
    if v.start is not None:
        entry["start"] = v.start
    if isinstance(v, Parameter) and v.range:
        entry |= {"range": v.range, "smallest": v.smallest}
    if isinstance(v, Output):
        entry["initially"] = v.initially
    return entry


def page_of(fmu: Path) -> bytes:
    """The page that an FMU carries. Raises PageError where it has none, OSError where the file cannot be read."""
    try:
        with zipfile.ZipFile(fmu) as archive:
            return archive.read(f"documentation/{PAGE}")
    except (zipfile.BadZipFile, KeyError):
        raise PageError(f"{fmu}: no FMU with documentation/{PAGE}, which those of this project have") from None


def with_design(content: bytes, file: Path) -> bytes:
    """The page that has a file open from the start: a parameter set, or whatever else the page writes.

    Raises PageError where the file is no text; whether it holds a design the page finds out.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise PageError(f"{file}: no text, so no parameter set") from None
    given = json.dumps({"name": file.name, "text": text}).replace("<", "\\u003c").encode()
    before, place, after = content.partition(GIVEN)
    return before + place + given + after


@functools.cache
def kernel() -> bytes:
    """The FMI 3.0 FMU as a WebAssembly module, compiled once in a process."""
    with tempfile.TemporaryDirectory() as folder:
        module = Path(folder) / "kernel.wasm"
        compile_module((FMU_SOURCE[3], FOLDER / "host.c"), module, FUNCTIONS, "-Wl,--import-symbols")
        return module.read_bytes()


def _source(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")
