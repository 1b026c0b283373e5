"""Lessons are tests: each is run from its first cell to its last, and must not wait forever."""

from nbclient.output_widget import OutputWidget

OutputWidget.sync_state = lambda self: None  # docs/conf.py says why
