"""Whether anything of a session is lost, whatever becomes of browser, connection and kernel.

usage: python -m benchmarks.keeping [TIMES]

Serves the dashboard on this machine, starts a run in it, and at a random moment reloads the page,
closes it, kills the browser, cuts the connection or kills the kernel; then opens the page again and
asks for every run that was begun. In the end the browser is closed, and what is left of kernels and
fitting processes is counted after the time that the server gives them.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil
from playwright.sync_api import BrowserContext, Error, Page, Playwright, sync_playwright

from benchmarks.chromium import FLAGS, find
from benchmarks.dashboard import PATIENCE, READY, RUN, served
from heartgen.serving.limits import CULL_SECONDS, IDLE_SECONDS
from heartgen.widgets.keeping.store import LEFT_SECONDS

TIMES = 20
"""Interruptions."""

LONGEST = 6.0
"""Seconds after the begin of a run within which it is interrupted."""

SAMPLES = (
    ("ideal", "ideal ellipsoid"),
    ("lifelike", "lifelike"),
    ("noisy", "careless segmentation"),
)
"""Names, and titles in the list."""

GONE = ".hg-gone:visible"


def main() -> None:
    """Print the table."""
    times = int(sys.argv[1]) if len(sys.argv) > 1 else TIMES
    with served() as (address, server), tempfile.TemporaryDirectory() as profile:
        with sync_playwright() as playwright:
            visitor = Visitor(playwright, Path(profile), address, server.pid)
            folder = sessions(server.pid)
            lost = []
            for number in range(1, times + 1):
                lost.append(interrupted(visitor, number))
                print(f"{number}: {lost[-1][0]}, {lost[-1][1]} lost", file=sys.stderr, flush=True)
            print("| interruption | times | runs lost |\n|---|---|---|")
            for kind in sorted({kind for kind, _ in lost}):
                found = [n for name, n in lost if name == kind]
                print(f"| {kind} | {len(found)} | {sum(found)} |", flush=True)
            visitor.context.close()
        wait_seconds = LEFT_SECONDS + IDLE_SECONDS + 2 * CULL_SECONDS  # it was fitting levels
        time.sleep(wait_seconds)
        left = processes(server.pid, folder)
        print(f"| kernels and fitting processes after {wait_seconds:.0f} s | {len(left)} | |")


class Visitor:
    """A browser with a profile of its own, and the page in it."""

    def __init__(self, playwright: Playwright, profile: Path, address: str, server: int) -> None:
        self.playwright, self.profile = playwright, profile
        self.address, self.server = address, server
        self.context: BrowserContext
        self.page: Page
        self.launch()

    def launch(self) -> None:
        """Start the browser, and open the page."""
        self.context = self.playwright.chromium.launch_persistent_context(
            str(self.profile),
            executable_path=find(),
            args=list(FLAGS),
            viewport={"width": 1440, "height": 900},
        )
        self.context.set_default_timeout(PATIENCE)
        self.open()

    def open(self) -> None:
        """Open the page in a new tab."""
        self.page = self.context.new_page()
        self.page.goto(self.address)
        self.page.wait_for_selector(READY)

    def reload(self) -> None:
        """Load the page anew."""
        self.page.reload()

    def close_tab(self) -> None:
        """Close the tab, and open another."""
        self.page.close()
        self.open()

    def kill_browser(self) -> None:
        """Kill the browser with all its processes, and start it again."""
        for process in psutil.process_iter(["cmdline"]):
            if f"--user-data-dir={self.profile}" in (process.info["cmdline"] or []):
                process.kill()
        with suppress(Error):  # of a browser that is dead
            self.context.close()
        self.launch()

    def cut_connection(self) -> None:
        """Be without the network for some seconds, then load the page anew."""
        self.context.set_offline(True)
        time.sleep(3)
        self.context.set_offline(False)
        self.page.reload()

    def kill_kernel(self) -> None:
        """Kill all kernels; the page offers to come back."""
        for process in psutil.Process(self.server).children():
            with suppress(psutil.Error):  # one that ends has no command line
                if "ipykernel" in " ".join(process.cmdline()):
                    process.kill()
        self.page.wait_for_selector(GONE)
        self.page.get_by_role("button", name="Bring it back").click()


def interrupted(visitor: Visitor, number: int) -> tuple[str, int]:
    """Start the run of this number, interrupt it, and count the runs that do not come back."""
    page = visitor.page
    name, title = SAMPLES[number % len(SAMPLES)]
    page.get_by_label("Sample", exact=True).select_option(label=f"Left ventricle · {title}")
    page.wait_for_selector(f"{READY}:has-text('{name}')")
    page.click(RUN)
    page.wait_for_selector(f".hg-run >> nth={number - 1}")
    time.sleep(random.uniform(0, LONGEST))
    ways: list[Callable[[], None]] = [
        *(visitor.reload, visitor.close_tab, visitor.kill_browser),
        *(visitor.cut_connection, visitor.kill_kernel),
    ]
    way = ways[number % len(ways)]
    way()
    page = visitor.page
    done = ".hg-run-label .hg-done"
    end = time.monotonic() + PATIENCE / 1000
    while page.locator(done).count() < number and time.monotonic() < end:
        time.sleep(0.5)
    return way.__name__.replace("_", " "), max(0, number - page.locator(done).count())


def processes(server: int, folder: str) -> list[psutil.Process]:
    """Kernels of a server, and the processes that fit for them.

    Parameters
    ----------
    server : int
        Its process.
    folder : str
        Of its sessions, by which they are known.
    """
    return [
        process
        for process in psutil.process_iter()
        if process.pid != server and _environment(process).get("HEARTGEN_SESSIONS") == folder
    ]


def resident(server: int) -> float:
    """Memory of all kernels and fitting processes, what they share with others left out, MB."""
    found = processes(server, sessions(server))
    return sum(process.memory_full_info().uss for process in found) / 2**20


def sessions(server: int) -> str:
    """Folder of the sessions of a server: what its processes are known by.

    Parameters
    ----------
    server : int
        Its process.
    """
    kernels = psutil.Process(server).children()
    return next((_environment(k)["HEARTGEN_SESSIONS"] for k in kernels), "none")


def _environment(process: psutil.Process) -> dict[str, str]:
    try:
        return process.environ()
    except psutil.Error:
        return {}


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    os.environ.setdefault("PYTHONUNBUFFERED", "1")
    main()
