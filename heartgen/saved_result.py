"""Results that were written: what of one is in its folder, and where its mask may be."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np

from heartgen.anatomy import analyze_under, rim_cone, with_hole
from heartgen.errors import HeartgenError, InputError, MissingFileError, NotKeptError
from heartgen.files import replacing
from heartgen.formats import read_mesh
from heartgen.images import Mask
from heartgen.images.accepting import MaskLike, accept, read_again
from heartgen.images.volume import LPS_FROM_RAS
from heartgen.mesh import HexMesh
from heartgen.mesh.hermite import RIM
from heartgen.options import Options
from heartgen.report import REPORT, Report, mask_sha256, options_beside
from heartgen.report_reading import read_report

MESHES = ("mesh.exf", "mesh.ex2", "mesh.exelem", "mesh.vtu", "mesh-vtu-bezier.vtu")
"""Files of a mesh, those first that hold its basis."""

MASK = "mask.nii.gz"
"""File of the mask, if it was written."""

GIVE_MASK = "give it: Personalization.load(folder, mask=...)"


class Saved(Protocol):
    """A result that was loaded, whose mask is found when it is asked for."""

    @property
    def mask(self) -> Mask:
        """Of the fit."""

    @property
    def options(self) -> Options:
        """Of the fit."""

    @property
    def mesh(self) -> HexMesh:
        """The result."""

    @property
    def report(self) -> Report:
        """On it."""


def load_parts(folder: Path, mask: MaskLike | None) -> dict[str, Any]:
    """What is in the folder of a result, by the names of its parts.

    Parameters
    ----------
    folder : Path
        Of the result.
    mask : Mask, path or image, optional
        That of the fit.

    Returns
    -------
    dict
        With ``folder``, where the mask is looked for later if it was not given.

    Raises
    ------
    InputError
        If there is no result, or it is of another mask.
    """
    if not folder.is_dir():
        raise MissingFileError(f"{folder}: There is no such folder: check the path.")
    mesh = next((folder / name for name in MESHES if (folder / name).is_file()), None)
    if mesh is None:
        raise MissingFileError(
            f"{folder}: There is no mesh that can be read ({', '.join(MESHES)}): give the folder "
            "of a result, or write it in one of these formats."
        )
    parts: dict[str, Any] = {
        "folder": folder,
        "report": read_report(folder / REPORT),
        "options": options_beside(mesh),
        "mesh": read_mesh(mesh),
    }
    if mask is not None:
        parts["mask"] = accept(mask)
        if mask_sha256(parts["mask"]) != parts["report"].mask_sha256:
            raise InputError(
                f"{folder}: The result is of {parts['report'].name}, and this is another mask "
                f"({parts['mask'].name}): give that of the fit."
            )
    return parts


def find_part(result: Saved, folder: Path, name: str) -> Any:
    """A part of a loaded result that is not there yet.

    Parameters
    ----------
    result : Saved
        With what is there.
    folder : Path
        From which it was loaded.
    name : str
        Of the part.

    Raises
    ------
    NotKeptError
        If it cannot be had.
    """
    if name == "mask":
        return _find_mask(folder, result.report)
    if name == "anatomy":
        anatomy = analyze_under(result.mask, result.options)
        has_hole = RIM in result.mesh.topology.surfaces
        return with_hole(anatomy, rim_cone(result.mesh)) if has_hole else anatomy
    raise NotKeptError(
        f"{folder}: A result that was loaded has no {name}, which is not written: fit the "
        "mask again with heartgen.personalize."
    )


def keep_mask(mask: Mask, folder: Path) -> Path:
    """Write a mask so that it can be read to the bit: NIfTI-2, whose affine is of doubles.

    With blood pools it is a label map, which `heartgen.images.schemes.KEPT` describes.

    Parameters
    ----------
    mask : Mask
        Of the result.
    folder : Path
        Of the result.

    Returns
    -------
    Path
        The file.
    """
    from nibabel.loadsave import save
    from nibabel.nifti2 import Nifti2Image

    make: Any = Nifti2Image
    values = mask.voxels.astype(np.uint8)
    if mask.blood is not None:
        values = np.where(mask.voxels, values, mask.blood)
    image = make(values, LPS_FROM_RAS * mask.affine)
    image.header.set_xyzt_units("mm")
    path = folder / MASK
    with replacing(path) as temporary:
        save(image, temporary)
    return path


def _find_mask(folder: Path, report: Report) -> Mask:
    """The mask of a report: the one that was written, or the one that it names."""
    seen = []
    if (folder / MASK).is_file():
        return _kept_mask(folder / MASK, report)
    if report.mask_source is not None:
        seen.append(str(report.mask_source["path"]))
        try:
            mask = read_again(report.mask_source, folder)
        except MissingFileError:
            pass
        except HeartgenError as error:
            raise NotKeptError(f"{error} It was the mask of this result: {GIVE_MASK}.") from error
        else:
            if mask_sha256(mask) == report.mask_sha256:
                return mask
            raise NotKeptError(
                f"{folder}: The file {seen[0]} has changed since the mesh was fitted to it: "
                f"{GIVE_MASK}."
            )
    where = f" ({', '.join(seen)})" if seen else ""
    raise NotKeptError(
        f"{folder}: The mask of this result, {report.name}, is not there{where}: {GIVE_MASK}."
    )


def _kept_mask(path: Path, report: Report) -> Mask:
    """A mask that `keep_mask` wrote."""
    from nibabel.loadsave import load

    image: Any = load(path)
    values = np.asarray(image.dataobj)
    blood = np.where(values > 1, values, 0).astype(np.uint8)
    mask = Mask(
        np.ascontiguousarray(values == 1),
        np.asarray(LPS_FROM_RAS * image.affine),
        report.name,
        blood=blood if blood.any() else None,
        source=report.mask_source,
    )
    if mask_sha256(mask) != report.mask_sha256:
        raise NotKeptError(f"{path}: This is not the mask of the report beside it: {GIVE_MASK}.")
    return mask
