"""Text files, and what writing a mesh made."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from heartgen.errors import InputError, cannot_read
from heartgen.files import flush, replacing


@dataclass(frozen=True)
class Written:
    """What writing a mesh made.

    Attributes
    ----------
    files : tuple of Path
        In the order in which they were written.
    notes : tuple of str
        What the user should know, such as the error of a format that cannot hold the mesh exactly.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> with TemporaryDirectory() as folder:
    ...     written = heartgen.write_mesh(mesh, Path(folder) / "mesh.exelem")
    >>> [path.name for path in written.files], written.notes
    (['mesh.exnode', 'mesh.exelem'], ())
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

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from heartgen.formats import write_text
    >>> with TemporaryDirectory() as folder:
    ...     path = write_text("one case", Path(folder) / "notes" / "read me.txt").files[0]
    ...     path.read_text()
    'one case'
    """
    return write_texts({Path(path): text})


def write_texts(texts: Mapping[Path, str]) -> Written:
    """Write text files that belong together: none takes its place before all are written.

    Parameters
    ----------
    texts : mapping of Path to str
        As of `write_text`.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If one cannot be written; earlier ones are then untouched.
    """
    with ExitStack() as all_of_them:
        temporaries = [all_of_them.enter_context(replacing(path)) for path in texts]
        for temporary, text in zip(temporaries, texts.values(), strict=True):
            temporary.write_bytes(text.encode())
            flush(temporary)
    return Written(tuple(texts))


def read_text(path: str | Path) -> str:
    """Content of a text file, in UTF-8.

    Parameters
    ----------
    path : path
        File to read.

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
        raise cannot_read(
            error,
            f"{path}: The file cannot be read ({error.strerror or error}): give one that exists.",
        ) from error
