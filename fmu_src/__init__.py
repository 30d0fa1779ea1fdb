"""The transplanter linkage as an FMU, and its kinematics in Python.

`fmu("3.0")` is the path of the file; the command is `linkage-fmu`. `solve(Geometry(L1=0.055), phi)` computes poses in
numpy, `measures` what a planting cycle is judged by, with gradients, from `Kinematics(geometry)` or from the FMU.

Installed from the wheel, this package is called `transplanter_linkage`; in the project's sources it is `fmu_src`.
Importing it needs nothing but the standard library; numpy is imported with the first name that needs it.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .twin.kinematics import Kinematics
    from .twin.linkage import Geometry, Solution, UnreachablePose, solve

__all__ = ["FILES", "Geometry", "Kinematics", "Solution", "UnreachablePose", "fmu", "solve"]

# The names that are imported when they are asked for, and whence.
LATER = {
    "Geometry": "twin.linkage",
    "Solution": "twin.linkage",
    "UnreachablePose": "twin.linkage",
    "solve": "twin.linkage",
    "Kinematics": "twin.kinematics",
}

# By edition, below fmus/ in the installed package and below build/ in the project.
FILES = {
    "2.0": "fmi2/TransplanterLinkage.fmu",
    "3.0": "fmi3/TransplanterLinkage.fmu",
    "twin": "twin/TransplanterLinkageTwin.fmu",
}


def __getattr__(name: str) -> Any:
    if name not in LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{LATER[name]}", __name__), name)


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
