"""Long work of an app, one piece after the other, in a thread of its own."""

from __future__ import annotations

import shutil
import tempfile
import traceback
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

from heartgen.errors import Cancelled, sentence
from heartgen.widgets.memory import release_memory
from heartgen.widgets.runs import Post

T = TypeVar("T")

Told = Callable[[str, str], None]
"""Takes what is being done, empty when nothing is, and why the last piece of work failed."""


class Worker:
    """A thread for work, and a folder for what was uploaded.

    Parameters
    ----------
    told : callable
        Called where the state lives, with what is being done and why something failed.
    post : callable, optional
        Has a change made where the state lives; at once if omitted.
    """

    def __init__(self, told: Told, post: Post | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="heartgen-"))
        self._told = told
        self._post: Post = post or (lambda change: change())
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen")
        self._waiting: list[str] = []
        self._kept = 0

    def do(self, doing: str, make: Callable[[], T], take: Callable[[T], None]) -> Future[None]:
        """Have something made in the thread, and taken in where the state lives.

        Parameters
        ----------
        doing : str
            What is being done, for the user.
        make : callable
            Does the work.
        take : callable
            Takes what it gives.
        """
        self._waiting.append(doing)
        self._told(self._waiting[0], "")
        return self._pool.submit(self._work, make, take)

    def post(self, change: Callable[[], None]) -> None:
        """Have the state changed where it lives; what goes wrong there is told, not lost.

        Parameters
        ----------
        change : callable
            Makes the change.
        """

        def guarded() -> None:
            try:
                change()
            except Exception as error:
                traceback.print_exc()
                failed = f"the page itself failed ({type(error).__name__}: {error})"
                self._told(self._doing, f"{failed}: please report it")

        self._post(guarded)

    def keep(self, path: Path) -> Path:
        """A file that was uploaded, where the next one does not take its place.

        Parameters
        ----------
        path : Path
            The file.
        """
        self._kept += 1
        folder = self.folder / f"kept-{self._kept}"
        folder.mkdir()
        return path.rename(folder / path.name)

    def close(self) -> None:
        """Begin no more work, and remove what was uploaded."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def _doing(self) -> str:
        return self._waiting[0] if self._waiting else ""

    def _work(self, make: Callable[[], T], take: Callable[[T], None]) -> None:
        """In the thread: work, and hand over what came of it, or why nothing did."""
        try:
            made = make()
        except Cancelled:
            self.post(lambda: self._end(""))
        except Exception as error:
            said = sentence(error)
            self.post(lambda: self._end(said))
        else:
            self.post(lambda: self._hand_over(made, take))
        release_memory()

    def _hand_over(self, made: T, take: Callable[[T], None]) -> None:
        self._end("")
        take(made)

    def _end(self, complaint: str) -> None:
        self._waiting.pop(0)
        self._told(self._doing, complaint)
