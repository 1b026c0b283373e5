"""Phantoms of the left ventricle: a mask as a scanner would give it, and the truth behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from heartgen.errors import InputError
from heartgen.images.mask import Mask
from heartgen.samples.placement import make_grid, make_pose
from heartgen.samples.shape import Ellipsoid, Lobe, Shape, below_base, depth, straighten, wall_point
from heartgen.samples.truth import Truth

Array = NDArray[np.float64]
Inside = Callable[[Shape, Array], NDArray[np.bool_]]

EXTENT_SAMPLES = 5000
"""Surface samples that, with the rims, span the heart to 0.2 mm; the margin does the rest."""

# Sizes of a normal adult left ventricle at end diastole (Lang et al. 2015, JASE 28:1-39): internal
# diameter 42-58 mm, wall 6-10 mm; about 80-90 mm from base to apex in long-axis views.
LIFELIKE = Shape(
    endo=Ellipsoid(22.0, 60.0, (0.8, 0.3), (Lobe(2, 0.07, 0.4), Lobe(3, 0.035, 1.2))),
    epi=Ellipsoid(32.0, 65.0, (0.0, 0.0), (Lobe(2, 0.05, 0.5), Lobe(3, 0.025, 1.1))),
    base_height=20.0,
    base_slope=(0.12, -0.07),
    bend=(5.0, -3.0),
)
"""Oval, slightly triangular sections, 10 mm of wall at the base and 5 mm at the apex, a base tilted
by 8 degrees, an apex 6 mm off the straight axis."""

VALVES = (Lobe(2, 4.0, 0.3), Lobe(3, 2.4, 1.0))
"""Rim of a base cut along valves: up to 6 mm above and below its plane."""

PAPILLARY_ANGLES = (0.9, 2.7)
"""Circumferential positions of the two papillary muscles, rad (about 100 degrees apart)."""

PAPILLARY_ROOT, PAPILLARY_TIP = -40.0, -6.0
"""Heights at which a papillary muscle leaves the wall and ends, mm, heart frame."""

PAPILLARY_AXIS = 0.48
"""Distance of a papillary tip from the long axis, share of the endocardial radius there."""

PAPILLARY_RADIUS = 4.0
"""Radius of a papillary muscle, mm (7 to 10 mm thick in adults)."""

TRABECULAE = 13
"""Ridges around the apical endocardium, 4 to 8 mm apart."""

TRABECULAR_HEIGHT = 3.0
"""Height of the ridges, mm."""

TRABECULAR_TWIST = 1.5
"""Turn of the ridges around the axis, rad per rad from the apex: they spiral."""

TRABECULAR_RANGE = (0.25, 1.25)
"""Angle from the apex over which ridges stand, rad: from beside the apex to the mid level."""


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
    """

    mask: Mask
    truth: Truth
    description: str


def ideal_cup(
    spacing: ArrayLike = 1.0,
    *,
    radius: float = 22.0,
    length: float = 60.0,
    wall: float = 10.0,
    base_height: float = 20.0,
    rotation: ArrayLike | int | None = None,
    translation: ArrayLike = (0.0, 0.0, 0.0),
    scale: float = 1.0,
    direction: ArrayLike | None = None,
) -> Sample:
    """Make a truncated ellipsoidal shell.

    Parameters
    ----------
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.
    radius, length : float, mm
        Semi-axes of the endocardium, across and along the long axis.
    wall : float, mm
        Added to both semi-axes for the epicardium.
    base_height : float, mm
        Height of the basal plane above the widest level.
    rotation : (3, 3) array, int or None
        From the heart frame (z from apex to base) to the world (LPS); an int seeds a random one.
    translation : (3,) array, mm, world (LPS)
        Where the centre of the ellipsoids goes.
    scale : float
        Factor on all sizes of the heart (not on the spacing).
    direction : (3, 3) array or None
        Columns are the directions of the index axes in the world (LPS); None for its axes.

    Returns
    -------
    Sample

    Raises
    ------
    InputError
        If a size, the placement or the grid makes no heart.
    """
    if not (min(radius, length, wall) > 0 and abs(base_height) < length):
        raise InputError(
            "An ideal cup needs a positive radius, length and wall, and a base_height between "
            f"-length and length; it got {radius}, {length}, {wall} and {base_height} mm."
        )
    shape = Shape(
        endo=Ellipsoid(radius, length),
        epi=Ellipsoid(radius + wall, length + wall),
        base_height=base_height,
    )
    truth = Truth(shape, make_pose(rotation, translation, scale))
    mask = _voxelise(truth, _wall, spacing, direction, "ideal cup")
    return Sample(mask, truth, "Truncated ellipsoidal shell with a flat base.")


