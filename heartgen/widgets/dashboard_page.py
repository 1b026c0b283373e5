"""The page: the panels in their places, one session behind them."""

from __future__ import annotations

import atexit
from functools import partial
from typing import Any

import ipywidgets as widgets

from heartgen.errors import InputError
from heartgen.widgets.coming_back import ComingBack
from heartgen.widgets.frame import framed, two_sided
from heartgen.widgets.help import SHORTCUTS, TOUR, Help
from heartgen.widgets.hints import marked
from heartgen.widgets.input_case import sample_choices
from heartgen.widgets.keeping.session import Keeping
from heartgen.widgets.keeping.store import begun
from heartgen.widgets.other_levels import OtherLevels
from heartgen.widgets.panels.assess import AssessPanel
from heartgen.widgets.panels.export import ExportPanel
from heartgen.widgets.panels.fit_options import OptionsPanel
from heartgen.widgets.panels.keeping import KeepPanel
from heartgen.widgets.panels.running import RunPanel
from heartgen.widgets.panels.service import ServicePanel
from heartgen.widgets.panels.slices import SlicesPanel
from heartgen.widgets.panels.source import SourcePanel
from heartgen.widgets.panels.view import ViewPanel
from heartgen.widgets.parts import button, classed
from heartgen.widgets.runs import post_on_loop
from heartgen.widgets.session import Session

FIRST = "lifelike"
"""Sample that is loaded when the page opens."""

ABOUT = "From a segmentation of the heart to a personalized cubic Hermite mesh"


def dashboard(sample: str | None = FIRST) -> widgets.Widget:
    """Make the dashboard.

    Parameters
    ----------
    sample : str or None
        Sample to load as soon as the page is on the screen.

    Returns
    -------
    ipywidgets.Widget
        Show it as the last line of a notebook's cell. Its `session` is the state behind the page.

    Raises
    ------
    InputError
        If there is no such sample.
    """
    if sample is not None and sample not in (name for _, name in sample_choices()):
        raise InputError(f"There is no sample {sample!r}; see heartgen.samples.names().")
    page = Page(sample)
    page.widget.session = page.session
    page.widget.page = page
    return page.widget


class Page:
    """All panels, and which of them is in the middle.

    Parameters
    ----------
    first : str, optional
        Sample to begin with; None for none.
    """

    def __init__(self, first: str | None = None) -> None:
        self.session = Session(post_on_loop(), Keeping(begun()))
        atexit.register(self.session.close)
        session = self.session
        self.back = ComingBack(session, first)
        self.others = OtherLevels(session)
        self.back.resumed.append(self.others.consider)
        atexit.register(self.others.close)
        self.source = SourcePanel(session)
        self.source.opened = self.back.open_file
        self.back.followed.append(self.source.recall)
        self.options = OptionsPanel(session)
        self.running = RunPanel(session)
        self.service = ServicePanel(session)
        self.keep = KeepPanel(session, self.back)
        atexit.register(self.service.remote.close)
        self.panels: dict[str, Any] = {
            "input": SlicesPanel(session),
            "view": ViewPanel(session),
            "assess": AssessPanel(session),
            "export": ExportPanel(session),
        }
        self.tabs = {
            key: button(title, tip, partial(self.turn_to, key), f"hg-tab hg-tab-{key}")
            for key, title, tip in (
                ("input", "1 Slices", "The mask in three slices, and what the checks found"),
                ("view", "4 View", "The heart in 3-D"),
                ("assess", "5 Assess", "How good the mesh is"),
                ("export", "6 Export", "Download the mesh"),
            )
        }
        side = [
            *(self.source.widget, self.options.widget, self.running.widget),
            *(self.keep.widget, self.service.widget),
        ]
        for key, panel in self.panels.items():
            title = self.tabs[key].description
            marked(self.tabs[key], role="tab", aria_controls=f"hg-panel-{key}")
            marked(panel.widget, role="tabpanel", id=f"hg-panel-{key}", aria_label=title)
        tabs = classed(widgets.HBox(list(self.tabs.values())), "hg-tabs")
        middle = [
            marked(tabs, role="tablist", aria_label="Steps"),
            *(panel.widget for panel in self.panels.values()),
        ]
        guide = Help(TOUR, SHORTCUTS)
        parts = [two_sided(side, middle), self.back.keeper]
        self.widget = framed(parts, ABOUT, guide=guide, kept=self.back.store.lasting)
        session.observe(self._mark, "states")
        session.observe(self._start_view, ["anatomy"])
        session.observe(self._follow, ["shown"])
        session.observe(self._complain, ["complaint", "case"])
        self.turn_to("input")

    def turn_to(self, key: str) -> None:
        """Put a panel into the middle.

        Parameters
        ----------
        key : str
            Name of the panel.
        """
        for name, panel in self.panels.items():
            panel.widget.layout.display = "" if name == key else "none"
            tab = self.tabs[name]
            (tab.add_class if name == key else tab.remove_class)("hg-open")
            marked(
                tab,
                aria_selected=str(name == key).lower(),
                tabindex="0" if name == key else "-1",
            )

    def _mark(self, _: Any) -> None:
        """Show on the tabs how their steps stand."""
        for key, tab in self.tabs.items():
            phase = self.session.states[key].phase
            for name in ("blocked", "ready", "running", "done", "failed"):
                (tab.add_class if name == phase else tab.remove_class)(f"hg-is-{name}")

    def _follow(self, change: Any) -> None:
        """Show the first mesh of a case as soon as it is there."""
        if change["new"] is not None and change["old"] is None:
            self.turn_to("view")

    def _complain(self, change: Any) -> None:
        """Show a new input, or why it was refused."""
        if change["new"]:
            self.turn_to("input")

    def _start_view(self, _: Any) -> None:
        """Start the 3-D view once there is something to see; its libraries take long to load."""
        self.panels["view"].open()
