"""The pages for people: their links lead somewhere, none is out of reach, what they claim is what comes out."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest
from lxml import etree
from markdown_it import MarkdownIt
from markdown_it.token import Token

from fmu_src.exporter import documentation
from fmu_src.exporter.documentation import DocumentationError, anchors, carried_pages, plain, read_page
from fmu_src.exporter.tables import TABLES, with_tables
from tests.conftest import PROJECT_ROOT
from tests.documentation.conftest import block_with

FOLDER = PROJECT_ROOT / "fmu_src" / "documentation"
PAGES = sorted(FOLDER.glob("*.md"))
README = PROJECT_ROOT / "README.md"
READ = [README, PROJECT_ROOT / "build" / "README.md", *PAGES]  # by people


def tokens(path: Path) -> list[Token]:
    return MarkdownIt("commonmark").enable("table").parse(path.read_text(encoding="utf-8"))


def parts(path: Path) -> list[Token]:
    """Links, images and the like, in the order of the page."""
    return [child for token in tokens(path) if token.type == "inline" for child in token.children or []]


def targets(path: Path) -> list[str]:
    """Where the links and images of a page lead, but for the web."""
    found = [part.attrGet("href") or part.attrGet("src") for part in parts(path) if part.type in ("link_open", "image")]
    return [unquote(str(target)) for target in found if not re.match(r"https?://", str(target))]


def anchors_of(path: Path) -> list[str]:
    read = tokens(path)
    return anchors(plain(read[k + 1]) for k, token in enumerate(read) if token.type == "heading_open")


# ---- links -------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", READ, ids=lambda path: path.relative_to(PROJECT_ROOT).as_posix())
def test_links_and_pictures_lead_somewhere(path):
    """On disk, as on a site that shows the sources; anchors too."""
    for target in targets(path):
        file, _, fragment = target.partition("#")
        there = (path.parent / file).resolve() if file else path
        assert there.exists() and there.is_relative_to(PROJECT_ROOT), f"{path.name} links {target}"
        if fragment:
            assert fragment in anchors_of(there), f"{path.name} links {target}: no such heading"


def test_no_page_is_out_of_reach():
    """README links each page; the FMU's first page links each that the FMU carries."""
    linked = {(README.parent / target.partition("#")[0]).resolve() for target in targets(README)}
    assert [page.name for page in PAGES if page.resolve() not in linked] == []
    assert len(carried_pages()) > 8 and set(carried_pages()) <= {page.name for page in PAGES}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_a_page_begins_with_its_one_title(path):
    headings = [token for token in tokens(path) if token.type == "heading_open"]
    assert headings[0].tag == "h1" and headings[0].map[0] == 0
    assert [heading.tag for heading in headings].count("h1") == 1


def test_files_that_pages_name_are_there():
    """In typewriter letters, from the project's folder; names in capitals stand for one of one's own."""
    named = {
        (path.name, part.content)
        for path in READ
        for part in parts(path)
        if part.type == "code_inline" and re.fullmatch(r"(?:fmu_src|scenarios|tests)/[\w./]+", part.content)
    }
    assert len(named) > 10
    missing = [(page, name) for page, name in named if not (PROJECT_ROOT / name).exists() and "NAME" not in name]
    assert not missing


def test_targets_that_pages_name_are_in_the_makefile():
    makefile = (PROJECT_ROOT / "Makefile").read_text()
    named = {
        found
        for path in READ
        for part in parts(path)
        if part.type == "code_inline"
        for found in re.findall(r"^make ([a-z-]+)$", part.content)
    }
    assert {"run", "test", "build", "bench", "hosts"} <= named
    missing = [target for target in named if not re.search(rf"^{target}:", makefile, re.MULTILINE)]
    assert not missing


def test_each_target_says_what_it_takes():
    """Every target of the Makefile has its line in building.md, with a time and what it downloads."""
    text = (FOLDER / "building.md").read_text(encoding="utf-8")
    described = set(re.findall(r"^\| `make ([\w-]+)` \|[^|]+\|[^|]+\|[^|]+\|$", text, re.MULTILINE))
    targets = set(re.findall(r"^([\w-]+):.*## ", (PROJECT_ROOT / "Makefile").read_text(), re.MULTILINE))
    assert described == targets - {"help"}


# ---- claims ------------------------------------------------------------------------------------


