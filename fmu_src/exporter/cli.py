"""The console command `linkage-fmu`: build | generate | info | validate."""

from __future__ import annotations

import argparse
import sys
import zipfile
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..interface import InterfaceError, load_interface
from .build import TwinError, build_fmu, build_twin, write_example_input
from . import compiler
from .compiler import PLATFORMS, CompileError, host_platform
from .documentation import DocumentationError
from .generate import generate
from .model_description import ModelDescriptionError
from .version import missing_packages

console = Console()


def main(arguments: list[str] | None = None) -> int:
    """Entry point; returns the exit status: 0 done, 1 refused or a check failed, 2 no FMU to validate."""
    parser = argparse.ArgumentParser(
        prog="linkage-fmu", description="Build and check the FMUs of the transplanter linkage."
    )
    commands = parser.add_subparsers(required=True, metavar="command")

    build = commands.add_parser("build", help="build the FMUs")
    build.add_argument("--output", type=Path, default=Path("build"), metavar="FOLDER", help="default: build")
    build.add_argument(
        "--platform", action="append", choices=[*PLATFORMS, "all"], help="repeatable; default: this machine's"
    )
    build.set_defaults(run=run_build)

    generated = commands.add_parser("generate", help="write the tracked files that are made from others")
    generated.add_argument("--check", action="store_true", help="write nothing; fail where a file is stale")
    generated.set_defaults(run=run_generate)

    info = commands.add_parser("info", help="show what an FMU is, has and promises")
    info.add_argument("fmu", type=Path, nargs="+")
    info.set_defaults(run=run_info)

    validate = commands.add_parser(
        "validate",
        help="check FMUs of any origin: files, binaries, runs",
        description="Check FMUs of any origin. Exit status: 0 all passed, 1 a check failed, 2 a file cannot be read or written.",
    )
    validate.add_argument("fmu", type=Path, nargs="*")
    validate.add_argument("--list", action="store_true", help="show the checks and what each proves")
    validate.add_argument("--junit", type=Path, metavar="FILE", help="write the results as JUnit XML as well")
    validate.add_argument("--skip", action="append", default=[], metavar="CHECK", help="leave a check out; repeatable")
    validate.add_argument(
        "--timeout", type=seconds, default=30.0, metavar="SECONDS", help="most that one check's run may take (30)"
    )
    validate.add_argument(
        "--glibc", type=glibc_version, default=(2, 17), metavar="VERSION", help="oldest glibc of your hosts (2.17)"
    )
    validate.set_defaults(run=run_validate, parser=validate)

    chosen = parser.parse_args(arguments)
    try:
        return chosen.run(chosen)
    except REFUSALS as problem:
        print(f"linkage-fmu: {problem}", file=sys.stderr)
        return 1


class UnreadableFmu(ValueError):
    """A file that is no FMU, or whose description cannot be read."""


class MissingPackages(RuntimeError):
    """What the extra [build] installs is not there; the message says how to install it."""


REFUSALS = (
    InterfaceError, ModelDescriptionError, DocumentationError, CompileError, TwinError, UnreadableFmu, MissingPackages,
    OSError,
)  # fmt: skip


def run_build(chosen: argparse.Namespace) -> int:
    if missing := missing_packages("build"):
        raise MissingPackages(f"build needs {' and '.join(missing)}: pip install {' '.join(missing)}")
    names = chosen.platform or []
    platforms = list(PLATFORMS.values()) if "all" in names else [PLATFORMS[name] for name in names]
    platforms = platforms or [host_platform()]
    for version in compiler.FMU_SOURCE:
        fmu = build_fmu(version, chosen.output, platforms)
        say(f"{fmu}  ({', '.join(p.name for p in platforms)})")
    say(str(write_example_input(chosen.output)))
    say(f"{build_twin(chosen.output)}  (Python)")
    return 0


def run_generate(chosen: argparse.Namespace) -> int:
    stale = generate(load_interface(), write=not chosen.check)
    for path in stale:
        say(f"{path}: {'stale: run linkage-fmu generate' if chosen.check else 'written'}")
    return 1 if stale and chosen.check else 0


