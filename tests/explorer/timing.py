"""How long the explorer takes in Chromium: to its first picture, and to redraw while something is dragged.

    python -m tests.explorer.timing [--loads N] [--moves N] [--beside PAGE]

The page is opened from the disk, offline. The first picture is there when the browser has painted what the script drew,
counted from the start of the navigation. A redraw is the browser's own task for one frame, from its tracing: script,
style, layout and paint. Beside each time stands how much of it the page's main thread had a processor for: the rest is
waiting, for other threads or, on a machine that does other work, for a processor. Measured, not tested. Another page
beside it, such as that of an earlier commit, is measured in turn with it, so that both meet the same load.
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

CATEGORIES = ("devtools.timeline", "disabled-by-default-devtools.timeline", "blink.user_timing")
ROUNDS = 4  # into which the moves of a drag are divided, for two pages to be dragged in turn


class Trace:
    """What the browser tells of itself while the block runs."""

    def __init__(self, page: Page) -> None:
        self.page, self.events, self._complete = page, list[dict[str, Any]](), list[bool]()
        self._session = page.context.new_cdp_session(page)
        self._session.on("Tracing.dataCollected", lambda data: self.events.extend(data["value"]))
        self._session.on("Tracing.tracingComplete", lambda _: self._complete.append(True))

    def __enter__(self) -> Trace:
        configuration = {"includedCategories": list(CATEGORIES)}
        self._session.send("Tracing.start", {"traceConfig": configuration, "transferMode": "ReportEvents"})
        return self

    def __exit__(self, *_: object) -> None:
        self._session.send("Tracing.end")
        while not self._complete:
            self.page.wait_for_timeout(20)

    def named(self, name: str) -> list[dict[str, Any]]:
        return [event for event in self.events if event["name"] == name]


Time = tuple[float, float]  # milliseconds, and those of them in which the main thread had a processor


def load(browser: Any, address: str) -> Time:
    """From the start of the navigation until the first picture is painted, in a context of its own."""
    context = browser.new_context(offline=True, reduced_motion="reduce", viewport={"width": 1500, "height": 950})
    page = context.new_page()
    with Trace(page) as trace:
        page.goto(address)
        page.evaluate("window.explorer.ready")
        page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    context.close()
    (drawn,) = trace.named("first-picture")
    start = max(event["ts"] for event in trace.named("navigationStart") if event["ts"] < drawn["ts"])
    painted = min(
        event["ts"] + event["dur"]
        for event in trace.named("Commit")
        if event["pid"] == drawn["pid"] and event["ts"] > drawn["ts"]
    )
    tasks = [e for e in trace.named("RunTask") if (e["pid"], e["tid"]) == (drawn["pid"], drawn["tid"])]
    busy = sum(e.get("tdur", 0) for e in tasks if start <= e["ts"] <= painted)
    return float(painted - start) / 1e3, float(busy) / 1e3


def frames(page: Page, drag: list[tuple[float, float]]) -> list[Time]:
    """The main thread's task for each frame while the pointer, pressed, goes through these places."""
    with Trace(page) as trace:
        page.mouse.move(*drag[0])
        page.mouse.down()
        for x, y in drag[1:]:
            page.mouse.move(x, y)
            page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        page.mouse.up()
    tasks = [e for e in trace.named("RunTask") if "dur" in e]
    drawn = [e for e in trace.named("FireAnimationFrame") if e.get("dur", 0) > 500]  # not the waiting above
    found = []
    for event in drawn:
        around = [
            t
            for t in tasks
            if (t["pid"], t["tid"]) == (event["pid"], event["tid"]) and t["ts"] <= event["ts"] <= t["ts"] + t["dur"]
        ]
        if around:
            task = max(around, key=lambda t: t["dur"])
            found.append((task["dur"] / 1e3, task.get("tdur", 0) / 1e3))
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


def said(title: str, runs: list[list[Time]], goal: float) -> str:
    lines = [f"{title} (goal {goal:g} ms)"]
    for values in runs:
        wall, busy = (sorted(each) for each in zip(*values, strict=True))
        lines.append(
            f"  median {statistics.median(wall):6.1f} ms, 95 % {wall[int(0.95 * (len(wall) - 1))]:6.1f} ms; "
            f"with a processor {statistics.median(busy):6.1f} ms; {len(values)} times"
        )
    if len(runs) == 2:
        ratios = [
            statistics.median(one[k] for one in runs[0]) / statistics.median(one[k] for one in runs[1]) for k in (0, 1)
        ]
        lines.append(f"  ratio of the medians {ratios[0]:.2f}; with a processor {ratios[1]:.2f}")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.explorer.timing", description="How long the explorer takes.")
    parser.add_argument("--loads", type=int, default=9, metavar="N", help="how often to load it (9)")
    parser.add_argument("--moves", type=int, default=80, metavar="N", help="moves of a drag (80)")
    parser.add_argument("--page", type=Path, default=PROJECT_ROOT / "build" / PAGE)
    parser.add_argument("--beside", type=Path, metavar="PAGE", help="another, measured in turn with it")
    chosen = parser.parse_args(arguments)
    program = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        parser.error("no Chromium here: apt-get install chromium, or CHROMIUM=its path")
    addresses = [file.resolve().as_uri() for file in (chosen.page, chosen.beside) if file]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        print(f"Chromium {browser.version}, {machine()}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
        loaded: list[list[Time]] = [[] for _ in addresses]
        for _ in range(chosen.loads):
            for values, address in zip(loaded, addresses, strict=True):
                values.append(load(browser, address))
        print(said("load to first picture", loaded, 300))
        for title, places in (("the crank", crank), ("a parameter", slider)):
            redrawn: list[list[Time]] = [[] for _ in addresses]
            for _ in range(ROUNDS):
                for k, address in enumerate(addresses):
                    page = browser.new_page(reduced_motion="reduce", viewport={"width": 1500, "height": 950})
                    page.goto(address)
                    page.evaluate("window.explorer.ready")
                    redrawn[k] += frames(page, places(page, chosen.moves // ROUNDS))
                    page.close()
            print(said(f"redraw while {title} is dragged", redrawn, 16))
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
