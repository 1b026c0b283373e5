"""Memory of visitors: no kernel takes all of the machine's, and what is free is given back."""

from __future__ import annotations

import ctypes
from contextlib import suppress

import psutil

SHARE = 0.5
"""Of the machine's memory that one process may take."""


def limit() -> None:
    """Keep this process, and those it starts, from taking all memory, where the system can."""
    with suppress(ImportError, ValueError, OSError):  # not POSIX, or held tighter already
        import resource

        most = int(SHARE * psutil.virtual_memory().total)
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def release_memory() -> None:
    """Return what is free to the system, where the C library can: it is much after a run."""
    with suppress(OSError, AttributeError):  # not glibc
        ctypes.CDLL("libc.so.6").malloc_trim(0)
