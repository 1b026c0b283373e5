"""Fits in a process of their own, found again by whoever comes for their results."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

import psutil

from heartgen.errors import Cancelled, HeartgenError
from heartgen.options import STEPS
from heartgen.widgets.keeping.fitter import BACKGROUND
from heartgen.widgets.keeping.jobs import PROGRESS, WORKER, Input, Job, read_json

if TYPE_CHECKING:
    from heartgen.result import Personalization
    from heartgen.widgets.runs import Progress

TICK = 0.1
"""Seconds between two looks at a job."""

TRIES = 3
"""Processes that may die over a job before it is given up."""

Arrived = Callable[["Personalization"], None]
"""Takes a result."""

DIED = (
    "the process that fits the mesh died each time it was tried, perhaps because memory ran out: "
    "crop the image to the heart, or resample it to larger voxels"
)


class Fitter:
    """A process that fits, started when there is something to do.

    Parameters
    ----------
    background : bool
        Whether its work is such that nobody waits for it.
    """

    def __init__(self, background: bool = False) -> None:
        self._background = background
        self._process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()

    def start(self) -> None:
        """Have the process there before it is needed, as its imports take long."""
        with self._lock:
            self._living()

    def close(self) -> None:
        """Tell the process that no more will come; it ends after the job in hand."""
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            _close_input(process)

    def results(
        self,
        job: Job,
        known: Input,
        progress: Progress,
        wanted: Callable[[], bool],
        arrived: Arrived = lambda result: None,
    ) -> Sequence[Personalization]:
        """Have a job done, by this process or the one that is at it already.

        Parameters
        ----------
        job : Job
            That was written.
        known : (Mask, Anatomy or None)
            Its input.
        progress : callable
            Told how far it is; raises `Cancelled` when the visitor has had enough.
        wanted : callable
            Whether whoever asks still has the session; otherwise they leave the job to its process.
        arrived : callable
            Called with each result as soon as it is there.

        Raises
        ------
        HeartgenError
            If nothing came of it.
        """
        told = _Told(job, progress)
        given: subprocess.Popen[str] | None = None
        times = 0
        found: dict[int, Personalization] = {}
        while (error := job.ended) is None:
            if not wanted():
                raise Cancelled("the session goes on elsewhere")
            try:
                told.pass_on()
            except Cancelled:
                self._stop(job)
                raise
            if job.worker is None and (given is None or given.poll() is not None):
                if max(job.tries, times) >= TRIES:  # a process may die before it begins the job
                    raise HeartgenError(DIED)
                given, times = self._give(job), times + 1
            _take_in(job, known, found, arrived)
            time.sleep(TICK)
        if error:
            raise HeartgenError(error)
        told.pass_on()
        _take_in(job, known, found, arrived)
        return [found[level] for level in job.levels]

    def _give(self, job: Job) -> subprocess.Popen[str] | None:
        """Hand over a job; None if the process had just ended."""
        with self._lock:
            process = self._living()
            assert process.stdin is not None
            try:
                with _broken_pipes_told():
                    process.stdin.write(f"{job.folder}\n")
                    process.stdin.flush()
            except OSError:
                return None
            return process

    def _stop(self, job: Job) -> None:
        """End the process that works on a job; what nobody waits for may be begun again."""
        worker = job.worker
        if self._background:
            (job.folder / WORKER).unlink(missing_ok=True)
        elif job.there:
            job.end("it was cancelled")
        if worker is not None:
            with suppress(psutil.Error):
                worker.kill()
        elif self._background:
            self.close()  # it may be about to begin

    def _living(self) -> subprocess.Popen[str]:
        """The process, started if there is none."""
        if self._process is not None and self._process.poll() is not None:
            _close_input(self._process)
            self._process = None
        if self._process is None:
            paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
            self._process = subprocess.Popen(
                [
                    *(sys.executable, "-P", "-m", "heartgen.widgets.keeping.fitter"),
                    *([BACKGROUND] if self._background else []),
                ],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=os.environ | {"PYTHONPATH": paths},
                start_new_session=True,  # else it would be ended with the kernel
                text=True,
            )
        return self._process


@contextmanager
def _broken_pipes_told() -> Iterator[None]:
    """Have a write to a process that is dead raise an error, and not end this one.

    Python sees to that, but libraries (Gmsh is one) bring back the system's default, which is to
    end whoever writes, without a word.
    """
    if not hasattr(signal, "pthread_sigmask"):  # a system that has no such signal
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        yield
    finally:
        if signal.SIGPIPE in signal.sigpending():
            signal.sigwait({signal.SIGPIPE})
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _close_input(process: subprocess.Popen[str]) -> None:
    """Let go of the pipe to a process, be it alive or dead."""
    if process.stdin is not None:
        with suppress(OSError), _broken_pipes_told():
            process.stdin.close()


def _take_in(job: Job, known: Input, found: dict[int, Personalization], arrived: Arrived) -> None:
    """Read what has come since."""
    for level in job.kept(job.levels):
        if level not in found:
            found[level] = job.result(level, known)
            arrived(found[level])


class _Told:
    """Passes on what the process wrote on its progress, each end of a step once."""

    def __init__(self, job: Job, progress: Progress) -> None:
        self._job, self._progress = job, progress
        self._passes = dict.fromkeys(STEPS, 0)
        self._step = STEPS[0]

    def pass_on(self) -> None:
        """Tell what is new; where nothing is, ask whether it is still wanted."""
        told = read_json(self._job.folder / PROGRESS)
        if told is None:
            self._progress(self._step, 0.0)
            return
        for step, passes in told["passes"].items():
            for _ in range(passes - self._passes[step]):
                self._passes[step] += 1
                self._progress(step, 1.0)
        self._step = told["step"]
        self._progress(self._step, min(told["done"], 0.999))
