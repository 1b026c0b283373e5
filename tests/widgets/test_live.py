"""Functions of lessons with sliders: what they print and return is shown, in no Output widget."""

from __future__ import annotations

import pytest

pytest.importorskip("ipywidgets")

from ipywidgets import IntSlider, Output, Widget

from heartgen.errors import InputError
from heartgen.widgets import live


def doubled(n: int) -> int:
    """Print a number, and return twice as much."""
    if n > 5:
        raise InputError("this is <too> much")
    print(f"n is {n}")
    return 2 * n


def test_what_is_printed_and_returned_follows_the_slider() -> None:
    slider, shown = live(doubled, n=IntSlider(2)).children
    assert slider.description == "n"
    assert "n is 2" in shown.value
    assert ">4<" in shown.value
    slider.value = 3
    assert "n is 3" in shown.value
    assert ">6<" in shown.value


def test_an_error_is_said_and_the_next_value_works() -> None:
    slider, shown = live(doubled, n=IntSlider(6)).children
    assert "this is &lt;too&gt; much" in shown.value
    slider.value = 1
    assert ">2<" in shown.value


def test_there_is_no_output_widget() -> None:
    assert not any(isinstance(each, Output) for each in tree(live(doubled, n=IntSlider(2))))


def tree(widget: Widget) -> list[Widget]:
    """A widget and all within."""
    return [widget, *(inner for each in getattr(widget, "children", ()) for inner in tree(each))]
