"""How the folder fmu_src becomes the package transplanter_linkage: hatchling calls this for each wheel.

The wheel carries the FMUs below fmus/: those in build/dist, or in the folder that LINKAGE_FMUS names. In a
development install they stay in build/, and one small module gives the sources the package's name.
"""

from __future__ import annotations

import os
import runpy
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.config import BuilderConfig
from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGE = "transplanter_linkage"
DEVELOPMENT_MODULE = f'''"""The folder fmu_src under the name {PACKAGE}: a development install."""

from fmu_src import FILES, __all__, __doc__, __getattr__, __path__, fmu
'''


class CustomBuildHook(BuildHookInterface[BuilderConfig]):
    """What hatchling calls before and after it makes a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            self.folder = tempfile.TemporaryDirectory()
            module = Path(self.folder.name) / "__init__.py"
            module.write_text(DEVELOPMENT_MODULE, encoding="utf-8")
            build_data["force_include_editable"] = {str(module): f"{PACKAGE}/{module.name}"}
            return
        fmus = Path(os.environ.get("LINKAGE_FMUS") or Path(self.root) / "build" / "dist").resolve()
        for name in runpy.run_path(str(Path(self.root) / "fmu_src" / "__init__.py"))["FILES"].values():
            if not (fmus / name).is_file():
                raise FileNotFoundError(f"{fmus / name}, which the wheel carries, is missing: run make dist")
            build_data["force_include"][str(fmus / name)] = f"{PACKAGE}/fmus/{name}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:  # noqa: ARG002 - as it is called
        if version == "editable":
            self.folder.cleanup()
