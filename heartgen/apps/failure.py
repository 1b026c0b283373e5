"""What the page says when something failed: one sentence."""

from __future__ import annotations

from heartgen.errors import HeartgenError


def sentence(error: Exception) -> str:
    """Say what went wrong and what to do.

    Parameters
    ----------
    error : Exception

    Returns
    -------
    str
    """
    if isinstance(error, HeartgenError):
        return str(error)
    if isinstance(error, MemoryError):
        return (
            "the image needs more memory than there is here: crop it to the heart, or resample it "
            "to larger voxels"
        )
    return (
        f"heartgen itself failed ({type(error).__name__}: {error}): please report it, with the "
        "mask if it may be shared"
    )
