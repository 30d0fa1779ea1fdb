"""What the user does in the page, and what comes of it: in Chromium, with pointer and keyboard."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv
from lxml import etree

from fmu_src.interface import Interface
from tests.explorer.conftest import settled, until

SSV_SCHEMA = Path(fmpy.__file__).parent / "ssp" / "schema" / "SystemStructureParameterValues.xsd"


def type_into(page: Any, name: str, text: str) -> None:
    field = page.locator(f"[data-field='{name}']")
    field.fill(text)
    field.press("Enter")
    settled(page)


def shown(page: Any, key: str) -> float:
    """A figure of the present design as the table has it, SI, from its attribute."""
    return float(page.locator(f"#figures tr[data-figure={key}] td").first.get_attribute("data-value"))


def choose(page: Any, name: str) -> None:
    page.locator("#preset").select_option(name)
    settled(page)


def design(page: Any, interface: Interface) -> dict[str, float]:
    names = [v.name for v in interface.of_kind("parameter") if v.name.startswith("geometry.")]
    return {
        name: page.evaluate("(name) => window.explorer.get(name)", name)
        for name in [*names, "crank.w", "plant.spacing", "ridge.depth"]
    }


# ---- each parameter by its control -----------------------------------------------------------


@pytest.fixture
def version() -> int:
    return 3


def test_each_control_by_its_number(page, new, interface):
    """One after the other: the pose of the page has the native FMU's bits, the figures change, undo takes it back."""
    native = new().setup().enter()
    before = page.evaluate("window.explorer.figures()")
    outputs = [v.name for v in interface.of_kind("output")]
    for row in page.locator("[data-control^='geometry.']").all():
        name = row.get_attribute("data-control")
        start = interface[name].start
        text = row.locator("input[type=text]").input_value()
        changed = f"{float(text) * 1.01:.2f}"
        type_into(page, name, changed)
        value = page.evaluate("(name) => window.explorer.get(name)", name)
        assert value == pytest.approx(start * 1.01, abs=2e-4) and value != start
        native.set({name: value, "crank.phi": 2.5, "crank.w": page.evaluate("window.explorer.get('crank.w')"),
                    "machine.v": page.evaluate("window.explorer.get('machine.v')"),
                    "machine.s": 0.4 * 2.5 / (2 * math.pi)})  # fmt: skip
        pose = page.evaluate("window.explorer.pose(2.5)")
        assert [pose[output] for output in outputs] == list(native.get(*outputs)), name
        figures = page.evaluate("window.explorer.figures()")
        assert any(figures[key] != before[key] for key in figures), name
        assert shown(page, "height") == figures["height"]
        native.set({name: start})
        page.locator("#undo").click()
        settled(page)
        assert row.locator("input[type=text]").input_value() == text
        assert page.evaluate("window.explorer.figures()") == before


def test_rate_spacing_and_depth(page):
    before = page.evaluate("window.explorer.figures()")
    type_into(page, "crank.w", "130")
    assert shown(page, "peak_acceleration") == pytest.approx(4 * before["peak_acceleration"], rel=1e-12)
    type_into(page, "crank.w", "65")
    type_into(page, "plant.spacing", "300")
    assert shown(page, "hole") != before["hole"] and shown(page, "height") == pytest.approx(before["height"], rel=1e-12)
    type_into(page, "plant.spacing", "400")
    type_into(page, "ridge.depth", "50")
    assert shown(page, "swept") < before["swept"]


def test_theta41_moves_phi4(page):
    type_into(page, "theta41", "180")
    assert page.locator("[data-field='geometry.phi4']").input_value() == "301"
    assert page.locator("[data-field='geometry.phi1']").input_value() == "121"


def test_the_ridge_may_stay_in_the_machine(page):
    before = shown(page, "hole")
    page.locator("#surface-held").check()
    settled(page)
    assert shown(page, "hole") == pytest.approx(before, abs=1e-6)
    level = page.evaluate("window.explorer.get('ridge.y')")
    type_into(page, "geometry.L1", "52")
    assert page.evaluate("window.explorer.get('ridge.y')") == level
    assert (
        page.locator("[data-control='ridge.depth']").is_hidden()
        and page.locator("[data-control='ridge.y']").is_visible()
    )


