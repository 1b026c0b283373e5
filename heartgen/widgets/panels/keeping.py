"""On the side: the session saved to a file, handed on as a link, or forgotten."""

from __future__ import annotations

import html
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import ipywidgets as widgets

from heartgen.errors import HeartgenError, sentence
from heartgen.widgets.coming_back import ComingBack
from heartgen.widgets.keeping.archive import ENDING, saved
from heartgen.widgets.keeping.store import KEPT_SECONDS
from heartgen.widgets.links import query_of
from heartgen.widgets.parts import button, classed, text
from heartgen.widgets.session import Session
from heartgen.widgets.transfer import MEGABYTE, Copy, Download

KEPT = (
    f"This session is kept for {KEPT_SECONDS / 3600:.0f} hours for this browser alone: reload the "
    "page, or come back to it."
)
NOT_KEPT = "This session ends with its kernel: save it to keep it."

OWN_FILE = "The link carries the options, not the file that you uploaded."


class KeepPanel:
    """What becomes of the session; folded away.

    Parameters
    ----------
    session : Session
        The visitor's work.
    back : ComingBack
        Knows its folder, and what the browser knows of it.
    """

    def __init__(self, session: Session, back: ComingBack) -> None:
        self.session, self.back = session, back
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen-save")
        self.more = button("", "Save the session, open it again, hand it on", self._unfold)
        classed(self.more, "hg-more")
        self.save = Download(
            self._make, title="Save session", hint="All inputs and meshes, to be opened here again"
        )
        self.note = text("", "hg-note")
        self.unkept = text("")
        self.link = text("", "hg-code hg-link")
        self.copy = Copy()
        self.anew = button(
            "Forget and begin anew",
            "Remove all that is kept of this session, and open an empty page",
            back.begin_anew,
        )
        self.rest = widgets.VBox(
            [
                text(f"<p>{KEPT if back.store.lasting else NOT_KEPT}</p>", "hg-note"),
                self.save,
                self.note,
                text("<h3>Link to this sample and these options</h3>"),
                self.link,
                self.copy,
                classed(widgets.HBox([self.anew]), "hg-buttons"),
            ]
        )
        if not back.store.lasting:
            self.anew.layout.display = "none"  # the page is a notebook's, which goes on
        self.widget = classed(
            widgets.VBox([self.more, self.unkept, self.rest]), "hg-card hg-service hg-keep"
        )
        self._unfolded = True
        self._unfold()
        session.observe(self._draw, ["states", "case", "shown"])
        session.observe(self._warn, ["unkept"])
        session.choices.observe(self._draw)
        self._draw()

    def _unfold(self) -> None:
        self._unfolded = not self._unfolded
        self.rest.layout.display = "" if self._unfolded else "none"
        self.more.description = f"{'▾' if self._unfolded else '▸'} Keep and share"
        if self._unfolded:
            self._draw()

    def _warn(self, change: Any) -> None:
        """Say that what is done is not kept."""
        said = f'<p class="hg-complaint" role="alert">{html.escape(change["new"])}</p>'
        self.unkept.value = said if change["new"] else ""

    def _draw(self, _: Any = None) -> None:
        """The link of the moment."""
        session = self.session
        self.save.disabled = session.case is None
        if not self._unfolded:
            return
        sample = session.case.origin.get("sample", "") if session.case else ""
        try:
            query = query_of(sample, session.choices.options(), session.shown is not None)
        except HeartgenError as error:
            self.link.value, self.copy.text = html.escape(str(error)), ""
            return
        self.copy.text = f"{self.back.address}?{query}"
        own = "" if sample or session.case is None else f"<p>{OWN_FILE}</p>"
        self.link.value = f"<pre tabindex=0>{html.escape(self.copy.text)}</pre>{own}"

    def _make(self) -> None:
        """Put it into one file, in a thread."""
        name = self.session.case.name if self.session.case else "heart"
        self.note.value = "Saving …"
        self._pool.submit(self._work, f"{name.split('.')[0]}{ENDING}")

    def _work(self, name: str) -> None:
        try:
            content = saved(self.back.store)
        except Exception as error:
            said = sentence(error)
            self.session.post(lambda: self._end(said))
        else:
            self.session.post(lambda: self._hand_over(name, content))

    def _end(self, said: str) -> None:
        self.save.busy = False
        self.note.value = html.escape(said)

    def _hand_over(self, name: str, content: bytes) -> None:
        self.save.hand_over(name, content)
        self.back.saved()
        self.note.value = f"{html.escape(name)}, {len(content) / MEGABYTE:.1f} MB"