def lifelike_lv(
    spacing: ArrayLike = 1.0,
    *,
    papillary: bool = False,
    trabeculae: bool = False,
    valves: bool = False,
    noise: float = 0.0,
    seed: int = 0,
    rotation: ArrayLike | int | None = None,
    translation: ArrayLike = (0.0, 0.0, 0.0),
    scale: float = 1.0,
    direction: ArrayLike | None = None,
) -> Sample:
    """Make a left ventricle with an oval, bent, tapering wall and a tilted base.

    Parameters
    ----------
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.
    papillary : bool
        Add two papillary muscles: free columns above, merged into the wall below.
    trabeculae : bool
        Add ridges to the apical endocardium.
    valves : bool
        Let the rim rise and fall by up to 6 mm, so that the base needs truncation.
    noise : float
        Probability of flipping each voxel that has a face in common with the other label.
    seed : int
        Seed of the noise.
    rotation : (3, 3) array, int or None
        From the heart frame (z from apex to base) to the world (LPS); an int seeds a random one.
    translation : (3,) array, mm, world (LPS)
        Where the long axis' widest level goes.
    scale : float
        Factor on all sizes of the heart (not on the spacing); 1 is human, 0.3 a rabbit.
    direction : (3, 3) array or None
        Columns are the directions of the index axes in the world (LPS); None for its axes.

    Returns
    -------
    Sample
        Its truth has the rim of the valves, but no muscles, trabeculae or noise.

    Raises
    ------
    InputError
        If the noise is not a probability, or the placement or the grid makes no heart.
    """
    if not 0 <= noise <= 1:
        raise InputError(f"The noise must be a probability between 0 and 1, not {noise}.")

    def inside(shape: Shape, points: Array) -> NDArray[np.bool_]:
        tissue = _wall(shape, points)
        if papillary:
            tissue |= _papillary(shape, points)
        if trabeculae:
            tissue |= _trabeculae(shape, points)
        return tissue

    shape = replace(LIFELIKE, base_waves=VALVES) if valves else LIFELIKE
    truth = Truth(shape, make_pose(rotation, translation, scale))
    mask = _voxelise(truth, inside, spacing, direction, "lifelike left ventricle")
    if noise > 0:
        mask = replace(mask, voxels=_flipped(mask.voxels, noise, seed))
    extras = {
        "papillary muscles": papillary,
        "trabeculae": trabeculae,
        "an irregular rim": valves,
        "voxel noise": noise > 0,
    }
    plus = " and ".join(name for name, present in extras.items() if present)
    text = "Oval, bent left ventricle with a tapering wall and a tilted base"
    return Sample(mask, truth, f"{text}, with {plus}." if plus else f"{text}.")


def _voxelise(
    truth: Truth, inside: Inside, spacing: ArrayLike, direction: ArrayLike | None, name: str
) -> Mask:
    """Mask of the voxels whose centres are inside, slab by slab to keep memory small."""
    surface, _ = truth.surface(EXTENT_SAMPLES)
    extent = np.concatenate([surface, *truth.rims])
    affine, size = make_grid(extent, spacing, direction)
    j, k = np.meshgrid(*(np.arange(s, dtype=np.float64) for s in size[1:]), indexing="ij")
    voxels = np.zeros(size, dtype=np.bool_)
    for i in range(size[0]):
        index = np.column_stack([np.full(j.size, float(i)), j.ravel(), k.ravel()])
        world = index @ affine[:3, :3].T + affine[:3, 3]
        voxels[i] = inside(truth.shape, truth.pose.to_heart(world)).reshape(size[1:])
    if not voxels.any():
        raise InputError(
            f"A spacing of {spacing!r} mm misses the whole wall of the heart; choose a finer one."
        )
    return Mask(voxels, affine, name)


def _wall(shape: Shape, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, heart frame, lie in the smooth wall, (n,)."""
    straight = straighten(shape, points)
    outside_cavity = depth(shape.endo, straight)[0] <= 0
    return np.asarray(
        below_base(shape, straight) & outside_cavity & (depth(shape.epi, straight)[0] > 0)
    )


def _papillary(shape: Shape, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, heart frame, lie in a papillary muscle, rooted in the wall, (n,)."""
    straight = straighten(shape, points)
    near = np.zeros(len(points), dtype=np.bool_)
    for angle in PAPILLARY_ANGLES:
        root, tip = (_endo_point(shape, z, angle) for z in (PAPILLARY_ROOT, PAPILLARY_TIP))
        centre = np.array([*shape.endo.centre, PAPILLARY_TIP])
        axis = centre + PAPILLARY_AXIS * (tip - centre) - root
        along = np.clip((straight - root) @ axis / (axis @ axis), 0, 1)
        near |= np.linalg.norm(straight - root - along[:, None] * axis, axis=1) < PAPILLARY_RADIUS
    return near


def _trabeculae(shape: Shape, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, heart frame, lie in a ridge on the apical endocardium, (n,)."""
    gap, polar, angle = depth(shape.endo, straighten(shape, points))
    start, end = TRABECULAR_RANGE
    window = np.sin(np.pi * np.clip((polar - start) / (end - start), 0, 1))
    ridge = np.maximum(np.cos(TRABECULAE * (angle + TRABECULAR_TWIST * polar)), 0)
    return np.asarray((gap > 0) & (gap < TRABECULAR_HEIGHT * window * ridge))


def _endo_point(shape: Shape, height: float, angle: float) -> Array:
    """Point (3,), mm, straight frame, of the endocardium at a height and angle."""
    polar = np.arccos(-height / shape.endo.length)
    return np.asarray(wall_point(shape.endo, polar * np.array([[np.cos(angle), np.sin(angle)]]))[0])


def _flipped(voxels: NDArray[np.bool_], probability: float, seed: int) -> NDArray[np.bool_]:
    """Flip voxels that share a face with the other label, each with the given probability."""
    boundary = ndimage.binary_dilation(voxels) & ~ndimage.binary_erosion(voxels)
    chance = np.random.default_rng(seed).random(voxels.shape)
    return np.asarray(voxels ^ (boundary & (chance < probability)))
