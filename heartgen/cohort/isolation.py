"""A job in a process of its own, which may die, hang or take all memory without harm to others."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any

import psutil
from distributed import get_worker
from distributed.protocol.pickle import dumps

from heartgen.cohort.child import READY
from heartgen.cohort.job import Job, give_up, rows_of
from heartgen.cohort.rows import Row
from heartgen.errors import Cancelled

TRIES = 2
"""Times that a job is tried whose process dies: it may have been killed for another's memory."""

STARTS = 3
"""Times that a process is started that does not come up."""

TICK = 0.25
"""Seconds between two looks at the time and the memory that a job takes."""

ENDING = 10.0
"""Seconds that the system may take to end a process."""

GB = 1e9
"""Bytes."""

MINUTE = 60.0
"""Seconds."""

CROP = "crop the image to the heart, resample it to larger voxels, or work in fewer processes"
"""What helps where memory is short."""


class NoProcessError(ImportError):
    """No process comes up in which heartgen can work."""


@dataclass(frozen=True)
class Watch:
    """Who looks at a job while it is done.

    Attributes
    ----------
    told : callable
        Called with the name of the running step and the share of it that is done.
    stopped : callable
        Whether the job is no longer wanted; asked again and again.
    """

    told: Callable[[str, float], None] = lambda step, done: None
    stopped: Callable[[], bool] = lambda: False


UNWATCHED = Watch()
"""Of a job that nobody looks at."""


class _EndedError(Exception):
    """The process has no answer, and why."""


class _DiedError(_EndedError):
    """It ended by itself, or was killed by somebody else."""


def do_apart(job: Job, limit: float | None = None, watch: Watch = UNWATCHED) -> list[Row]:
    """Do a job in a process of its own; whatever becomes of that becomes the reason in its rows.

    Parameters
    ----------
    job : Job
        What to do.
    limit : float or None
        Seconds that each of its levels may take; None for as long as it likes.
    watch : Watch
        Who looks at it meanwhile.

    Returns
    -------
    list of dict
        As of `heartgen.cohort.job.do`.

    Raises
    ------
    NoProcessError
        If no process comes up: that is not for the job's sake.
    Cancelled
        If it was stopped; its process has ended then.
    """
    if (done := rows_of(job)) is not None:
        return done
    reason = ""
    for _ in range(TRIES):
        child = _idle_child()
        try:
            answer = child.answer_to(job, limit, _memory(), watch)
        except _EndedError as ended:
            reason = str(ended)
            if isinstance(ended, _DiedError):
                continue
            break
        finally:
            child.end_unless_idle()
        return give_up(job, answer) if isinstance(answer, str) else answer
    return give_up(job, reason)


def end_idle() -> None:
    """End the processes that wait for jobs."""
    while _idle:
        _idle.pop().end()


class _Child:
    """A process that works on jobs, one at a time."""

    def __init__(self) -> None:
        paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "heartgen.cohort.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": paths},
        )
        self.answers: SimpleQueue[Any] = SimpleQueue()
        Thread(target=self._receive, daemon=True).start()
        self.idle = self.answers.get() == READY

    def answer_to(
        self, job: Job, limit: float | None, memory: float | None, watch: Watch
    ) -> list[Row] | str:
        """Rows of a job, or why they cannot be had; within time (s per level) and memory (bytes).

        Raises
        ------
        _EndedError
            If the process died or had to be ended.
        Cancelled
            If the job was stopped.
        """
        self.idle = False
        end = None if limit is None else time.monotonic() + limit * len(job.levels)
        assert self.process.stdin is not None
        with suppress(OSError):  # it is dead, as the answer will tell
            pickle.dump(dumps(job), self.process.stdin)
            self.process.stdin.flush()
        while True:
            if watch.stopped():
                raise Cancelled("it was cancelled")
            try:
                answer = self.answers.get(timeout=TICK)
            except Empty:
                if end is not None and time.monotonic() > end:
                    raise _EndedError(_too_long(limit or 0.0)) from None
                if memory is not None and self._memory() > memory:
                    raise _EndedError(_too_large(memory)) from None
                continue
            if isinstance(answer, tuple):
                watch.told(*answer)
                continue
            if answer is None:
                raise _DiedError(_death(self.process.wait()))
            self.idle = True
            rows: list[Row] | str = answer
            return rows

    def end_unless_idle(self) -> None:
        """Keep a process that has done its job, and end any other."""
        if self.idle:
            _idle.append(self)
        else:
            self.end()

    def end(self) -> None:
        """End the process, whatever it does."""
        self.process.kill()
        assert self.process.stdin is not None
        with suppress(OSError):  # of a job that it did not take in
            self.process.stdin.close()
        with suppress(subprocess.TimeoutExpired):  # the system does not let go of it: leave it
            self.process.wait(ENDING)

    def _receive(self) -> None:
        """Take in answers, and None when there will be no more."""
        assert self.process.stdout is not None
        with suppress(Exception), self.process.stdout:
            while True:
                self.answers.put(pickle.load(self.process.stdout))
        self.answers.put(None)

    def _memory(self) -> float:
        """Memory that the process takes, bytes."""
        with suppress(psutil.Error):
            return float(psutil.Process(self.process.pid).memory_info().rss)
        return 0.0


_idle: list[_Child] = []
"""Processes of this worker that wait for a job."""


def _idle_child() -> _Child:
    """A process that waits for a job, started if there is none."""
    with suppress(IndexError):
        while True:
            child = _idle.pop()
            if child.process.poll() is None:
                return child
            child.end()
    for _ in range(STARTS):
        child = _Child()
        if child.idle:
            return child
        child.end()
    raise NoProcessError(f"no process that works comes up, {sys.executable} does not import it")


def _memory() -> float | None:
    """Share of a job in the memory that Dask gives this worker, bytes; None if it sets no limit."""
    try:
        worker = get_worker()
    except ValueError:  # no worker
        return None
    limit = worker.memory_manager.memory_limit
    return limit / worker.state.nthreads if limit else None


def _death(code: int) -> str:
    """Why there is no result of a process that ended with this code."""
    try:
        how = signal.Signals(-code).name
    except ValueError:
        how = f"exit code {code}"
    what = f"its process died each time it was tried ({how})"
    if how == "SIGKILL":
        return f"{what}, perhaps because memory ran out: {CROP}"
    return f"{what}: please report it, with the mask if it may be shared"


def _too_long(limit: float) -> str:
    """Why there is no result after so many seconds."""
    return (
        f"it was not done within {limit / MINUTE:g} minutes: look at the mask with heartgen "
        "inspect, or allow more time with --time-limit and --redo"
    )


def _too_large(memory: float) -> str:
    """Why there is no result where so many bytes were allowed."""
    return f"it took more than {memory / GB:.1f} GB, the memory that a process may have: {CROP}"
