"""What the FMU tells people and hosts about itself: documentation, icons, terminals."""

from __future__ import annotations

import io
import re
import struct
import zipfile

import pytest
from lxml import etree, html
from PIL import Image

from fmu_src.exporter import documentation, icons
from fmu_src.exporter.documentation import PIECES, DocumentationError, introduction, pieces
from fmu_src.exporter.icons import same_picture
from fmu_src.exporter.model_description import FMI3
from fmu_src.exporter.terminals import SCHEMA
from tests.conftest import PROJECT_ROOT

PAGES = ("index.html", "fmi-ls-ref.html")


@pytest.fixture(scope="module")
def content(fmi, fmu_files) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu_files[fmi]) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def page(content) -> etree._Element:
    return html.document_fromstring(content["documentation/index.html"])


# ---- the page ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PAGES)
def test_it_needs_nothing_else(content, name):
    """No script, no style sheet, no picture from elsewhere; its links lead to what is in the FMU, or to the paper."""
    root = html.document_fromstring(content[f"documentation/{name}"])
    assert not list(root.iter("script", "link", "img", "iframe", "object"))
    assert b"url(" not in content[f"documentation/{name}"] and b"@import" not in content[f"documentation/{name}"]
    for link in root.iter("a"):
        target = link.get("href")
        assert target.startswith("https://doi.org/") or f"documentation/{target}" in content, target


def test_every_variable_is_listed(page, interface):
    rows = {row[1].text_content(): [cell.text_content() for cell in row] for row in page.iter("tr") if len(row) == 6}
    for v in interface.variables:
        assert rows[v.name][0] == str(v.value_reference) and rows[v.name][5] == v.text
    assert len(rows) == 1 + len(interface.variables), "and the line of headings"


def test_it_shows_the_mechanism_and_says_what_it_should(page, fmi):
    (svg,) = page.iter("svg")
    assert len(list(svg.iter("polygon"))) == 2
    headings = [heading.text for heading in page.iter("h2")]
    assert headings[: len(PIECES)] == list(PIECES)
    assert {"Interface", "Terminals", "Check your host", "The published planting cycle", "Licence"} <= set(headings)
    said = " ".join(page.text_content().split())
    assert "FMI 2.0 and 3.0, co-simulation and Model Exchange" in said
    assert f"this file is for FMI {fmi}.0, co-simulation and Model Exchange" in said
    assert "334.65 mm" in said and re.search(r"\d+ agree, \d+ differ, \d+ are not determined", said)
    assert "**" not in said and "](" not in said, "Markdown left over"


def test_pieces():
    """By heading or bold beginning, to the next of either; links to files of the project lose their target."""
    text = "# T\n\nno\n" + "".join(
        f"\n## {name}\n\ntext of {name}\n" if k % 2 else f"\n**{name}.** text of {name}, [a](b.md), [c](https://d)\n"
        for k, name in enumerate(PIECES)
    ) + "\n## The house\n\nnot this\n"  # fmt: skip
    found = pieces(text)
    assert list(found) == list(PIECES)
    for k, name in enumerate(PIECES):
        assert found[name] == f"text of {name}" + ("" if k % 2 else ", a, [c](https://d)")
    with pytest.raises(DocumentationError, match="Limits"):
        pieces(text.replace("Limits", "Borders"))


def test_what_a_figure_says_goes_with_it():
    """The pictures of README.md are not in the FMU."""
    text = "".join(f"## {name}\n\nbefore\n\n![alt](a/b.svg)\n\nThe figure is\nthis. after\n\n" for name in PIECES)
    assert set(pieces(text).values()) == {"before\n\nafter"}


def test_introduction():
    assert introduction("# Title\n\nSome [text](https://d),\n[here](e.md).\n\n![f](g)\n") == (
        "Some [text](https://d),\nhere."
    )
    with pytest.raises(DocumentationError, match="title"):
        introduction("no title\n\ntext\n\n")


def test_without_the_readme_the_description_of_the_distribution_serves(monkeypatch, tmp_path, interface):
    """As after `pip install`: the page is made from the copy there."""
    monkeypatch.setattr(documentation, "README", tmp_path / "README.md")
    assert b"What to connect" in documentation.documentation_content(interface, FMI3)["documentation/index.html"]


