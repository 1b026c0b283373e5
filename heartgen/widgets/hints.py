"""What controls say about themselves on hover: ipywidgets leaves out those that have a label."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import anywidget
from traitlets import Dict

SCRIPT = Path(__file__).parent / "web" / "hints.js"


class Hints(anywidget.AnyWidget):
    """Texts by the CSS class of their control; once on every page."""

    _esm = SCRIPT
    hints: Dict[str, str] = Dict().tag(sync=True)


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
