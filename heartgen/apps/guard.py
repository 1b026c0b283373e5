"""What a visitor of the dashboard may ask of Jupyter's server: the page, and their own kernel."""

from __future__ import annotations

from typing import Any

from jupyter_server.auth import Authorizer, User
from jupyter_server.base.handlers import JupyterHandler


class OnlyThePage(Authorizer):
    """Refuses files, terminals, sessions, the list of kernels, and new kernels.

    A kernel's number cannot be guessed: who knows it has its page.
    """

    def is_authorized(
        self, handler: JupyterHandler, user: User, action: str, resource: str
    ) -> bool:
        """Whether a request may pass."""
        named: dict[str, Any] = handler.path_kwargs
        known = "kernel_id" in named or bool(handler.path_args)
        return resource == "kernels" and known and action in ("read", "execute")
