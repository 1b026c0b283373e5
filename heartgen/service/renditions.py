"""What is made of a result when it is first asked for: other formats, a picture, a 3-D view."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from threading import BoundedSemaphore

from heartgen.errors import HeartgenError, InputError
from heartgen.formats import FORMATS
from heartgen.service.artifacts import Artifacts

logger = logging.getLogger("heartgen.service")

AT_ONCE = 2
"""Renditions that are made at the same time."""

PATIENCE = 180.0
"""Seconds that one may take."""

ALL = "results"
"""All files of a result, in one archive."""

MEDIA = {
    "results": "application/zip",
    "preview": "image/png",
    "view": "text/html",
    "report": "application/json",
}
"""What is asked for besides mesh formats, and of which kind its file is."""

NAMES = (*MEDIA, *FORMATS)
"""All that can be asked for."""

KEPT = ("mesh.exf", "mesh.vtu", "report.json")
"""Files of each result."""

STORED = {"exf": "mesh.exf", "vtu": "mesh.vtu", "report": "report.json"}
"""What every result has already."""


class Renditions:
    """Renditions of results.

    Parameters
    ----------
    artifacts : Artifacts
        Where results are.
    """

    def __init__(self, artifacts: Artifacts) -> None:
        self.artifacts = artifacts
        self._turns = BoundedSemaphore(AT_ONCE)

    def file(self, place: str, name: str) -> Path:
        """The file of a rendition.

        Parameters
        ----------
        place : str
            Of the result, below the data folder.
        name : str
            One of `NAMES`.

        Returns
        -------
        Path
            An archive where there are several files.

        Raises
        ------
        HeartgenError
            If it cannot be made.
        """
        result = self.artifacts.home / place
        if name in STORED:
            return result / STORED[name]
        if name not in NAMES:
            raise InputError(f"{name!r} is not known: choose one of {', '.join(NAMES)}")
        made = result / name  # of a model, some were made as it was published
        if not made.is_dir():
            folder = f"renditions/{place.replace('/', '-')}/{name}"
            made = self.artifacts.make(folder, lambda stage: self.make(result, name, stage))
        return next(made.iterdir())

    def make(self, result: Path, name: str, folder: Path) -> None:
        """Make a rendition, in a process of its own unless it is an archive.

        Parameters
        ----------
        result : Path
            Folder of the result.
        name : str
            One of `NAMES`.
        folder : Path
            Empty; gets one file.
        """
        if name == ALL:
            _pack([result / each for each in KEPT], folder / "heartgen.zip")
            return
        command = [sys.executable, "-P", "-m", "heartgen.service.rendering"]
        paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
        with self._turns:
            try:
                subprocess.run(
                    [*command, str(result), name, str(folder)],
                    env=os.environ | {"PYTHONPATH": paths},
                    capture_output=True,
                    timeout=PATIENCE,
                    check=True,
                )
            except (subprocess.SubprocessError, OSError) as error:
                said = getattr(error, "stderr", b"") or b""
                lines = said.decode("utf-8", "replace").strip().splitlines()
                logger.warning("no %s: %s", name, lines[-1:] or type(error).__name__)
                raise HeartgenError(
                    f"{name} cannot be made of this result: take another format, or tell who "
                    "operates the service"
                ) from None
        files = [each for each in folder.iterdir() if each.is_file()]
        if len(files) > 1:
            _pack(files, folder / f"mesh-{name}.zip")
            for each in files:
                each.unlink()


def media_type(name: str, path: Path) -> str:
    """Of which kind a file is, for the header of an answer.

    Parameters
    ----------
    name : str
        One of `NAMES`.
    path : Path
        Of its file.
    """
    if path.suffix == ".zip":
        return "application/zip"
    return MEDIA.get(name, "application/octet-stream")


def _pack(files: list[Path], target: Path) -> None:
    """Put files in an archive."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in files:
            archive.write(file, file.name)
