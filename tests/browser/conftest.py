"""A real browser on the dashboard, served as Binder serves it: one port, a prefix, no network."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip("playwright.sync_api")
pytest.importorskip("voila")
pytest.importorskip("trame_vtk")

from playwright.sync_api import expect

from benchmarks import chromium

expect.set_options(timeout=30_000)  # milliseconds: two cores do more than one page

PREFIX = "/user/x/"
SIZE = {"width": 1440, "height": 900}
STARTING = 180


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def wait_for(address: str, server: subprocess.Popen) -> None:
    """Wait until a server answers."""
    end = time.monotonic() + STARTING
    while time.monotonic() < end:
        assert server.poll() is None, "the server ended"
        try:
            urllib.request.urlopen(address, timeout=5)
            return
        except OSError:
            time.sleep(0.2)
    raise AssertionError(f"no answer from {address}")


@pytest.fixture(scope="session")
def server(repository: Path, tmp_path_factory: pytest.TempPathFactory):
    """Process and address of a server with exactly the settings of binder/."""
    folder = tmp_path_factory.mktemp("server")
    (folder / "config").mkdir()
    for name in ("binder/jupyter_server_config.py", "apps/voila.json", "binder/voila.py"):
        shutil.copy(repository / name, folder / "config")
    port = free_port()
    environment = {
        **os.environ,
        "JUPYTERHUB_SERVICE_PREFIX": PREFIX,
        "JUPYTER_CONFIG_DIR": str(folder / "config"),
        "JUPYTER_PATH": str(repository / "heartgen" / "serving"),
        "JUPYTER_RUNTIME_DIR": str(folder / "runtime"),
        "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow",
    }
    command = [sys.executable, "-m", "jupyter", "server", "--no-browser", "--allow-root", "-y"]
    command += [f"--ServerApp.port={port}", "--ServerApp.port_retries=0", "--ip=127.0.0.1"]
    command += [f"--ServerApp.base_url={PREFIX}", f"--ServerApp.root_dir={repository}"]
    command += ["--IdentityProvider.token=", "--ServerApp.log_level=40"]
    with (folder / "log").open("wb") as log:
        server = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
        try:
            wait_for(f"http://127.0.0.1:{port}{PREFIX}api", server)
            yield server, f"http://127.0.0.1:{port}{PREFIX}voila/render/apps/dashboard.ipynb"
        finally:
            server.terminate()
            server.wait(30)


@pytest.fixture(scope="session")
def apps(server):
    """Address of the folder of the apps."""
    return server[1].removesuffix("dashboard.ipynb")


@pytest.fixture(scope="session")
def address(server):
    """Address of the page."""
    return server[1]


@pytest.fixture(scope="module")
def browser():
    """Chromium as Debian has it; its event loop must not outlive these tests."""
    if chromium.find() is None:
        pytest.skip(f"no browser is installed: none of {', '.join(chromium.NAMES)} is on the PATH")
    with chromium.launched() as browser:
        yield browser


@pytest.fixture(scope="module")
def page(browser, address):
    """The dashboard with its first sample loaded."""
    page = browser.new_page(viewport=SIZE, accept_downloads=True)
    page.set_default_timeout(120_000)
    page.goto(address)
    page.wait_for_selector(".hg-side .hg-step-input .hg-done")
    yield page
    page.close()
