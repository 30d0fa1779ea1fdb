"""The direction of the rooms: who may import or include whom.

An arrow that runs up, or a circle, fails with both names. Files are read as text, Python by its syntax tree, C by its
#include lines: nothing is imported or compiled.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path, PurePosixPath

import pytest

from tests.conftest import PROJECT_ROOT

# Whom a room may know, itself apart. A file belongs to the room of the longest prefix of its path.
MAY_KNOW: dict[str, tuple[str, ...]] = {
    # in C, from the linkage over the component to FMI
    "fmu_src/linkage/": (),
    "fmu_src/component/": ("fmu_src/linkage/",),
    "fmu_src/fmi/": ("fmu_src/component/", "fmu_src/linkage/"),
    # Python: the interface below; exporter, validation and twin side by side; the command line above them
    "fmu_src/interface.py": (),
    "fmu_src/measures.py": (),
    "fmu_src/__init__.py": ("fmu_src/twin/",),  # whose solver it hands on
    "fmu_src/twin/": ("fmu_src/interface.py",),
    "fmu_src/formats/": (),
    "fmu_src/explorer/": (),  # the page: it knows the FMU by the standard's functions alone
    "fmu_src/exporter/": ("fmu_src/interface.py", "fmu_src/formats/", "fmu_src/twin/"),  # which draws the linkage
    "fmu_src/validation/": ("fmu_src/formats/",),  # of FMUs of any origin: see ALLOWED
    "fmu_src/cli.py": ("fmu_src/__init__.py", "fmu_src/interface.py", "fmu_src/exporter/", "fmu_src/validation/"),
    "fmu_src/__main__.py": ("fmu_src/cli.py",),
    # what the product is held against; no room of the product knows it
    "fmu_src/oracle/": ("fmu_src/interface.py", "fmu_src/exporter/reference.py"),
    # scenarios know built FMUs, fmpy and the wheel's measures: of each other nothing but common/; `make run` runs two
    "scenarios/__main__.py": ("scenarios/field_row/", "scenarios/paper_cycle/"),
    "scenarios/common/": ("fmu_src/measures.py", "fmu_src/__init__.py"),
    "scenarios/balancing/": ("scenarios/common/",),
    "scenarios/design/": ("scenarios/common/", "fmu_src/measures.py", "fmu_src/__init__.py"),
    "scenarios/field_row/": ("scenarios/common/", "fmu_src/measures.py"),
    "scenarios/paper_cycle/": ("scenarios/common/", "fmu_src/measures.py"),
    "scenarios/spacing_change/": ("scenarios/common/", "fmu_src/measures.py"),
    "scenarios/speed_vs_error/": ("scenarios/common/",),
    "scenarios/sweep/": ("scenarios/common/", "fmu_src/measures.py"),
    "scenarios/twelve_rows/": ("scenarios/common/",),
    "tests/": ("fmu_src/", "scenarios/"),
    "hatch_build.py": ("fmu_src/__init__.py",),
}  # fmt: skip

# The exceptions, file by file: who knows what, although its room may not.
ALLOWED: dict[str, tuple[str, ...]] = {
    # the one door from the scenarios to the sources: what the FMU is measured against
    "scenarios/speed_vs_error/yardstick.py": (
        "fmu_src/interface.py", "fmu_src/exporter/compiler.py", "fmu_src/oracle/", "fmu_src/twin/",
    ),
    # C programs that time the bare core in their own process, or name variables by their value references
    "scenarios/speed_vs_error/solving/evaluations.c": ("fmu_src/linkage/", "fmu_src/component/interface.h"),
    "scenarios/speed_vs_error/cost/instances.c": ("fmu_src/component/interface.h",),
    "scenarios/speed_vs_error/cost/step_cost.c": ("fmu_src/linkage/linkage.h", "fmu_src/component/interface.h"),
    "scenarios/speed_vs_error/hard_cases/environment.c": ("fmu_src/component/interface.h",),
    # checks of this project's own FMUs alone: by this file the validator knows the project, and by no other
    "fmu_src/validation/ours.py": ("fmu_src/interface.py", "fmu_src/twin/linkage.py"),
}  # fmt: skip

IGNORED = {"build", ".venv", "__pycache__", "documentation"}
MODULES = {"transplanter_linkage": "fmu_src"}  # the package's name when installed


def files(*endings: str) -> Iterator[str]:
    for top in ("fmu_src", "scenarios", "tests"):
        for path in sorted((PROJECT_ROOT / top).rglob("*")):
            if path.suffix in endings and not IGNORED & set(path.parts):
                yield path.relative_to(PROJECT_ROOT).as_posix()
    yield from (name for name in ("hatch_build.py",) if Path(name).suffix in endings)


def module_file(name: str) -> str | None:
    """The file of a module of this project: a.b.c as a/b/c.py or a/b/c/__init__.py; None for one of another."""
    top, _, rest = name.partition(".")
    path = PurePosixPath(MODULES.get(top, top), *filter(None, rest.split(".")))
    for candidate in (f"{path}.py", f"{path}/__init__.py"):
        if (PROJECT_ROOT / candidate).is_file():
            return candidate
    return None


def python_arrows(name: str) -> Iterator[str]:
    """The files of this project that a Python file imports, wherever in it."""
    package = PurePosixPath(name).parent.parts
    for node in ast.walk(ast.parse((PROJECT_ROOT / name).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from filter(None, (module_file(alias.name) for alias in node.names))
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else ()
            base = ".".join((*start, *filter(None, [node.module])))
            for alias in node.names:
                found = module_file(f"{base}.{alias.name}") or module_file(base)
                if found:
                    yield found


def c_arrows(name: str) -> Iterator[str]:
    """The files of this project that a C file includes: beside it, or from fmu_src/ or the project's root."""
    text = (PROJECT_ROOT / name).read_text(encoding="utf-8")
    for included in re.findall(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', text, re.MULTILINE):
        for root in (PurePosixPath(name).parent, PurePosixPath("fmu_src"), PurePosixPath()):
            path = (PROJECT_ROOT / root / included).resolve()
            if path.is_file():
                yield path.relative_to(PROJECT_ROOT).as_posix()
                break


@cache
def arrows() -> tuple[tuple[str, str], ...]:
    """(who, whom) of every import and include."""
    found = {(name, whom) for name in files(".py") for whom in python_arrows(name)}
    found |= {(name, whom) for name in files(".c", ".h") for whom in c_arrows(name)}
    return tuple(sorted((who, whom) for who, whom in found if who != whom))


def room(name: str) -> str:
    """The room of a file; "" where it has none."""
    return max((prefix for prefix in MAY_KNOW if name.startswith(prefix)), key=len, default="")


def runs_up(who: str, whom: str) -> bool:
    known = (room(who), *MAY_KNOW.get(room(who), ()), *ALLOWED.get(who, ()))
    own_room_face = whom.endswith("__init__.py") and room(whom) == ""  # an empty package on the way
    return not own_room_face and not whom.startswith(tuple(prefix for prefix in known if prefix))


def unit(name: str) -> str:
    """A C source and its header are one; a package's face is left out of circles, as it hands names on alone."""
    return name.rpartition(".")[0] if name.endswith((".c", ".h")) else name


def circles(of: Iterable[tuple[str, str]]) -> list[set[str]]:
    """The sets of files that reach each other (strongly connected, by reachability both ways)."""
    onward: dict[str, set[str]] = {}
    for who, whom in of:
        if unit(who) != unit(whom):
            onward.setdefault(unit(who), set()).add(unit(whom))

    def reached(start: str) -> set[str]:
        seen, waiting = set(), [start]
        while waiting:
            for found in onward.get(waiting.pop(), set()) - seen:
                seen.add(found)
                waiting.append(found)
        return seen

    reach = {name: reached(name) for name in onward}
    in_circle = {name for name in reach if name in reach[name]}
    found: list[set[str]] = []
    for name in sorted(in_circle):
        circle = {other for other in reach[name] if name in reach.get(other, set())}
        if circle not in found:
            found.append(circle)
    return found


# ---- the house -----------------------------------------------------------------------------------


def test_every_file_has_a_room():
    without = [name for name in files(".py", ".c", ".h") if not room(name) and not name.endswith("__init__.py")]
    assert not without, f"say in MAY_KNOW whom these may know: {without}"


def test_no_arrow_runs_up():
    up = [f"{who} knows {whom}" for who, whom in arrows() if runs_up(who, whom)]
    assert not up, "\n".join(up)


def test_no_files_are_in_a_circle():
    found = [" <-> ".join(sorted(circle)) for circle in circles(arrows())]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(("who", "whom"), [(who, whom) for who, all_ in ALLOWED.items() for whom in all_])
def test_an_exception_is_needed(who, whom):
    assert any(a == who and b.startswith(whom) for a, b in arrows()), f"take {who} -> {whom} out of ALLOWED"


# ---- the test itself -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("who", "whom"),
    [
        ("fmu_src/linkage/linkage.c", "fmu_src/component/component.h"),
        ("fmu_src/component/crank.c", "fmu_src/fmi/adaptor.h"),
        ("fmu_src/exporter/build.py", "fmu_src/validation/files.py"),
        ("fmu_src/validation/files.py", "fmu_src/exporter/build.py"),
        ("fmu_src/interface.py", "fmu_src/cli.py"),
        ("fmu_src/exporter/reference.py", "fmu_src/oracle/oracle.py"),
        ("scenarios/sweep/__main__.py", "scenarios/field_row/system.py"),
        ("scenarios/common/reports.py", "scenarios/paper_cycle/published.py"),
        ("scenarios/paper_cycle/families.py", "fmu_src/twin/linkage.py"),
        ("scenarios/speed_vs_error/solving/way.py", "fmu_src/oracle/oracle.py"),
        ("scenarios/common/loader.h", "fmu_src/component/interface.h"),
        ("fmu_src/exporter/build.py", "tests/conftest.py"),
    ],
)
def test_arrows_that_would_run_up(who, whom):
    assert runs_up(who, whom)
    assert (PROJECT_ROOT / who).is_file() and (PROJECT_ROOT / whom).is_file()


def test_imports_and_includes_are_seen(tmp_path):
    found = set(arrows())
    assert ("fmu_src/cli.py", "fmu_src/validation/report.py") in found  # relative, within a function
    assert ("scenarios/twelve_rows/__main__.py", "scenarios/common/reports.py") in found  # from package import module
    assert ("scenarios/speed_vs_error/solving/evaluations.c", "fmu_src/linkage/linkage.c") in found
    assert ("fmu_src/component/instance.h", "fmu_src/linkage/mass.h") in found


def test_a_circle_is_seen():
    assert circles([("a.c", "b.h"), ("b.c", "c.h"), ("c.h", "a.h"), ("c.h", "d.h"), ("d.h", "d.c")]) == [
        {"a", "b", "c"}
    ]
    assert circles([("a.py", "b.py"), ("b.py", "c.py")]) == []
