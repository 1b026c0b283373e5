"""Pictures of a personalisation: the 3-D view, slices of the mask, and a page with the report.

Each is loaded when it is first used, so that slices do not wait for VTK, nor the other way round.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heartgen.errors import HeartgenError

if TYPE_CHECKING:
    from heartgen.viewing.fields import plot_fibres, plot_field
    from heartgen.viewing.page import view_html
    from heartgen.viewing.scene import plot
    from heartgen.viewing.slices import draw_slices

__all__ = [
    "draw_slices",
    "plot",
    "plot_fibres",
    "plot_field",
    "view_html",
]

_HOMES = {
    "plot_fibres": "heartgen.viewing.fields",
    "plot_field": "heartgen.viewing.fields",
    "draw_slices": "heartgen.viewing.slices",
    "plot": "heartgen.viewing.scene",
    "view_html": "heartgen.viewing.page",
}


def __getattr__(name: str) -> Any:
    """Load a public name, or say which packages are missing for it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'heartgen.viewing' has no attribute {name!r}")
    try:
        return getattr(import_module(_HOMES[name]), name)
    except ModuleNotFoundError as error:
        raise HeartgenError(
            f"pictures need the package {error.name}, which is not installed: "
            "pip install 'heartgen[plot]'"
        ) from error
