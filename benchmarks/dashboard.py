"""How fast the dashboard is in a real browser, what a visitor costs, and whether five get on.

usage: python -m benchmarks.dashboard

Serves the dashboard on this machine and opens it in Chromium with software rendering, so that a
browser with a graphics card is faster. Needs playwright and a Chromium on the PATH.
"""

from __future__ import annotations

import io
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import nibabel
import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Page

from benchmarks.chromium import launched
from heartgen import samples

VISITORS = 5
UPLOAD_MEGABYTES = 100
PATIENCE = 600_000
READY = ".hg-side .hg-step-input .hg-done"
SHOWN = ".hg-step-view .hg-done"
RUN = ".hg-primary:enabled:visible"


def main() -> None:
    """Print the table."""
    rows: list[tuple[str, str]] = []
    with served() as (address, server), launched() as chromium:
        first(chromium, address, rows)
        both(chromium, address, server, rows)
        upload(chromium, address, rows)
        crowd(chromium, address, rows)
    print(f"| {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} | |")
    print("|---|---|")
    for name, value in rows:
        print(f"| {name} | {value} |", flush=True)


def first(chromium: Browser, address: str, rows: list[tuple[str, str]]) -> None:
    """A cold kernel, and the first mesh of the left ventricle."""
    page = chromium.new_page(viewport={"width": 1440, "height": 900})
    page.set_default_timeout(PATIENCE)
    start = time.perf_counter()
    page.goto(address)
    page.wait_for_selector(".hg-primary:visible")
    rows.append(("URL to page", since(start)))
    page.wait_for_selector(RUN)
    rows.append(("URL to usable page: sample loaded, Run enabled", since(start)))
    page.wait_for_selector(READY)
    rows.append(("URL to measured heart", since(start)))
    page.click(".hg-tab-view")
    page.wait_for_selector(".hg-frame")
    wait(lambda: colored(page) > 0.02)
    rows.append(("URL to mask in 3-D", since(start)))
    before = page.locator(".hg-frame").screenshot()
    for name in ("first", "second"):
        start = time.perf_counter()
        page.click(RUN)
        number = 1 if name == "first" else 2
        page.wait_for_selector(f"{SHOWN}:has-text('shows {number} ·')")
        done = since(start)
        if number == 1:
            wait(lambda: page.locator(".hg-frame").screenshot() != before)
        rows.append((f"LV, level 1: click to mesh, {name} run", f"{since(start)} (fit {done})"))
    page.close()


def both(
    chromium: Browser, address: str, server: subprocess.Popen[bytes], rows: list[tuple[str, str]]
) -> None:
    """Memory of a visitor after a run of both ventricles."""
    known = kernels(server.pid)
    page = opened(chromium, address)
    page.get_by_label("Sample", exact=True).select_option(label="Both ventricles · lifelike")
    page.wait_for_selector(f"{READY}:has-text('biv')")
    start = time.perf_counter()
    page.click(RUN)
    page.wait_for_selector(SHOWN)
    rows.append(("BiV, level 1: click to mesh", since(start)))
    time.sleep(5)
    (pid,) = kernels(server.pid) - known
    resident, shared = memory(pid)
    rows.append(("memory of a visitor after it", f"{resident:.0f} MB, {shared:.0f} of it shared"))
    page.close()


def upload(chromium: Browser, address: str, rows: list[tuple[str, str]]) -> None:
    """A large file."""
    page = opened(chromium, address)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.nii"
        large_mask(path)
        start = time.perf_counter()
        page.set_input_files(".hg-drop input", path)
        page.wait_for_selector(".hg-drop progress:not([hidden])")
        page.wait_for_selector(".hg-drop b")
        size = path.stat().st_size / 2**20
        rows.append((f"upload of {size:.0f} MB, with progress", since(start)))
        page.wait_for_selector(f"{READY}:has-text('large.nii')")
        rows.append(("… read and measured", since(start)))
    page.close()


def crowd(chromium: Browser, address: str, rows: list[tuple[str, str]]) -> None:
    """Visitors at once, each with a heart of their own."""
    start = time.perf_counter()
    pages = [chromium.new_context().new_page() for _ in range(VISITORS)]
    names = ["lifelike", "ideal", "noisy", "papillary", "valves"]
    titles = ["Lifelike", "Ideal ellipsoid", "Careless segmentation"]
    titles += ["With papillary muscles", "With valve anatomy"]
    for page in pages:
        page.set_default_timeout(PATIENCE)
        page.goto(address)
    for page, name, title in zip(pages, names, titles, strict=True):
        page.wait_for_selector(READY)
        page.get_by_label("Sample", exact=True).select_option(
            label=f"Left ventricle · {title.lower()}"
        )
        page.wait_for_selector(f"{READY}:has-text('{name}')")
    for page in pages:
        page.click(RUN)
    for page, name in zip(pages, names, strict=True):
        page.wait_for_selector(f"{SHOWN}:has-text('shows 1 · {name} ·')")
    rows.append((f"{VISITORS} visitors at once, each their own heart, all right", since(start)))
    for page in pages:
        page.context.close()


def opened(chromium: Browser, address: str) -> Page:
    """The page with its first sample."""
    page = chromium.new_page(viewport={"width": 1440, "height": 900})
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    page.wait_for_selector(READY)
    return page


def large_mask(path: Path) -> None:
    """A heart in a large image of floating-point numbers, not compressed."""
    mask = samples.lifelike_lv(1.0).mask
    side = round((UPLOAD_MEGABYTES * 2**20 / 4) ** (1 / 3))
    voxels = np.zeros((side, side, side), np.float32)
    i, j, k = mask.voxels.shape
    voxels[:i, :j, :k] = mask.voxels
    nibabel.save(nibabel.Nifti1Image(voxels, np.diag([-1.0, -1.0, 1.0, 1.0]) @ mask.affine), path)


def colored(page: Page) -> float:
    """Share of the pixels of the 3-D view that are not gray."""
    shot = page.locator(".hg-frame").screenshot()
    pixels = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), dtype=int)
    return float(np.mean(np.ptp(pixels, axis=2) > 40))


def wait(true: Callable[[], bool]) -> None:
    """Wait until something is so."""
    while not true():
        time.sleep(0.1)


def since(start: float) -> str:
    """Time since then."""
    return f"{time.perf_counter() - start:.1f} s"


def kernels(server: int) -> set[int]:
    """Processes of the kernels of a server."""
    found = subprocess.run(
        ["pgrep", "-P", str(server), "-f", "ipykernel"], capture_output=True, text=True, check=False
    )
    return set(map(int, found.stdout.split()))


def memory(pid: int) -> tuple[float, float]:
    """Resident memory of a process, and how much of it is files that others share, MB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    sizes = {line.split(":")[0]: line.split()[1] for line in lines if line.startswith("Rss")}
    anonymous, shared = float(sizes["RssAnon"]), float(sizes["RssFile"])
    return (anonymous + shared) / 1024, shared / 1024


@contextmanager
def served() -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """The dashboard on a free port."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port = listener.getsockname()[1]
    command = [sys.executable, "-c", "from heartgen.cli import main; main()", "dashboard"]
    server = subprocess.Popen([*command, "--no-browser", "--port", str(port)])
    address = f"http://127.0.0.1:{port}/"
    while True:
        try:
            json.load(urllib.request.urlopen(f"{address}api", timeout=5))
            break
        except OSError:
            time.sleep(0.2)
    try:
        yield address, server
    finally:
        server.send_signal(signal.SIGTERM)
        server.wait(30)


if __name__ == "__main__":
    main()
