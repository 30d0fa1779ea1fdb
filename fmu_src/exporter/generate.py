"""The tracked files that are made from others, and the check that they are not stale."""

from __future__ import annotations

from pathlib import Path

from ..interface import Interface
from . import c_interface
from .compiler import SOURCE_ROOT

README = SOURCE_ROOT.parent / "README.md"
README_MARKS = ("<!-- interface: generated from fmu_src/interface.toml -->", "<!-- interface: end -->")


def generated_files(interface: Interface) -> dict[Path, str]:
    """What each generated file must contain."""
    from .drawing import mechanism_svg  # reads interface.toml when it is imported

    component = SOURCE_ROOT / "component"
    return {
        component / "interface.h": c_interface.header(interface),
        component / "interface.c": c_interface.source(interface),
        SOURCE_ROOT / "linkage.svg": mechanism_svg().decode(),
        README: with_interface_table(README.read_text(encoding="utf-8"), interface),
    }


def generate(interface: Interface, write: bool) -> list[Path]:
    """The files that are, or with `write` were, stale."""
    stale = []
    for path, content in generated_files(interface).items():
        if not path.exists() or path.read_text(encoding="utf-8") != content:
            stale.append(path)
            if write:
                path.write_text(content, encoding="utf-8")
    return stale


def with_interface_table(readme: str, interface: Interface) -> str:
    """README.md with its interface table made anew between the two marks."""
    before, begin, rest = readme.partition(README_MARKS[0])
    _, end, after = rest.partition(README_MARKS[1])
    if not begin or not end:
        raise ValueError(f"README.md: the marks {README_MARKS} are missing")
    return f"{before}{begin}\n{interface_table(interface)}\n{end}{after}"


def interface_table(interface: Interface) -> str:
    rows = ["| # | name | kind | unit | start | meaning |", "|---|---|---|---|---|---|"]
    for v in interface.variables:
        start = "" if v.start is None else f"{v.start}".lower() if v.type == "boolean" else f"{v.start:.10g}"
        unit = v.unit.name if v.unit else ""
        rows.append(f"| {v.value_reference} | `{v.name}` | {v.kind} | {unit} | {start} | {v.text} |")
    return "\n".join(rows)
