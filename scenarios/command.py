"""The command line that the scenes share: which FMU, where to, and errors in one line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from fmpy.fmi1 import FMICallException
from rich.console import Console

from scenarios import reports
from scenarios.cycle import FmuError, Refused

ROOT = Path(__file__).resolve().parent.parent
FMU = ROOT / "build" / "fmi2" / "TransplanterLinkage.fmu"


def parser(scene: str, doc: str, **output: object) -> argparse.ArgumentParser:
    """Options that every scene has; ``doc`` is its module's text, whose first line describes it.

    ``output`` are arguments of argparse for that option, where the scene has its own way.
    """
    made = argparse.ArgumentParser(prog=f"python -m scenarios.{scene}", description=doc.splitlines()[0])
    made.add_argument("--fmu", type=Path, default=FMU, help="the linkage FMU, FMI 2.0 (default: %(default)s)")
    usual = {"default": ROOT / "build" / "reports" / scene,
             "help": "folder for tables and figures (default: %(default)s)"}
    made.add_argument("--output", type=Path, **usual | output)
    return made


def run(scene: Callable[[argparse.Namespace, Console], Sequence[Path]], options: argparse.Namespace) -> int:
    """Run a scene, which prints and returns the files that it wrote; returns the exit status."""
    console = reports.console()
    try:
        written = scene(options, console)
    except FmuError as error:
        print(error, file=sys.stderr)
    except (Refused, FMICallException) as refusal:
        print(f"{options.fmu} refused: {refusal}", file=sys.stderr)
    except OSError as error:
        print(f"The reports cannot be written to {options.output}: {error}", file=sys.stderr)
    else:
        reports.show_files(console, options.output, written)
        return 0
    return 1
