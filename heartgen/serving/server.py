"""`heartgen dashboard`, `heartgen apps`: Jupyter's server with Voila on one port, and no more."""

from __future__ import annotations

import json
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from heartgen.errors import HeartgenError
from heartgen.serving.limits import (
    CULL_SECONDS,
    IDLE_SECONDS,
    IDLE_SECONDS_UNKEPT,
    MESSAGE_BYTES,
    OUTPUT_BYTES_PER_SECOND,
    limit_memory,
)

DASHBOARD, INDEX = "dashboard", "index"
"""Names of the notebooks that are opened: one app alone, and the page that leads to all."""

SETTINGS = "voila.json"
"""Voila's configuration, beside the notebooks."""

LOCAL = ("localhost", "127.0.0.1", "::1")
"""Hosts that only this machine reaches."""

WIDGET_MESSAGES = [
    "comm_open",
    "comm_close",
    "comm_msg",
    "comm_info_request",
    "kernel_info_request",
    "shutdown_request",
]
"""What a browser may tell a kernel: moves of widgets, but no code."""

NEEDED = ("jupyter_server", "voila", "ipywidgets", "anywidget", "pyvista")

GUARD = "heartgen.serving.guard"
"""Module that says what may be asked of the server."""

POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob: ws: wss:; frame-ancestors 'self'"
)
"""The page loads nothing from elsewhere: no one else learns of a visitor. (Scripts of widgets are
blobs; Voila's page would ask a network for fonts.)"""

TEMPLATE = "heartgen"
"""Of Voila's pages, in `voila/templates` beside this module: its loading screen."""

KERNEL = {"HistoryManager": {"enabled": False}, "IPKernelApp": {"log_level": 40}}
"""Kernels keep no history, and tell errors only."""


@dataclass(frozen=True)
class Address:
    """Where the apps are served.

    Attributes
    ----------
    host : str
        Name or number of the machine's address.
    port : int or None
        None for the first free one from Jupyter's usual.
    token : str or None
        None for one that is made up where others could reach the page, and none where they cannot.
    base_url : str
        Begins and ends in a slash.
    browser : bool
        Open the page.
    page : {"dashboard", "index"}
        The dashboard alone, or the page that leads to all apps.
    """

    host: str = "localhost"
    port: int | None = None
    token: str | None = None
    base_url: str = "/"
    browser: bool = True
    page: str = DASHBOARD


def serve(place: Address) -> None:
    """Serve the apps until they are interrupted.

    Parameters
    ----------
    place : Address
        Where.

    Raises
    ------
    HeartgenError
        If packages are missing, or the port is taken.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise HeartgenError(
            f"the apps need the packages {', '.join(missing)}, which are not installed: "
            "pip install 'heartgen[apps]'"
        )
    from jupyter_server.serverapp import ServerApp

    limit_memory()
    with served_folder(place.page) as folder:
        os.environ.update(environment(folder))
        try:
            ServerApp.launch_instance(argv=arguments(place, folder))
        except SystemExit as ended:
            if ended.code:
                raise HeartgenError(
                    f"the apps could not be served on {place.host}, port {place.port}: "
                    "choose another port with --port"
                ) from None


@contextmanager
def served_folder(page: str = DASHBOARD) -> Iterator[Path]:
    """Lend a folder that holds the page and what configures it; it is removed afterwards.

    Parameters
    ----------
    page : {"dashboard", "index"}
        The notebook that is served; all of them with the index.
    """
    folder = Path(tempfile.mkdtemp(prefix="heartgen-apps-"))
    try:
        (folder / "served").mkdir()
        (folder / "visitors").mkdir()
        (folder / "config").mkdir()
        home = notebooks()
        for notebook in home.glob("*.ipynb" if page == INDEX else f"{page}.ipynb"):
            shutil.copy(notebook, folder / "served")
        shutil.copy(home / SETTINGS, folder / "config")
        profile = folder / "ipython" / "profile_default"
        profile.mkdir(parents=True)
        (profile / "ipython_kernel_config.json").write_text(json.dumps(KERNEL), encoding="utf-8")
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def notebooks() -> Path:
    """Folder of the apps' notebooks: in the installed package, or in the checkout beside it."""
    here = Path(__file__).resolve()
    for path in (here.parent / "apps", here.parents[2] / "apps"):
        if (path / SETTINGS).is_file():
            return path
    raise HeartgenError("the apps are missing from the installation: install heartgen again")


def environment(folder: Path) -> dict[str, str]:
    """Variables of the server, which its kernels inherit.

    Parameters
    ----------
    folder : Path
        With the server's settings.
    """
    return {
        "JUPYTER_CONFIG_PATH": _before("JUPYTER_CONFIG_PATH", folder / "config"),
        "JUPYTER_PATH": _before("JUPYTER_PATH", Path(__file__).parent),
        "HEARTGEN_SESSIONS": str(folder / "sessions"),
        "TMPDIR": str(folder / "visitors"),  # goes with the server, even if a kernel is killed
        "IPYTHONDIR": str(folder / "ipython"),
        "PYDEVD_DISABLE_FILE_VALIDATION": "1",
    }


def _before(variable: str, path: Path) -> str:
    """A variable's paths with another that comes first."""
    return os.pathsep.join(filter(None, [str(path), os.environ.get(variable, "")]))


def arguments(place: Address, folder: Path) -> list[str]:
    """Command line of Jupyter's server.

    Parameters
    ----------
    place : Address
        Where the apps are served.
    folder : Path
        With the server's settings.
    """
    local = place.host in LOCAL
    token = place.token if place.token is not None else "" if local else secrets.token_urlsafe(24)
    extensions = {
        "voila.server_extension": True,
        GUARD: True,
        **dict.fromkeys(
            (
                "jupyterlab",
                "notebook_shim",
                "jupyter_lsp",
                "jupyter_server_proxy",
                "jupyter_server_terminals",
            ),
            False,
        ),
    }
    options: dict[str, Any] = {
        "ServerApp.ip": place.host,
        "ServerApp.base_url": place.base_url,
        "ServerApp.root_dir": str(folder / "served"),
        "ServerApp.default_url": f"/voila/render/{place.page}.ipynb",
        "ServerApp.open_browser": place.browser,
        "ServerApp.jpserver_extensions": extensions,
        "ServerApp.authorizer_class": f"{GUARD}.OnlyThePage",
        "ServerApp.tornado_settings": {
            "websocket_max_message_size": MESSAGE_BYTES,
            "headers": {"Content-Security-Policy": POLICY},
        },
        "ServerApp.log_level": 40,
        "VoilaConfiguration.template": TEMPLATE,
        "ServerApp.allow_root": True,  # as in containers; the browser cannot run code
        "IdentityProvider.token": token,
        "PasswordIdentityProvider.password_required": False,
        "MappingKernelManager.allowed_message_types": WIDGET_MESSAGES,
        "MappingKernelManager.cull_idle_timeout": (
            IDLE_SECONDS if place.page == DASHBOARD else IDLE_SECONDS_UNKEPT
        ),
        "MappingKernelManager.cull_interval": CULL_SECONDS,
        "ZMQChannelsWebsocketConnection.iopub_data_rate_limit": OUTPUT_BYTES_PER_SECOND,
    }
    if place.port is not None:
        options |= {"ServerApp.port": place.port, "ServerApp.port_retries": 0}
    return [f"--{name}={value}" for name, value in options.items()] + ["-y"]