def test_python_example_runs_without_a_word(beside_the_build: Path):
    text = (FOLDER / "connecting.md").read_text(encoding="utf-8")
    program = block_with(text, "simulate_fmu", "python") + (
        "\nassert abs(result['ground.x'][-1] - 0.1669) < 1e-4"
        # fmpy passes over unknown ones
        "\nassert {*result.dtype.names} == {'time', 'ground.x', 'ground.y', 'tip.angle'}"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=beside_the_build, capture_output=True, text=True, check=True
    )
    assert run.stdout + run.stderr == ""


def test_the_coupling_table_is_its_figure():
    """Both show what was measured; tests/scenarios holds the figure's numbers against a run."""
    description = etree.parse(FOLDER / "speed_vs_error.svg").find(".//{http://purl.org/dc/elements/1.1/}description")
    drawn = json.loads(description.text)
    text = (FOLDER / "connecting.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\|.+\| ([\d.e-]+) mm \| ([\d.e-]+) mm \| (\d) \|$", text, re.MULTILINE)
    assert len(rows) == len(drawn["position_m"]) == 6
    for (at_1_ms, at_10_ms, _), (rung, errors) in zip(rows, drawn["position_m"].items(), strict=True):
        for written, step in ((at_1_ms, 1.0), (at_10_ms, 10.0)):
            assert float(written) == pytest.approx(1e3 * errors[drawn["steps_ms"].index(step)], rel=5e-3), rung


def test_every_generated_table_is_on_one_page():
    marks = [name for page in PAGES for name in re.findall(r"<!-- generated: (\w+) from", page.read_text("utf-8"))]
    assert sorted(marks) == sorted(TABLES)


def test_what_is_produced_has_a_line():
    """build/README.md names each FMU and archive that is there, and each folder of reports that a scenario writes."""
    text = (PROJECT_ROOT / "build" / "README.md").read_text(encoding="utf-8")
    made = [path.relative_to(PROJECT_ROOT / "build") for path in (PROJECT_ROOT / "build").glob("*/*.fmu")]
    made += [path.relative_to(PROJECT_ROOT / "build") for path in (PROJECT_ROOT / "build").glob("*.ssp")]
    assert len(made) > 5
    for path in made:
        assert f"`{path.as_posix()}`" in text or f"`{path.parent.as_posix()}/*{path.suffix}`" in text, path


# ---- how pages become the FMU's documentation ---------------------------------------------------


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.setattr(documentation, "FOLDER", tmp_path)
    return tmp_path


def test_links_of_carried_pages(folder):
    (folder / "index.md").write_text("# I\n\n[a](one.md), [b](two.md#x-y), [c](https://d), [e](../f.h), [g](#i)\n")
    page = read_page("index.md", ["index.md", "one.md"])
    assert '<a href="one.html">a</a>, b, <a href="https://d">c</a>, e, <a href="#i">g</a>' in page.body
    assert page.links == ("one.md", "two.md") and page.title == "I"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("no title\n", "title"),
        ("# T\n\n<div>x</div>\n", "HTML"),
        ("# T\n\ntext <b>x</b>\n", "HTML"),
        ("# T\n\n![p](gone.svg)\n", "gone.svg"),
        ("# T\n\n[p](gone.md)\n", "gone.md"),
    ],
)
def test_what_cannot_be_carried_is_refused(folder, text, problem):
    (folder / "index.md").write_text(text)
    with pytest.raises(DocumentationError, match=problem):
        [read_page(name, ()) for name in carried_pages()]


def test_anchors_are_those_of_github():
    """Lower case, without punctuation, words joined by hyphens; a repeated heading is numbered."""
    assert anchors(["What `x.y` is, in mm", "A  B", "a b", "a b", "Übung_1"]) == [
        "what-xy-is-in-mm", "a--b", "a-b", "a-b-1", "übung_1",
    ]  # fmt: skip


def test_marks_of_generated_tables(interface):
    marked = "a\n<!-- generated: interface from x -->\nSTALE\n<!-- end of interface -->\nb\n"
    made = with_tables(marked, interface)
    assert made.startswith("a\n<!--") and made.endswith("-->\nb\n") and "STALE" not in made
    assert with_tables(made, interface) == made
    assert all(f"`{variable.name}`" in made for variable in interface.variables)
    for wrong in (marked.replace("end of interface", "end of it"), marked.replace("interface", "face")):
        with pytest.raises(ValueError, match=r"partner|no such table"):
            with_tables(wrong, interface)