def run_info(chosen: argparse.Namespace) -> int:
    for fmu in chosen.fmu:
        names, description = read_fmu(fmu)
        say(f"{fmu}: {description.modelName}, FMI {description.fmiVersion}")
        say(description.description or "")
        say("binaries: " + ", ".join(sorted({name.split("/")[1] for name in names if name.startswith("binaries/")})))
        for interface_type, promised in promises(description).items():
            say(f"{interface_type}: " + ", ".join(promised))
        table = Table("#", "name", "kind", "unit", "start", "meaning", box=None, pad_edge=False)
        for v in description.modelVariables:
            table.add_row(
                str(v.valueReference), v.name, v.causality, v.unit or "", v.start or "", Text(v.description or "")
            )
        console.print(table)
    return 0


def run_validate(chosen: argparse.Namespace) -> int:
    from .validation.report import check_table, result_table, summary, write_junit
    from .validation.subject import Options
    from .validation.table import FAILED, NAMES, validate

    if chosen.list:
        console.print(check_table())
        return 0
    if not chosen.fmu:
        chosen.parser.error("which FMU?")
    for name in chosen.skip:
        if name not in NAMES:
            chosen.parser.error(f"--skip {name}: no such check; there are {', '.join(NAMES)}")
    options = Options(limit=chosen.timeout, glibc=chosen.glibc, skip=frozenset(chosen.skip))
    results, is_incomplete = {}, False
    for fmu in dict.fromkeys(chosen.fmu):
        try:
            with console.status(str(fmu)) as status:
                results[fmu] = validate(fmu, options, lambda title, fmu=fmu: status.update(f"{fmu}: {title}"))
        except OSError as problem:
            print(f"linkage-fmu: {fmu}: {problem.strerror or problem}", file=sys.stderr)
            is_incomplete = True
            continue
        say(str(fmu))
        console.print(result_table(results[fmu]))
        say(summary(results[fmu]))
    if chosen.junit is not None:
        try:
            write_junit(chosen.junit, results)
        except OSError as problem:
            print(f"linkage-fmu: {chosen.junit}: {problem.strerror or problem}", file=sys.stderr)
            is_incomplete = True
    failed = any(result.outcome == FAILED for of_one in results.values() for result in of_one)
    return 2 if is_incomplete else int(failed)


def seconds(text: str) -> float:
    value = float(text)
    if not 0 < value < 1e6:
        raise ValueError
    return value


def glibc_version(text: str) -> tuple[int, int]:
    major, minor = text.split(".")
    return int(major), int(minor)


def say(text: str) -> None:
    """A line as it is: paths and foreign descriptions are no markup."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)


def read_fmu(fmu: Path):
    """Names in the archive, and the description as fmpy reads it."""
    import fmpy

    try:
        with zipfile.ZipFile(fmu) as archive:
            names = archive.namelist()
        return names, fmpy.read_model_description(str(fmu), validate=False)
    except OSError:
        raise
    except Exception as problem:  # fmpy raises plain Exceptions, its XML library errors of its own
        raise UnreadableFmu(f"{fmu}: no readable FMU: {problem}") from problem


def promises(description) -> dict[str, list[str]]:
    """The capabilities that an FMU declares, by interface type."""
    names = {
        "canHandleVariableCommunicationStepSize": "variable steps",
        "canInterpolateInputs": "input derivatives",
        "maxOutputDerivativeOrder": "output derivatives",
        "hasEventMode": "event mode",
        "providesIntermediateUpdate": "intermediate update",
        "canReturnEarlyAfterIntermediateUpdate": "early return",
        "canGetAndSetFMUstate": "states",
        "canSerializeFMUstate": "serialized states",
        "providesDirectionalDerivative": "directional derivatives",
        "providesDirectionalDerivatives": "directional derivatives",
        "providesAdjointDerivatives": "adjoint derivatives",
        "needsExecutionTool": "needs a tool on the host",
    }
    types = {
        "Co-Simulation": description.coSimulation,
        "Model Exchange": description.modelExchange,
        "Scheduled Execution": description.scheduledExecution,
    }
    return {
        name: [text for attribute, text in names.items() if getattr(interface, attribute, False)]
        for name, interface in types.items()
        if interface is not None
    }
