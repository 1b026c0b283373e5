"""Pictures of every step of the dashboard, for the documentation or to be looked at.

usage: python -m benchmarks.pictures [FOLDER]

Writes ``dashboard-STEP.png`` (1440x900) and ``dashboard-STEP-small.png`` (1024x768) of every step
into FOLDER; without one, those that the documentation shows into docs. Needs playwright and a
Chromium on the PATH.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser, Page

from benchmarks.chromium import launched
from benchmarks.dashboard import PATIENCE, READY, RUN, SHOWN, colored, served, wait

SIZES = {"": (1440, 900), "-small": (1024, 768)}

IN_DOCS = ("input", "stack", "fields", "assess", "export")
"""Steps whose large picture the documentation shows."""

SETTLED = 4.0
"""Seconds in which nothing changes when everything has come to rest."""

KEY = ".hg-scale"
"""Key of the colors in the view."""

HEART, NAME = "Both ventricles · lifelike", "biv"
STACK = "Left ventricle · clinical short-axis stack"


def main() -> None:
    """Take all pictures."""
    looked_at = len(sys.argv) > 1
    folder = Path(sys.argv[1] if looked_at else "docs")
    folder.mkdir(parents=True, exist_ok=True)

    def keep(step: str, ending: str, shot: bytes) -> None:
        if looked_at or (step in IN_DOCS and not ending):
            (folder / f"dashboard-{step}{ending}.png").write_bytes(shot)

    with served() as (address, _), launched() as chromium:
        for ending in SIZES if looked_at else ("",):
            walk(chromium, address, ending, keep)


def walk(
    chromium: Browser, address: str, ending: str, keep: Callable[[str, str, bytes], None]
) -> None:
    """Go through the steps as a visitor does."""
    width, height = SIZES[ending]
    page = chromium.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    page.wait_for_selector(READY)
    choose(page, "Sample", HEART)
    page.wait_for_selector(f"{READY}:has-text('{NAME}')")
    page.wait_for_selector(RUN)

    def take(step: str) -> None:
        keep(step, ending, at_rest(page))

    take("input")
    page.get_by_role("button", name="More choices").click()
    take("choices")
    page.get_by_role("button", name="Fewer choices").click()
    page.get_by_role("button", name="All levels").click()
    page.wait_for_selector(".hg-side .hg-step-run .hg-running")
    keep("run", ending, page.screenshot())
    page.wait_for_selector(SHOWN)
    wait(lambda: colored(page) > 0.02)
    choose(page, "Cut", "Long axis, 1")
    take("view")
    choose(page, "Color by", "AHA segment")
    choose(page, "Lines", "Fibers")
    choose(page, "Cut", "No cut")
    page.wait_for_selector(f"{KEY}:has-text('AHA segment')")
    take("fields")
    page.click(".hg-tab-assess")
    take("assess")
    page.click(".hg-tab-export")
    take("export")
    choose(page, "Sample", STACK)
    page.wait_for_selector(f"{READY}:has-text('stack')")
    page.click(RUN)
    page.wait_for_selector(f"{SHOWN}:has-text('stack')")
    page.click(".hg-tab-view")
    choose(page, "Lines", "Element edges")
    choose(page, "Color by", "Quality Q")
    page.wait_for_selector(f"{KEY}:has-text('Jacobian ratio')")
    take("stack")
    page.close()


def at_rest(page: Page) -> bytes:
    """The picture of a page on which nothing changes any more."""
    shot = b""
    while True:
        before = shot
        time.sleep(SETTLED)
        shot = page.screenshot()
        if shot == before:
            return shot


def choose(page: Page, label: str, option: str) -> None:
    """Choose from a list by its label."""
    page.get_by_label(label, exact=True).select_option(label=option)


if __name__ == "__main__":
    main()
