"""On the side, where several hearts were uploaded at once: all fitted, one after the other."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import ipywidgets as widgets

from heartgen.widgets.input_case import VIEWS
from heartgen.widgets.parts import button, choose, classed, text
from heartgen.widgets.session import Session


class SeveralPanel:
    """The hearts that were uploaded: a click looks at one, another fits them all.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.note = text("", "hg-note")
        self.which = widgets.Dropdown(description="Heart", options=[("", "")])
        self.which.tooltip = "The one that is looked at"
        classed(self.which, "hg-row hg-above")
        self.fit = button(
            "Fit all of them",
            "One after the other, with these choices; the table under Assess compares them",
            self._fit,
            "hg-primary",
        )
        self.together = choose(
            (("Hearts, one each", False), ("Views of one heart", True)),
            False,
            "They are",
            "Views: to the stack that is looked at, the contours of the others are added, such as "
            "those of long-axis slices",
        )
        classed(self.together, "hg-above")
        parts = [self.note, self.together, self.which]
        self.widget = widgets.VBox([*parts, classed(widgets.HBox([self.fit]), "hg-buttons")])
        classed(self.widget, "hg-several")
        self._offering = False
        self.which.observe(self.look, "value")
        self.together.observe(self.look, "value")
        session.observe(self._offer, ["hearts", "origin"])
        session.observe(self._draw, ["refused"])
        self._offer()

    def _offer(self, _: Any = None) -> None:
        """Offer the hearts; one alone is no choice."""
        hearts = [Path(origin["file"]) for origin in self.session.hearts]
        self.widget.layout.display = "" if len(hearts) > 1 else "none"
        self._offering = True
        self.which.options = [(path.name, str(path)) for path in hearts] or [("", "")]
        at = self.session.origin.get("file", "")
        if Path(at) in hearts:
            self.which.value = at
        self.together.value = Path(at) in hearts and VIEWS in self.session.origin
        self._offering = False
        self._draw()

    def look(self, _: Any = None) -> None:
        """Look at a heart: one of the files, or what all of them show together."""
        if self._offering:
            return
        hearts = self.session.hearts
        chosen = next(heart for heart in hearts if heart["file"] == self.which.value)
        others = [heart["file"] for heart in hearts if heart is not chosen]
        views = {VIEWS: "\n".join(others)} if self.together.value else {}
        self._draw()
        self.session.load_origin({**chosen, **views})

    def _fit(self) -> None:
        self.session.refused = []
        self.session.start_all(self.session.hearts)

    def _draw(self, _: Any = None) -> None:
        told = "".join(
            f'<p class="hg-complaint" role="alert">{html.escape(sentence)}</p>'
            for sentence in self.session.refused
        )
        self.note.value = f"<p>{len(self.session.hearts)} images were uploaded.</p>{told}"
        self.fit.layout.display = "none" if self.together.value else ""
