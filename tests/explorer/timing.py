"""How long the explorer takes in Chromium: to its first picture, and to redraw while something is dragged.

    python -m tests.explorer.timing [--loads N] [--moves N]

The page is opened from the disk, offline. The first picture is when the script has drawn it, counted from the start of
the navigation. A redraw is the browser's own task for one frame, from its tracing: script, style, layout and paint.
Measured, not tested: the figures are this machine's, and depend on what else it does.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
from pathlib import Path
from typing import Any

from playwright.sync_api import Page, sync_playwright

from fmu_src.exporter.page import PAGE
from scenarios.common.reports import machine
from tests.conftest import PROJECT_ROOT
from tests.explorer.conftest import NAMES

CATEGORIES = ("devtools.timeline", "disabled-by-default-devtools.timeline")


def loads(browser: Any, address: str, count: int) -> list[float]:
    """Milliseconds from the start of the navigation to the first picture, each in a context of its own."""
    found = []
    for _ in range(count):
        context = browser.new_context(offline=True, reduced_motion="reduce", viewport={"width": 1500, "height": 950})
        page = context.new_page()
        page.goto(address)
        page.evaluate("window.explorer.ready")
        found.append(page.evaluate("performance.getEntriesByName('first-picture')[0].startTime"))
        context.close()
    return found


def frames(page: Page, drag: list[tuple[float, float]]) -> list[float]:
    """Milliseconds of the main thread for each frame while the pointer, pressed, goes through these places."""
    session = page.context.new_cdp_session(page)
    events: list[dict[str, Any]] = []
    session.on("Tracing.dataCollected", lambda data: events.extend(data["value"]))
    complete: list[bool] = []
    session.on("Tracing.tracingComplete", lambda _: complete.append(True))
    session.send(
        "Tracing.start", {"traceConfig": {"includedCategories": list(CATEGORIES)}, "transferMode": "ReportEvents"}
    )
    page.mouse.move(*drag[0])
    page.mouse.down()
    for x, y in drag[1:]:
        page.mouse.move(x, y)
        page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    page.mouse.up()
    session.send("Tracing.end")
    while not complete:
        page.wait_for_timeout(50)
    tasks = [e for e in events if e["name"] == "RunTask" and "dur" in e]
    drawn = [e for e in events if e["name"] == "FireAnimationFrame" and e.get("dur", 0) > 500]  # not the waiting above
    found = []
    for event in drawn:
        around = [
            t
            for t in tasks
            if (t["pid"], t["tid"]) == (event["pid"], event["tid"]) and t["ts"] <= event["ts"] <= t["ts"] + t["dur"]
        ]
        found += [max(t["dur"] for t in around) / 1e3] if around else []
    return found


def crank(page: Page, moves: int) -> list[tuple[float, float]]:
    """Places about the handle."""
    box = page.locator("#crank-handle circle").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    return [(x + 0.6 * k, y + 0.2 * k) for k in range(moves)]


def slider(page: Page, moves: int) -> list[tuple[float, float]]:
    """Places along the slider of L1, within which the linkage closes."""
    box = page.locator("[data-slider='geometry.L1']").bounding_box()
    assert box is not None
    return [(box["x"] + box["width"] * (0.5 + 0.1 * k / moves), box["y"] + box["height"] / 2) for k in range(moves)]


def said(title: str, values: list[float], goal: float) -> str:
    ordered = sorted(values)
    late = ordered[int(0.95 * (len(ordered) - 1))]
    middle = statistics.median(values)
    return f"{title}: median {middle:.1f} ms, 95 % {late:.1f} ms, {len(values)} times (goal {goal:g} ms)"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.explorer.timing", description="How long the explorer takes.")
    parser.add_argument("--loads", type=int, default=9, metavar="N", help="how often to load it (9)")
    parser.add_argument("--moves", type=int, default=80, metavar="N", help="moves of a drag (80)")
    parser.add_argument("--page", type=Path, default=PROJECT_ROOT / "build" / PAGE)
    chosen = parser.parse_args(arguments)
    program = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        parser.error("no Chromium here: apt-get install chromium, or CHROMIUM=its path")
    address = chosen.page.resolve().as_uri()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        print(f"Chromium {browser.version}, {machine()}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
        print(said("load to first picture", loads(browser, address, chosen.loads), 300))
        page = browser.new_page(reduced_motion="reduce", viewport={"width": 1500, "height": 950})
        page.goto(address)
        page.evaluate("window.explorer.ready")
        print(said("redraw while the crank is dragged", frames(page, crank(page, chosen.moves)), 16))
        print(said("redraw while a parameter is dragged", frames(page, slider(page, chosen.moves)), 16))
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
