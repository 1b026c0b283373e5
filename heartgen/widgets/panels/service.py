"""On the side: a service that fits the heart instead of this page, and its library of models."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import ipywidgets as widgets

from heartgen.errors import HeartgenError
from heartgen.widgets.parts import button, classed, row, status, text
from heartgen.widgets.remote import Address, Remote
from heartgen.widgets.session import Session

HERE = "http://127.0.0.1:8000"
"""Where `heartgen serve` listens unless told otherwise."""

SHOWN = ("species", "condition", "modality", "phase")
"""What a model is listed with."""


class ServicePanel:
    """Send to a service, and open from its library; folded away, as few need it.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.remote = Remote(session)
        self.more = button(
            "", "A service of heartgen: send it this heart, or open its models", self._unfold
        )
        classed(self.more, "hg-more")
        self.url = _line(widgets.Text(HERE), "Address", "Of a service, as heartgen serve runs it")
        self.token = _line(
            widgets.Password(),
            "Token",
            "From whoever operates the service; not needed on localhost",
        )
        self.send = button(
            "Send to the service",
            "Have it fit this heart with these choices",
            self._send,
            "hg-send",
        )
        self.words = _line(
            widgets.Text(placeholder="human DCM"),
            "Words",
            "All of them are looked for; none lists the latest",
        )
        self.search = button("Search its library", "List models", self._search, "hg-search")
        self.models = row(
            "Model", widgets.Dropdown(options=[("Search first", "")]), "What the search found"
        )
        classed(self.models, "hg-above")
        self.open = button("Open", "Fetch this model and look at it", self._open, "hg-open-model")
        self.note = text("", "hg-remote")
        self.rest = widgets.VBox(
            [
                self.url,
                self.token,
                classed(widgets.HBox([self.send]), "hg-buttons"),
                self.words,
                classed(widgets.HBox([self.search]), "hg-buttons"),
                self.models,
                classed(widgets.HBox([self.open]), "hg-buttons"),
                self.note,
            ]
        )
        self.widget = classed(widgets.VBox([self.more, self.rest]), "hg-card hg-service")
        self._unfolded = True
        self._unfold()
        self.remote.observe(self._draw, ["doing", "complaint", "found"])
        self.remote.observe(self._list, ["models"])
        session.observe(self._draw, ["states"])
        self._draw()

    @property
    def address(self) -> Address:
        """The service that is written down."""
        return Address(self.url.value, self.token.value)

    def _unfold(self) -> None:
        self._unfolded = not self._unfolded
        self.rest.layout.display = "" if self._unfolded else "none"
        self.more.description = f"{'▾' if self._unfolded else '▸'} A service and its library"

    def _send(self) -> None:
        self._try(lambda: self.remote.send(self.address))

    def _search(self) -> None:
        self._try(lambda: self.remote.search(self.address, self.words.value))

    def _open(self) -> None:
        self._try(lambda: self.remote.open(self.address, self.models.value))

    def _try(self, act: Callable[[], Any]) -> None:
        """Act, and say on the page why it cannot be."""
        try:
            self.remote.complaint = ""
            act()
        except HeartgenError as error:
            self.remote.refuse(str(error))

    def _list(self, _: Any) -> None:
        """Offer what was found."""
        found = [(_title(each), each["identifier"]) for each in self.remote.models]
        self.models.options = found or [("Nothing is there", "")]
        self._draw()

    def _draw(self, _: Any = None) -> None:
        """Which buttons are of use, and what is going on."""
        blocked = self.session.states["run"].phase == "blocked"
        self.send.disabled = blocked or self.session.active_run is not None
        self.search.disabled = bool(self.remote.doing)
        self.open.disabled = bool(self.remote.doing) or not self.models.value
        self.note.value = status(self.remote.doing, self.remote.complaint, self.remote.found)


def _line(control: Any, label: str, tooltip: str) -> Any:
    """A line of text with its label above it."""
    return classed(row(label, control, tooltip), "hg-above")


def _title(model: dict[str, Any]) -> str:
    """A model in the list."""
    about = ", ".join(model[name] for name in SHOWN if model[name] not in ("", "unknown"))
    return f"{model['title']} · {about}" if about else str(model["title"])
