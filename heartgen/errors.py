"""The errors heartgen raises on purpose. Each message says what is wrong, where, and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class HeartgenError(Exception):
    """Base of all errors that are meant for the user."""


class InputError(HeartgenError):
    """The file or array given is not a mask that heartgen can mesh."""


class AnatomyError(HeartgenError):
    """The shape analysis could not measure the heart in the mask."""


class RegistrationError(HeartgenError):
    """No fold-free deformation from template to patient was found."""


class MeshError(HeartgenError):
    """A mesh is not valid, or not what an operation needs."""


class Cancelled(HeartgenError):
    """The user asked for a running fit to stop."""


@contextmanager
def needing(whose: str, extra: str) -> Iterator[None]:
    """Say which package is missing for what is imported inside, and how to get it.

    Parameters
    ----------
    whose : str
        Subject and verb: ``"the dashboard needs"``.
    extra : str
        Of heartgen's, that brings the package.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise HeartgenError(
            f"{whose} the package {error.name}, which is not installed: "
            f"pip install 'heartgen[{extra}]'"
        ) from error


def sentence(error: BaseException) -> str:
    """Say what went wrong and what to do.

    Parameters
    ----------
    error : BaseException

    Returns
    -------
    str
        That of a HeartgenError; of others, one that does not leave a user alone with a traceback.
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
