"""What a visitor of the dashboard may ask of Jupyter's server: the page, and their own kernel."""

from __future__ import annotations

import sys
from typing import Any

from jupyter_server.auth import Authorizer, User
from jupyter_server.base.handlers import JupyterHandler
from jupyter_server.serverapp import ServerApp


class OnlyThePage(Authorizer):
    """Refuses files, terminals, sessions, the list of kernels, and new kernels.

    A kernel's number cannot be guessed: who knows it has its page.
    """

    def is_authorized(
        self, handler: JupyterHandler, user: User, action: str, resource: str
    ) -> bool:
        """Whether a request may pass.

        Parameters
        ----------
        handler : JupyterHandler
            Of the request.
        user : User
            Who asks.
        action : str
            Such as ``"read"`` or ``"execute"``.
        resource : str
            Such as ``"kernels"``.
        """
        named: dict[str, Any] = handler.path_kwargs
        known = "kernel_id" in named or bool(handler.path_args)
        return resource == "kernels" and known and action in ("read", "execute")


def _jupyter_server_extension_points() -> list[dict[str, str]]:
    """What Jupyter's server is to load."""
    return [{"module": __name__}]


def _load_jupyter_server_extension(server: ServerApp) -> None:
    """Have the address told once the server answers."""
    # the first turn of the loop binds the port, later than this: in the second, it answers
    server.io_loop.add_callback(server.io_loop.add_callback, _say_where, server)


def _say_where(server: ServerApp) -> None:
    """Print the address, once there is a port: it may be another than the first that was tried."""
    token = server.identity_provider.token
    query = f"?token={token}" if token else ""
    called = "dashboard" if "dashboard" in server.default_url else "apps"
    address = f"http://{server.ip}:{server.port}{server.base_url}{query}"
    print(f"heartgen {called}: {address}   (Ctrl-C ends it)", file=sys.stderr, flush=True)
