"""Pieces of the dashboard for a cell of a notebook: look at a result, weigh levels of detail."""

from __future__ import annotations

import atexit
from collections.abc import Sequence
from typing import TYPE_CHECKING

import ipywidgets as widgets

from heartgen.errors import InputError
from heartgen.widgets.input_case import InputCase
from heartgen.widgets.panels.assess import link_tradeoff
from heartgen.widgets.panels.view import ViewPanel
from heartgen.widgets.parts import classed, style, text
from heartgen.widgets.runs import Outcome, post_on_loop
from heartgen.widgets.session import Session
from heartgen.widgets.tradeoff_plot import Tradeoff

if TYPE_CHECKING:
    from heartgen.result import Personalization


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
    made = classed(widgets.VBox([style(), *above, panel.widget]), "hg-app hg-cell")
    made.session = session
    return made
