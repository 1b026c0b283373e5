"""Cases that do something to the process that reads them; it has to be able to import them."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from heartgen.cohort import Case


class CannotBeToldError(Exception):
    """Says letters that no file takes, in several lines."""

    def __str__(self):
        return "no\nletter: \udcff"


@dataclass(frozen=True, eq=False)
class Faulty(Case):
    """Adds a line to a log whenever it is read, then does what its deed says."""

    deed: str = ""
    log: Path | None = None

    def read(self, ventricles="auto"):
        if self.log is not None:
            with self.log.open("a") as log:
                log.write(f"{self.name}\n")
        DEEDS[self.deed]()
        return super().read(ventricles)


def kill_worker():
    """End the worker too, with which this process ends."""
    os.kill(os.getppid(), signal.SIGKILL)
    time.sleep(60)


def raises(error):
    def deed():
        raise error

    return deed


def hog():
    held = []
    while True:
        held.append(np.ones(10_000_000))
        time.sleep(0.01)


def prints():
    print("on standard output", flush=True)
    os.write(1, b"and past Python")


DEEDS = {
    "": lambda: None,
    "prints": prints,
    "reads": lambda: sys.stdin.read(),
    "linalg": lambda: np.linalg.svd(np.full((3, 3), np.nan)),
    "memory": raises(MemoryError()),
    "exits": lambda: sys.exit("no more"),
    "recursion": raises(RecursionError("too deep")),
    "untellable": raises(CannotBeToldError()),
    "os._exit": lambda: os._exit(3),
    "killed": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "crashes": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "worker": kill_worker,
    "hangs": lambda: time.sleep(3600),
    "hog": hog,
}
