"""What the apps are made of: each in one function, and pieces for the cells of a notebook.

State lives in a model that knows no widget (`Session` and its parts); the panels draw it; the same
page serves Voila, JupyterLab and a notebook cell.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heartgen.errors import needing
from heartgen.renamed import keep_former_names

if TYPE_CHECKING:
    from heartgen.widgets.dashboard_page import dashboard
    from heartgen.widgets.exercises import Exercise
    from heartgen.widgets.index_page import index
    from heartgen.widgets.notebook_cells import compare, show_3d, view
    from heartgen.widgets.session import Session
    from heartgen.widgets.sliders import live
    from heartgen.widgets.states_page import states
    from heartgen.widgets.tradeoff_page import tradeoff

__all__ = [
    "Exercise",
    "Session",
    "compare",
    "dashboard",
    "index",
    "live",
    "show_3d",
    "states",
    "tradeoff",
    "view",
]

_HOMES = {
    "Exercise": "heartgen.widgets.exercises",
    "Session": "heartgen.widgets.session",
    "compare": "heartgen.widgets.notebook_cells",
    "dashboard": "heartgen.widgets.dashboard_page",
    "index": "heartgen.widgets.index_page",
    "live": "heartgen.widgets.sliders",
    "states": "heartgen.widgets.states_page",
    "tradeoff": "heartgen.widgets.tradeoff_page",
    "show_3d": "heartgen.widgets.notebook_cells",
    "view": "heartgen.widgets.notebook_cells",
}


def __getattr__(name: str) -> Any:
    """Load a public name, or say which packages are missing for it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'heartgen.widgets' has no attribute {name!r}")
    with needing("the dashboard needs", "apps"):
        return getattr(import_module(_HOMES[name]), name)


keep_former_names(__name__)
