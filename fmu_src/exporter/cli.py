"""The console command `linkage-fmu`: build | generate | info | validate."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ..interface import InterfaceError, load_interface
from .build import TwinError, build_fmi2, build_twin, write_example_input
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
    except (InterfaceError, ModelDescriptionError, CompileError, TwinError, OSError) as problem:
        print(f"linkage-fmu: {problem}", file=sys.stderr)
        return 1


def run_build(chosen: argparse.Namespace) -> int:
    names = chosen.platform or []
    platforms = list(PLATFORMS.values()) if "all" in names else [PLATFORMS[name] for name in names]
    fmu = build_fmi2(chosen.output, platforms or [host_platform()])
    console.print(f"{fmu}  ({', '.join(p.name for p in platforms or [host_platform()])})", highlight=False, soft_wrap=True)
    console.print(str(write_example_input(chosen.output)), highlight=False, soft_wrap=True)
    console.print(f"{build_twin(chosen.output)}  (Python)", highlight=False, soft_wrap=True)
    return 0


def run_generate(chosen: argparse.Namespace) -> int:
    stale = generate(load_interface(), write=not chosen.check)
    for path in stale:
        console.print(f"{path}: {'stale: run linkage-fmu generate' if chosen.check else 'written'}", highlight=False, soft_wrap=True)
    return 1 if stale and chosen.check else 0


def run_info(chosen: argparse.Namespace) -> int:
    import fmpy

    for fmu in chosen.fmu:
        description = fmpy.read_model_description(str(fmu), validate=False)
        console.print(f"[bold]{fmu}[/bold]: {description.modelName}, FMI {description.fmiVersion}", highlight=False, soft_wrap=True)
        console.print(description.description or "", highlight=False, soft_wrap=True)
        console.print(f"binaries: {', '.join(fmpy.supported_platforms(str(fmu)))}", highlight=False, soft_wrap=True)
        table = Table("name", "kind", "unit", "start", "meaning", box=None, pad_edge=False)
        for v in description.modelVariables:
            table.add_row(v.name, v.causality, v.unit or "", v.start or "", v.description or "")
        console.print(table)
    return 0


def run_validate(chosen: argparse.Namespace) -> int:
    from fmpy.validation import validate_fmu

    failed = False
    for fmu in chosen.fmu:
        problems = validate_fmu(str(fmu))
        failed = failed or bool(problems)
        console.print(f"{fmu}: {'no problems found' if not problems else ''}", highlight=False, soft_wrap=True)
        for problem in problems:
            console.print(f"  {problem}", highlight=False, soft_wrap=True)
    return 1 if failed else 0
