"""A function of a lesson with a slider for each of its arguments.

ipywidgets' own `interact` shows what the function draws in an Output widget. What runs a notebook
for Voila tells the kernel of that on the very socket on which it waits for the cell to end, may
miss it, and then waits forever (nbclient, issue 312). Here it is caught in the kernel, and HTML.
"""

from __future__ import annotations

import html
from base64 import b64encode
from collections.abc import Callable
from typing import Any

import ipywidgets as widgets
from IPython.utils.capture import capture_output

from heartgen.errors import HeartgenError
from heartgen.shown import as_html

SLIDER_WIDTH = "380px"


def live(function: Callable[..., Any], **controls: widgets.Widget) -> widgets.Widget:
    """Show what a function draws, prints and returns, for the values of controls.

    Parameters
    ----------
    function : callable
        Called with a value of each control, by its name, whenever one of them is moved.
    **controls : ipywidgets.Widget
        With a `value`, such as a slider; one without a description is named as the argument.

    Returns
    -------
    ipywidgets.Widget
        Show it as the last line of a notebook's cell.

    Examples
    --------
    >>> from ipywidgets import IntSlider
    >>> from heartgen.widgets import live
    >>> square = live(lambda n: n**2, n=IntSlider(3))
    >>> slider, shown = square.children
    >>> slider.value = 4
    >>> "16" in shown.value
    True
    """
    for name, control in controls.items():
        control.description = control.description or name
        control.layout.width, control.layout.max_width = SLIDER_WIDTH, "100%"
    shown = widgets.HTML()

    def draw(_: object = None) -> None:
        shown.value = _shown(function, {name: each.value for name, each in controls.items()})

    for control in controls.values():
        control.observe(draw, "value")
    draw()
    return widgets.VBox([*controls.values(), shown])


def _shown(function: Callable[..., Any], values: dict[str, Any]) -> str:
    """What a call leaves, as HTML."""
    with capture_output() as caught:
        try:
            returned = function(**values)
        except HeartgenError as error:
            returned = error
    parts = [as_html(caught.stdout)] if caught.stdout else []
    parts += [
        _picture(each.data["image/png"], values)
        for each in caught.outputs
        if "image/png" in each.data
    ]
    if returned is not None:
        parts.append(as_html(str(returned)))
    return "".join(parts)


def _picture(png: bytes | str, values: dict[str, Any]) -> str:
    """A picture; IPython hands over bytes, or has them encoded already."""
    encoded = png if isinstance(png, str) else b64encode(png).decode()
    about = html.escape(", ".join(f"{name} {value}" for name, value in values.items()))
    source = f"data:image/png;base64,{encoded}"
    return f'<img src="{source}" alt="Drawn for {about}" style="max-width: 100%">'
