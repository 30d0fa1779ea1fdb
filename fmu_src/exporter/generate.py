"""The tracked files that are made from others, and the check that they are not stale."""

from __future__ import annotations

from pathlib import Path

from ..interface import Interface
from . import c_interface
from .compiler import SOURCE_ROOT
from .documentation import FOLDER
from .tables import MARK, with_tables


def generated_files(interface: Interface) -> dict[Path, str | bytes]:
    """What each generated file must contain."""
    from .drawing import DRAWING, mechanism_svg  # reads interface.toml when it is imported
    from .icons import icon_files

    component = SOURCE_ROOT / "component"
    pages = {path: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.md"))}
    return {
        component / "interface.h": c_interface.header(interface),
        component / "interface.c": c_interface.source(interface),
        DRAWING: mechanism_svg().decode(),
        **{path: with_tables(text, interface) for path, text in pages.items() if MARK.search(text)},
        **icon_files(),
    }


def generate(interface: Interface, write: bool) -> list[Path]:
    """The files that are, or with `write` were, stale."""
    readme = SOURCE_ROOT.parent / "README.md"
    if not readme.exists():
        raise FileNotFoundError(
            f"{readme} is missing: generate is for the project's sources, not for an installed wheel"
        )
    stale = []
    for path, content in generated_files(interface).items():
        if not _is_current(path, content):
            stale.append(path)
            if write:
                path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return stale


def _is_current(path: Path, content: str | bytes) -> bool:
    from .icons import same_picture

    if not path.exists():
        return False
    if isinstance(content, str):
        return path.read_text(encoding="utf-8") == content
    return same_picture(path.read_bytes(), content)
