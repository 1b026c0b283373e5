"""What one visitor may take of the machine: memory, time without a page, size of messages."""

from __future__ import annotations

from contextlib import suppress

MEMORY_SHARE = 0.5
"""Of the machine's memory that one process may take."""

IDLE_SECONDS = 120
"""Time after which a kernel without a page is ended where the dashboard alone is served: whoever
comes back gets another one, which finds the session where it was."""

IDLE_SECONDS_UNKEPT = 600
"""The same where there are pages whose work ends with their kernel."""

CULL_SECONDS = 30
"""Time between two looks for such kernels."""

MESSAGE_BYTES = 64 * 1024 * 1024
"""Largest message of a browser; Jupyter's own limit, 10 MB, drops larger ones without a word."""

OUTPUT_BYTES_PER_SECOND = 1e9
"""Jupyter drops what a kernel sends faster than this; its default, 1 MB, would lose a download."""


def limit_memory() -> None:
    """Keep this process, and those it starts, from taking all memory, where the system can."""
    with suppress(ImportError, ValueError, OSError):  # not POSIX, or held tighter already
        import resource

        import psutil

        most = int(MEMORY_SHARE * psutil.virtual_memory().total)
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
