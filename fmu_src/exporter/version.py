"""Which release of the project writes these files, and what it lacks."""

from __future__ import annotations

from importlib.metadata import requires, version
from importlib.util import find_spec

DISTRIBUTION = "transplanter-linkage-fmu"


def project_version() -> str:
    return version(DISTRIBUTION)


def generation_tool() -> str:
    return f"{DISTRIBUTION} {project_version()}"


def missing_packages(extra: str) -> list[str]:
    """The packages of one of this distribution's extras that are not installed."""
    declared = (line.partition(";") for line in requires(DISTRIBUTION) or [])
    named = [name.strip() for name, _, marker in declared if marker.replace('"', "'").strip() == f"extra == '{extra}'"]
    return [name for name in named if find_spec(name) is None]