def test_a_slider_is_one_step_of_the_history(page):
    slider = page.locator("[data-slider='geometry.L1']")
    box = slider.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, middle)
    page.mouse.down()
    for share in (0.55, 0.6, 0.62):
        page.mouse.move(box["x"] + box["width"] * share, middle)
        settled(page)
    page.mouse.up()
    settled(page)
    moved = page.evaluate("window.explorer.get('geometry.L1')")
    assert 0.052 < moved < 0.062
    page.keyboard.press("Control+z")
    settled(page)
    assert page.evaluate("window.explorer.get('geometry.L1')") == 0.05
    assert page.locator("#undo").is_disabled()
    page.keyboard.press("Control+Shift+z")
    settled(page)
    assert page.evaluate("window.explorer.get('geometry.L1')") == moved


def test_a_slider_by_keys(page):
    slider = page.locator("[data-slider='geometry.L4']")
    slider.focus()
    slider.press("ArrowRight")
    slider.press("Shift+ArrowLeft")
    settled(page)
    assert page.locator("[data-field='geometry.L4']").input_value() == "18.9"


@pytest.mark.parametrize(
    ("text", "words"), [("", "no number"), ("five", "no number"), ("1e12", "must be from"), ("-5", "must be from")]
)
def test_what_is_no_value(page, text, words):
    type_into(page, "geometry.L2", text)
    assert words in page.locator("#message").inner_text()
    assert page.evaluate("window.explorer.get('geometry.L2')") == 0.105


def test_derivatives_say_which_way_helps(page):
    page.locator("#goal").select_option("swept")
    settled(page)
    by = page.evaluate("window.explorer.gradients().swept")
    for name in ("geometry.L1", "geometry.L4", "plant.spacing"):
        cell = page.locator(f"[data-slope='{name}']")
        assert float(cell.get_attribute("data-value")) == by[name]
        assert ("helps-less" if by[name] > 0 else "helps-more") in cell.get_attribute("class")
    page.locator("#aim").select_option("1")
    assert ("helps-more" if by["geometry.L1"] > 0 else "helps-less") in page.locator(
        "[data-slope='geometry.L1']"
    ).get_attribute("class")


# ---- the crank -------------------------------------------------------------------------------


def crank_degrees(page: Any) -> float:
    return float(page.locator("#phi").input_value())


def test_the_crank_is_dragged(page):
    """Clockwise is the working direction; the drawing follows, and the cursor of the curves."""
    box = page.locator("#crank-handle circle").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    cursor = page.locator("#speed .cursor").get_attribute("d")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 25, y - 5)
    settled(page)
    page.mouse.up()
    assert 5 < crank_degrees(page) < 90
    assert page.locator("#speed .cursor").get_attribute("d") != cursor
    page.mouse.move(x + 60, y)  # let go: it stays
    settled(page)
    here = crank_degrees(page)
    page.mouse.move(x, y)
    settled(page)
    assert crank_degrees(page) == here


def test_the_crank_by_keys(page):
    handle = page.locator("#crank-handle")
    handle.focus()
    for key in ("ArrowRight", "ArrowRight", "PageUp", "ArrowLeft"):
        handle.press(key)
    settled(page)
    assert crank_degrees(page) == 11 and handle.get_attribute("aria-valuenow") == "11"
    handle.press("Home")
    settled(page)
    assert crank_degrees(page) == 0


def test_it_plays_and_pauses(page):
    assert page.locator("#play").get_attribute("aria-pressed") == "false"  # the user wants no motion
    page.locator("#play").click()
    until(page, "Number(document.getElementById('phi').value) > 3")
    page.locator("#play").click()
    settled(page)
    here = crank_degrees(page)
    page.wait_for_timeout(100)
    assert crank_degrees(page) == here


def test_it_turns_from_the_start_where_motion_is_welcome(visit):
    page = visit(reduced_motion="no-preference")
    until(page, "Number(document.getElementById('phi').value) > 3")


def test_the_joints_drawn_are_where_the_links_put_them(page, interface):
    """Each link has its length in the drawing: no joint is made up."""
    page.evaluate("window.explorer.set({'geometry.L5': 0.25, 'geometry.theta3': 0.6})")
    slider = page.locator("#phi")
    slider.fill("123")
    settled(page)
    at = page.evaluate("""() => Object.fromEntries([...document.querySelectorAll('#machine .joint')].map((mark) => {
        const [x, y] = mark.getAttribute('transform').match(/-?[\\d.]+/g).map(Number);
        return [mark.querySelector('text').textContent, [x, -y]];
    }))""")
    lengths = {
        "OA": "L1",
        "AB": "L2",
        "DB": "L3",
        "CD": "L4",
        "DE": "L5",
        "EF": "L6",
        "GF": "L7",
        "HI": "L8",
        "IJ": "L9",
    }
    for link, name in lengths.items():
        length = math.dist(at[link[0]], at[link[1]])
        assert length == pytest.approx(
            page.evaluate("(n) => 1e3 * window.explorer.get(n)", f"geometry.{name}"), abs=0.05
        ), link


