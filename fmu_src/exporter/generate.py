"""The tracked files that are made from others, and the check that they are not stale."""

from __future__ import annotations

from pathlib import Path

from ..interface import Interface
from . import c_interface
from .compiler import SOURCE_ROOT

README = SOURCE_ROOT.parent / "README.md"
README_MARKS = ("<!-- interface: generated from fmu_src/interface.toml -->", "<!-- interface: end -->")


def generated_files(interface: Interface) -> dict[Path, str | bytes]:
    """What each generated file must contain."""
    from .drawing import mechanism_svg  # reads interface.toml when it is imported
    from .icons import icon_files

    component = SOURCE_ROOT / "component"
    return {
        component / "interface.h": c_interface.header(interface),
        component / "interface.c": c_interface.source(interface),
        SOURCE_ROOT / "linkage.svg": mechanism_svg().decode(),
        README: with_interface_table(README.read_text(encoding="utf-8"), interface),
        **icon_files(),
    }


def generate(interface: Interface, write: bool) -> list[Path]:
    """The files that are, or with `write` were, stale."""
    if not README.exists():
        raise FileNotFoundError(
            f"{README} is missing: generate is for the project's sources, not for an installed wheel"
        )
    stale = []
    for path, content in generated_files(interface).items():
        if not _is_current(path, content):
            stale.append(path)
            if write and isinstance(content, bytes):
                path.write_bytes(content)
            elif write:
                path.write_text(content, encoding="utf-8")
    return stale


def _is_current(path: Path, content: str | bytes) -> bool:
    from .icons import same_picture

    if not path.exists():
        return False
    if isinstance(content, str):
        return path.read_text(encoding="utf-8") == content
    return same_picture(path.read_bytes(), content)


def with_interface_table(readme: str, interface: Interface) -> str:
    """README.md with its interface table made anew between the two marks."""
    before, begin, rest = readme.partition(README_MARKS[0])
    _, end, after = rest.partition(README_MARKS[1])
    if not begin or not end:
        raise ValueError(f"README.md: the marks {README_MARKS} are missing")
    return f"{before}{begin}\n{interface_table(interface)}\n{end}{after}"


def interface_table(interface: Interface) -> str:
    rows = [f"| {n} | `{name}` | " + " | ".join(rest) + " |" for n, name, *rest in interface_rows(interface)]
    return "\n".join(["| # | name | kind | unit | start | meaning |", "|---|---|---|---|---|---|", *rows])


def interface_rows(interface: Interface) -> list[tuple[str, ...]]:
    """Number, name, kind, unit, start and meaning of every variable, as people read them."""
    rows = []
    for v in interface.variables:
        start = "" if v.start is None else f"{v.start}".lower() if v.type == "boolean" else f"{v.start:.10g}"
        rows.append((str(v.value_reference), v.name, v.kind, v.unit.name if v.unit else "", start, v.text))
    return rows
