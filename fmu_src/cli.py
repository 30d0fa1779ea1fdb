"""The console command `linkage-fmu`: build | explore | generate | info | mend | validate."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
import tempfile
import textwrap
import threading
import webbrowser
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import FrameType
from typing import Any

from rich.console import Console
from rich.text import Text

from . import fmu as built_fmu
from .exporter import compiler
from .exporter.build import TwinError, build_fmu, build_twin, write_example_input, write_page
from .exporter.compiler import PLATFORMS, WEB_ASSEMBLY, CompileError, host_platform
from .exporter.documentation import DocumentationError
from .exporter.generate import generate
from .exporter.model_description import ModelDescriptionError
from .exporter.page import PAGE, PageError, page_of, with_design
from .exporter.python_fmu import PythonFmuError, mend_fmu
from .exporter.version import missing_packages
from .interface import InterfaceError, load_interface
from .validation.text import printable

console = Console()


def main(arguments: list[str] | None = None) -> int:
    """Entry point; returns the exit status: 0 done, 1 refused or a check failed, 2 wrong usage or not all judged."""
    parser = argparse.ArgumentParser(
        prog="linkage-fmu", description="Build and check the FMUs of the transplanter linkage."
    )
    commands = parser.add_subparsers(required=True, metavar="command")

    build = commands.add_parser("build", help="build the FMUs")
    build.add_argument("--output", type=Path, default=Path("build"), metavar="FOLDER", help="default: build")
    build.add_argument(
        "--platform",
        action="append",
        choices=[*PLATFORMS, WEB_ASSEMBLY.name, "all"],
        help=f"repeatable; default: this machine's; {WEB_ASSEMBLY.name} is experimental, and in FMI 3.0 alone",
    )
    build.set_defaults(run=run_build)

    explore = commands.add_parser(
        "explore",
        help="open the linkage in a browser, to change and compare it",
        description="Open the explorer in a browser: the page that each FMU carries as documentation/explorer.html.",
    )
    explore.add_argument(
        "file", type=Path, nargs="?", help="an FMU, or a parameter set (SSV) or another file that the page wrote"
    )
    explore.set_defaults(run=run_explore)

    generated = commands.add_parser("generate", help="write the tracked files that are made from others")
    generated.add_argument("--check", action="store_true", help="write nothing; fail where a file is stale")
    generated.set_defaults(run=run_generate)

    info = commands.add_parser("info", help="show what an FMU is, has and promises")
    info.add_argument("fmu", type=Path, nargs="+")
    info.set_defaults(run=run_info)

    mend = commands.add_parser(
        "mend",
        help="mend FMUs that PythonFMU built: they crash after an exception and at exit",
        description="Mend FMUs that PythonFMU 0.6.5 to 0.7.0 built, each in place: their library uses freed objects "
        "after an exception of the slave, and freed memory when the process ends. Exit status: 0 all are mended, "
        "1 one was refused.",
    )
    mend.add_argument("fmu", type=Path, nargs="+")
    mend.set_defaults(run=run_mend)

    validate = commands.add_parser(
        "validate",
        help="check FMUs of any origin: files, binaries, runs",
        description="Check FMUs of any origin. Exit status: 0 no check failed, 1 one failed (or warned with --strict), "
        "2 an FMU could not be judged or a file not be written, 128 + N ended by signal N.",
    )
    validate.add_argument("fmu", type=Path, nargs="*")
    validate.add_argument("--list", action="store_true", help="show the checks and what each proves")
    validate.add_argument("--junit", type=Path, metavar="FILE", help="write the results as JUnit XML as well")
    validate.add_argument("--json", type=Path, metavar="FILE", help="and as JSON; - is standard output, with no table")
    validate.add_argument("-q", "--quiet", action="store_true", help="show nothing but problems")
    validate.add_argument("--skip", action="append", default=[], metavar="CHECK", help="leave a check out; repeatable")
    validate.add_argument(
        "--timeout", type=positive, default=30.0, metavar="SECONDS", help="most that one run of an FMU may take (30)"
    )
    validate.add_argument(
        "--limit", type=positive, default=600.0, metavar="SECONDS", help="most that all checks of an FMU may take (600)"
    )
    validate.add_argument(
        "--memory", type=gib, default=gib("4"), metavar="GIB", help="most that a running FMU may hold (4)"
    )
    validate.add_argument(
        "--unpacked", type=gib, default=gib("4"), metavar="GIB", help="most that an FMU may have unpacked (4)"
    )
    validate.add_argument(
        "--entries", type=count, default=100_000, metavar="N", help="most files that an FMU may have (100000)"
    )
    validate.add_argument(
        "--glibc", type=glibc_version, default=(2, 17), metavar="VERSION", help="oldest glibc of your hosts (2.17)"
    )
    validate.add_argument("--strict", action="store_true", help="warnings fail as well")
    validate.set_defaults(run=run_validate, parser=validate)

    chosen = parser.parse_args(arguments)
    try:
        return int(chosen.run(chosen))
    except REFUSALS as problem:
        complain(str(problem))
        return 1


class UnreadableFmu(ValueError):
    """A file that is no FMU, or whose description cannot be read."""


class MissingPackages(RuntimeError):
    """What the extra [build] installs is not there; the message says how to install it."""


REFUSALS = (
    InterfaceError, ModelDescriptionError, DocumentationError, CompileError, PageError, TwinError, PythonFmuError,
    UnreadableFmu, MissingPackages, OSError,
)  # fmt: skip


def run_build(chosen: argparse.Namespace) -> int:
    if missing := missing_packages("build"):
        raise MissingPackages(f"build needs {' and '.join(missing)}: pip install {' '.join(missing)}")
    names = chosen.platform or []
    known = PLATFORMS | {WEB_ASSEMBLY.name: WEB_ASSEMBLY}
    platforms = [known[name] for name in (known if "all" in names else names)] or [host_platform()]
    for version in compiler.FMU_SOURCE:
        usable = [target for target in platforms if version == 3 or target != WEB_ASSEMBLY]
        if usable:
            say(f"{build_fmu(version, chosen.output, usable)}  ({', '.join(p.name for p in usable)})")
        else:
            say(f"no FMU of FMI {version}.0: it has no {WEB_ASSEMBLY.name}")
    say(str(write_example_input(chosen.output)))
    say(f"{build_twin(chosen.output)}  (Python)")
    say(str(write_page(chosen.output)))
    return 0


def run_explore(chosen: argparse.Namespace) -> int:
    is_fmu = chosen.file is not None and chosen.file.suffix.lower() == ".fmu"
    page = page_of(chosen.file if is_fmu else built_fmu("3.0"))
    if chosen.file is not None and not is_fmu:
        page = with_design(page, chosen.file)
    # the browser reads it when this command has ended: it stays, where the system clears up
    place = Path(tempfile.mkdtemp(prefix="linkage-")) / PAGE
    place.write_bytes(page)
    if not webbrowser.open(place.as_uri()):
        complain("no browser was found: open the page yourself")
    say(place.as_uri())
    return 0


def run_generate(chosen: argparse.Namespace) -> int:
    stale = generate(load_interface(), write=not chosen.check)
    for path in stale:
        say(f"{path}: {'stale: run linkage-fmu generate' if chosen.check else 'written'}")
    return 1 if stale and chosen.check else 0


def run_info(chosen: argparse.Namespace) -> int:
    for fmu in chosen.fmu:
        names, description, declared = read_fmu(fmu)
        say(f"{fmu}: {description.modelName}, FMI {description.fmiVersion}")
        say_wrapped(description.description or "")
        say("binaries: " + ", ".join(sorted({name.split("/")[1] for name in names if name.startswith("binaries/")})))
        for interface_type, promised in promises(declared).items():
            say_wrapped(f"{interface_type}: " + ", ".join(promised))
        show_variables(description.modelVariables)
    return 0


MEANING_WIDTH = 40  # with less beside the other columns, meanings stand on lines of their own


def show_variables(variables: Sequence[Any]) -> None:
    """A line a variable where the output has no width, for other programs to search; else the meaning is wrapped beside
    the other columns, or below them where the screen is narrow.
    """
    kept = ("valueReference", "name", "causality", "unit", "start")
    headings = ("#", "name", "kind", "unit", "start")
    rows = [[printable("" if (value := getattr(v, key)) is None else str(value)) for key in kept] for v in variables]
    widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
    beside = sum(widths) + 2 * len(widths)
    is_beside = page_width() - beside >= MEANING_WIDTH
    indent = " " * (beside if is_beside else widths[0] + 2)

    def line(texts: Sequence[str], meaning: str) -> None:
        words = "  ".join(text.ljust(width) for text, width in zip(texts, widths, strict=True))
        below = wrapped(meaning, indent)
        if is_beside and below:
            words += "  " + below.pop(0).lstrip()
        for text in (words.rstrip(), *below):
            say(text)

    line(headings, "meaning")
    for row, v in zip(rows, variables, strict=True):
        line(row, printable(v.description or ""))


def page_width() -> int:
    """Columns of the terminal, or that COLUMNS gives; where nothing has a width, lines do not end."""
    return console.width if console.is_terminal or "COLUMNS" in os.environ else sys.maxsize


def wrapped(text: str, indent: str = "") -> list[str]:
    """Lines between words; a word that is longer than the page stays whole."""
    return textwrap.wrap(
        text,
        page_width(),
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def say_wrapped(text: str) -> None:
    for line in wrapped(printable(text)):
        say(line)


def run_mend(chosen: argparse.Namespace) -> int:
    status = 0
    for fmu in chosen.fmu:
        try:
            replaced = mend_fmu(fmu)
        except (PythonFmuError, OSError) as problem:  # the others are mended all the same
            complain(str(problem))
            status = 1
        else:
            say(f"{fmu}: mended {', '.join(replaced)}" if replaced else f"{fmu}: was mended before")
    return status


def run_validate(chosen: argparse.Namespace) -> int:
    with interruptible() as interruption:
        return judge_all(chosen, interruption)


def judge_all(chosen: argparse.Namespace, interruption: Interruption) -> int:
    from .validation.process import BrokenInstallation
    from .validation.report import Judged, as_json, check_table, exit_status, junit, result_table, summary, write
    from .validation.subject import Options
    from .validation.table import NAMES, PASSED, validate

    if chosen.list:
        console.print(check_table())
        return 0
    if not chosen.fmu:
        chosen.parser.error("which FMU?")
    for name in chosen.skip:
        if name not in NAMES:
            chosen.parser.error(f"--skip {name}: no such check; there are {', '.join(NAMES)}")
    options = Options(
        limit=chosen.timeout, total=chosen.limit, memory=chosen.memory, unpacked=chosen.unpacked,
        entries=chosen.entries, glibc=chosen.glibc, skip=frozenset(chosen.skip), strict=chosen.strict,
    )  # fmt: skip
    to_stdout = chosen.json == Path("-")
    given = list(dict.fromkeys(chosen.fmu))
    judged: list[Judged] = []
    is_incomplete = False

    def show(one: Judged) -> None:
        if one.unreadable is not None:
            complain(f"{one.name}: {one.unreadable}")
        elif not to_stdout and not (chosen.quiet and one.outcome == PASSED):
            say(one.name)
            console.print(result_table(one.results, chosen.quiet))
            if not chosen.quiet:
                say(summary(one.results))

    def judge(fmu: Path) -> Judged:
        name = printable(str(fmu))
        try:
            with Console(stderr=True).status(Text(name)) as status:
                return Judged(fmu, validate(fmu, options, lambda title: status.update(Text(f"{name}: {title}"))))
        except OSError as problem:
            place = f": {problem.filename}" if problem.filename and Path(problem.filename) != fmu else ""
            return Judged(fmu, unreadable=printable(f"{problem.strerror or problem}{place}"))
        except BrokenInstallation as problem:
            return Judged(fmu, unreadable=printable(str(problem)))

    try:
        for fmu in given:
            judged.append(judge(fmu))
            try:
                show(judged[-1])
                sys.stdout.flush()
            except OSError as problem:  # nobody reads it, or the disk is full: the reports may still be had
                complain(f"standard output: {problem.strerror or problem}")
                is_incomplete = True
                sys.stdout = Path(os.devnull).open("w")  # noqa: SIM115 for the rest of this process
    except KeyboardInterrupt:
        complain(f"ended by {interruption.name}; {len(judged)} of {len(given)} FMUs were judged")
    status = interruption.status or (2 if is_incomplete else exit_status(judged))
    for path, content in ((chosen.junit, junit(judged)), (chosen.json, as_json(judged, status))):
        try:
            if path == Path("-"):
                sys.stdout.write(content.decode())
                sys.stdout.flush()
            elif path is not None:
                write(path, content)
        except OSError as problem:
            complain(f"{printable(str(path))}: {problem.strerror or problem}")
            status = status if interruption.status else 2
    return status


class Interruption:
    """The signal by which the user ends the command."""

    number = 0

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        for each in ENDS:  # once is enough: what follows cleans up
            signal.signal(each, lambda *_: None)  # SIG_IGN has Python complain of one that is just coming
        self.number = number
        raise KeyboardInterrupt

    @property
    def name(self) -> str:
        return signal.Signals(self.number).name

    @property
    def status(self) -> int:
        """As a shell has it; 0 where there was none."""
        return 128 + self.number if self.number else 0


ENDS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]


@contextlib.contextmanager
def interruptible() -> Iterator[Interruption]:
    """Every signal that asks the command to end raises KeyboardInterrupt, once. One that was ignored stays so."""
    interruption = Interruption()
    if threading.current_thread() is not threading.main_thread():
        yield interruption
        return
    before = {number: signal.getsignal(number) for number in ENDS}
    for number, handler in before.items():
        if handler != signal.SIG_IGN:
            signal.signal(number, interruption)
    try:
        yield interruption
    finally:
        if not interruption.number:  # or else all that is left to do is to end
            for number, handler in before.items():
                signal.signal(number, handler)


def complain(text: str) -> None:
    print(f"linkage-fmu: {text}", file=sys.stderr)


def positive(text: str) -> float:
    value = float(text)
    if not 0 < value < 1e6:
        raise ValueError
    return value


def count(text: str) -> int:
    if int(text) < 1:
        raise ValueError
    return int(text)


def gib(text: str) -> float:
    """Bytes of so many GiB."""
    return positive(text) * 2**30


def glibc_version(text: str) -> tuple[int, int]:
    major, minor = text.split(".")
    return int(major), int(minor)


def say(text: str) -> None:
    """A line as it is: paths and foreign descriptions are no markup, and do nothing to the terminal."""
    console.print(printable(text), highlight=False, markup=False, soft_wrap=True)


def read_fmu(fmu: Path) -> tuple[list[str], Any, dict[str, dict[str, str]]]:
    """Names in the archive, the description as fmpy reads it, and the attributes of its elements by their names, for
    fmpy leaves some of them out.
    """
    import fmpy
    from lxml import etree

    try:
        with zipfile.ZipFile(fmu) as archive:
            names, text = archive.namelist(), archive.read("modelDescription.xml")
        root = etree.fromstring(text, etree.XMLParser(resolve_entities=False, no_network=True))
        declared = {str(element.tag): {str(k): str(v) for k, v in element.attrib.items()} for element in root}
        return names, fmpy.read_model_description(str(fmu), validate=False), declared
    except OSError:
        raise
    except Exception as problem:  # fmpy raises plain Exceptions, its XML library errors of its own
        raise UnreadableFmu(f"{fmu}: no readable FMU: {problem}") from problem


def promises(declared: dict[str, dict[str, str]]) -> dict[str, list[str]]:
    """The capabilities that an FMU declares, by interface type."""
    names = {
        "canHandleVariableCommunicationStepSize": "variable steps",
        "canInterpolateInputs": "input derivatives",
        "maxOutputDerivativeOrder": "output derivatives",
        "hasEventMode": "event mode",
        "providesIntermediateUpdate": "intermediate update",
        "canReturnEarlyAfterIntermediateUpdate": "early return",
        "canGetAndSetFMUstate": "states",  # FMI 2.0
        "canSerializeFMUstate": "serialized states",
        "canGetAndSetFMUState": "states",  # FMI 3.0
        "canSerializeFMUState": "serialized states",
        "providesDirectionalDerivative": "directional derivatives",  # FMI 2.0
        "providesDirectionalDerivatives": "directional derivatives",  # FMI 3.0
        "providesAdjointDerivatives": "adjoint derivatives",
        "needsExecutionTool": "needs a tool on the host",
    }
    types = {
        "CoSimulation": "Co-Simulation", "ModelExchange": "Model Exchange", "ScheduledExecution": "Scheduled Execution"
    }  # fmt: skip
    return {
        title: [
            text for attribute, text in names.items() if declared[element].get(attribute, "0") not in ("0", "false")
        ]
        for element, title in types.items()
        if element in declared
    }
