"""The explorer in a real browser, without a network. Where there is no Chromium, the tests that need it say so."""

from __future__ import annotations

import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from fmu_src.exporter.page import PAGE

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@pytest.fixture(scope="session")
def chromium() -> str:
    """Where the browser is: the program that CHROMIUM names, or one of the usual names."""
    found = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip("no Chromium here: apt-get install chromium, or CHROMIUM=its path")
    return found


@pytest.fixture(scope="session")
def page_file(fmu_files: dict[int, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page as the FMU carries it, in a folder whose name is no plain ASCII."""
    place = tmp_path_factory.mktemp("Seite – страница") / PAGE
    with zipfile.ZipFile(fmu_files[3]) as archive:
        place.write_bytes(archive.read(f"documentation/{PAGE}"))
    return place


@pytest.fixture(scope="session")
def browser(chromium: str) -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright here")
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def visit(browser: Any, page_file: Path) -> Iterator[Callable[..., Any]]:
    """Opens the page, offline, and waits until it is ready. After the test: it asked for nothing, and no error was."""
    contexts, requests, problems = [], [], []

    def open_page(address: str = "", page_file: Path = page_file, **options: Any) -> Any:
        settings = {"offline": True, "reduced_motion": "reduce", "viewport": {"width": 1500, "height": 950}}
        context = browser.new_context(**(settings | options))
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(60_000)
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on(
            "console", lambda message: problems.append(message.text) if message.type in ("error", "warning") else None
        )
        page.goto(page_file.as_uri() + address)
        assert page.evaluate("window.explorer.ready") is True
        return page

    open_page.allowed = []  # type: ignore[attr-defined]  # beginnings of what the browser may complain of
    yield open_page
    for context in contexts:
        context.close()
    assert [text for text in problems if not text.startswith(tuple(open_page.allowed))] == []  # type: ignore[attr-defined]
    assert all(url.split("#")[0].endswith(PAGE) or url.startswith("blob:") for url in requests), requests


@pytest.fixture
def page(visit: Callable[..., Any]) -> Any:
    return visit()


def settled(page: Any) -> None:
    """Wait until the page has drawn what it was told."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def until(page: Any, expression: str, seconds: float = 60.0) -> None:
    """Wait until an expression of JavaScript is true. Not by playwright's own way, which the page's policy forbids."""
    for _ in range(round(seconds / 0.05)):
        if page.evaluate(expression):
            return
        page.wait_for_timeout(50)
    pytest.fail(f"not within {seconds:g} s: {expression}")
