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
from .generate import generate
from .model_description import ModelDescriptionError

console = Console()


def main(arguments: list[str] | None = None) -> int:
    """Entry point; returns the exit status: 0 done, 1 refused or a check failed."""
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

    validate = commands.add_parser("validate", help="check FMUs as fmpy does")
    validate.add_argument("fmu", type=Path, nargs="+")
    validate.set_defaults(run=run_validate)

    chosen = parser.parse_args(arguments)
    try:
        return chosen.run(chosen)
    except (InterfaceError, ModelDescriptionError, CompileError, TwinError, UnreadableFmu, OSError) as problem:
        print(f"linkage-fmu: {problem}", file=sys.stderr)
        return 1


class UnreadableFmu(ValueError):
    """A file that is no FMU, or whose description cannot be read."""


def run_build(chosen: argparse.Namespace) -> int:
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
    from fmpy.validation import validate_fmu

    failed = False
    for fmu in chosen.fmu:
        read_fmu(fmu)
        problems = validate_fmu(str(fmu))
        failed = failed or bool(problems)
        say(f"{fmu}: {'problems' if problems else 'no problems found'}")
        for problem in problems:
            say(f"  {problem}")
    return 1 if failed else 0


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
