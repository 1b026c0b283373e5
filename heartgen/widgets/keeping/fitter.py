"""A process that fits what the page asks for, so that it is fitted whatever becomes of the page.

Started by `heartgen.widgets.keeping.fits`. It is told folders of jobs, a line each, and leaves
progress and results there. When whoever started it ends, it brings the job in hand to its end,
unless that is work nobody waits for.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import Any

from heartgen.errors import Cancelled, sentence
from heartgen.widgets.keeping.jobs import PROGRESS, Job, write_json
from heartgen.widgets.memory import release_memory

BACKGROUND = "--background"
"""Argument of a process whose work nobody waits for."""

IDLE_SECONDS = 30.0
"""Time that it waits for the next job: a run after a look at the last is spared the imports."""

FIRST_SECONDS = 180.0
"""Time that it waits for the first job."""

INTERVAL = 0.2
"""Least seconds between two words on how far a step is."""

NICENESS = 19
"""Of work that nobody waits for: the least urgent there is."""

OOM_SCORE = 800
"""Of 1000: where memory runs out, Linux ends this process before the one that has the page."""


def main() -> None:
    """Do the jobs that come, and end when none has come for a while."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    faulthandler.enable()
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(OOM_SCORE))
    background = BACKGROUND in sys.argv
    if background and hasattr(os, "nice"):
        os.nice(NICENESS)
        with suppress(OSError):  # Linux weighs sessions first, and processes within each
            Path("/proc/self/autogroup").write_text(str(NICENESS))
    jobs: SimpleQueue[str] = SimpleQueue()
    alone = Event()
    Thread(target=_receive, args=(jobs, alone), daemon=True).start()

    import heartgen.pipeline  # noqa: F401  (takes long: done while the visitor looks at the mask)

    patience = FIRST_SECONDS
    while not (alone.is_set() and jobs.empty()):
        try:
            folder = jobs.get(timeout=patience)
        except Empty:
            break
        if folder:
            do(Job(Path(folder)), alone if background else Event())
        patience = IDLE_SECONDS


def do(job: Job, unwanted: Event) -> None:
    """Do a job; whatever goes wrong becomes a sentence in its folder.

    Parameters
    ----------
    job : Job
        What to do.
    unwanted : Event
        Set when nobody wants it any more.
    """
    from heartgen.pipeline import levels_in_turn

    if not job.there or job.ended is not None:  # cancelled before it was begun
        return
    try:
        job.begin()
        known = job.input()
        levels = tuple(n for n in job.levels if n not in job.kept(job.levels))
        tell = _Teller(job, unwanted)
        if levels:
            for result in levels_in_turn([known[0]], levels, job.options, tell, known[1]):
                job.keep(result, known)
    except Cancelled:
        return
    except Exception as error:
        with suppress(OSError):  # the folder is gone: nobody waits
            job.end(sentence(error))
    else:
        job.end()
    release_memory()


class _Teller:
    """Writes down how far a job is; ends it when it is no longer wanted."""

    def __init__(self, job: Job, unwanted: Event) -> None:
        self._job, self._unwanted = job, unwanted
        self._passes: dict[str, int] = {}
        self._told = 0.0

    def __call__(self, step: str, done: float) -> None:
        if done >= 1:
            self._passes[step] = self._passes.get(step, 0) + 1
        elif time.monotonic() - self._told < INTERVAL:
            return
        self._told = time.monotonic()
        if self._unwanted.is_set() or not self._job.there or self._job.ended is not None:
            raise Cancelled("nobody waits for it")
        told: dict[str, Any] = {"step": step, "done": float(done), "passes": self._passes}
        with suppress(OSError):  # no reason to lose a fit
            write_json(self._job.folder / PROGRESS, told)


def _receive(jobs: SimpleQueue[str], alone: Event) -> None:
    """Take in jobs; know when there will be no more."""
    for line in sys.stdin:
        jobs.put(line.strip())
    alone.set()
    jobs.put("")  # wakes who waits


if __name__ == "__main__":
    main()