# ---- presets, variants -----------------------------------------------------------------------


def figures_of_variants(page: Any, key: str) -> list[float]:
    return [float(cell.get_attribute("data-value")) for cell in page.locator(f"#variants td[data-figure={key}]").all()]


def test_the_papers_sentence(page):
    """Section 4 and 6 (2): L1 up, higher; L4 up, higher and smaller hole; L7, the nozzle's posture; theta41, height."""
    choose(page, "geometry.L1")
    heights = figures_of_variants(page, "height")
    assert len(heights) >= 5 and np.all(np.diff(heights) > 0.005)
    choose(page, "geometry.L4")
    heights, holes = figures_of_variants(page, "height"), figures_of_variants(page, "hole")
    assert np.all(np.diff(heights) > 0.005) and np.all(np.diff(holes) < 0)
    assert "L4 = 36 mm makes no whole turn" in page.locator("#preset-hint").inner_text()
    choose(page, "geometry.L7")
    leans = figures_of_variants(page, "lean")
    assert np.all(np.diff(leans) > 0) or np.all(np.diff(leans) < 0)
    heights = figures_of_variants(page, "height")
    slope = np.ptp(heights) / 0.025
    assert slope < 2  # little beside L1 and L4, some 5 mm per mm
    choose(page, "theta41")
    assert len(figures_of_variants(page, "height")) == 6 and np.ptp(figures_of_variants(page, "height")) > 0.1
    for name, text in (("geometry.L1", "48"), ("geometry.L4", "20"), ("theta41", "185"), ("geometry.L7", "255")):
        before = page.evaluate("window.explorer.figures()")
        type_into(page, name, text)
        after = page.evaluate("window.explorer.figures()")
        assert (
            after["height"] != before["height"] and after["lean"] != before["lean"] and after["hole"] != before["hole"]
        )


def test_variants_are_kept_overlaid_and_named(page):
    type_into(page, "geometry.L1", "55")
    page.locator("#variant-name").fill("long crank")
    page.locator("#keep").click()
    type_into(page, "geometry.L1", "50")
    assert page.locator("#machine .variant title").all_text_contents() == ["long crank"]
    height = figures_of_variants(page, "height")
    assert height[0] > shown(page, "height")
    name = page.get_by_label("name of long crank")
    name.fill("longer")
    name.press("Enter")
    settled(page)
    page.get_by_label("show longer").uncheck()
    settled(page)
    assert page.locator("#machine .variant").count() == 0 and page.locator("#variants tbody tr").count() == 1
    page.get_by_role("button", name="Use").click()
    settled(page)
    assert page.evaluate("window.explorer.get('geometry.L1')") == 0.055
    page.get_by_label("drop longer").click()
    settled(page)
    assert page.locator("#variants").is_hidden()


# ---- a design that cannot close --------------------------------------------------------------


def test_an_impossible_design(page):
    last = page.evaluate("window.explorer.figures()")
    path = page.locator("#machine .tip-path").get_attribute("d")
    type_into(page, "geometry.L1", "80")
    text = page.locator("#notice").inner_text()
    assert "dyad ABD" in text and "mm too far apart" in text and "329° of the crank" in text
    assert page.locator("#machine .tip-path").get_attribute("d") == path
    assert "stale" in page.locator("body").get_attribute("class")
    with pytest.raises(Exception, match="does not close"):
        page.evaluate("window.explorer.figures()")
    page.locator("#back").click()
    settled(page)
    assert page.locator("#notice").is_hidden() and page.evaluate("window.explorer.figures()") == last


def test_the_nearest_that_closes(page):
    type_into(page, "geometry.L1", "80")
    page.locator("#nearest").click()
    settled(page)
    reached = page.evaluate("window.explorer.get('geometry.L1')")
    assert 0.06 < reached < 0.08 and page.locator("#notice").is_hidden()
    assert page.evaluate("window.explorer.figures().margin") < 0.1  # beside the dead point, as near as it can be
    type_into(page, "geometry.L1", f"{1e3 * reached + 0.3:.3f}")
    assert page.locator("#notice").is_visible()


# ---- what is taken away opens again ----------------------------------------------------------

CHANGES = {"geometry.L1": 0.0521, "geometry.phi4": 5.3, "plant.spacing": 0.35, "ridge.depth": 0.09, "crank.w": 7.0}


def saved(page: Any, selector: str, folder: Path) -> Path:
    with page.expect_download() as event:
        page.locator(selector).click()
    place = folder / event.value.suggested_filename
    event.value.save_as(place)
    return place


