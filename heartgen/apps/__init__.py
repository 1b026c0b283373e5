"""The dashboard: mask in, mesh out, in a browser with nothing to install.

State lives in a model that knows no widget (`Session` and its parts); the panels draw it; the same
page serves Voila, JupyterLab and a notebook cell.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heartgen.errors import HeartgenError

if TYPE_CHECKING:
    from heartgen.apps.page import dashboard
    from heartgen.apps.session import Session

__all__ = ["Session", "dashboard"]

_HOMES = {"Session": "heartgen.apps.session", "dashboard": "heartgen.apps.page"}


def __getattr__(name: str) -> Any:
    """Load a public name, or say which packages are missing for it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'heartgen.apps' has no attribute {name!r}")
    try:
        return getattr(import_module(_HOMES[name]), name)
    except ModuleNotFoundError as error:
        raise HeartgenError(
            f"the dashboard needs the package {error.name}, which is not installed: "
            "pip install 'heartgen[apps]'"
        ) from error
