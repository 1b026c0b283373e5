"""What is free is given back to the system after long work."""

from __future__ import annotations

import ctypes
from contextlib import suppress


def release_memory() -> None:
    """Return what is free to the system, where the C library can: it is much after a run."""
    with suppress(OSError, AttributeError):  # not glibc
        ctypes.CDLL("libc.so.6").malloc_trim(0)
