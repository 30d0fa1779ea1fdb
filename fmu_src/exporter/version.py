"""Which release of the project writes these files."""

from __future__ import annotations

from importlib.metadata import version

DISTRIBUTION = "transplanter-linkage-fmu"


def project_version() -> str:
    return version(DISTRIBUTION)


def generation_tool() -> str:
    return f"{DISTRIBUTION} {project_version()}"
