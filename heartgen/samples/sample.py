"""A phantom: the voxels that a scanner would give, and the truth behind them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from heartgen.errors import InputError
from heartgen.images.mask import Mask
from heartgen.samples.placement import UNMOVED, Placement, make_grid, make_pose
from heartgen.samples.truth import Heart, Truth

Array = NDArray[np.float64]

EXTENT_SAMPLES = 5000
"""Surface samples that, with the rims, span the heart to 0.2 mm; the margin does the rest."""


@dataclass(frozen=True)
class Sample:
    """A phantom.

    Attributes
    ----------
    mask : Mask
        The voxels that a user would start from.
    truth : Truth
        The smooth wall behind them.
    description : str
        One sentence about what it looks like.

    Examples
    --------
    >>> from heartgen import samples
    >>> sample = samples.ideal_cup(4.0)
    >>> sample.mask.voxels.shape, sample.description
    ((24, 24, 31), 'Truncated ellipsoidal shell with a flat base.')
    """

    mask: Mask
    truth: Truth
    description: str


def make_sample(
    heart: Heart,
    inside: Callable[[Array], NDArray[np.bool_]],
    spacing: ArrayLike,
    name: str,
    description: str,
    **placement: Unpack[Placement],
) -> Sample:
    """Place a heart in the world and look at it through voxels.

    Parameters
    ----------
    heart : Heart
        The smooth wall.
    inside : callable
        Points (n, 3), mm, heart frame, to whether there is tissue, (n,).
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.
    name : str
        Name of the mask.
    description : str
        One sentence.
    **placement : Placement
        How the heart lies in the world and under the voxels.

    Returns
    -------
    Sample

    Raises
    ------
    InputError
        If the noise is not a probability, or the placement or the grid makes no heart.
    """
    placed: Placement = {**UNMOVED, **placement}
    if unknown := placed.keys() - UNMOVED.keys():
        raise TypeError(f"a phantom has no {', '.join(sorted(unknown))}")
    noise = placed["noise"]
    if not 0 <= noise <= 1:
        raise InputError(f"The noise must be a probability between 0 and 1, not {noise}.")
    truth = Truth(heart, make_pose(placed["rotation"], placed["translation"], placed["scale"]))
    surface, _ = truth.surface(EXTENT_SAMPLES)
    affine, size = make_grid(np.concatenate([surface, *truth.rims]), spacing, placed["direction"])
    voxels = np.zeros(size, dtype=np.bool_)
    j, k = np.meshgrid(*(np.arange(s, dtype=np.float64) for s in size[1:]), indexing="ij")
    # Slab by slab, which keeps memory small.
    for i in range(size[0]):
        index = np.column_stack([np.full(j.size, float(i)), j.ravel(), k.ravel()])
        world = index @ affine[:3, :3].T + affine[:3, 3]
        voxels[i] = inside(truth.pose.to_heart(world)).reshape(size[1:])
    if not voxels.any():
        raise InputError(
            f"A spacing of {spacing!r} mm misses the whole wall of the heart; choose a finer one."
        )
    if noise > 0:
        voxels = _flipped(voxels, noise, placed["seed"])
    return Sample(Mask(voxels, affine, name), truth, description)


def _flipped(voxels: NDArray[np.bool_], probability: float, seed: int) -> NDArray[np.bool_]:
    """Flip voxels that share a face with the other label, each with the given probability."""
    boundary = ndimage.binary_dilation(voxels) & ~ndimage.binary_erosion(voxels)
    chance = np.random.default_rng(seed).random(voxels.shape)
    return np.asarray(voxels ^ (boundary & (chance < probability)))
