"""Hearts for an app: samples at a click, and files with a word on what they are."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import ipywidgets as widgets

from heartgen.widgets.panels.source import OWN, SCHEMES
from heartgen.widgets.parts import card, choose, classed, row, text
from heartgen.widgets.session import MAX_UPLOAD
from heartgen.widgets.transfer import MEGABYTE, Upload


class FilePanel:
    """A list of samples and a drop zone.

    Parameters
    ----------
    folder : Path
        Where files are written.
    samples : iterable of (str, str)
        Titles and names.
    chosen : callable
        Called with the name of a sample.
    arrived : callable
        Called with the path of a file, and the scheme of its labels.
    refused : callable
        Called with a sentence.
    formats : str
        What may be uploaded, for the user.

    Attributes
    ----------
    widget : ipywidgets.VBox
        To be put on the page.
    first : str or None
        Sample that is taken when the page is on the screen.
    """

    def __init__(
        self,
        folder: Path,
        samples: Iterable[tuple[str, str]],
        chosen: Callable[[str], Any],
        arrived: Callable[[Path, str], Any],
        refused: Callable[[str], Any],
        formats: str,
    ) -> None:
        self.first: str | None = None
        self._chosen, self._arrived = chosen, arrived
        self.sample = choose(
            [("Choose …", ""), *samples], "", "Sample", "Hearts of known shape, to try this with"
        )
        self.scheme = choose(
            SCHEMES, SCHEMES[0][1], "File is", "What the numbers in an uploaded image stand for"
        )
        self.roles = row(
            "Labels",
            widgets.Text("lv_myocardium=2,lv_pool=3,rv_pool=1", continuous_update=False, layout={}),
            "Roles and their labels: lv_myocardium, lv_pool, rv_pool, rv_myocardium",
        )
        self.roles.layout.display = "none"
        for control in (self.sample, self.scheme, self.roles):
            classed(control, "hg-above")
        self.upload = Upload(folder, MAX_UPLOAD, self._take_file, refused, self._shown)
        self.sample.observe(self._take_sample, "value")
        self.scheme.observe(self._scheme_chosen, "value")
        limit = text(f"{formats}, up to {MAX_UPLOAD / MEGABYTE:.0f} MB", "hg-note")
        self.parts = [self.sample, self.scheme, self.roles, self.upload, limit]

    def card(self, title: str, *others: Any) -> widgets.VBox:
        """Its controls, and others below them, under a title.

        Parameters
        ----------
        title : str
            Above the controls.
        *others : ipywidgets.Widget
            Below them.
        """
        return card(title, *self.parts, *others)

    def _shown(self) -> None:
        """The page is on the screen: what changes before, a browser may miss."""
        first, self.first = self.first, None
        if first is not None:
            self.sample.value = first

    def _take_sample(self, change: Any) -> None:
        """Take a sample; afterwards, the same may be chosen again."""
        if change["new"]:
            self._chosen(change["new"])
            self.sample.value = ""

    def _take_file(self, path: Path) -> None:
        scheme = self.roles.value if self.scheme.value == OWN else self.scheme.value
        self._arrived(path, scheme)

    def _scheme_chosen(self, change: Any) -> None:
        self.roles.layout.display = "" if change["new"] == OWN else "none"
