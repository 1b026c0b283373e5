"""What a page begins with: the session the browser comes for, what a link asks for, or a sample."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.errors import HeartgenError, sentence
from heartgen.widgets.keeping.archive import open_saved
from heartgen.widgets.keeping.keeper import Greeting, Keeper
from heartgen.widgets.keeping.past import Past
from heartgen.widgets.keeping.store import Store, begun, found
from heartgen.widgets.links import Link

if TYPE_CHECKING:
    from heartgen.widgets.session import Session

QUERY = "QUERY_STRING"
"""Variable in which Voila tells what follows the question mark of the page's address."""

BACK = "bringing your session back"


class ComingBack:
    """Finds the visitor's session, and has the browser know it.

    Parameters
    ----------
    session : Session
        That nothing was done in yet.
    first : str, optional
        Sample to begin with where there is nothing to come back to; None for none.
    """

    def __init__(self, session: Session, first: str | None = None) -> None:
        self._session, self._first = session, first
        self._run_at_once = False
        self._greeted = False
        self._had = 0
        self.address = ""
        self.keeper = Keeper(self.greet, self._beat)
        self.followed: list[Callable[[], Any]] = []
        self.resumed: list[Callable[[], Any]] = []
        session.observe(self._draw_unsaved, ["runs", "outcomes", "taken", "states"])
        session.observe(self._run_once_ready, ["states"])

    @property
    def store(self) -> Store:
        """Folder of the session of the moment."""
        assert self._session.keeping is not None
        return self._session.keeping.store

    def greet(self, greeting: Greeting) -> None:
        """The page is on the screen: begin.

        Parameters
        ----------
        greeting : Greeting
            What the browser says.
        """
        if self._greeted:  # the page is shown a second time, as notebooks do
            return
        self._greeted, self.address = True, greeting.address
        if self._session.keeping is not None:
            self._session.keeping.fitter.start()  # its imports are done while the heart is read
        self._session.origin = {}
        try:
            link = Link.read(os.environ.get(QUERY, ""))
            past = self._left(greeting, link)
        except HeartgenError as error:
            link, past, self._first = Link(), None, None
            self._session.refuse(str(error))
        if past is not None:
            self._bring(past)
        else:
            self._begin(link)
            self._known()

    def _left(self, greeting: Greeting, link: Link) -> Store | None:
        """The session that the browser comes for, if something was done in it."""
        if link.empty or greeting.again:
            mine = found(greeting.mine)
            if mine is not None and mine.read() is not None:
                return mine
        left = map(found, greeting.left if link.empty else ())
        return next((store for store in left if store is not None and _is_missed(store)), None)

    def open_file(self, path: Path) -> None:
        """Open a session that was saved, in place of the one that is here.

        Parameters
        ----------
        path : Path
            The file.
        """
        store = begun()
        self._leave_work()
        self._read(store, lambda: open_saved(path, store), f"opening {path.name}", fresh=True)

    def begin_anew(self) -> None:
        """Forget the session, and everything that is kept of it."""
        self._leave_work()
        self.keeper.begin_anew()
        if self.store.mine:
            self.store.remove()

    def saved(self) -> None:
        """The visitor has all that was done."""
        self._had = len(self._session.outcomes)
        self.keeper.unsaved = self._session.active_run is not None

    def _begin(self, link: Link) -> None:
        """Begin with what a link asks for, or with the first sample."""
        session = self._session
        for name, value in link.choices.items():
            setattr(session.choices, name, value)
        self._run_at_once = link.run
        sample = link.sample or self._first
        if sample and session.case is None and not session.reading:
            session.load_sample(sample)
        self._follow()

    def _bring(self, store: Store) -> None:
        """Take a session over."""
        self._read(store, lambda: None, BACK, fresh=False)

    def _read(self, store: Store, prepare: Callable[[], None], doing: str, fresh: bool) -> None:
        """Read a session in the thread, then go on with it."""
        session, keeping = self._session, self._session.keeping
        assert keeping is not None
        session.awaited, session.reading, session.complaint = True, doing, ""

        def read() -> None:
            try:
                prepare()
                past = keeping.past(store)
            except Exception as error:
                said = sentence(error)
                session.post(lambda: self._stay(said))
                if fresh:
                    store.remove()
            else:
                session.post(lambda: self._go_on(store, past))

        session.submit(read)

    def _go_on(self, store: Store, past: Past) -> None:
        """Be as the session was."""
        session, keeping = self._session, self._session.keeping
        assert keeping is not None
        self._leave_work()  # what was begun in the meantime would be written into the other
        keeping.move(store, past)
        past.restore(session)
        self._follow()
        self._known()

    def _leave_work(self) -> None:
        """End what goes on, and begin nothing that waits."""
        self._session.queue = []
        for run in self._session.runs:
            run.cancel()

    def _stay(self, said: str) -> None:
        """Go on without a session that could not be read."""
        self._session.refuse(said)
        self._known()

    def _follow(self) -> None:
        """Have the panels say what is there now."""
        for follow in self.followed:
            follow()

    def _known(self) -> None:
        """Have the browser know the session, where it can be found again."""
        if self.store.lasting:
            self.keeper.remember(self.store.key)

    def _beat(self) -> bool:
        """A sign of life: whether the session is still this page's."""
        if not self.store.mine:
            return False
        was_left = self.store.left  # as far as was known: computers sleep
        self.store.hold()
        if was_left:
            for resume in self.resumed:
                resume()
        return True

    def _draw_unsaved(self, change: Any) -> None:
        """Whether something would be missed: a mesh that was not taken away, or a run."""
        meshes = len(self._session.outcomes)
        if change["name"] == "taken" and change["new"]:
            self._had = meshes
        self.keeper.unsaved = meshes > self._had or self._session.active_run is not None

    def _run_once_ready(self, _: Any) -> None:
        """Run what a link asks for as soon as its heart is measured."""
        session = self._session
        if self._run_at_once and session.anatomy is not None and not session.reading:
            self._run_at_once = False
            session.post(self._start)

    def _start(self) -> None:
        with suppress(HeartgenError):  # what a link asks for contradicts itself: the page says so
            self._session.start()


def _is_missed(store: Store) -> bool:
    """Whether there is more in a session that was left than a sample, which is soon there again."""
    try:
        told = store.read() or {}
    except HeartgenError:  # damaged, and not asked for
        return False
    return bool(told.get("runs") or told.get("queue") or "file" in told.get("origin", ()))
