"""The errors heartgen raises on purpose. Each message says what is wrong, where, and what to do.

All are `HeartgenError`; each is also the error of Python that others would raise in its place: a
`ValueError` for what is given, an `OSError` for files.

Examples
--------
>>> import heartgen
>>> try:
...     heartgen.personalize("no_such_file.nii.gz")
... except FileNotFoundError as error:
...     print(error)
no_such_file.nii.gz: There is no such file: check the path.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

BEFORE = "Seen before: "
"""How the note of a finding begins."""


LONGEST = 120
"""Letters of a path that are shown when the system refuses it."""


class HeartgenError(Exception):
    """Base of all errors that are meant for the user."""


class InputError(HeartgenError, ValueError):
    """The file, array or option given is not one that heartgen can mesh with."""


class FileError(HeartgenError, OSError):
    """A file cannot be written, or read, where it is."""


class UnreadableFileError(InputError, FileError):
    """The system does not open a file that is to be read."""


class MissingFileError(UnreadableFileError, FileNotFoundError):
    """There is no file of this name."""


def cannot_read(error: OSError, message: str) -> UnreadableFileError:
    """The error for a file that the system does not open: of its own kind if it is missing.

    Parameters
    ----------
    error : OSError
        Of the system.
    message : str
        One sentence.
    """
    missing = isinstance(error, FileNotFoundError)
    return MissingFileError(message) if missing else UnreadableFileError(message)


class AnatomyError(HeartgenError, ValueError):
    """The shape analysis could not measure the heart in the mask."""


class RegistrationError(HeartgenError):
    """No fold-free deformation from template to patient was found."""


class MeshError(HeartgenError, ValueError):
    """A mesh is not valid, or not what an operation needs."""


class NotKeptError(HeartgenError, AttributeError):
    """A result that was loaded has no such part."""


class Cancelled(HeartgenError):
    """The user asked for a running fit to stop."""


@contextmanager
def recalling(findings: Iterable[str]) -> Iterator[None]:
    """Add to an error what was seen before it, as a note: it may be the reason.

    Parameters
    ----------
    findings : iterable of str
        Sentences.
    """
    try:
        yield
    except HeartgenError as error:
        for note in (f"{BEFORE}{finding}" for finding in findings):
            if note not in notes_of(error) and not isinstance(error, Cancelled):
                error.add_note(note)
        raise


def refused_by_system(error: OSError) -> str:
    """Say which file or folder the system refused, and why; of a long name, its beginning.

    Parameters
    ----------
    error : OSError
        With the name of a file.
    """
    name = str(error.filename)
    shown = name if len(name) <= LONGEST else f"{name[:LONGEST]}..."
    return (
        f"{shown}: The system refuses this file or folder ({error.strerror}): check its name, that "
        "it is there, and that you may use it"
    )


def notes_of(error: Exception) -> list[str]:
    """Sentences about what was seen before an error.

    Parameters
    ----------
    error : Exception
        Any error.
    """
    return list(getattr(error, "__notes__", ()))


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
        What was raised.

    Returns
    -------
    str
        That of a HeartgenError, with what was seen before it; of others, one that does not leave a
        user alone with a traceback.
    """
    if isinstance(error, HeartgenError):
        return " ".join((str(error), *notes_of(error)))
    if isinstance(error, OSError) and error.filename is not None:
        return refused_by_system(error)
    if isinstance(error, MemoryError):
        return (
            "the image needs more memory than there is here: crop it to the heart, or resample it "
            "to larger voxels"
        )
    return (
        f"heartgen itself failed ({type(error).__name__}: {error}): please report it, with the "
        "mask if it may be shared"
    )
