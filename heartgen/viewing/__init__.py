"""Pictures of a personalization: the 3-D view, slices of the mask, and a page with the report.

Each is loaded when it is first used, so that slices do not wait for VTK, nor the other way round.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heartgen.errors import needing
from heartgen.renamed import keep_former_names

if TYPE_CHECKING:
    from heartgen.viewing.bullseye import Bullseye, bullseyes, draw_bullseye
    from heartgen.viewing.fiber_glyphs import plot_fibers
    from heartgen.viewing.fields import plot_field
    from heartgen.viewing.figures import draw_histograms, draw_tradeoff
    from heartgen.viewing.motion import compare_html
    from heartgen.viewing.page import view_html
    from heartgen.viewing.plain import plot_mesh, to_pyvista
    from heartgen.viewing.rendering import render
    from heartgen.viewing.scene import plot
    from heartgen.viewing.slice_views import draw_slices
    from heartgen.viewing.stages import draw_mesh, draw_stages

__all__ = [
    "Bullseye",
    "bullseyes",
    "compare_html",
    "draw_bullseye",
    "draw_histograms",
    "draw_mesh",
    "draw_slices",
    "draw_stages",
    "draw_tradeoff",
    "plot",
    "plot_fibers",
    "plot_field",
    "plot_mesh",
    "render",
    "to_pyvista",
    "view_html",
]

_HOMES = {
    "Bullseye": "heartgen.viewing.bullseye",
    "bullseyes": "heartgen.viewing.bullseye",
    "draw_bullseye": "heartgen.viewing.bullseye",
    "compare_html": "heartgen.viewing.motion",
    "draw_histograms": "heartgen.viewing.figures",
    "draw_mesh": "heartgen.viewing.stages",
    "draw_slices": "heartgen.viewing.slice_views",
    "draw_stages": "heartgen.viewing.stages",
    "draw_tradeoff": "heartgen.viewing.figures",
    "plot": "heartgen.viewing.scene",
    "plot_fibers": "heartgen.viewing.fiber_glyphs",
    "plot_field": "heartgen.viewing.fields",
    "plot_mesh": "heartgen.viewing.plain",
    "to_pyvista": "heartgen.viewing.plain",
    "render": "heartgen.viewing.rendering",
    "view_html": "heartgen.viewing.page",
}


def __getattr__(name: str) -> Any:
    """Load a public name, or say which packages are missing for it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'heartgen.viewing' has no attribute {name!r}")
    with needing("pictures need", "plot"):
        return getattr(import_module(_HOMES[name]), name)


keep_former_names(__name__)
