"""Java libraries from Maven Central, resolved by mvn into a class path."""

from __future__ import annotations

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


def class_path(*coordinates: str) -> str:
    """The class path of `group:artifact:version` and all that they need; resolved once, into build/hosts."""
    parts = [coordinate.split(":") for coordinate in coordinates]
    folder = TOOLS / "-".join(parts[0][1:])
    found = folder / "classpath.txt"
    pom = POM.format(artifact=parts[0][1], dependencies="\n".join(DEPENDENCY.format(*p) for p in parts))
    if not (found.exists() and (folder / "pom.xml").read_text() == pom):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "pom.xml").write_text(pom)
        run("mvn", "-q", "-B", "dependency:build-classpath", f"-Dmdep.outputFile={found}", cwd=folder)
    return found.read_text().strip()


def java(class_path: str, *arguments: object, cwd: Path | None = None) -> str:
    return run("java", "-cp", class_path, *arguments, cwd=cwd)
