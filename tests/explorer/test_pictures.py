"""How the page looks in each of its states. Each picture was looked at once; since then it must stay like it.

What is compared is a small picture in grey, a twelfth of the window: letters, which differ from system to system,
vanish in it; panels, drawings, curves and colours do not. `python -m tests.explorer.test_pictures` takes the pictures
anew: look at the large ones, which it puts into build/reports/explorer/, before the small ones are handed in.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.explorer.conftest import settled, until

FOLDER = Path(__file__).with_name("pictures")
SHARE = 12  # a pixel of the small picture is a square of so many of the window
MEAN, WORST = 0.9, 0.01  # of 255: what a picture may be off; the share of pixels off by more than 25


def click(selector: str) -> Callable[[Any], None]:
    return lambda page: page.locator(selector).click()


def values(**given: float) -> Callable[[Any], None]:
    return lambda page: page.evaluate(
        "(values) => window.explorer.set(values)", {f"geometry.{k}": v for k, v in given.items()}
    )


def figure(name: str) -> Callable[[Any], None]:
    return lambda page: page.locator("#preset").select_option(name)


def coupling(page: Any) -> None:
    page.locator("#tab-coupling").click()
    until(page, "document.getElementById('error-over-step').dataset.done !== undefined")


WIDE, NARROW = {"width": 1500, "height": 960}, {"width": 420, "height": 2400}
STATES: dict[str, tuple[dict[str, Any], list[Callable[[Any], None]]]] = {
    "published": ({"viewport": WIDE}, []),
    "dark": ({"viewport": WIDE, "color_scheme": "dark"}, []),
    "narrow": ({"viewport": NARROW}, []),
    "figure_3": ({"viewport": WIDE}, [figure("geometry.L1")]),
    "figure_4": ({"viewport": WIDE}, [figure("theta41")]),
    "figure_5": ({"viewport": WIDE}, [figure("geometry.L4")]),
    "figure_6": ({"viewport": WIDE}, [figure("geometry.L7")]),
    "cannot_close": ({"viewport": WIDE}, [values(L1=0.08)]),
    "co_simulation": ({"viewport": WIDE}, [coupling]),
}


def picture(visit: Callable[..., Any], state: str) -> bytes:
    options, steps = STATES[state]
    page = visit(**options)
    for step in steps:
        step(page)
    settled(page)
    # of the paper's figures the drawings alone, in which they differ
    return page.locator(".pictures").screenshot() if state.startswith("figure_") else page.screenshot()


def small(png: bytes) -> np.ndarray:
    """In grey, a pixel a square of the window."""
    image = Image.open(io.BytesIO(png)).convert("L")
    return np.asarray(image.resize((image.width // SHARE, image.height // SHARE), Image.Resampling.BOX), dtype=float)


def off(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    difference = np.abs(one - other)
    return float(difference.mean()), float((difference > 25).mean())


@pytest.mark.parametrize("state", STATES)
def test_it_looks_as_it_did(visit, state):
    known = np.asarray(Image.open(FOLDER / f"{state}.png"), dtype=float)
    now = small(picture(visit, state))
    assert np.abs(np.subtract(now.shape, known.shape)).max() <= 2  # a line of letters may be higher elsewhere
    height, width = np.minimum(now.shape, known.shape)
    now, known = now[:height, :width], known[:height, :width]
    mean, worst = off(now, known)
    assert mean <= MEAN and worst <= WORST, (
        f"{state}: off by {mean:.2f} of 255 in the mean, {worst:.1%} by more than 25"
    )


def test_states_differ_by_more_than_is_allowed():
    """The comparison sees what it is for: a family of curves, a notice, another tab, a dark page."""
    pictures = {
        state: np.asarray(Image.open(FOLDER / f"{state}.png"), dtype=float) for state in STATES if state != "narrow"
    }
    for one, first in pictures.items():
        for other, second in pictures.items():
            if one != other and first.shape == second.shape:
                mean, worst = off(first, second)
                assert mean > MEAN or worst > WORST, (one, other, mean, worst)


def take_all() -> None:
    """Write the pictures, small and large."""
    import os
    import shutil

    from playwright.sync_api import sync_playwright

    from fmu_src.exporter.page import PAGE
    from tests.conftest import PROJECT_ROOT
    from tests.explorer.conftest import NAMES

    large = PROJECT_ROOT / "build" / "reports" / "explorer"
    for folder in (FOLDER, large):
        folder.mkdir(parents=True, exist_ok=True)
    program = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])

        def visit(**options: Any) -> Any:
            page = browser.new_context(offline=True, reduced_motion="reduce", **options).new_page()
            page.goto((PROJECT_ROOT / "build" / PAGE).as_uri())
            page.evaluate("window.explorer.ready")
            return page

        for state in STATES:
            png = picture(visit, state)
            (large / f"{state}.png").write_bytes(png)
            Image.fromarray(small(png).round().astype(np.uint8)).save(FOLDER / f"{state}.png", optimize=True)
            print(large / f"{state}.png")
        browser.close()


if __name__ == "__main__":
    sys.exit(take_all())
