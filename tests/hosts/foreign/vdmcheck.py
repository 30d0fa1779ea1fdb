"""VDMCheck2: the static semantics of modelDescription.xml as a formal model (VDM-SL). Its sister for FMI 3.0 is not
on Maven Central.
"""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from pathlib import Path

from tests.hosts.foreign import TOOLS, HostError
from tests.hosts.foreign.java import class_path, is_resolved, missing, prepared  # noqa: F401 - of this host too

NAME, PACKAGE = "VDMCheck2", "Maven Central org.into-cps.vdmcheck.fmi2:vdmcheck2"
EDITIONS = {"2.0"}
VERSION = "1.1.3"
LIBRARY = f"org.into-cps.vdmcheck.fmi2:vdmcheck2:{VERSION}"
PREPARED = prepared(LIBRARY)
FOLDER = TOOLS / f"vdmcheck2-{VERSION}"
UNPACKED = ("fmi2-static-model/", "fmi2-rule-model/", "fmi2schema/")


def version() -> str:
    return VERSION


def is_prepared() -> bool:
    return is_resolved(LIBRARY) and all((FOLDER / part).is_dir() for part in UNPACKED)


def prepare() -> None:
    """It looks for its parts beside itself: jars without versions in their names, the rules and schemas unpacked."""
    for jar in map(Path, class_path(LIBRARY).split(":")):
        shutil.copyfile(jar, FOLDER / f"{jar.name.rsplit('-', 1)[0]}.jar")
        with zipfile.ZipFile(jar) as archive:
            archive.extractall(FOLDER, [name for name in archive.namelist() if name.startswith(UNPACKED)])


def check(fmu: Path) -> list[str]:
    done = subprocess.run(["java", "-jar", "vdmcheck2.jar", fmu], cwd=FOLDER, capture_output=True, text=True)
    lines = (done.stdout + done.stderr).splitlines()
    if not lines:
        raise HostError(f"java ended with {done.returncode} and said nothing")
    return [] if lines == ["No errors found."] else lines
