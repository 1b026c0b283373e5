"""Files of the service: each appears whole, by renaming, under a name that we choose."""

from __future__ import annotations

import hashlib
import json
import shutil
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from heartgen import __version__
from heartgen.cohort.job import ROWS, STAGE
from heartgen.errors import FileError
from heartgen.images.file_kinds import ENDINGS, identify, refuse
from heartgen.report import REPORT
from heartgen.service.settings import MB

BLOCK = 1024 * 1024
"""Bytes that are copied at a time."""

LONGER_ENDINGS = sorted(ENDINGS, key=len, reverse=True)


class Artifacts:
    """The folder of the service.

    Parameters
    ----------
    home : Path
        The data folder.
    free : int
        MB of its disk that are left free.
    """

    def __init__(self, home: Path, free: int = 0) -> None:
        self.home, self.free = home.absolute(), free
        for name in ("incoming", "uploads", "results", "renditions", "library", "stop"):
            (self.home / name).mkdir(parents=True, exist_ok=True)

    @property
    def results(self) -> Path:
        """Folder of all results."""
        return self.home / "results"

    def check_space(self, needed: int = 0) -> None:
        """Refuse what would fill the disk.

        Parameters
        ----------
        needed : int
            Bytes that are to be written.

        Raises
        ------
        FileError
            If there is no room.
        """
        if shutil.disk_usage(self.home).free - needed < self.free * MB:
            raise FileError(
                "the disk of the service is full: try again later, or tell who operates it"
            )

    def take_in(self, content: BinaryIO, name: str) -> tuple[str, str]:
        """Keep an upload, under a name of our own.

        Parameters
        ----------
        content : file
            To be read from its place on.
        name : str
            As the user gave it: its ending alone is looked at.

        Returns
        -------
        place : str
            Below the data folder.
        digest : str
            SHA-256 of the content.

        Raises
        ------
        InputError
            If it is not of a format that is read, by its first bytes and the ending of its name.
        """
        ending = next((e for e in LONGER_ENDINGS if name.lower().endswith(e)), "")
        with self._staged("incoming") as stage:
            stage.mkdir()
            file, digest = stage / f"mask{ending}", hashlib.sha256()
            with file.open("xb") as out:
                while block := content.read(BLOCK):
                    digest.update(block)
                    out.write(block)
            if not ending:
                refuse(
                    "the upload",
                    f"Its name must end in {', '.join(ENDINGS)}: give one file, a mask or a label "
                    "map.",
                )
            identify(file)
            home = self.home / "uploads" / digest.hexdigest()
            home.mkdir(exist_ok=True)
            file.replace(home / file.name)
        return f"uploads/{digest.hexdigest()}/{file.name}", digest.hexdigest()

    def result(self, fingerprint: str) -> Path:
        """Folder of a result, which may be absent.

        Parameters
        ----------
        fingerprint : str
            Of mask and options.
        """
        return self.results / fingerprint

    def is_done(self, fingerprint: str) -> bool:
        """Whether a result is there.

        Parameters
        ----------
        fingerprint : str
            Of mask and options.
        """
        return (self.result(fingerprint) / ROWS).is_file()

    def summary(self, fingerprint: str) -> dict[str, Any]:
        """The figures that a result is told by.

        Parameters
        ----------
        fingerprint : str
            Of mask and options.
        """
        report = json.loads((self.result(fingerprint) / REPORT).read_text(encoding="utf-8"))
        row = json.loads((self.result(fingerprint) / ROWS).read_text(encoding="utf-8"))["rows"][0]
        return {
            "status": row["status"],
            "success": report["success"],
            "error_mean": report["accuracy"]["mean"],
            "error_max": report["accuracy"]["max"],
            "quality_mean": report["quality"]["mean"],
            "quality_min": report["quality"]["min"],
            "wriggle": report["fairness"]["circumferential_median"],
            "mask_sha256": report["mask_sha256"],
            "findings": [finding["message"] for finding in report["findings"]],
            "seconds": round(sum(report["seconds"].values()), 2),
        }

    def make(self, place: str, write: Callable[[Path], None]) -> Path:
        """Have a folder that is made once, whole, and kept.

        Parameters
        ----------
        place : str
            Below the data folder.
        write : callable
            Called with an empty folder, unless there is one already.
        """
        target = self.home / place
        if target.is_dir():
            return target
        with self._staged(place.partition("/")[0]) as stage:
            stage.mkdir()
            write(stage)
            target.parent.mkdir(parents=True, exist_ok=True)
            with suppress(OSError):  # another was faster: that one stays
                stage.rename(target)
        return target

    def forget(self, place: str) -> None:
        """Remove a file or a folder, at once for whoever looks at it.

        Parameters
        ----------
        place : str
            Below the data folder.
        """
        with self._staged("incoming") as away, suppress(FileNotFoundError):
            (self.home / place).rename(away)

    def stop_mark(self, job: str, starts: int) -> Path:
        """The file whose presence ends a job that runs.

        Parameters
        ----------
        job : str
            Its identifier.
        starts : int
            How often it was begun: another server may have begun it again.
        """
        return self.home / "stop" / f"{job}-{starts}"

    def sweep(self, before: float) -> None:
        """Remove what workers that were killed left unfinished long ago, and old marks.

        Parameters
        ----------
        before : float
            Seconds since 1970: younger ones may be of a worker that runs.
        """
        for each in (*self.results.glob(f"{STAGE}/*"), *(self.home / "stop").iterdir()):
            with suppress(OSError):
                if each.stat().st_mtime < before:
                    self.forget(str(each.relative_to(self.home)))

    def clean(self) -> None:
        """Remove what servers that were killed left unfinished; none may be running."""
        for name in ("incoming", *(f"{each}/{STAGE}" for each in ("renditions", "library"))):
            shutil.rmtree(self.home / name, ignore_errors=True)
        for mark in (self.home / "stop").iterdir():
            mark.unlink(missing_ok=True)
        (self.home / "incoming").mkdir(exist_ok=True)

    @contextmanager
    def _staged(self, name: str) -> Iterator[Path]:
        """Lend a path that is not there yet, on the same disk; what is left of it is removed."""
        above = self.home / name if name == "incoming" else self.home / name / STAGE
        try:
            above.mkdir(parents=True, exist_ok=True)
            stage = above / uuid.uuid4().hex
            yield stage
        except OSError as error:
            if isinstance(error, FileError):
                raise
            raise FileError(
                f"the service cannot keep files now ({error.strerror or 'no room'}): try again "
                "later, or tell who operates it"
            ) from error
        finally:
            shutil.rmtree(stage, ignore_errors=True)
            with suppress(OSError):
                stage.unlink(missing_ok=True)


def fingerprint(digest: str, ending: str, options: Mapping[str, Any], selection: Any) -> str:
    """The same text for what has the same result.

    Parameters
    ----------
    digest : str
        SHA-256 of the upload.
    ending : str
        Of its name.
    options : mapping
        All options of the fit.
    selection : mapping
        What of the image is the myocardium.
    """
    told = json.dumps([__version__, digest, ending, options, selection], sort_keys=True)
    return hashlib.sha256(told.encode()).hexdigest()
