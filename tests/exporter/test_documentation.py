"""What the FMU tells people and hosts about itself: documentation, icons, terminals."""

from __future__ import annotations

import io
import posixpath
import struct
import zipfile

import pytest
from lxml import etree, html
from PIL import Image

from fmu_src.exporter import icons
from fmu_src.exporter.documentation import carried_pages, html_name
from fmu_src.exporter.icons import same_picture
from fmu_src.exporter.page import PAGE
from fmu_src.exporter.reference import definitions
from fmu_src.exporter.terminals import SCHEMA
from tests.conftest import PROJECT_ROOT


@pytest.fixture(scope="module")
def content(fmi, fmu_files) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu_files[fmi]) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def pages(content) -> dict[str, etree._Element]:
    """By name in documentation/, as a browser reads them."""
    return {
        name.removeprefix("documentation/"): html.document_fromstring(data.decode())
        for name, data in content.items()
        if name.startswith("documentation/") and name.endswith(".html") and name != f"documentation/{PAGE}"
    }


def said(page: etree._Element) -> str:
    """What a page says, in one line."""
    (main,) = page.iter("main")
    return " ".join(main.text_content().split())


# ---- the pages -----------------------------------------------------------------------------------


def test_they_are_those_that_the_first_one_links(pages):
    assert sorted(pages) == sorted(map(html_name, carried_pages()))
    linked = {link.get("href").partition("#")[0] for link in pages["index.html"].find(".//main").iter("a")}
    assert linked >= set(pages) - {"index.html"}


def test_they_need_nothing_else(pages, content):
    """No script, no style sheet, nothing from elsewhere; each link, anchor and picture is in the FMU, or a paper's."""
    anchors = {name: {e.get("id") for e in page.iter() if e.get("id")} for name, page in pages.items()}
    for name, page in pages.items():
        assert not list(page.iter("script", "link", "iframe", "object"))
        text = content[f"documentation/{name}"]
        assert b"url(" not in text and b"@import" not in text
        for link in page.iter("a"):
            target, _, fragment = link.get("href").partition("#")
            if target.startswith("https://"):
                continue
            target = target or name
            assert posixpath.normpath(f"documentation/{target}") in content, (name, target)
            assert not fragment or fragment in anchors[target], (name, target, fragment)
        for image in page.iter("img"):
            assert f"documentation/{image.get('src')}" in content and image.get("alt"), (name, image.get("src"))


def test_each_leads_to_all_others(pages):
    for name, page in pages.items():
        (nav,) = page.iter("nav")
        assert [link.get("href") for link in nav.iter("a")] == [html_name(page) for page in carried_pages()]
        (here,) = (link for link in nav.iter("a") if link.get("aria-current"))
        assert here.get("href") == name and here.text == page.find(".//h1").text == page.find(".//title").text


def test_they_are_the_pages_whole(pages):
    """Every word of a page's Markdown paragraphs is there, and no mark is left over."""
    for source in carried_pages():
        text = said(pages[html_name(source)]).replace("**kwargs", "")  # Python's, in an example
        for left_over in ("**", "](", "<!--", "generated:", "|---"):
            assert left_over not in text, (source, left_over)
        for line in (PROJECT_ROOT / "fmu_src" / "documentation" / source).read_text(encoding="utf-8").splitlines():
            if line.startswith("## "):
                assert line.removeprefix("## ").replace("`", "") in text, (source, line)


def test_pictures_are_carried_as_they_are(content):
    """Pictures of their own, without a script, that a browser shows in light and dark."""
    for name in ("linkage.svg", "speed_vs_error.svg"):
        data = (PROJECT_ROOT / "fmu_src" / "documentation" / name).read_bytes()
        assert content[f"documentation/{name}"] == data
        assert not list(etree.fromstring(data).iter("{http://www.w3.org/2000/svg}script"))


def test_the_drawing_names_every_parameter_of_the_geometry(content, interface):
    drawn = etree.fromstring(content["documentation/linkage.svg"])
    texts = [text.text for text in drawn.iter("{http://www.w3.org/2000/svg}text")]
    for name in interface.geometry:
        assert texts.count(name) == 1, name
    assert {"x, forward", "y, up", "100 mm", "working direction"} <= set(texts)


def test_every_variable_is_listed(pages, interface):
    rows = {
        row[1].text_content(): [cell.text_content() for cell in row]
        for row in pages["interface.html"].iter("tr")
        if len(row) == 6
    }
    for v in interface.variables:
        assert rows[v.name][0] == str(v.value_reference) and rows[v.name][5] == v.text
    assert len(rows) == 1 + len(interface.variables), "and the line of headings"


def test_they_say_what_they_should(pages, fmi):
    first = said(pages["index.html"])
    assert "an FMU for FMI 2.0 and 3.0, co-simulation and Model Exchange" in first
    assert f"for FMI {fmi}.0, co-simulation and Model Exchange." in first, "this very file"
    assert "334.65 mm" in said(pages["published_cycle.html"])
    assert "BSD-2-Clause" in first


def test_experiments_page(pages, interface):
    text = said(pages["reference_results.html"])
    for of in definitions(interface):
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
    assert kinds == {
        "phi": "signal",
        "w": "signal",
        "a": "signal",
        "tau": "inflow",
        "inertia": "signal",
        "tau_bias": "signal",
    }


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
