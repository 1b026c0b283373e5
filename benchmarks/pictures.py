"""Pictures of every step of the dashboard, for the documentation and to be looked at.

usage: python -m benchmarks.pictures [FOLDER]

Writes ``dashboard-STEP.png`` (1440x900) and ``dashboard-STEP-small.png`` (1024x768) into FOLDER,
docs by default. Needs playwright and a Chromium on the PATH.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from playwright.sync_api import Browser, Page

from benchmarks.chromium import launched
from benchmarks.dashboard import PATIENCE, READY, RUN, SHOWN, colored, served, wait

SIZES = {"": (1440, 900), "-small": (1024, 768)}
SETTLED = 4.0
"""Seconds in which everything has come to rest."""

HEART, NAME = "Both ventricles · lifelike", "biv"
STACK = "Left ventricle · clinical short-axis stack"


def main() -> None:
    """Take all pictures."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs")
    folder.mkdir(parents=True, exist_ok=True)
    with served() as (address, _), launched() as chromium:
        for ending, (width, height) in SIZES.items():
            walk(chromium, address, folder, ending, width, height)


def walk(
    chromium: Browser, address: str, folder: Path, ending: str, width: int, height: int
) -> None:
    """Go through the steps as a visitor does."""
    page = chromium.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    page.wait_for_selector(READY)
    choose(page, "Sample", HEART)
    page.wait_for_selector(f"{READY}:has-text('{NAME}')")
    page.wait_for_selector(RUN)

    def take(step: str) -> None:
        time.sleep(SETTLED)
        page.screenshot(path=folder / f"dashboard-{step}{ending}.png")

    take("input")
    page.get_by_role("button", name="More choices").click()
    take("choices")
    page.get_by_role("button", name="Fewer choices").click()
    page.get_by_role("button", name="All levels").click()
    page.wait_for_selector(".hg-side .hg-step-run .hg-running")
    take("run")
    page.wait_for_selector(SHOWN)
    wait(lambda: colored(page) > 0.02)
    choose(page, "Cut", "Long axis, 1")
    take("view")
    choose(page, "Color by", "AHA segment")
    choose(page, "Lines", "Fibers")
    choose(page, "Cut", "No cut")
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
    take("stack")
    page.close()


def choose(page: Page, label: str, option: str) -> None:
    """Choose from a list by its label."""
    page.get_by_label(label, exact=True).select_option(label=option)


if __name__ == "__main__":
    main()