def test_experiments_page(content, interface):
    text = content["documentation/fmi-ls-ref.html"].decode()
    for of in documentation.definitions(interface):
        assert of.name in text and of.description.partition("'")[0] in text


# ---- icons ---------------------------------------------------------------------------------------


def test_icons(content, fmi):
    """PNG beside each SVG, square, transparent where nothing is drawn; at the top in FMI 2.0 alone."""
    png = [name for name in content if name.endswith(".png")]
    assert "terminalsAndIcons/icon.png" in png and ("model.png" in png) == (fmi == 2)
    assert content.get("model.png") in (None, content["terminalsAndIcons/icon.png"])
    for name in png:
        width, height = struct.unpack_from(">II", content[name], 16)
        assert content[name][:8] == b"\x89PNG\r\n\x1a\n" and width == height >= 32
        assert Image.open(io.BytesIO(content[name])).convert("RGBA").getpixel((0, 0))[3] == 0
        if name != "model.png":
            root = etree.fromstring(content[name.replace(".png", ".svg")])
            assert root.tag == "{http://www.w3.org/2000/svg}svg" and float(root.get("width")) * 2 == width


def test_a_changed_picture_is_seen():
    size, strokes = icons.icons()["point"]
    one = icons.png(size, strokes)
    recompressed = io.BytesIO()
    Image.open(io.BytesIO(one)).save(recompressed, "PNG", compress_level=1)
    assert recompressed.getvalue() != one and same_picture(one, recompressed.getvalue())
    assert not same_picture(one, icons.png(size, strokes[:-1]))
    assert not same_picture(one, icons.png(size + 1, strokes))


# ---- terminals -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def terminals(content) -> dict[str, etree._Element]:
    root = etree.fromstring(content["terminalsAndIcons/terminalsAndIcons.xml"])
    etree.XMLSchema(etree.parse(str(SCHEMA))).assertValid(root)
    return {terminal.get("name"): terminal for terminal in root.iter("Terminal")}


def test_members(terminals, interface):
    """Each input and output with a group is in one terminal, under the last part of its name."""
    found = {}
    for name, terminal in terminals.items():
        for member in terminal.iter("TerminalMemberVariable"):
            assert member.get("variableName") == f"{name}.{member.get('memberName')}"
            assert member.get("variableName") not in found
            found[member.get("variableName")] = member.get("variableKind")
    connectable = {v.name for v in interface.variables if v.kind in ("input", "output")}
    assert set(found) == connectable - {"assembly.margin"}
    assert {name for name, kind in found.items() if kind != "signal"} == {"crank.tau"}


def test_the_crank_is_a_flange(terminals):
    """Members as Modelica names a shaft's; the torque is positive where it acts on the linkage."""
    crank = terminals["crank"]
    assert crank.get("terminalKind") == "Modelica.Mechanics.Rotational.Interfaces.Flange_a"
    kinds = {m.get("memberName"): m.get("variableKind") for m in crank.iter("TerminalMemberVariable")}
    assert kinds == {"phi": "signal", "w": "signal", "a": "signal", "tau": "inflow"}


def test_torque_flows_in(new):
    """What "inflow" says: the power tau w that enters at the crank is what the tip does against the soil."""
    instance = new().setup().enter().set({"crank.phi": 1.0, "crank.w": 2.0, "tip.fx": -30.0, "tip.fy": 80.0})
    tau, vx, vy = instance.get("crank.tau", "tip.vx", "tip.vy")
    assert tau * 2.0 == pytest.approx(30.0 * vx - 80.0 * vy, rel=1e-13)


def test_terminals_are_drawn(terminals, content):
    for terminal in terminals.values():
        (drawn,) = terminal.iter("TerminalGraphicalRepresentation")
        assert f"terminalsAndIcons/{drawn.get('iconBaseName')}.png" in content
        assert all(abs(float(drawn.get(name))) <= 110 for name in ("x1", "y1", "x2", "y2"))


def test_licence(content):
    assert content["documentation/licenses/license.txt"] == (PROJECT_ROOT / "LICENSE").read_bytes()
