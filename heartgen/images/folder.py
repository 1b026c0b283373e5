"""A folder with one file for each structure of a heart, as TotalSegmentator writes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from heartgen.images.checks import check_finite, report
from heartgen.images.file_kinds import ENDINGS, refuse, stem
from heartgen.images.names import scheme_of_names
from heartgen.images.schemes import Scheme
from heartgen.images.structures import Structures
from heartgen.images.volume import Volume

PAIRED = (".dcm",)
"""Endings of images of which a folder is no folder of structures."""

SAME_GRID = 1e-3
"""Difference of two affines, relative to a voxel, that is still rounding."""


def structure_files(folder: Path) -> list[Path]:
    """Images in a folder, by name; none if it has DICOM files and no names of a heart's parts.

    Parameters
    ----------
    folder : Path
        Where to look.
    """
    endings = tuple(ending for ending in ENDINGS if ending not in PAIRED)
    entries = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    images = [path for path in entries if path.name.lower().endswith(endings) and path.is_file()]
    others = len(entries) - len(images)
    return images if len(images) > 1 and (others == 0 or _scheme(images)) else []


def is_one_heart(folder: Path) -> bool:
    """Whether the images in a folder are the parts of one heart, by their names.

    Parameters
    ----------
    folder : Path
        With images.
    """
    scheme = _scheme(structure_files(folder))
    return scheme is not None and max(len(scheme.lv_myocardium), len(scheme.lv_pool)) == 1


def folder_structures(folder: Path, read: Callable[[Path], Volume]) -> Structures:
    """Structures of a folder with a file for each.

    Parameters
    ----------
    folder : Path
        With several images.
    read : callable
        Reads a file.

    Returns
    -------
    Structures
        Named after the files, which are read when they are asked for.
    """
    files = dict(enumerate(structure_files(folder), start=1))

    def load(numbers: Sequence[int], _: int) -> Volume:
        volumes = [read(files[number]) for number in numbers]
        report(folder.name, [check_finite(volume.values) for volume in volumes])
        first = volumes[0]
        for number, other in zip(numbers, volumes, strict=True):
            reach = SAME_GRID * np.linalg.norm(first.affine[:3, :3], axis=0).min()
            same = other.values.shape == first.values.shape and (
                np.abs(other.affine - first.affine)[:3, :3].max() * max(first.values.shape) < reach
                and np.abs(other.affine - first.affine)[:3, 3].max() < reach
            )
            if not same:
                refuse(
                    folder.name,
                    f"{files[number].name} has other voxels than {files[numbers[0]].name}: "
                    "resample the files to one grid.",
                )
        shape = first.values.shape[:3]
        layers = np.stack([volume.values.reshape(shape) != 0 for volume in volumes], axis=-1)
        findings = dict.fromkeys(finding for volume in volumes for finding in volume.findings)
        return Volume(layers, first.affine, findings=tuple(findings))

    names = {number: stem(path) for number, path in files.items()}
    return Structures(folder.resolve().name, names, load, kind="structure")


def _scheme(images: Sequence[Path]) -> Scheme | None:
    """The scheme that names of files tell, if any."""
    return scheme_of_names({number: stem(path) for number, path in enumerate(images, start=1)})
