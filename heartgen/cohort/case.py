"""A case: a heart to be meshed, and where its mask comes from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from heartgen.images import Mask
from heartgen.images.selecting import Selection
from heartgen.report import mask_sha256

BLOCK = 1 << 20
"""Bytes that are hashed at a time."""

WHOLE = Selection()
"""Of an image that is a mask."""


@dataclass(frozen=True, eq=False)
class Case:
    """A heart to be meshed.

    Attributes
    ----------
    name : str
        Unlike that of any other case; parts between slashes are folders of the results.
    source : Path or Mask
        File to be read, or the mask itself.
    group : str
        Cases of a group are counted together in reports.
    selection : Selection
        What of the file is the myocardium.
    choices : mapping of str to value
        Options of this case alone.
    """

    name: str
    source: Path | Mask
    group: str = ""
    selection: Selection = WHOLE
    choices: Mapping[str, Any] = field(default_factory=dict)

    def read(self, ventricles: str = "auto") -> Mask:
        """The mask; raises InputError where no heart can be meshed from the file.

        Parameters
        ----------
        ventricles : {"auto", "lv", "biv"}
            Which to take from a label map.
        """
        if isinstance(self.source, Mask):
            return self.source
        return self.selection.read(self.source, ventricles)

    def digest(self) -> str:
        """SHA-256 of the file, of all files of a folder by name, or of voxels and affine."""
        if isinstance(self.source, Mask):
            return mask_sha256(self.source)
        found = hashlib.sha256()
        for file in _files(self.source):
            with file.open("rb") as stream:
                while block := stream.read(BLOCK):
                    found.update(block)
        return found.hexdigest()

    def stamp(self) -> list[Any]:
        """What changes when the case does, without reading it: sizes and times of its files."""
        told = [self.name, asdict(self.selection)]
        if isinstance(self.source, Mask):
            return [*told, self.digest()]
        try:
            states = [file.stat() for file in _files(self.source)]
        except OSError:  # it cannot be looked at now: reading it will say why
            return told
        return [*told, *([state.st_size, state.st_mtime_ns] for state in states)]


def _files(source: Path) -> list[Path]:
    """The file, or all files of a folder by name; none if there is nothing."""
    if source.is_dir():
        return sorted(file for file in source.iterdir() if file.is_file())
    return [source] if source.is_file() else []
