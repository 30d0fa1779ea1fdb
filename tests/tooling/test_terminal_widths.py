"""At 80 and at 120 columns no command loses a digit or breaks a word: what it says is what it says on a wide page."""

from __future__ import annotations

import ast
import importlib
import io
import os
import re
import subprocess
import sys
from argparse import Namespace

import pytest
from rich.console import Console

from scenarios.common import reports
from scenarios.paper_cycle import comparison
from scenarios.paper_cycle.published import AGREES, DIFFERS, OPEN, Row
from scenarios.spacing_change import __main__ as spacing
from tests.conftest import PROJECT_ROOT
from tests.hosts import table as hosts

WIDTHS = (80, 120)
WIDE = 1000
FRAMES = re.compile(r"[|+\u2500-\u257f]|(?<![\w.])-{2,}(?![\w.])")  # of tables, drawn with these


def words(text: str) -> set[str]:
    """What is between blanks and the frames of tables."""
    return {word for line in text.splitlines() for word in FRAMES.sub(" ", line).split()}


def assert_whole(narrow: str, wide: str, width: int) -> None:
    assert words(narrow) == words(wide)
    too_long = [line for line in narrow.splitlines() if len(line) > width and " " in line.strip()]
    assert not too_long


def page(width: int, show) -> str:
    file = io.StringIO()
    show(Console(file=file, width=width, highlight=False))
    return file.getvalue()


# ---- tables of the scenarios -----------------------------------------------------------------------

MANY = ("case", *(f"figure {k} / (m/s{k})" for k in range(12)), "remark on it")
TABLES = {
    "more numbers than have room": (
        MANY,
        [("worst case", *["-123.456789e-12"] * 12, "an explanation of many words " * 5)] * 3,
    ),
    "two texts of many words": (("what", "value", "why"), [("nozzle " * 20, "1.5 +- 0.25 mm", "because " * 40)]),
    "a long name": (("parameters", "value"), [("geometry.theta8.with.a.long.name.that.cannot.be.broken", "+0.0001")]),
    "no rows": (("name", "value"), []),
    "an empty cell and markup": (("name", "value"), [("[bold]", ""), ("", "[/]")]),
}


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", TABLES)
def test_a_table_fits_and_is_whole(name, width):
    headings, rows = TABLES[name]

    def show(console: Console) -> None:
        reports.show_table(console, "A title of several words", headings, rows, words=("remark on it", "why"))

    assert_whole(page(width, show), page(WIDE, show), width)


@pytest.mark.parametrize("width", WIDTHS)
def test_numbers_stay_on_their_line(width):
    """A number and its unit, or its spread, are not parted."""
    headings, rows = TABLES["two texts of many words"]
    assert "1.5 +- 0.25 mm" in page(
        width, lambda console: reports.show_table(console, "", headings, rows, words=("why",))
    )


def test_every_table_of_scenarios_and_hosts_is_made_there():
    """For what is made there fits."""
    makers = []
    for room in ("scenarios", "tests/hosts"):
        for file in sorted((PROJECT_ROOT / room).rglob("*.py")):
            tree = ast.parse(file.read_text(encoding="utf-8"))
            if any(isinstance(node, ast.ImportFrom) and node.module == "rich.table" for node in ast.walk(tree)):
                makers.append(file.relative_to(PROJECT_ROOT).as_posix())
    assert makers == ["scenarios/common/reports.py"]


@pytest.fixture(scope="module")
def spacing_tables(fmu_file, tmp_path_factory):
    """What the scene hands over to be shown."""
    shown = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reports, "show_table", lambda _console, *table, **options: shown.append((table, options)))
        options = Namespace(fmu=fmu_file, output=tmp_path_factory.mktemp("spacing"), variants=[])
        spacing.scene(options, Console(file=io.StringIO()))
    return shown


@pytest.mark.parametrize("width", WIDTHS)
def test_spacing_change(spacing_tables, width):
    """Nine columns of numbers, at 80 columns of the screen too."""

    def show(console: Console) -> None:
        for table, options in spacing_tables:
            reports.show_table(console, *table, **options)

    assert "-0.054" in page(width, show)
    assert_whole(page(width, show), page(WIDE, show), width)


# ---- the comparison with the paper -----------------------------------------------------------------

