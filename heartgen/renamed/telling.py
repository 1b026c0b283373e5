"""The warning that tells a new name."""

from __future__ import annotations

import sys
import warnings
from types import FrameType

from heartgen.renamed.tables import REMOVED_IN


def warn_of(old: str, new: str) -> None:
    """Tell of a new name, at the line of the caller outside of heartgen.

    Parameters
    ----------
    old, new : str
        What the user wrote, and what to write.
    """
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and _is_ours(frame):
        level += not _is_bootstrap(frame)  # which `warnings` does not count
        frame = frame.f_back
    warnings.warn(
        f"{old} is now {new}: the former name works until heartgen {REMOVED_IN}",
        FutureWarning,
        stacklevel=level,
    )


def _is_ours(frame: FrameType) -> bool:
    """Whether a frame is of heartgen or of the machinery of imports."""
    name = str(frame.f_globals.get("__name__", ""))
    return name.partition(".")[0] in ("heartgen", "importlib")


def _is_bootstrap(frame: FrameType) -> bool:
    """Whether a frame is of the innermost machinery of imports."""
    return str(frame.f_globals.get("__name__", "")).startswith("importlib._bootstrap")