SELECTORS = {"ssv": "[data-save=ssv]", "json": "[data-save=json]", "csv": "[data-save=csv]", "dxf": "[data-save=dxf]",
             "machine": "[data-svg=machine]", "ground": "[data-svg=ground]", "speed": "[data-svg=speed]"}  # fmt: skip


@pytest.mark.parametrize("kind", SELECTORS)
def test_every_download_opens_again(visit: Callable[..., Any], interface, tmp_path, kind):
    """In another page the design has the same values and figures, to the bit."""
    first = visit()
    first.evaluate("(values) => window.explorer.set(values)", CHANGES)
    settled(first)
    place = saved(first, SELECTORS[kind], tmp_path)
    second = visit()
    second.locator("#open").set_input_files(place)
    until(second, "document.getElementById('message').textContent.includes('is open')")
    assert design(second, interface) == design(first, interface) | CHANGES
    assert second.evaluate("window.explorer.figures()") == first.evaluate("window.explorer.figures()")


def test_a_link_carries_the_design(visit, interface):
    first = visit()
    first.evaluate("(values) => window.explorer.set(values)", CHANGES)
    first.locator("#link").click()
    until(first, "location.hash.length > 1")
    second = visit(first.evaluate("location.hash"))
    assert design(second, interface) == design(first, interface)


def test_variants_travel_with_the_json(visit, tmp_path):
    first = visit()
    first.locator("#preset").select_option("geometry.L1")
    settled(first)
    place = saved(first, "[data-save=json]", tmp_path)
    second = visit()
    second.locator("#open").set_input_files(place)
    until(second, "document.querySelectorAll('#variants tbody tr').length > 4")
    assert figures_of_variants(second, "height") == figures_of_variants(first, "height")


def test_the_ssv_is_one(page, interface, tmp_path):
    """Valid by the standard's schema: each parameter that shapes the motion, with the value that the FMU takes."""
    page.evaluate("(values) => window.explorer.set(values)", CHANGES)
    settled(page)
    read = etree.parse(saved(page, SELECTORS["ssv"], tmp_path))
    etree.XMLSchema(etree.parse(SSV_SCHEMA)).assertValid(read)
    values = {p.get("name"): (float(p[0].get("value")), p[0].get("unit")) for p in read.iter("{*}Parameter")}
    assert set(values) == {name for output in interface.of_kind("output") for name in output.initially}
    assert values["geometry.L1"] == (0.0521, "m") and values["geometry.theta9"] == (
        interface["geometry.theta9"].start,
        "rad",
    )


def test_the_csv_has_every_digit(page, tmp_path):
    """As fmpy reads tables; the rows are the poses, to the bit."""
    place = saved(page, SELECTORS["csv"], tmp_path)
    table = read_csv(str(place))
    rows = list(csv.DictReader(io.StringIO(place.read_text())))
    assert len(table) == len(rows) == 721
    for k in (0, 100, 500):
        pose = page.evaluate("(phi) => window.explorer.pose(phi)", float(rows[k]["crank.phi"]))
        assert all(float(rows[k][name]) == value for name, value in pose.items() if name != "machine.s")
        assert table["tip.x"][k] == pose["tip.x"]


def test_the_dxf_has_lengths_and_pivots(page, tmp_path):
    """Read by a library for DXF: each link a line of its length, in mm; pivots where they are."""
    document = ezdxf.readfile(saved(page, SELECTORS["dxf"], tmp_path))
    assert not document.audit().errors
    lines = {line.dxf.layer: (line.dxf.end - line.dxf.start).magnitude for line in document.modelspace().query("LINE")}
    expected = {"OA": 50, "AB": 105, "DB": 105, "CD": 18, "DE": 240, "EF": 70, "GF": 250, "HI": 55, "IJ": 200}
    assert lines == pytest.approx(expected, abs=1e-5)
    pivots = {
        tuple(np.round(circle.dxf.center, 6))[:2] for circle in document.modelspace().query("CIRCLE[layer=='PIVOTS']")
    }
    assert pivots == {(0, 0), (115, -55), (107, -115)}
    texts = [text.dxf.text for text in document.modelspace().query("TEXT")]
    assert "L1 = 50" in texts and "C (115, -55)" in texts


