"""The command line: ``heartgen fit``, ``heartgen inspect`` and ``heartgen demo``."""

from heartgen.cli.commands import app, main

__all__ = ["app", "main"]
