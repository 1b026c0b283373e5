"""Files that appear whole or not at all, whatever happens while they are written."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from heartgen.errors import HeartgenError, InputError


@dataclass(frozen=True)
class Written:
    """What writing a mesh made.

    Attributes
    ----------
    files : tuple of Path
    notes : tuple of str
        What the user should know, such as the error of a format that cannot hold the mesh exactly.
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()


def write_text(text: str, path: str | Path) -> Written:
    """Write a text file in one step.

    Parameters
    ----------
    text : str
        Written as UTF-8 with Unix line ends.
    path : path
        Its folder is created if absent. A file of that name is replaced.

    Returns
    -------
    Written
        That one file.

    Raises
    ------
    HeartgenError
        If the file cannot be written; an earlier one is then untouched.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(text.encode())
    return Written((Path(path),))


def read_text(path: str | Path) -> str:
    """Content of a text file, in UTF-8.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: This is not a text file: give a mesh in a known format."
        ) from error
    except OSError as error:
        raise InputError(
            f"{path}: The file cannot be read ({error.strerror or error}): give one that exists."
        ) from error


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Lend a temporary file of the same folder and ending; it becomes the file on success.

    Parameters
    ----------
    path : path
        Its folder is created if absent. A file of that name is replaced when the block ends; if
        the block fails or is interrupted, it is untouched and the temporary file is removed.

    Yields
    ------
    Path
        Where to write.

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    """
    target = Path(os.path.realpath(path))  # a link stays a link to the new file
    temporary = target.with_name(f".{uuid.uuid4().hex}{target.suffix}")
    try:
        if target.exists() and not target.is_file():
            raise HeartgenError(f"{path}: This is not a file: choose another name.")
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(target)
    except OSError as error:
        raise HeartgenError(
            f"{path}: The file cannot be written ({error.strerror or error}): choose a folder with "
            "free space in which you may write."
        ) from error
    finally:
        with suppress(OSError):  # it has become the file, or never was
            temporary.unlink()
