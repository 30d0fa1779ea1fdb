"""The page as a file: one, small, asking for nothing; made from interface.toml and modules that fit together."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from lxml import html

from fmu_src import cli
from fmu_src.exporter.page import FOLDER, LARGEST, PAGE, PageError, page_of, script, with_design
from scenarios.paper_cycle.families import FAMILIES
from tests.conftest import BOTH_VERSIONS, PROJECT_ROOT
from tests.explorer.conftest import until


@pytest.fixture(scope="module")
def content(fmu_files: dict[int, Path]) -> bytes:
    return page_of(fmu_files[3])


@BOTH_VERSIONS
def test_it_is_in_each_fmu_and_linked(fmu_files, version, content):
    assert page_of(fmu_files[version]) == content == (PROJECT_ROOT / "build" / PAGE).read_bytes()
    with zipfile.ZipFile(fmu_files[version]) as archive:
        index = html.document_fromstring(archive.read("documentation/index.html").decode())
    assert PAGE in [link.get("href") for link in index.iter("a")]


def test_it_is_one_small_file_that_asks_for_nothing(content):
    assert len(content) <= LARGEST
    read = html.document_fromstring(content.decode())
    assert not list(read.iter("link", "img", "iframe", "object", "base", "form"))
    assert not any(element.get("src") for element in read.iter())
    written = re.findall(rb"https?://[\w./-]+", content)
    assert {url.split(b"/")[2] for url in written} <= {b"www.w3.org", b"ssp-standard.org"}  # namespaces, never fetched
    code = re.sub(rb"/\*\*.*?\*/", b"", content, flags=re.DOTALL)  # without its types, which name modules
    assert not re.search(rb"\b(fetch|import|XMLHttpRequest|WebSocket|EventSource|sendBeacon)\(", code)


def test_its_policy_allows_its_own_script_and_style_alone(content):
    read = html.document_fromstring(content.decode())
    (policy,) = read.xpath("//meta[@http-equiv='Content-Security-Policy']/@content")
    assert "default-src 'none'" in policy and "connect-src" not in policy
    for element in (*read.iter("style"), *read.xpath("//script[@type='module']")):
        digest = hashlib.sha256(element.text.encode()).digest()
        assert re.search(rf"'sha256-{re.escape(__import__('base64').b64encode(digest).decode())}'", policy)


def test_presets_are_the_families_of_the_cycle():
    """The scenarios may not read the page's file, nor it theirs: they are held together here."""
    published = json.loads((FOLDER / "published.json").read_text(encoding="utf-8"))
    ours = [
        (f["figure"], f["name"].removeprefix("geometry."), f["title"], tuple(f["values"]))
        for f in published["families"]
    ]
    assert ours == [(f.figure, f.symbol, f.title, f.values) for f in FAMILIES]


