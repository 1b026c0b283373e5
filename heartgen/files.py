"""Files that appear whole or not at all, whatever happens while they are written."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from heartgen.errors import FileError, HeartgenError


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
    FileError
        If the file cannot be written.
    """
    target = Path(os.path.realpath(path))  # a link stays a link to the new file
    temporary = target.with_name(f".{uuid.uuid4().hex}{_ending(target)}")
    try:
        if target.exists() and not target.is_file():
            raise FileError(f"{path}: This is not a file: choose another name.")
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        flush(temporary)
        temporary.replace(target)
    except HeartgenError:
        raise
    except OSError as error:
        raise FileError(
            f"{path}: The file cannot be written ({error.strerror or error}): choose a folder with "
            "free space in which you may write."
        ) from error
    finally:
        with suppress(OSError):  # it has become the file, or never was
            temporary.unlink()


@contextmanager
def results_in(folder: Path) -> Iterator[None]:
    """Create a folder, and say so if the results cannot be written into it.

    Parameters
    ----------
    folder : Path
        May be absent.

    Raises
    ------
    FileError
        If the system refuses the folder, or what the block writes.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except HeartgenError:
        raise
    except OSError as error:
        raise FileError(
            f"{folder}: the results cannot be written there ({error.strerror or error}): choose "
            "a folder with free space in which you may write"
        ) from error


def flush(path: Path) -> None:
    """Have a file on the disk; `OSError` if there is no place for all of it.

    Parameters
    ----------
    path : Path
        A file that was written.
    """
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _ending(path: Path) -> str:
    """End of a file name from which libraries know the format, such as ``.nii.gz``."""
    packed = path.suffix.lower() == ".gz"
    return "".join(path.suffixes[-2:]) if packed else path.suffix
