"""Java libraries from Maven Central, resolved by mvn into a class path."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tests.hosts.foreign import TOOLS, missing_programs, run

POM = """<project>
  <modelVersion>4.0.0</modelVersion>
  <groupId>transplanter-linkage</groupId><artifactId>{artifact}-host</artifactId><version>1</version>
  <packaging>pom</packaging>
  <dependencies>
{dependencies}
  </dependencies>
</project>
"""
DEPENDENCY = "    <dependency><groupId>{}</groupId><artifactId>{}</artifactId><version>{}</version></dependency>"


def missing() -> str:
    return missing_programs("java", "mvn")


def is_resolved(*coordinates: str) -> bool:
    """Whether class_path has these already."""
    folder, pom = project(coordinates)
    found = folder / "classpath.txt"
    return found.exists() and (folder / "pom.xml").read_text() == pom


def class_path(*coordinates: str) -> str:
    """The class path of `group:artifact:version` and all that they need; resolved once, into build/hosts."""
    folder, pom = project(coordinates)
    found = folder / "classpath.txt"
    if not is_resolved(*coordinates):
        folder.mkdir(parents=True, exist_ok=True)
        found.unlink(missing_ok=True)
        (folder / "pom.xml").write_text(pom)
        log = folder.with_suffix(".log")
        run("mvn", "-B", "dependency:build-classpath", f"-Dmdep.outputFile={found}", cwd=folder, log=log)
    return found.read_text().strip()


def project(coordinates: Sequence[str]) -> tuple[Path, str]:
    """The folder of these libraries, named after the first, and its pom.xml."""
    parts = [coordinate.split(":") for coordinate in coordinates]
    dependencies = "\n".join(DEPENDENCY.format(*part) for part in parts)
    return TOOLS / "-".join(parts[0][1:]), POM.format(artifact=parts[0][1], dependencies=dependencies)


def prepared(*coordinates: str) -> str:
    """PREPARED of a module, in words."""
    artifact, version = coordinates[0].split(":")[1:]
    return f"mvn fetches {artifact} {version} and what it needs from Maven Central: a minute"


def java(class_path: str, *arguments: object, cwd: Path | None = None) -> str:
    return run("java", "-cp", class_path, *arguments, cwd=cwd)
