"""The explorer in Firefox, offline: no error, no request, the native FMU's bits. Where there is none, tests say so."""

from __future__ import annotations

import base64
import json
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fmu_src.exporter.page import PAGE
from fmu_src.interface import Interface
from tests.explorer.firefox import Firefox, firefox
from tests.explorer.test_numbers import POSES, native_poses, some_designs
from tests.harness.host import Instance

DESIGNS = 200


@pytest.fixture(scope="module")
def opened(page_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    """The page, ready."""
    program = os.environ.get("FIREFOX") or shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        pytest.skip("no Firefox here: apt-get install firefox-esr, or FIREFOX=its path")
    pytest.importorskip("websockets", reason="no websockets here")
    with firefox(program, tmp_path_factory.mktemp("profile")) as browser:
        browser.go(page_file.as_uri())
        assert browser.evaluate("window.explorer.ready") is True
        yield browser


@pytest.fixture
def version() -> int:
    return 3


def test_it_opens_from_the_disk(opened):
    figures = opened.evaluate("window.explorer.figures()")
    assert figures["height"] * 1e3 == pytest.approx(334.65, abs=0.005)
    assert opened.evaluate("document.querySelector('#machine .tip-path').getAttribute('d').length") > 5000
    assert opened.evaluate("document.getElementById('notice').hidden") is True


def test_its_poses_to_the_bit(opened, new: Callable[..., Instance], interface: Interface):
    """As test_numbers.py has it in Chromium, with fewer designs."""
    designs = list(some_designs(interface, DESIGNS))
    native = new().setup().enter()
    compared = 0
    for start in range(0, DESIGNS, 50):
        batch = designs[start : start + 50]
        for design, answer in zip(batch, opened.evaluate(f"({POSES})({json.dumps(batch)})"), strict=True):
            read = next((given.split(",") for given, _ in answer["poses"] if given), None)
            if read is None:
                continue
            expected = native_poses(native, design, answer["speed"], read)
            for (given, text), own in zip(answer["poses"], expected, strict=True):
                assert (base64.b64decode(text) if given else text) == own, design
                compared += 1
    assert compared > 5 * DESIGNS


def test_presets_and_an_impossible_design(opened):
    opened.evaluate("window.explorer.set({'geometry.L1': 0.05})")
    opened.evaluate(
        "(() => { const p = document.getElementById('preset'); p.value = 'geometry.L4'; "
        "p.dispatchEvent(new Event('change')); return new Promise((done) => setTimeout(() => done(true), 500)); })()"
    )
    assert opened.evaluate("document.querySelectorAll('#variants tbody tr').length") == 6
    opened.evaluate("window.explorer.set({'geometry.L1': 0.08})")
    assert (
        opened.evaluate("new Promise((done) => setTimeout(() => done(document.getElementById('notice').hidden), 500))")
        is False
    )


def test_no_error_and_no_request(opened):
    """Last in the file: over all that the others did."""
    opened.evaluate("1")
    said = [
        parameters["text"]
        for method, parameters in opened.events
        if method == "log.entryAdded" and parameters["level"] in ("error", "warn")
    ]
    assert said == []
    asked = [
        parameters["request"]["url"] for method, parameters in opened.events if method == "network.beforeRequestSent"
    ]
    assert [url for url in asked if not url.endswith(PAGE) and not url.startswith("data:")] == []
