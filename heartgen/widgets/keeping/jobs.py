"""A job's folder: what is to be fitted, how far it is, who works on it, and what came of it.

The page's kernel writes the job and the fitting process the rest, so that either may end: another
kernel finds the job where it was, and another process begins it again.
"""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import psutil

from heartgen.options import Options
from heartgen.renamed import new_options
from heartgen.widgets.keeping.packing import pack, unpack

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.images import Mask
    from heartgen.result import Personalization

JOB, PROGRESS, WORKER, ENDED = "job.json", "progress.json", "worker.json", "ended.json"

SETTING = 5.0
"""Seconds by which the begin of a process seems to move when the clock is set."""

Given = TypeVar("Given")

BUSY = (0.01, 0.05, 0.2, 0.5)
"""Seconds between tries to get at a small file: Windows lets nobody replace one that is read."""

Input = tuple["Mask", "Anatomy | None"]
"""What a fit begins with: the mask, and what was measured in it if it was."""


@dataclass(frozen=True)
class Job:
    """What is to be fitted, in a folder of its own.

    Attributes
    ----------
    folder : Path
        Of the job.
    """

    folder: Path

    @property
    def there(self) -> bool:
        """Whether it was written."""
        return (self.folder / JOB).is_file()

    def write(
        self, mask: Path, anatomy: Path | None, options: Options, levels: tuple[int, ...]
    ) -> None:
        """Write down what is to be done.

        Parameters
        ----------
        mask : Path
            File of the mask.
        anatomy : Path or None
            File of what was measured in it, if it was.
        options : Options
            All but the level of detail.
        levels : tuple of int
            Levels of detail.
        """
        self._make_folder()
        told = {
            "mask": os.path.relpath(mask, self.folder),
            "anatomy": None if anatomy is None else os.path.relpath(anatomy, self.folder),
            "options": asdict(options),
            "levels": levels,
        }
        write_json(self.folder / JOB, told)

    @property
    def told(self) -> dict[str, Any]:
        """What is to be done, as it was written."""
        return dict(read_json(self.folder / JOB) or {})

    def input(self) -> Input:
        """Mask and anatomy of the job."""
        told = self.told
        mask = unpack(self.folder / told["mask"])
        anatomy = told["anatomy"]
        return mask, None if anatomy is None else unpack(self.folder / anatomy, mask)

    @property
    def options(self) -> Options:
        """All but the level of detail."""
        return options_of(self.told["options"])

    @property
    def levels(self) -> tuple[int, ...]:
        """Levels of detail."""
        return tuple(self.told["levels"])

    def is_of(self, mask: Path, options: Options) -> bool:
        """Whether it was written, for this mask and under these options.

        Parameters
        ----------
        mask : Path
            File of the mask.
        options : Options
            All but the level of detail.
        """
        told = self.told
        return bool(told) and (
            (self.folder / told["mask"]).resolve() == mask.resolve() and self.options == options
        )

    def begins_as(self, other: Job) -> bool:
        """Whether it begins with the mask and the anatomy that another begins with.

        Parameters
        ----------
        other : Job
            That was written.
        """
        return all(self.told[name] == other.told[name] for name in ("mask", "anatomy"))

    def widen(self, levels: tuple[int, ...]) -> None:
        """Have further levels done.

        Parameters
        ----------
        levels : tuple of int
            Levels of detail; those that it has anyway are no more work.
        """
        told = self.told
        more = [level for level in levels if level not in told["levels"]]
        if more:
            write_json(self.folder / JOB, {**told, "levels": [*told["levels"], *more]})
            (self.folder / ENDED).unlink(missing_ok=True)

    def keep(self, result: Personalization, known: Input) -> None:
        """Write a result.

        Parameters
        ----------
        result : Personalization
            Of one level.
        known : (Mask, Anatomy or None)
            What it was made of.
        """
        self._make_folder()
        pack(result, self._place(result.options.lod), known)

    def kept(self, levels: tuple[int, ...]) -> tuple[int, ...]:
        """Those levels that are there.

        Parameters
        ----------
        levels : tuple of int
            Levels of detail.
        """
        return tuple(level for level in levels if self._place(level).is_file())

    def result(self, level: int, known: Input) -> Personalization:
        """Read a result.

        Parameters
        ----------
        level : int
            Level of detail.
        known : (Mask, Anatomy or None)
            What it was made of.
        """
        found: Personalization = unpack(self._place(level), known)
        return found

    def take_over(self, other: Job, level: int) -> None:
        """Have a result of another job that begins with the same.

        Parameters
        ----------
        other : Job
            Where it is.
        level : int
            Level of detail.
        """
        shutil.copy(other._place(level), self._place(level))

    def end(self, error: str = "") -> None:
        """Say that there is no more to come.

        Parameters
        ----------
        error : str
            Why there is no result; empty if there is.
        """
        write_json(self.folder / ENDED, {"error": error})

    @property
    def ended(self) -> str | None:
        """Why there is no result, empty if there is; None while it is worked on."""
        told = read_json(self.folder / ENDED)
        return None if told is None else str(told["error"])

    def begin(self) -> None:
        """Say that this process works on it now."""
        me = psutil.Process()
        told = {"pid": me.pid, "created": me.create_time(), "tries": self.tries + 1}
        write_json(self.folder / WORKER, told)

    @property
    def tries(self) -> int:
        """How many processes have begun it."""
        return int((read_json(self.folder / WORKER) or {"tries": 0})["tries"])

    @property
    def worker(self) -> psutil.Process | None:
        """The process that works on it, if it lives."""
        told = read_json(self.folder / WORKER)
        if told is None:
            return None
        with suppress(psutil.Error):
            process = psutil.Process(told["pid"])
            same = abs(process.create_time() - told["created"]) < SETTING
            if same and process.status() != psutil.STATUS_ZOMBIE:
                return process
        return None

    def _make_folder(self) -> None:
        """Make its folder, unless the session was removed."""
        for folder in (self.folder.parent, self.folder):
            folder.mkdir(exist_ok=True)

    def _place(self, level: int) -> Path:
        return self.folder / f"lod-{level}.pack"


def options_of(told: dict[str, Any]) -> Options:
    """Options that were written as JSON.

    Parameters
    ----------
    told : dict
        By name.
    """
    return Options(**new_options(told, stored=True))


def write_json(path: Path, value: Any) -> None:
    """Write a small file, which appears whole or not at all.

    It is not forced onto the disk: a process that is killed loses nothing by that, and it is
    written at every move of the visitor.

    Parameters
    ----------
    path : Path
        The file.
    value : object
        Plain values.
    """
    temporary = path.with_name(f".{os.getpid()}-{path.name}")
    temporary.write_text(json.dumps(value), encoding="utf-8")
    _patiently(lambda: temporary.replace(path))


def read_json(path: Path) -> Any:
    """What is in a small file; None if there is none.

    Parameters
    ----------
    path : Path
        The file.
    """
    try:
        return json.loads(_patiently(lambda: path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return None


def _patiently(act: Callable[[], Given]) -> Given:
    """Get at a small file, be it that another process has it at the moment."""
    for seconds in BUSY:
        with suppress(PermissionError):
            return act()
        time.sleep(seconds)
    return act()
