"""From a file or an array to a checked mask: `read_mask`, `read_labels`, `mask_from_array`."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heartgen.errors import recalling
from heartgen.images.checks import (
    check_affine,
    check_background,
    check_data_type,
    check_dimensions,
    check_empty,
    check_extent,
    check_finite,
    check_frames,
    check_scale,
    check_size,
    report,
)
from heartgen.images.cine_frames import Frame
from heartgen.images.file_kinds import refuse
from heartgen.images.labels import myocardium, whole_numbers
from heartgen.images.mask import LEFT_BLOOD, WALL, Finding, Mask
from heartgen.images.opening import enough_memory, name_of, open_image
from heartgen.images.repairs import fill_lost_planes, keep_largest, pad_border
from heartgen.images.schemes import Labeling
from heartgen.images.sources import source_of
from heartgen.images.structures import Structures
from heartgen.images.taking import Select, Taking, take
from heartgen.images.ventricles import RV_WALL, VentricleChoice, check_choices
from heartgen.images.volume import LPS_FROM_RAS, Label, Volume

logger = logging.getLogger("heartgen")


def read_mask(
    path: str | PathLike[str],
    *,
    label: Label | None = None,
    view: bool = False,
    frame: Frame | None = None,
) -> Mask:
    """Read and check a mask of the myocardium.

    Structures whose names say what they are (``"LV blood pool"``, ``"Myo"``, ``"RV wall"``, or
    SNOMED codes) are read as `read_labels` does, unless `label` is given.

    Parameters
    ----------
    path : path-like
        NIfTI, NRRD, MetaImage or any other volume that SimpleITK reads; a DICOM segmentation (SEG)
        or structure set (RTSTRUCT), as a file or as the folder it is in; or a folder with a file
        for each structure.
    label : int, str, or sequence of them, optional
        What is myocardium in a label image or a segmentation, by number or by name; several are
        united. Not needed if the image is binary: 0 and one other value.
    view : bool
        Whether it is a further view of a heart, such as a long-axis slice, that need not show the
        whole of it.
    frame : int or str, optional
        Which frame of a cine: its number from 1; or ``"ED"`` or ``"ES"``, the frame with the
        largest or the smallest cavity of the left ventricle.

    Returns
    -------
    Mask
        In one piece (but for a view), with background around it, its `findings` saying what was
        mended.

    Raises
    ------
    InputError
        If no heart can be meshed from the file; the message names every reason that was found.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> from heartgen.images.writing import write_mask
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "heart.nii.gz"
    ...     write_mask(heartgen.samples.ideal_cup(4.0).mask, path)
    ...     mask = heartgen.read_mask(path)
    >>> mask.name, mask.voxels.shape
    ('heart.nii.gz', (24, 24, 31))
    """
    return read_heart(path, Taking(label=label, frame=frame), view=view)


def read_labels(
    path: str | PathLike[str],
    scheme: Labeling,
    *,
    ventricles: VentricleChoice = "auto",
    rv_wall: float = RV_WALL,
    view: bool = False,
    frame: Frame | None = None,
) -> Mask:
    """Read a label map of the heart, and take from it the myocardium of its ventricles.

    Where the right ventricle's blood pool is labeled but not its wall, the wall is built: within
    `rv_wall` of the pool, open at the base.

    Parameters
    ----------
    path : path-like
        As of `read_mask`. Structures count as labels.
    scheme : str, Scheme, or mapping of str to labels
        What the labels mean: ``"acdc"``, ``"mmwhs"``, ``"ukbb"``, ``"mnms"`` (M&Ms, M&Ms-2),
        ``"emidec"``, ``"totalsegmentator"`` (heartchambers_highres), or ``"auto"`` for what
        names tell or else the scheme that fits. Or the number(s) or name(s) of labels for each of
        the roles ``lv_myocardium``, ``lv_pool``, ``rv_pool``, ``rv_myocardium``, of which the first
        is needed.
    ventricles : {"auto", "lv", "biv"}
        Which to take: all that are labeled, the left, both.
    rv_wall : float
        Thickness of the right ventricular wall if it has to be built, mm.
    view : bool
        As of `read_mask`.
    frame : int or str, optional
        As of `read_mask`.

    Returns
    -------
    Mask
        As of `read_mask`; its `findings` also say what was built.

    Raises
    ------
    InputError
        As of `read_mask`; or if labels or the scheme are not as they have to be.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> import numpy as np
    >>> from heartgen.images.writing import write_image
    >>> cup = heartgen.samples.ideal_cup(4.0).mask
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "labels.nii.gz"
    ...     write_image(2 * cup.voxels.astype(np.uint8), cup.affine, path)
    ...     mask = heartgen.read_labels(path, {"lv_myocardium": 2})
    >>> bool(mask.voxels.sum() == cup.voxels.sum())
    True
    """
    taking = Taking(scheme=scheme, ventricles=ventricles, rv_wall=rv_wall, frame=frame)
    return read_heart(path, taking, view=view)


def read_heart(path: str | PathLike[str], taking: Taking, *, view: bool = False) -> Mask:
    """Read what is asked for from a file, and check it.

    Parameters
    ----------
    path : path-like
        As of `read_mask`.
    taking : Taking
        What to take of what the file holds.
    view : bool
        As of `read_mask`.

    Returns
    -------
    Mask
        As of `read_mask`.

    Raises
    ------
    InputError
        As of `read_mask`.
    """
    file = Path(path)
    name = name_of(file)
    check_choices(taking.ventricles, taking.rv_wall, name)
    with enough_memory(file):
        volume, select = take(open_image(file), taking, name)
        mask = _checked(volume, name, select, view)
    return replace(mask, source=source_of(file, taking, view))


def mask_from_array(
    voxels: ArrayLike,
    affine: ArrayLike,
    *,
    name: str = "mask",
    label: Label | None = None,
    frame: Literal["LPS", "RAS"] = "LPS",
) -> Mask:
    """Check an array and take it for a mask of the myocardium.

    Parameters
    ----------
    voxels : (nx, ny, nz) array-like
        Binary, or labels.
    affine : (4, 4) array-like
        Voxel index to world coordinates, mm.
    name : str
        Name for reports.
    label : int, or sequence of int, optional
        What is myocardium in a label image.
    frame : {"LPS", "RAS"}
        Frame of the world `affine` leads to; nibabel's and NIfTI's affines are RAS.

    Returns
    -------
    Mask
        As of `read_mask`.

    Raises
    ------
    InputError
        As of `read_mask`.

    Examples
    --------
    >>> import heartgen
    >>> import numpy as np
    >>> voxels = heartgen.samples.ideal_cup(4.0).mask.voxels
    >>> affine = np.diag([-4.0, -4.0, 4.0, 1.0])  # as nibabel gives it
    >>> mask = heartgen.mask_from_array(voxels, affine, frame="RAS")
    >>> mask.spacing.tolist(), np.diag(mask.affine).tolist()
    ([4.0, 4.0, 4.0], [4.0, 4.0, 4.0, 1.0])
    """
    world = _matrix(affine, name)
    if frame not in ("LPS", "RAS"):
        refuse(name, f"The frame {frame!r} is unknown: give 'LPS' or 'RAS'.")
    if frame == "RAS" and world.shape == (4, 4):
        world = LPS_FROM_RAS * world
    return _checked(Volume(np.asarray(voxels), world), name, partial(myocardium, label=label))


def read_grid(path: str | PathLike[str]) -> tuple[tuple[int, ...], NDArray[np.float64]]:
    """Read where the voxels of an image are, whatever it shows.

    Parameters
    ----------
    path : path-like
        As of `read_mask`.

    Returns
    -------
    shape : (int, int, int)
        Voxels along i, j, k.
    affine : (4, 4) float64
        Voxel index to world coordinates, mm, LPS; no shear.

    Raises
    ------
    InputError
        If the image cannot be read, or is no volume in the world.
    """
    file = Path(path)
    with enough_memory(file):
        held = open_image(file)
        if isinstance(held, Structures):
            held = held.load(list(held.names)[:1], 0)
        shape = held.values.shape
        report(name_of(file), [check_size(shape), check_dimensions(shape)])
        report(name_of(file), [check_affine(held.affine)])
        return shape[:3], held.affine


def _checked(volume: Volume, name: str, select: Select, view: bool = False) -> Mask:
    """The mask that is selected from a volume, once every check has seen it.

    A view need not show enough for a mesh, nor be in one piece.
    """
    shape = volume.values.shape
    report(name, [check_size(shape), check_dimensions(shape), check_data_type(volume.values.dtype)])
    report(name, [check_frames(shape)])
    volume = replace(volume, values=volume.values.reshape(shape[:3]))
    findings = [*volume.findings, check_affine(volume.affine), check_finite(volume.values)]
    parts = None
    if findings[-1] is None:
        parts, told = select(replace(volume, values=whole_numbers(volume.values)))
        findings += told
    if parts is not None:
        voxels = parts == WALL
        findings += [check_empty(voxels), check_background(voxels)]
        findings += [] if view else [check_extent(voxels)]
    seen = report(name, findings)
    assert parts is not None  # else one of the findings was fatal
    blood = np.where(parts == WALL, np.uint8(0), parts.astype(np.uint8))
    mask = Mask(
        np.ascontiguousarray(parts == WALL),
        volume.affine,
        name,
        blood=blood if np.any(blood == LEFT_BLOOD) else None,
    )
    if not view:
        mask, lost = fill_lost_planes(mask)
        mask, dropped = keep_largest(mask)
        scale = check_scale(mask.voxels, mask.affine)
        with recalling(finding.message for finding in seen):
            seen += report(name, [lost, dropped, check_extent(mask.voxels), scale])
    mask, padded = pad_border(mask)
    mask = replace(mask, findings=seen + report(name, [padded]))
    log_findings(mask.findings, name)
    return mask


def _matrix(affine: ArrayLike, name: str) -> NDArray[np.float64]:
    """An affine as an array of its own."""
    try:
        return np.array(affine, dtype=np.float64)
    except (TypeError, ValueError):
        refuse(name, "The affine is not a matrix of numbers: give the 4 x 4 voxel-to-world matrix.")


def log_findings(findings: Iterable[Finding], name: str) -> None:
    """Log what was found: serious findings as warnings.

    Parameters
    ----------
    findings : iterable of Finding
        What was found.
    name : str
        Of the mask.
    """
    for finding in findings:
        level = logging.WARNING if finding.serious else logging.INFO
        logger.log(level, "%s: %s", name, finding.message)
