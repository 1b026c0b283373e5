"""The command line: ``heartgen fit``, ``heartgen batch`` and the other commands."""

from __future__ import annotations

import signal
import sys


def main() -> None:
    """Run the command line."""
    # Scripts start what ends in & deaf to interrupts: hear them, to be able to cancel cleanly.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        from heartgen.cli.cohort import app

        app(prog_name="heartgen")
    except KeyboardInterrupt:
        sys.exit(128 + signal.SIGINT)
