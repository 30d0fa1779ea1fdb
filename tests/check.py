"""`make check`: the tests of the rooms that differ from main. Quick, before a commit; `make test` runs all of them.

    python -m tests.check [--base REVISION] [--list]

What differs is what git says: commits since the base, changes that are not committed, new files. A file of tests that
differs is run itself. A room without an entry below is tested by the room of its name.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# What guards a room beside tests/<its name>, and takes seconds: the first part of a path that fits counts.
ROOMS = {
    "fmu_src/linkage": ["tests/linkage", "tests/fmi/test_directional_derivatives.py"],
    "fmu_src/component": ["tests/component", "tests/fmi/test_bad_input.py"],
    "fmu_src/fmi/web_assembly": ["tests/fmi/test_web_assembly.py"],
    "fmu_src/fmi": ["tests/fmi/test_state_machine.py", "tests/fmi/test_fmi3_state_machine.py"],
    "fmu_src/exporter": ["tests/exporter/test_generated_files.py", "tests/exporter/test_model_description.py"],
    "fmu_src/formats": [
        "tests/exporter/test_reference.py",
        "tests/twin/test_exceptions.py",
        "tests/twin/test_heap_at_exit.py",
    ],
    "fmu_src/twin": ["tests/twin/test_linkage.py"],
    "fmu_src/validation": ["tests/validation/test_traits.py", "tests/validation/test_validation.py"],
    "fmu_src/documentation": ["tests/exporter/test_documentation.py", "tests/documentation"],
    "fmu_src/interface": ["tests/exporter/test_interface_file.py", "tests/exporter/test_generated_files.py"],
    "fmu_src/cli": ["tests/exporter/test_command.py", "tests/tooling/test_terminal_widths.py"],
    "scenarios/common": ["tests/scenarios/test_measures.py", "tests/tooling/test_terminal_widths.py"],
    "tests/harness": ["tests/component/test_time.py", "tests/fmi/test_state_machine.py"],
    "tests/conftest": ["tests/component/test_time.py", "tests/fmi/test_state_machine.py"],
    "tests/hosts/foreign": ["tests/hosts/test_foreign_hosts.py"],
    "tests/hosts/table": ["tests/hosts/test_foreign_hosts.py"],
    "tests/check": ["tests/tooling/test_check.py"],
    "README.md": ["tests/documentation"],
    "CONTRIBUTING.md": ["tests/documentation", "tests/tooling/test_check.py"],
    "Makefile": ["tests/tooling"],
    "requirements": ["tests/tooling/test_locks.py"],
    "pyproject.toml": ["tests/tooling/test_locks.py"],
}


def changed(base: str) -> list[str]:
    """The files that differ from the base, or were added since, by their names in the project.

    Raises ValueError with what git says where it knows no such revision.
    """
    commands = (
        ["git", "diff", "--name-only", "--merge-base", base],
        ["git", "ls-files", "--others", "--exclude-standard"],
    )
    found: list[str] = []
    for command in commands:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            raise ValueError(f"git cannot compare with {base}: {done.stderr.strip()}")
        found += done.stdout.splitlines()
    return found


def tests_of(file: str, root: Path = ROOT) -> list[str]:
    """The files and folders of tests that guard a file; none for what no test reads."""
    path = Path(file)
    if path.name.startswith("test_") and path.parts[0] == "tests":
        return [file] if (root / path).exists() else []
    for room, tests in ROOMS.items():
        if file.startswith(room):
            return tests
    if path.parts[0] == "fmu_src" and len(path.parts) > 2:
        return [f"tests/{path.parts[1]}"] if (root / "tests" / path.parts[1]).is_dir() else []
    # scenarios/NAME/... or scenarios/NAME.py: the folder or the file of tests with that name
    if path.parts[0] == "scenarios" and len(path.parts) > 1:
        name = Path(path.parts[1]).stem
        beside = [f"tests/scenarios/{name}", f"tests/scenarios/test_{name}.py"]
        return [candidate for candidate in beside if (root / candidate).exists()]
    return []


def selected(files: Iterable[str], root: Path = ROOT) -> list[str]:
    """The tests to run for files that differ: each once, none that lies in a folder that is run."""
    tests = sorted({test for file in files for test in tests_of(file, root)})
    return [test for test in tests if not any(test.startswith(f"{other}/") for other in tests)]


def main(arguments: list[str] | None = None) -> int:
    """Run them, or only list them; returns pytest's exit status, 0 where there is nothing to run."""
    parser = argparse.ArgumentParser(prog="python -m tests.check", description="Test the rooms that differ from main.")
    parser.add_argument("--base", default="main", metavar="REVISION", help="what to compare with (main)")
    parser.add_argument("--list", action="store_true", help="name the tests, run nothing")
    chosen = parser.parse_args(arguments)
    try:
        tests = selected(changed(chosen.base))
    except ValueError as problem:
        parser.error(str(problem))
    print("\n".join(tests) or "nothing that differs has quick tests: make test runs them all")
    if chosen.list or not tests:
        return 0
    spread = ["--numprocesses", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
    command = [sys.executable, "-m", "pytest", *spread, *tests]
    return subprocess.run(command, cwd=ROOT).returncode


if __name__ == "__main__":
    sys.exit(main())
