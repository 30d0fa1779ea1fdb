"""The command line that the scenarios share: which FMU, where to, and errors in one line."""

from __future__ import annotations

import argparse
import copy
import math
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path

from fmpy.fmi1 import FMICallException
from rich.console import Console

from scenarios.common import reports
from scenarios.common.instance import FmuError, Refused

ROOT = Path(__file__).resolve().parents[2]
FMU = ROOT / "build" / "fmi2" / "TransplanterLinkage.fmu"
FMI3 = ROOT / "build" / "fmi3" / "TransplanterLinkage.fmu"
TWIN = ROOT / "build" / "twin" / "TransplanterLinkageTwin.fmu"


class Help(argparse.HelpFormatter):
    """No word is broken, and a path that is a default is shown as from where the user stands."""

    def _split_lines(self, text: str, width: int) -> list[str]:
        return textwrap.wrap(" ".join(text.split()), width, break_long_words=False, break_on_hyphens=False)

    def _expand_help(self, action: argparse.Action) -> str:
        if isinstance(action.default, Path):
            action = copy.copy(action)
            action.default = reports.shown(action.default)
        return super()._expand_help(action)


def plants(most: int) -> Callable[[str], int]:
    """The type of an option: a number of plants, from 1 on."""

    def number(text: str) -> int:
        if not text.isdecimal() or not 1 <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"give a number of plants from 1 to {most}")
        return int(text)

    return number


def whole(least: int, most: int) -> Callable[[str], int]:
    """The type of an option: a whole number within limits."""

    def number(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from {least} to {most}")
        return int(text)

    return number


def between(low: float, high: float, what: str, unit: str = "") -> Callable[[str], float]:
    """A type of option: a number within limits; the message asks for `what`, its limits and their unit."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"give {what} from {low:g} to {high:g}{unit and ' ' + unit}")
        return value

    return number


def parser(scenario: str, doc: str, **output: object) -> argparse.ArgumentParser:
    """Options that every scenario has; ``doc`` is its module's text, whose first line describes it.

    ``output`` are arguments of argparse for that option, where the scenario has its own way.
    """
    made = argparse.ArgumentParser(
        prog=f"python -m scenarios.{scenario}", description=doc.splitlines()[0], formatter_class=Help
    )
    made.add_argument("--fmu", type=Path, default=FMU, help="the linkage FMU (default: %(default)s)")
    usual = {
        "default": ROOT / "build" / "reports" / scenario,
        "help": "folder for tables and figures (default: %(default)s)",
    }
    made.add_argument("--output", type=Path, **usual | output)
    return made


def run(scenario: Callable[[argparse.Namespace, Console], Sequence[Path]], options: argparse.Namespace) -> int:
    """Run a scenario, which prints and returns the files that it wrote; returns the exit status."""
    console = reports.console()
    try:
        written = scenario(options, console)
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