def test_the_svg_is_a_drawing_by_itself(page, tmp_path):
    """No style or script of the page is needed: each mark has its colours; its size is in mm."""
    root = etree.parse(saved(page, SELECTORS["machine"], tmp_path)).getroot()
    assert root.get("width").endswith("mm") and not list(root.iter("{*}style", "{*}script"))
    paths = [path for path in root.iter("{*}path") if path.get("d")]
    assert len(paths) > 20 and all(path.get("stroke") for path in paths)
    assert all(not element.get("class") for element in root.iter())


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.json", "{", "no JSON"),
        ("a.json", "{}", "no design"),
        ("a.json", '{"format": "transplanter-linkage-design/1", "values": {"geometry.L1": "x"}}', "no number"),
        ("a.json", '{"format": "transplanter-linkage-design/1", "values": {"geometry.Q": 1}}', "no such quantity"),
        ("a.ssv", "<ParameterSet", "no XML"),
        ("a.ssv", "<other/>", "no ParameterSet"),
        ("a.svg", "<svg xmlns='http://www.w3.org/2000/svg'/>", "carries no design"),
        ("a.csv", "time,x\n0,1\n", "carries no design"),
        ("a.txt", "", "carries no design"),
    ],
)
def test_a_file_that_is_none(visit, tmp_path, name, text, words):
    visit.allowed.append("Applying inline style")  # Chromium's own message about broken XML has one
    page = visit()
    before = page.evaluate("window.explorer.figures()")
    (tmp_path / name).write_text(text)
    page.locator("#open").set_input_files(tmp_path / name)
    until(page, "document.getElementById('message').textContent !== ''")
    assert words in page.locator("#message").inner_text()
    assert page.evaluate("window.explorer.figures()") == before


def test_a_link_that_is_none(visit):
    page = visit("#geometry.L1=abc")
    assert "no number" in page.locator("#message").inner_text()


def test_an_ssv_of_a_system_opens(page, tmp_path):
    """Names with the component before them, parameters that the page has no control for."""
    (tmp_path / "row.ssv").write_text(
        '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" '
        'name="r"><ssv:Parameters>'
        '<ssv:Parameter name="linkage.geometry.L1"><ssv:Real value="0.053" unit="m"/></ssv:Parameter>'
        '<ssv:Parameter name="soil.k"><ssv:Real value="7"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
    )
    page.locator("#open").set_input_files(tmp_path / "row.ssv")
    until(page, "window.explorer.get('geometry.L1') === 0.053")


# ---- for all people --------------------------------------------------------------------------


def test_every_control_has_a_name(page):
    nameless = page.evaluate("""() => [...document.querySelectorAll(
            'button, input, select, [role=slider], [role=img], table')]
        .filter((element) => element.checkVisibility() && !(element.getAttribute('aria-label') || element.labels?.length
            || element.textContent.trim() || element.getAttribute('aria-labelledby')))
        .map((element) => element.outerHTML.slice(0, 90))""")
    assert [element for element in nameless if 'id="figures"' not in element] == []


def test_nothing_to_use_is_hidden_from_screen_readers(page):
    """What lies within an image or a hidden element is told by none of them: the crank's handle lies in a drawing."""
    hidden = page.evaluate("""() => [...document.querySelectorAll('button, input, select, a[href], [tabindex]')]
        .filter((element) => element.closest('[role=img], [aria-hidden=true]'))
        .map((element) => element.outerHTML.slice(0, 90))""")
    assert hidden == []
    assert page.get_by_role("slider", name="Crank OA", exact=True).count() == 1


def test_all_is_reached_by_keyboard(page):
    """Tab goes through everything and shows where it is."""
    seen = set()
    for _ in range(120):
        page.keyboard.press("Tab")
        found = page.evaluate("""() => {
            const element = document.activeElement;
            const style = getComputedStyle(element.id === 'crank-handle' ? element.firstElementChild : element);
            const {field, slider, save, svg} = element.dataset;
            return [element.id || field || slider || save || svg || element.tagName,
                    style.outlineStyle !== 'none' || style.strokeWidth === '5px'];
        }""")
        assert found[1] or found[0] == "BODY", found
        seen.add(found[0])
    assert {
        "tab-design",
        "preset",
        "geometry.L1",
        "goal",
        "crank-handle",
        "play",
        "phi",
        "keep",
        "csv",
        "open",
        "machine",
    } <= seen


def test_tabs_by_keys(page):
    page.locator("#tab-design").focus()
    page.keyboard.press("ArrowRight")
    assert page.locator("#page-coupling").is_visible() and page.locator("#page-design").is_hidden()
    assert page.evaluate("document.activeElement.id") == "tab-coupling"


@pytest.mark.parametrize("width", [360, 800, 1300, 2200])
def test_nothing_is_cut_off(visit, width):
    page = visit(viewport={"width": width, "height": 800})
    for tab in ("#tab-design", "#tab-coupling"):
        page.locator(tab).click()
        settled(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
