"""Named phantoms for demonstrations, notebooks and tests; the same at every call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from scipy.spatial.transform import Rotation

from heartgen.errors import InputError
from heartgen.samples.phantoms import Sample, ideal_cup, lifelike_lv

NOISE = 0.25
"""Share of the boundary voxels flipped in the noisy phantom: a careless manual segmentation."""

CHEST_ANGLES = (-50.0, -35.0, 25.0)
"""Turns about x, y and z, degrees: the long axis points left, forward and down as in a chest."""

CORONAL = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
"""Columns are the index axes of a coronal image in the world (LPS): left, down, back."""

CORONAL_SPACING = (1.25, 1.25, 2.0)
"""Pixel size and slice distance of the tilted phantom's coronal image, mm."""


def names() -> tuple[str, ...]:
    """Names of the phantoms that `load` knows."""
    return tuple(_MAKERS)


def load(name: str) -> Sample:
    """Make a phantom by name.

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    Sample
        Its mask carries the name.

    Raises
    ------
    InputError
        If there is no phantom of that name.
    """
    if name not in _MAKERS:
        raise InputError(f"There is no sample {name!r}; choose one of {', '.join(_MAKERS)}.")
    sample = _MAKERS[name]()
    return replace(sample, mask=replace(sample.mask, name=name))


def _tilted() -> Sample:
    """Lifelike ventricle as it lies in a chest, on a coarser coronal image."""
    rotation = Rotation.from_euler("xyz", CHEST_ANGLES, degrees=True).as_matrix()
    sample = lifelike_lv(CORONAL_SPACING, rotation=rotation, direction=CORONAL)
    return replace(sample, description=f"As in a chest, on coronal slices: {sample.description}")


_MAKERS: dict[str, Callable[[], Sample]] = {
    "ideal": ideal_cup,
    "lifelike": lifelike_lv,
    "papillary": lambda: lifelike_lv(papillary=True, trabeculae=True),
    "valves": lambda: lifelike_lv(valves=True),
    "noisy": lambda: lifelike_lv(noise=NOISE),
    "tilted": _tilted,
}