# ---- the maker -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("files", "problem"),
    [
        ({"main.js": 'import { a } from "./gone.js";\n'}, "main.js imports gone.js"),
        (
            {"main.js": 'import { a } from "./b.js";\n', "b.js": 'import { c } from "./main.js";\n'},
            "import one another",
        ),
        (
            {"main.js": 'import { a } from "./b.js";\nconst x = 1;\n', "b.js": "export const a = 1;\nconst x = 2;\n"},
            "declares x",
        ),
        ({"main.js": 'import { a } from "./b.js";\nlet [y, x] = [];\n', "b.js": "function x() {}\n"}, "declares x"),
        ({"main.js": "export default 1;\n"}, "another form"),
        ({"main.js": 'import * as b from "./b.js";\n', "b.js": ""}, "another form"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_modules_that_do_not_fit_are_refused(tmp_path, files, problem):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(PageError, match=problem):
        script(tmp_path)


def test_modules_stand_behind_those_that_they_import(tmp_path):
    (tmp_path / "main.js").write_text('import { b } from "./b.js";\nimport {\n  c,\n} from "./c.js";\nb(c);\n')
    (tmp_path / "b.js").write_text('import { c } from "./c.js";\nexport function b() {}\n')
    (tmp_path / "c.js").write_text("// @ts-check\nexport const c = 1;\n")
    assert script(tmp_path) == "// ---- c.js\nconst c = 1;\n\n// ---- b.js\nfunction b() {}\n\n// ---- main.js\nb(c);\n"


# ---- the command -----------------------------------------------------------------------------


@pytest.fixture
def opened(monkeypatch) -> list[str]:
    """What the command gives to the browser."""
    addresses: list[str] = []
    monkeypatch.setattr(cli.webbrowser, "open", lambda address: addresses.append(address) or True)
    return addresses


def test_explore_opens_the_page(opened, content, capsys):
    assert cli.main(["explore"]) == 0
    assert capsys.readouterr().out.split() == opened
    assert Path(opened[0].removeprefix("file://")).read_bytes() == content


def test_explore_an_fmu(opened, fmu_file, content):
    assert cli.main(["explore", str(fmu_file)]) == 0
    assert Path(opened[0].removeprefix("file://")).read_bytes() == content


def test_explore_a_parameter_set(opened, content, tmp_path):
    place = tmp_path / "mine.ssv"
    place.write_text("<a>ü</script></a>", encoding="utf-8")
    assert cli.main(["explore", str(place)]) == 0
    written = Path(opened[0].removeprefix("file://")).read_bytes()
    read = html.document_fromstring(written.decode())
    (given,) = read.xpath("//script[@id='given']")
    assert json.loads(given.text) == {"name": "mine.ssv", "text": "<a>ü</script></a>"}
    assert written == with_design(content, place)


def test_explore_without_a_browser(monkeypatch, capsys):
    monkeypatch.setattr(cli.webbrowser, "open", lambda address: False)
    assert cli.main(["explore"]) == 0
    said = capsys.readouterr()
    assert "no browser" in said.err and said.out.startswith("file://")


@pytest.mark.parametrize("name", ["gone.ssv", "binary.ssv", "other.fmu", "empty.fmu"])
def test_explore_what_is_none(opened, tmp_path, capsys, name):
    (tmp_path / "binary.ssv").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "other.fmu").write_bytes(b"no archive")
    with zipfile.ZipFile(tmp_path / "empty.fmu", "w"):
        pass
    assert cli.main(["explore", str(tmp_path / name)]) == 1
    assert name in capsys.readouterr().err and not opened


# ---- another interface -----------------------------------------------------------------------


@pytest.fixture
def other_page(project_copy: Path) -> Path:
    """The page of a project to whose interface a parameter was added, which the tip depends on."""
    file = project_copy / "fmu_src" / "interface.toml"
    text = file.read_text(encoding="utf-8")
    kind = 'kind = "parameter", unit = "m", start = 0.012, range = [0.0, 1.0]'
    line = f'  {{ name = "nozzle.width", {kind}, text = "New" }},\n'
    text = text.replace("]\n\n[model]", f"{line}]\n\n[model]").replace(
        '["nozzle", "geometry.L8"', '["nozzle", "nozzle.width", "geometry.L8"'
    )
    file.write_text(text, encoding="utf-8")
    program = (
        "from fmu_src.exporter.c_interface import header, source\n"
        "from fmu_src.exporter.page import page\n"
        "from fmu_src.interface import load_interface\n"
        "from pathlib import Path\n"
        "interface = load_interface()\n"
        "Path('fmu_src/component/interface.h').write_text(header(interface))\n"
        "Path('fmu_src/component/interface.c').write_text(source(interface))\n"
        "Path('explorer.html').write_bytes(page(interface))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=project_copy, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return project_copy / PAGE


def test_a_new_parameter_has_its_control(other_page, visit):
    page = visit(page_file=other_page)
    page.get_by_text("nozzle", exact=True).click()  # a group of its own
    field = page.locator("[data-field='nozzle.width']")
    assert field.input_value() == "12" and "New" in field.get_attribute("title")
    assert page.locator("[data-slope='nozzle.width']").inner_text() == "–"  # the C has no derivative by it
    assert page.locator("[data-slope='geometry.L1']").inner_text() != "–"
    field.fill("13.5")
    field.press("Enter")
    assert page.evaluate("window.explorer.get('nozzle.width')") == 0.0135


def test_every_parameter_that_shapes_the_motion_has_its_control(page, interface):
    shaping = {name for output in interface.of_kind("output") for name in output.initially}
    for closed in ("Mass of the links", "Weight"):
        page.get_by_text(closed, exact=True).click()
    until(page, "document.querySelector(\"[data-field='gravity']\") !== null")
    shown = {row.get_attribute("data-control") for row in page.locator("[data-control]").all()}
    titles = page.locator("details.group summary").all_inner_texts()
    assert titles == ["Planting", "Lengths, pivots and angles", "Mass of the links", "Weight"]
    assert shaping <= shown and len(shaping) >= 18
    assert shown - shaping == {"crank.w", "plant.spacing", "ridge.depth", "ridge.y", "theta41"}
