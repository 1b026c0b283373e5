"""The dashboard: mask in, mesh out, in a browser with nothing to install.

State lives in a model that knows no widget (`Session` and its parts); the panels draw it; the same
page serves Voila, JupyterLab and a notebook cell.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heartgen.errors import needing
from heartgen.renamed import keep_former_names

if TYPE_CHECKING:
    from heartgen.apps.dashboard_page import dashboard
    from heartgen.apps.notebook_cells import compare, view
    from heartgen.apps.session import Session

__all__ = ["Session", "compare", "dashboard", "view"]

_HOMES = {
    "Session": "heartgen.apps.session",
    "compare": "heartgen.apps.notebook_cells",
    "dashboard": "heartgen.apps.dashboard_page",
    "view": "heartgen.apps.notebook_cells",
}


def __getattr__(name: str) -> Any:
    """Load a public name, or say which packages are missing for it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'heartgen.apps' has no attribute {name!r}")
    with needing("the dashboard needs", "apps"):
        return getattr(import_module(_HOMES[name]), name)


keep_former_names(__name__)