ROWS = [
    Row("a", "5, fig. 8", "descends, decelerated", "speed 1.47 to 1.77 m/s, still rising", AGREES, "a remark"),
    Row(
        "b",
        "4.1, fig. 3",
        "hole unchanged",
        "69.8, 60.2, 52.7, 46.7, 41.7, 37.5 mm at six lengths",
        DIFFERS,
        "spread 69%",
    ),
    Row("c", "5", "about 800 mm", "334.7 mm", OPEN, "the paper does not say from where the height counts"),
    Row("d", "1", "highest at 0 deg", "357.86 deg", AGREES),
]


@pytest.mark.parametrize("width", WIDTHS)
def test_the_comparison_begins_with_what_differs(width):
    shown = page(width, lambda console: comparison.show(console, ROWS))
    in_order = [
        re.sub(r"\s+", " ", part) for part in ("1 differ", "unchanged", "spread 69%", "1 are not", "counts", "2 agree")
    ]
    places = [shown.index(part) for part in in_order]
    assert places == sorted(places)
    assert_whole(shown, page(WIDE, lambda console: comparison.show(console, ROWS)), width)


# ---- commands, as a user starts them ---------------------------------------------------------------


def said(command: list[str], width: int | None) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    if width is not None:
        environment["COLUMNS"] = str(width)
    done = subprocess.run(command, cwd=PROJECT_ROOT, env=environment, capture_output=True, text=True, check=True)
    return done.stdout


MAINS = [
    ".".join(path.relative_to(PROJECT_ROOT).with_suffix("").parts)
    for room in ("scenarios", "tests/hosts")
    for path in sorted((PROJECT_ROOT / room).rglob("*.py"))
    if "argparse" in (text := path.read_text(encoding="utf-8")) or "command.parser(" in text
    if "def main(" in text
]


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("module", MAINS)
def test_help(module, width, monkeypatch, capsys):
    """Paths among the defaults are as from where the user stands, and whole."""

    def shown(columns: int) -> str:
        monkeypatch.setenv("COLUMNS", str(columns))
        with pytest.raises(SystemExit) as ended:
            importlib.import_module(module).main(["--help"])
        assert ended.value.code == 0
        return capsys.readouterr().out

    monkeypatch.chdir(PROJECT_ROOT)
    narrow = shown(width)
    assert_whole(narrow, shown(WIDE), width)
    assert str(PROJECT_ROOT) not in narrow


def test_every_scene_has_help():
    assert {"scenarios.field_row.__main__", "scenarios.field_row.engines", "scenarios.sweep.__main__"} < set(MAINS)


def linkage_fmu(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "fmu_src", *arguments]


COMMANDS = {
    "info of FMI 2.0": linkage_fmu("info", "build/fmi2/TransplanterLinkage.fmu"),
    "info of FMI 3.0": linkage_fmu("info", "build/fmi3/TransplanterLinkage.fmu"),
    "info of the twin": linkage_fmu("info", "build/twin/TransplanterLinkageTwin.fmu"),
    "validate --list": linkage_fmu("validate", "--list"),
    "make help": ["make", "--no-print-directory", "help"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command(name, fmu_files):
    wide = said(COMMANDS[name], WIDE)
    for width in WIDTHS:
        assert_whole(said(COMMANDS[name], width), wide, width)


def test_info_takes_few_lines(fmu_file):
    """A variable takes one line of figures, and no more of words than they fill."""
    command = COMMANDS["info of FMI 2.0"]
    narrow, piped = said(command, 80).splitlines(), said(command, None).splitlines()
    variables = [line for line in piped if re.match(r"\d+ ", line)]
    assert len(variables) > 40 and all(len(line.split()) > 3 for line in variables)  # one line each
    assert len(narrow) < 4 * len(variables)


# ---- the hosts of others ---------------------------------------------------------------------------


@pytest.mark.parametrize("width", WIDTHS)
def test_the_table_of_hosts(width):
    error = "libcosim of the Open Simulation Platform"
    rows = [(error, "1.2.3", "3.0 ME", "table, FMU without units", "1.2e-12", "3.4e-10", "5.6", hosts.DEFECT)] * 2

    def show(console: Console) -> None:
        reports.show_table(console, "", hosts.HEADINGS, rows, words=hosts.WORDS)

    assert_whole(page(width, show), page(WIDE, show), width)
