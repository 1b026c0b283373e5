"""The browser's part in keeping a session: it knows the key, and asks before results are left."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import anywidget
from traitlets import Bool

MOST = 5
"""Keys of sessions that a browser may name."""


@dataclass(frozen=True)
class Greeting:
    """What a browser says when the page is on its screen.

    Attributes
    ----------
    mine : str
        Key of the session of this tab, if it had one.
    left : tuple of str
        Keys of sessions of pages that were closed, the newest first.
    address : str
        Of the page, without what follows its path.
    again : bool
        Whether the page was loaded anew, or returned to: a link that it was opened by was followed.
    """

    mine: str = ""
    left: tuple[str, ...] = ()
    address: str = ""
    again: bool = False


class Keeper(anywidget.AnyWidget):
    """Says which session the browser comes for, and remembers the one that it gets.

    Parameters
    ----------
    greeted : callable
        Called when the page is on the screen.
    beaten : callable
        Called from time to time as long as it is; whether the session is still this page's.
    """

    _esm = Path(__file__).parents[1] / "web" / "keeper.js"
    unsaved = Bool(False).tag(sync=True)

    def __init__(self, greeted: Callable[[Greeting], None], beaten: Callable[[], bool]) -> None:
        super().__init__()
        self._greeted, self._beaten = greeted, beaten
        self.on_msg(self._hear)

    def remember(self, key: str) -> None:
        """Have the browser know the session.

        Parameters
        ----------
        key : str
            Of the session.
        """
        self.send({"kind": "key", "key": key})

    def begin_anew(self) -> None:
        """Have the browser forget the session, and open the page without it."""
        self.unsaved = False
        self.send({"kind": "anew"})

    def _hear(self, _: Any, message: dict[str, Any], __: Any) -> None:
        """A message of the browser."""
        if message.get("kind") == "hello":
            left = [str(key) for key in message.get("left", ())][:MOST]
            mine, address = str(message.get("mine", "")), str(message.get("address", ""))
            again = bool(message.get("again", False))
            self._greeted(Greeting(mine, tuple(left), address, again))
        elif message.get("kind") == "beat" and not self._beaten():
            self.send({"kind": "elsewhere"})
