"""Pieces of the dashboard for a cell of a notebook: look at a result, weigh levels of detail."""

from __future__ import annotations

import atexit
import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import ipywidgets as widgets

from heartgen.errors import InputError
from heartgen.widgets.hints import hints
from heartgen.widgets.input_case import InputCase
from heartgen.widgets.panels.assess import link_tradeoff
from heartgen.widgets.panels.view import ViewPanel
from heartgen.widgets.parts import classed, style, text
from heartgen.widgets.runs import Outcome, post_on_loop
from heartgen.widgets.session import Session
from heartgen.widgets.tradeoff_plot import Tradeoff

if TYPE_CHECKING:
    import pyvista

    from heartgen.result import Personalization

SCENE_HEIGHT = 420
"""Height of a scene in a cell, pixels."""


@dataclass(frozen=True)
class Scene:
    """A scene in 3-D that needs no kernel to be turned: it stays in the notebook.

    Attributes
    ----------
    page : str
        A whole page of HTML.
    height : int
        Pixels.
    """

    page: str
    height: int = SCENE_HEIGHT

    def __repr__(self) -> str:
        return "A scene in 3-D, to be turned with the mouse"

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" title="{self}" '
            f'style="width: 100%; height: {self.height}px; border: 0"></iframe>'
        )


def show_3d(plotter: pyvista.Plotter, height: int = SCENE_HEIGHT) -> Scene:
    """Show a scene in a cell, where it can be turned and stays when the kernel has gone.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Holds the scene, such as ``mesh.plot(off_screen=True)`` makes it.
    height : int
        Pixels.

    Returns
    -------
    Scene
        Show it as the last line of a notebook's cell.
    """
    from heartgen.viewing.page import scene_page

    return Scene(scene_page(plotter), height)


def view(result: Personalization) -> widgets.Widget:
    """Show a result in 3-D: step through its stages, color it, cut it open.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and all on the way to it.

    Returns
    -------
    ipywidgets.Widget
        Show it as the last line of a notebook's cell.
    """
    return _framed(_session([result]))


def compare(results: Sequence[Personalization]) -> widgets.Widget:
    """Plot error against quality; a click on a point shows its mesh in 3-D below.

    Parameters
    ----------
    results : sequence of Personalization
        Of one mask, each at another level of detail, as `heartgen.personalize_levels` makes them.

    Returns
    -------
    ipywidgets.Widget
        Show it as the last line of a notebook's cell.

    Raises
    ------
    InputError
        If there are none, or two have the same level.
    """
    if not results or len({r.options.lod for r in results}) < len(results):
        raise InputError("there is nothing to compare: give results of different levels of detail")
    session = _session(results)
    tradeoff = Tradeoff()
    link_tradeoff(tradeoff, session)
    about = text("Click a point to load its mesh.", "hg-note")
    return _framed(session, classed(widgets.VBox([tradeoff, about]), "hg-panel hg-cell-plot"))


def _session(results: Sequence[Personalization]) -> Session:
    """A session that holds results; the first is shown."""
    mask = results[0].mask
    case = InputCase(mask, "mask", "")
    outcomes = [Outcome(number, case, result) for number, result in enumerate(results, start=1)]
    session = Session(post_on_loop(), outcomes=outcomes)
    atexit.register(session.close)
    session.show(outcomes[0])
    return session


def _framed(session: Session, *above: widgets.Widget) -> widgets.Widget:
    """The 3-D view in a frame that a notebook's cell can hold."""
    panel = ViewPanel(session, titled=False)
    panel.open()
    made = classed(widgets.VBox([style(), *above, panel.widget, hints()]), "hg-app hg-cell")
    made.session = session
    return made
