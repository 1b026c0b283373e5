"""How long a visitor of the dashboard waits: from a link to a mesh, and from one level to another.

usage: python -m benchmarks.page_times

Serves the dashboard on this machine and opens links in Chromium with software rendering, each
visitor with a profile of their own. A mesh counts once it is drawn: when the 3-D view says that it
shows it, and has more colors than a mask. Needs playwright and a Chromium on the PATH.
"""

from __future__ import annotations

import io
import os
import statistics
import time

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Page

from benchmarks.chromium import launched
from benchmarks.dashboard import PATIENCE, READY, SHOWN, served, wait
from benchmarks.keeping import processes, resident, sessions

LINK = "?sample=lifelike&run=1"
BOTH = "?sample=biv&run=1"

ALSO = ".hg-run-label:has-text('also at level 2, 3, 4, 5')"

LOOK = 2.0
"""Seconds for which a mesh is looked at before the next level is chosen."""

COLORS = 40
"""More colors, of 16 shades a channel, are a mesh: a mask has one, in light and shade."""

SWITCH = """([key, text]) => new Promise((done) => {
  const start = performance.now();
  const frame = document.querySelector("[data-shown]"), before = frame.dataset.shown;
  const told = () => document.querySelector(".hg-step-view").innerText.includes(text);
  const look = () => frame.dataset.shown !== before && told()
    ? done((performance.now() - start) / 1000)
    : requestAnimationFrame(look);
  const slider = document.querySelector("[role=slider]");
  slider.focus();
  for (const type of ["keydown", "keyup"])
    document.activeElement.dispatchEvent(new KeyboardEvent(type, {key, bubbles: true}));
  look();
})"""
"""Seconds from a key on the slider of levels to the new mesh in the view."""


def main() -> None:
    """Print the table."""
    with served() as (address, server), launched() as chromium:
        before = os.getloadavg()[0]
        print("| figure | measured |\n|---|---|")
        for name in ("cold server", "second visitor"):
            page, seconds = linked(chromium, f"{address}{LINK}")
            print(f"| link to a mesh on the screen, {name}, s | {seconds:.1f} |", flush=True)
            if name != "cold server":
                print(f"| click to mesh, second run, s | {another_run(page):.1f} |", flush=True)
                levels(page)
            page.context.close()
        page, seconds = linked(chromium, f"{address}{BOTH}")
        print(f"| link to a mesh of both ventricles, s | {seconds:.1f} |", flush=True)
        time.sleep(5)
        told = memory(server.pid)
        print(f"| memory of its visitor while other levels are fitted, MB | {told} |", flush=True)
        page.wait_for_selector(ALSO)
        levels(page)
        print(f"| memory of its visitor then, MB | {memory(server.pid)} |", flush=True)
        print(f"| load before, after | {before:.1f}, {os.getloadavg()[0]:.1f} |")


def linked(chromium: Browser, address: str) -> tuple[Page, float]:
    """A page of a new visitor, and the seconds until its mesh is seen."""
    page = chromium.new_context(viewport={"width": 1440, "height": 900}).new_page()
    page.set_default_timeout(PATIENCE)
    start = time.perf_counter()
    page.goto(address)
    seen(page, 1)
    return page, time.perf_counter() - start


def seen(page: Page, number: int) -> None:
    """Wait until the mesh of a run is drawn."""
    page.wait_for_selector(f"{SHOWN}:has-text('shows {number} ·')", state="attached")
    page.wait_for_selector("[data-shown]:visible")
    wait(lambda: colors(page) > COLORS)


def another_run(page: Page) -> float:
    """Seconds from a click on Run to the mesh of another heart, which was measured before."""
    page.get_by_label("Sample", exact=True).select_option(
        label="Left ventricle · careless segmentation"
    )
    page.wait_for_selector(f"{READY}:has-text('noisy')")
    page.wait_for_selector(".hg-start:enabled")
    button = page.get_by_role("button", name="Run", exact=True)
    before = page.locator("[data-shown]").get_attribute("data-shown")
    start = time.perf_counter()
    button.click()
    page.wait_for_selector(f"{SHOWN}:has-text('shows 2 ·')", state="attached")
    wait(lambda: page.locator("[data-shown]").get_attribute("data-shown") != before)
    return time.perf_counter() - start


def levels(page: Page) -> None:
    """Print the times of switches between levels that were fitted in the background."""
    page.wait_for_selector(ALSO)
    ways = [("ArrowRight", n) for n in (2, 3, 4, 5)] + [("ArrowLeft", n) for n in (4, 3, 2, 1)]
    seconds = []
    for key, n in ways:
        time.sleep(LOOK)
        seconds.append(page.evaluate(SWITCH, [key, f"LoD {n}"]))
    told = ", ".join(f"{s:.2f}" for s in seconds)
    print(f"| level switch, median, s | {statistics.median(seconds):.2f} ({told}) |", flush=True)


def colors(page: Page) -> int:
    """Number of colors in the 3-D view."""
    shot = page.locator(".hg-frame").screenshot()
    pixels = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), dtype=int)[50:, 10:-10]
    return len(np.unique((pixels // 16).reshape(-1, 3), axis=0))


def memory(server: int) -> str:
    """Of all processes of the visitor, what they share left out, and of the largest, MB."""
    each = [p.memory_full_info().uss / 2**20 for p in processes(server, sessions(server))]
    return f"{resident(server):.0f} in {len(each)} processes, the largest {max(each):.0f}"


if __name__ == "__main__":
    main()
