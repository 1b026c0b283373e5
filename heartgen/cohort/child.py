"""A process that works on one case after another, told by its standard input and output.

Started by `heartgen.cohort.isolation`, with which it shares nothing but these: whatever a case does
to its process, it does to no other case.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import BinaryIO

from distributed.protocol.pickle import loads

from heartgen.errors import sentence

READY = "ready"
"""First answer, once everything is imported."""

PROGRESS_INTERVAL = 0.25
"""Seconds between two words on how far a step is."""

OOM_SCORE = 800
"""Of 1000: where memory runs out, Linux ends this process before those that keep the results."""


def main() -> None:
    """Answer each job with its rows, or with the reason why it could not be understood.

    Before, there are pairs of the running step and the share of it that is done.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that the user sees
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(str(OOM_SCORE))
    questions, answers = _own_streams()
    jobs: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_receive, args=(questions, jobs), daemon=True).start()

    from heartgen.cohort.job import do

    _send(READY, answers)
    while True:
        packed = jobs.get()
        try:
            job = loads(packed)
        except Exception as error:
            _send(sentence(error), answers)
            continue
        _send(do(job, _teller(answers)), answers)


def _teller(answers: BinaryIO) -> Callable[[str, float], None]:
    """Progress that is sent: each step once, and then not too often."""
    last: tuple[str, float] = ("", 0.0)

    def tell(step: str, done: float) -> None:
        nonlocal last
        now = time.monotonic()
        if step != last[0] or now - last[1] > PROGRESS_INTERVAL:
            last = (step, now)
            _send((step, float(done)), answers)

    return tell


def _own_streams() -> tuple[BinaryIO, BinaryIO]:
    """Standard input and output, out of reach for whatever reads and prints."""
    questions, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return questions, answers


def _receive(questions: BinaryIO, jobs: SimpleQueue[bytes]) -> None:
    """Take in jobs; end with the process that gives them, even in the middle of one."""
    with suppress(Exception):
        while True:
            jobs.put(pickle.load(questions))
    os._exit(0)


def _send(answer: object, answers: BinaryIO) -> None:
    """Answer, or end if nobody listens."""
    try:
        pickle.dump(answer, answers)
        answers.flush()
    except OSError:
        sys.exit(0)


if __name__ == "__main__":
    main()
