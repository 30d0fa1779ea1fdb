"""The transplanter linkage as an FMU. `fmu("3.0")` is the path of the file; the command is `linkage-fmu`.

Installed from the wheel, this package is called `transplanter_linkage`; in the project's sources it is `fmu_src`.
Importing it needs nothing but the standard library.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["FILES", "fmu"]

# By edition, below fmus/ in the installed package and below build/ in the project.
FILES = {
    "2.0": "fmi2/TransplanterLinkage.fmu",
    "3.0": "fmi3/TransplanterLinkage.fmu",
    "twin": "twin/TransplanterLinkageTwin.fmu",
}


def fmu(edition: str) -> Path:
    """The FMU's file. edition: "2.0" or "3.0", the FMI version, or "twin", the readable one in Python (FMI 2.0).

    Raises ValueError for any other edition, FileNotFoundError where the project's FMUs are not built yet.
    """
    if edition not in FILES:
        raise ValueError(f"no FMU of the edition {edition!r}: there are {', '.join(map(repr, FILES))}")
    package = Path(__file__).resolve().parent
    installed, built = package / "fmus", package.parent / "build"
    path = (installed if installed.is_dir() else built) / FILES[edition]
    if not path.is_file():
        raise FileNotFoundError(
            f"{path} is missing: " + ("install the wheel again" if path.is_relative_to(installed) else "run make build")
        )
    return path
