"""The place of a 3-D view on a page, which is empty until the libraries of the view are loaded."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import ipywidgets as widgets

from heartgen.widgets.memory import release_memory
from heartgen.widgets.parts import classed, text

Made = Callable[[Any], None]
"""Takes a scene, where the page lives."""


class ViewPlace:
    """A 3-D view that starts when it is opened, and makes its scenes in a thread.

    Attributes
    ----------
    widget : ipywidgets.Box
        To be put on the page.
    view : HeartView or None
        Once it has started.

    Parameters
    ----------
    ready : callable
        Called when the view has started.
    post : callable
        Has something done where the page lives.
    told, pointed : callable
        As of `heartgen.widgets.viewer.HeartView`.
    """

    def __init__(
        self,
        ready: Callable[[], None],
        post: Callable[[Callable[[], None]], None],
        told: Callable[[dict[str, Any]], None] = lambda message: None,
        pointed: Callable[[Any], None] = lambda point: None,
    ) -> None:
        self.widget = classed(
            widgets.Box([text("The 3-D view is starting …", "hg-notice")]), "hg-view"
        )
        self.view: Any = None
        self._ready, self._post = ready, post
        self._told, self._pointed = told, pointed
        self._task: asyncio.Task[None] | None = None
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen-view")
        self._ask = self._done = 0

    def open(self) -> None:
        """Have the view started, once, where there is a loop: else nobody is looking."""
        if self._task is not None:
            return
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            return
        self._task = loop.create_task(self._start())
        self._task.add_done_callback(self._started)

    def make(self, scene: Callable[[], Any], made: Made, failed: Callable[[str], None]) -> None:
        """Make a scene in the thread, and hand it over unless a newer one is asked for.

        Parameters
        ----------
        scene : callable
            Makes it.
        made : callable
            Takes it.
        failed : callable
            Takes a sentence instead, if it cannot be made.
        """
        self._ask += 1
        self._pool.submit(self._make, self._ask, scene, made, failed)

    def prepare(self, work: Callable[[], None]) -> None:
        """Have something done in the thread when no scene waits to be made.

        Parameters
        ----------
        work : callable
            Makes what scenes will need.
        """
        self._pool.submit(self._prepare, work)

    def _prepare(self, work: Callable[[], None]) -> None:
        """In the thread: let scenes go first."""
        if self._ask != self._done:
            self.prepare(work)
            return
        with suppress(Exception):  # the scene itself will say what is wrong
            work()
        release_memory()

    def _make(
        self, ask: int, scene: Callable[[], Any], made: Made, failed: Callable[[str], None]
    ) -> None:
        """In the thread: make the newest scene only."""
        self._done = ask
        if ask != self._ask:
            return
        try:
            found = scene()
        except Exception as error:
            sentence = f"the view cannot be drawn ({type(error).__name__}: {error})"
            self._post(lambda: failed(sentence))
            return
        release_memory()
        self._post(lambda: made(found) if ask == self._ask else None)

    def _started(self, task: asyncio.Task[None]) -> None:
        """Say so if the view could not be started."""
        if not task.cancelled() and (error := task.exception()) is not None:
            sentence = f"The 3-D view could not be started ({type(error).__name__}: {error})."
            self.widget.children = (text(sentence, "hg-notice"),)

    async def _start(self) -> None:
        """Start the 3-D view; the page is on the screen by then."""
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(self._pool, _import_scene)
        from heartgen.widgets.viewer import HeartView

        self.view = HeartView(self._told, self._pointed)
        self.widget.children = (self.view.widget,)
        self._ready()


def _import_scene() -> None:
    """Load VTK and make the page of vtk.js, which take long, beside the kernel's loop."""
    import heartgen.widgets.viewer  # noqa: F401
    from heartgen.widgets.scene_widget import empty_page

    empty_page()
