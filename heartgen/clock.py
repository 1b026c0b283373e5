"""Times the steps of the pipeline, and reports how far they are."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

logger = logging.getLogger("heartgen")

Progress = Callable[[str, float], None]
"""Called with the name of the running step and the share of it that is done; raise to cancel."""


class Clock:
    """Times steps and reports their progress.

    Parameters
    ----------
    progress : callable
        Called with the name of a step and the share of it that is done.
    before : mapping of str to float, optional
        Seconds of the steps that were made before.

    Attributes
    ----------
    seconds : dict of str to float
        Of each step that is done.
    """

    def __init__(self, progress: Progress, before: Mapping[str, float] | None = None) -> None:
        self.progress = progress
        self.seconds = dict(before or {})

    @contextmanager
    def step(self, name: str) -> Iterator[Callable[[float], None]]:
        """Time what is done within; what it gives is to be called with the share that is done.

        Parameters
        ----------
        name : str
            Of the step.
        """
        start = time.perf_counter()
        self.progress(name, 0.0)
        yield lambda done: self.progress(name, done)
        self.progress(name, 1.0)
        self.seconds[name] = round(time.perf_counter() - start, 3)
        logger.info("%s: %.1f s", name, self.seconds[name])
