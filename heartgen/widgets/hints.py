"""What controls say about themselves: on hover, and to those who do not see them.

ipywidgets leaves out the texts of controls that have a label, the roles of boxes, the names of
sliders and the alternative texts of pictures.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import anywidget
from traitlets import Dict

SCRIPT = Path(__file__).parent / "web" / "hints.js"

MARKED = "hg-marked-"
"""Begins the CSS class of a widget with attributes."""


class Hints(anywidget.AnyWidget):
    """Texts and attributes by the CSS class of their widget; once on every page."""

    _esm = SCRIPT
    hints: Dict[str, str] = Dict().tag(sync=True)
    attributes: Dict[str, dict[str, str]] = Dict().tag(sync=True)


@lru_cache(1)
def hints() -> Hints:
    """The texts of all controls."""
    return Hints()


def explained(control: Any, hint: str) -> Any:
    """A control that explains itself on hover.

    Parameters
    ----------
    control : ipywidgets.Widget
        Returned with a class that the hint is tied to.
    hint : str
        What is shown, a sentence.
    """
    known = hints()
    name = f"hg-hint-{len(known.hints)}"
    known.hints = {**known.hints, name: hint}
    control.add_class(name)
    return control


def marked(widget: Any, **attributes: str) -> Any:
    """A widget whose element has attributes of HTML, such as a role; others that it has stay.

    Parameters
    ----------
    widget : ipywidgets.Widget
        Returned with a class that the attributes are tied to.
    **attributes : str
        By name, with underscores for hyphens: ``aria_label="Input"``.
    """
    known = hints()
    name = next((c for c in widget._dom_classes if c.startswith(MARKED)), "")
    if not name:
        name = f"{MARKED}{len(known.attributes)}"
        widget.add_class(name)
    given = {key.replace("_", "-"): value for key, value in attributes.items()}
    before = known.attributes.get(name, {})
    if {**before, **given} != before:
        known.attributes = {**known.attributes, name: {**before, **given}}
    return widget
