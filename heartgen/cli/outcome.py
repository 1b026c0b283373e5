"""How a command ends: with all its files, or with one sentence, an exit code and no file."""

from __future__ import annotations

import os
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import typer
from rich.console import Console

from heartgen.errors import Cancelled, FileError, HeartgenError, notes_of, refused_by_system
from heartgen.files import results_in
from heartgen.wording import worded_for

FAILED = 1
"""Exit code of an error that has a sentence."""

UNEXPECTED = 70
"""Exit code of an error in heartgen itself (EX_SOFTWARE of BSD's sysexits.h)."""

CANCELLED = 128 + signal.SIGINT
"""Exit code after Ctrl-C, as shells have it: 130."""

errors = Console(stderr=True)
"""Where progress and errors go: standard output is for results."""


@contextmanager
def errors_reported(debug: bool) -> Iterator[None]:
    """Turn what goes wrong in the block into a sentence on standard error and an exit code.

    Parameters
    ----------
    debug : bool
        Show the traceback as well.

    Raises
    ------
    typer.Exit
        With the code.
    """
    try:
        with worded_for("command line"):
            yield
    except (KeyboardInterrupt, Cancelled) as error:
        _say(str(error) or "cancelled, nothing written")
        raise typer.Exit(CANCELLED) from None
    except HeartgenError as error:
        if debug:
            errors.print_exception()
        for note in notes_of(error):
            errors.print(note, markup=False, highlight=False, soft_wrap=True)
        _say(str(error))
        raise typer.Exit(FAILED) from None
    except Exception as error:
        if debug:
            errors.print_exception()
        if isinstance(error, OSError) and error.filename is not None:
            _say(f"{refused_by_system(error)}.")
            raise typer.Exit(FAILED) from None
        name = type(error).__name__
        what = f"{name}: {error}" if str(error) else name
        _say(
            f"heartgen itself failed ({what}): please report what the same command prints with "
            "--debug added, and attach the mask if it may be shared"
        )
        raise typer.Exit(UNEXPECTED) from None


@contextmanager
def written_together(folder: Path) -> Iterator[Path]:
    """Lend an empty folder; its files move on into `folder` when the block has written them all.

    Parameters
    ----------
    folder : Path
        Created if absent. Files of the same names in it are replaced.

    Yields
    ------
    Path
        Where to write.

    Raises
    ------
    HeartgenError
        If the files cannot be written.
    """
    created = not folder.exists()
    try:
        with (
            results_in(folder),
            tempfile.TemporaryDirectory(prefix=".heartgen-", dir=folder) as stage,
        ):
            yield Path(stage)
            for file in sorted(Path(stage).iterdir()):
                file.replace(folder / file.name)
                typer.echo(folder / file.name)
    finally:
        if created:
            with suppress(OSError):  # not empty: all is well
                folder.rmdir()


def check_folder(folder: Path) -> None:
    """Refuse a folder for results that could not be written, before the work is done.

    Parameters
    ----------
    folder : Path
        Where results are to go; may be absent.
    """
    existing = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not existing.is_dir():
        raise FileError(f"{existing}: This is a file, not a folder: choose another with -o.")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise FileError(f"{existing}: You may not write there: choose another folder with -o.")


def check_picture(path: Path) -> None:
    """Refuse a name for a picture that no picture can have.

    Parameters
    ----------
    path : Path
        Where the picture is to go.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    endings = FigureCanvasAgg.get_supported_filetypes()
    if path.suffix[1:].lower() not in endings:
        raise HeartgenError(
            f"{path}: A picture cannot be written in this format: end the name in "
            ".png, .pdf or .svg."
        )


def _say(text: str) -> None:
    """One line on standard error."""
    errors.print(text, style="bold red", markup=False, highlight=False, soft_wrap=True)
