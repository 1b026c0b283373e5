"""What a visitor of the dashboard may ask of Jupyter's server: the page, and their own kernel."""

from __future__ import annotations

import re
from typing import Any

import psutil
from jupyter_server.auth import Authorizer, User
from jupyter_server.base.handlers import JupyterHandler
from jupyter_server_proxy.handlers import LocalProxyHandler

LOCAL = ("localhost", "127.0.0.1")
"""Where kernels have their ports."""

PORT = re.compile(r"/proxy/(?:absolute/)?(\d+)(?:/|$)")
"""Of a request to the proxy."""


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


def close_proxy() -> None:
    """Let the proxy pass nothing on but what belongs to a 3-D view.

    Its own list of what is allowed is not asked for ports of this machine (4.6), so that its
    question is answered here.
    """
    LocalProxyHandler._check_host_allowlist = is_a_view


def is_a_view(handler: Any, host: str) -> bool:
    """Whether the proxy may pass a request on: to the 3-D view of a kernel, to nothing else here.

    Parameters
    ----------
    handler : tornado.web.RequestHandler
        Of the request.
    host : str
        Where it is to go.

    Returns
    -------
    bool
    """
    asked = PORT.search(handler.request.path)
    if host not in LOCAL or asked is None:
        return False
    return any(
        connection.status == psutil.CONN_LISTEN and connection.laddr.port == int(asked[1])
        for kernel in psutil.Process().children(recursive=True)
        for connection in kernel.net_connections(kind="tcp")
    )
