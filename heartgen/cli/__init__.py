"""The command line: ``heartgen fit``, ``heartgen batch`` and the other commands."""

from __future__ import annotations

import signal
import sys
import warnings


def main() -> None:
    """Run the command line."""
    # Scripts start what ends in & deaf to interrupts: hear them, to be able to cancel cleanly.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    warnings.formatwarning = _sentence
    try:
        from heartgen.cli.operating import app

        app(prog_name="heartgen")
    except KeyboardInterrupt:
        sys.exit(128 + signal.SIGINT)


def _sentence(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    line: str | None = None,
) -> str:
    """A warning without the line of code, which tells nothing to whoever typed a command."""
    return f"{message}\n"
