"""Whatever holds a mask, taken for one: paths, arrays, and images of nibabel and SimpleITK.

Images of those libraries are known by the module that their class is from, so that neither library
is loaded for one that was not given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heartgen.errors import InputError, UnreadableFileError
from heartgen.images.mask import Mask
from heartgen.images.reading import mask_from_array, read_heart, read_mask
from heartgen.images.sources import taking_of

MaskLike: TypeAlias = Any
"""A `Mask`; a path; an array, with an affine or a spacing beside it; an image of nibabel or
SimpleITK. Neither library has to be there, which is why a type checker is told no more."""

ACCEPTED = (
    "give a path, a heartgen.Mask, a NumPy array with affine=... or spacing=..., or an image of "
    "nibabel or SimpleITK"
)

AXES = 3


def accept(
    image: MaskLike,
    *,
    affine: ArrayLike | None = None,
    spacing: ArrayLike | None = None,
    view: bool = False,
) -> Mask:
    """Take whatever holds a mask for one.

    Parameters
    ----------
    image : Mask, path-like, (nx, ny, nz) array-like, nibabel image or SimpleITK image
        A file is read as `heartgen.read_mask` does. Worlds of nibabel are RAS and those of
        SimpleITK LPS: both are put in ours, LPS, mm.
    affine : (4, 4) array-like, optional
        Of an array: voxel index to world coordinates, mm, LPS.
    spacing : float or (3,) array-like, optional
        Of an array: distance of its voxels along i, j, k, mm; its axes are then taken for left,
        posterior, superior.
    view : bool
        As of `heartgen.read_mask`; of a file.

    Returns
    -------
    Mask

    Raises
    ------
    InputError
        If it is none of these, or no heart can be meshed from it.

    Examples
    --------
    >>> import numpy as np
    >>> from heartgen import samples
    >>> cup = samples.ideal_cup(spacing=2.0).mask
    >>> accept(cup.voxels, spacing=2.0)  # doctest: +ELLIPSIS
    Mask 'mask': mask, ... voxels of 2 x 2 x 2 mm
      myocardium ... ml
    """
    is_array = not isinstance(image, Mask | str | PathLike) and hasattr(image, "__array__")
    library = _library(image)
    if library is not None or not is_array:
        _refuse_place(affine, spacing)
    if isinstance(image, Mask):
        return image
    if isinstance(image, str | PathLike):
        return read_mask(image, view=view)
    if library == "nibabel":
        return _from_nibabel(image)
    if library == "SimpleITK":
        return _from_itk(image)
    if is_array:
        return mask_from_array(_array(image), _affine(affine, spacing))
    raise InputError(f"a mask cannot be made of {_kind(image)}: {ACCEPTED}")


def accept_all(
    images: MaskLike | Iterable[MaskLike],
    *,
    affine: ArrayLike | None = None,
    spacing: ArrayLike | None = None,
) -> list[Mask]:
    """Take one mask, or a mask and further views of the same heart; otherwise as `accept`.

    Parameters
    ----------
    images : as of `accept`, or iterable of them
        Further ones are views, which need not show the whole of the heart.
    affine, spacing : array-like, optional
        Of one array.

    Returns
    -------
    list of Mask

    Raises
    ------
    InputError
        Also if there is none.
    """
    if _is_one(images):
        return [accept(images, affine=affine, spacing=spacing)]
    each = list(images)
    if not each:
        raise InputError("there is no image of the heart: give a mask, and further views of it")
    _refuse_place(affine, spacing)
    return [accept(image, view=number > 0) for number, image in enumerate(each)]


def read_again(source: Mapping[str, Any], folder: Path) -> Mask:
    """Read a mask from where it was read before.

    Parameters
    ----------
    source : mapping of str to value
        As `Mask.source` has it.
    folder : Path
        From where a relative path leads, and where a file of that name is looked for otherwise.

    Returns
    -------
    Mask

    Raises
    ------
    InputError
        As of `read_mask`.
    """
    said = dict(source)
    path, view = folder / said.pop("path"), bool(said.pop("view", False))
    place = path if path.exists() else folder / path.name
    return read_heart(place, taking_of(said), view=view)


def _is_one(images: Any) -> bool:
    """Whether this is one image, and not several."""
    if isinstance(images, Mask | str | bytes | dict | PathLike) or hasattr(images, "__array__"):
        return True
    return _library(images) is not None or not isinstance(images, Iterable)


def _library(image: Any) -> str | None:
    """Which library the class of an image is from, if one of the two."""
    homes = {kind.__module__.partition(".")[0] for kind in type(image).__mro__}
    return next((name for name in ("nibabel", "SimpleITK") if name in homes), None)


def _kind(image: Any) -> str:
    """What something is, in words."""
    if image is None:
        return "None"
    name = type(image).__name__
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


def _refuse_place(affine: ArrayLike | None, spacing: ArrayLike | None) -> None:
    """Refuse a second word on where voxels lie."""
    given = [name for name, v in (("affine", affine), ("spacing", spacing)) if v is not None]
    if given:
        raise InputError(
            f"{' and '.join(given)} can be given for an array alone, files and images say "
            "themselves where their voxels lie: leave it out"
        )


def _array(image: Any) -> NDArray[Any]:
    """What is given as an array."""
    try:
        return np.asarray(image)
    except Exception as error:  # of whatever library the object is from
        raise InputError(f"{_kind(image)} is no array ({error}): {ACCEPTED}") from error


def _affine(affine: ArrayLike | None, spacing: ArrayLike | None) -> ArrayLike:
    """Where the voxels of an array lie."""
    if affine is not None and spacing is not None:
        raise InputError(
            "affine and spacing were both given, and the affine holds the spacing: give one"
        )
    if affine is not None:
        return affine
    if spacing is None:
        raise InputError(
            "an array does not say how large its voxels are: give affine=..., voxel index to "
            "world (LPS), or spacing=..., in mm"
        )
    try:
        sides = np.broadcast_to(np.asarray(spacing, dtype=np.float64), AXES)
    except (TypeError, ValueError):
        sides = np.zeros(AXES)
    if not (np.isfinite(sides) & (sides > 0)).all():
        raise InputError(
            f"a spacing of {spacing!r} is no size of voxels: give one positive number in mm, or "
            "three, along i, j and k"
        )
    return np.diag([*sides, 1.0])


def _from_nibabel(image: Any) -> Mask:
    """A mask from an image of nibabel, whose world is RAS."""
    from heartgen.images.nifti import MM

    file = image.get_filename() if hasattr(image, "get_filename") else None
    name = Path(file).name if file else "nibabel image"
    if getattr(image, "affine", None) is None or not hasattr(image, "dataobj"):
        raise InputError(f"{name}: {_kind(image)} has no voxels in the world: {ACCEPTED}")
    kinds = {kind.__name__ for kind in type(image).__mro__}
    if "AnalyzeImage" in kinds and not hasattr(image.header, "get_sform"):
        raise InputError(
            f"{name}: This is an Analyze image, which does not say which side is left: make a "
            "NIfTI image of it."
        )
    try:
        values = np.asanyarray(image.dataobj)
    except OSError as error:
        raise UnreadableFileError(
            f"{name}: The voxels of this image cannot be read ({error}): load it again."
        ) from error
    units = getattr(image.header, "get_xyzt_units", None)
    to_mm = 1.0 if units is None else MM.get(units()[0], 1.0)
    affine = np.diag([to_mm, to_mm, to_mm, 1.0]) @ np.asarray(image.affine, dtype=np.float64)
    return mask_from_array(values, affine, name=name, frame="RAS")


def _from_itk(image: Any) -> Mask:
    """A mask from an image of SimpleITK: its world is LPS, and its arrays are (z, y, x)."""
    from heartgen.images.itk import placed

    name = "SimpleITK image"
    if not all(hasattr(image, a) for a in ("GetDirection", "GetNumberOfComponentsPerPixel")):
        raise InputError(f"{name}: {_kind(image)} has no voxels in the world: {ACCEPTED}")
    if image.GetDimension() < AXES or image.GetNumberOfComponentsPerPixel() > 1:
        raise InputError(
            f"{name}: It has {image.GetDimension()} axes and "
            f"{image.GetNumberOfComponentsPerPixel()} numbers a voxel: give a volume of labels."
        )
    return mask_from_array(*placed(image), name=name)
