"""Whether every 3-D view of a notebook comes in JupyterLab after a cold Run All, off screen or not.

usage: python -m benchmarks.cold_views [--runs N] [--notebooks 01_first_mesh 02_hermite ...]

Each run has a fresh kernel and a fresh browser, and is never scrolled before the kernel is idle:
most views are off screen while the kernel is busy. Then the notebook is scrolled through, once, and
each view is to show something colored within a few seconds. Needs playwright, JupyterLab, and a
Chromium on the PATH.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Locator, Page

from benchmarks.chromium import launched

VIEWS_IN = {"01_first_mesh": 2, "02_hermite": 2}
"""Views in each notebook that is run."""

WIDTHS = (800, 1500)
HEIGHT = 800
PATIENCE = 600_000
"""Milliseconds for a whole Run All."""

QUIET = 6
"""Looks, half a second apart, at which a kernel that rests has nothing to do."""

COMING = 15.0
"""Seconds in which a view that is scrolled to has to come: a software renderer is slow."""

VIEWS = ".jp-OutputArea-output iframe, .jp-OutputArea-output .hg-view"
"""A scene of its own, or the view of a result."""

SCROLLER = "document.querySelector('.jp-Notebook .jp-WindowedPanel-outer')"

STEP = f"""() => {{
  const panel = {SCROLLER}, before = panel.scrollTop;
  panel.scrollTop += 200;
  return panel.scrollTop > before;
}}"""
"""Scrolls a little; whether there was more to scroll."""

IN_SIGHT = """e => {
  const box = e.getBoundingClientRect();
  return box.height > 50 && box.top > 0 && box.bottom < window.innerHeight + 50;
}"""

SATURATED, SHARE = 40, 0.02
"""Difference of color channels of a pixel that is no gray, and the share of such in a heart."""


def main() -> None:
    """Print a line for each run, and the sum."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--notebooks", nargs="+", default=list(VIEWS_IN))
    parser.add_argument("--pictures", type=Path, help="folder for what a view that failed shows")
    given = parser.parse_args()
    good = 0
    for run in range(given.runs):
        name = given.notebooks[run % len(given.notebooks)]
        width = WIDTHS[run // len(given.notebooks) % len(WIDTHS)]
        with served(name) as address:
            shown = cold_run(address, width, given.pictures)
        good += all(shown) and len(shown) == VIEWS_IN[name]
        marks = " ".join("shown" if each else "BLANK" for each in shown)
        print(f"{run + 1:3d} {name} {width} px: {marks}", flush=True)
    print(f"{good} of {given.runs} runs with all views shown")


def cold_run(address: str, width: int, pictures: Path | None) -> list[bool]:
    """Run all cells of a notebook in a new browser; whether each of its views came."""
    with launched() as chromium:
        page = chromium.new_page(viewport={"width": width, "height": HEIGHT})
        page.set_default_timeout(PATIENCE)
        page.goto(address)
        page.wait_for_selector(".jp-Notebook .jp-Cell")
        idle(address)
        page.get_by_role("menuitem", name="Run", exact=True).click()
        page.get_by_role("menuitem", name="Run All Cells", exact=True).click()
        idle(address)
        return scrolled(page, pictures)


def idle(address: str) -> None:
    """Wait until there is a kernel that has had nothing to do for a while."""
    end, quiet = time.monotonic() + PATIENCE / 1000, 0
    while quiet < QUIET:
        assert time.monotonic() < end, "the kernel does not come to rest"
        time.sleep(0.5)
        states = []
        with (
            suppress(urllib.error.HTTPError),  # the server fails while a kernel comes up
            urllib.request.urlopen(f"{address.split('lab/')[0]}api/kernels", timeout=60) as answer,
        ):
            states = [kernel["execution_state"] for kernel in json.load(answer)]
        quiet = quiet + 1 if states == ["idle"] else 0


def scrolled(page: Page, pictures: Path | None) -> list[bool]:
    """Scroll from the first cell to the last; whether each view came, in their order."""
    seen: dict[str, bool] = {}
    page.evaluate(f"() => {{ {SCROLLER}.scrollTop = 0 }}")
    while True:
        time.sleep(0.5)
        for view in page.locator(VIEWS).all():
            cell = view.evaluate("e => e.closest('.jp-Cell').dataset.windowedListIndex")
            if cell not in seen and view.evaluate(IN_SIGHT):
                seen[cell] = came(view)
                if not seen[cell] and pictures is not None:
                    pictures.mkdir(parents=True, exist_ok=True)
                    page.screenshot(path=pictures / f"{time.time():.0f}.png")
        if not page.evaluate(STEP):
            return list(seen.values())


def came(view: Locator) -> bool:
    """Whether something colored comes into a view in time."""
    end = time.monotonic() + COMING
    while time.monotonic() < end:
        shot = view.screenshot()
        pixels = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), dtype=int)
        if np.mean(np.ptp(pixels, axis=2) > SATURATED) > SHARE:
            return True
        time.sleep(0.5)
    return False


@contextmanager
def served(notebook: str) -> Iterator[str]:
    """A copy of a notebook in JupyterLab, with the settings Jupyter comes with."""
    home = Path(__file__).parents[1] / "notebooks"
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(home / f"{notebook}.ipynb", folder)
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            port = listener.getsockname()[1]
        command = [sys.executable, "-m", "jupyter", "lab", "--no-browser", "--allow-root"]
        command += [f"--ServerApp.port={port}", "--ServerApp.ip=127.0.0.1"]
        command += [f"--ServerApp.root_dir={folder}", "--IdentityProvider.token="]
        command += ["--ServerApp.log_level=40"]
        settings = {"JUPYTER_CONFIG_DIR": f"{folder}/.config", "HOME": folder}
        server = subprocess.Popen(
            command, env={**os.environ, **settings}, stderr=subprocess.DEVNULL, cwd=folder
        )
        address = f"http://127.0.0.1:{port}/"
        try:
            while True:
                try:
                    urllib.request.urlopen(f"{address}api", timeout=5)
                    break
                except OSError:
                    time.sleep(0.2)
            yield f"{address}lab/tree/{notebook}.ipynb"
        finally:
            server.terminate()
            server.wait(30)


if __name__ == "__main__":
    main()
