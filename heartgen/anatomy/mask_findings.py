"""What the shape analysis did with a mask that the user should know."""

from __future__ import annotations

import numpy as np

from heartgen.anatomy.basal_surface import BasalSurface
from heartgen.anatomy.base import Base
from heartgen.anatomy.blood_pools import BloodPools
from heartgen.anatomy.fit_surfaces import LEAST_WALL
from heartgen.images.mask import Finding, Mask

PIN_HOLE = 0.1
"""Size over the opening's up to which a further opening of a right ventricle is a pin-hole; a
larger one is that of the pulmonary valve."""

LARGE_HOLE = 0.15
"""Size of an opening, over that at the base, from which it is no pin-hole but a missing wall."""


def opening_findings(pools: BloodPools, mask: Mask, base: Base) -> tuple[Finding, ...]:
    """Openings of the wall far from the base: how large and where; they were closed.

    Parameters
    ----------
    pools : BloodPools
        Whose cavities were closed.
    mask : Mask
        The myocardium, in the world (LPS).
    base : Base
        Of the heart.
    """
    pixel = float(np.prod(mask.spacing) ** (2 / 3))
    leaks = [("left", leak, pools.left) for leak in pools.left.leaks]
    if pools.right is not None:
        most = PIN_HOLE * len(pools.right.opening)
        leaks += [("right", leak, pools.right) for leak in pools.right.leaks if leak.size < most]
    large = [each for each in leaks if each[1].size > LARGE_HOLE * len(each[2].opening)]
    found = [
        Finding(
            "leaks",
            f"the {name} ventricle's wall is open over {leak.size * pixel:.3g} mm^2, "
            f"{-float(base.plane.height(mask.to_world(leak.center[None]))[0]):.0f} mm below the "
            "base: the mesh's wall there is made up; complete the mask",
            serious=True,
        )
        for name, leak, _ in large
    ]
    small = [each[1].size for each in leaks if each not in large]
    if small:
        told = (
            f"the wall has {len(small)} pin-hole(s) of at most {max(small) * pixel:.2g} mm^2 far "
            "from the base, which were closed"
        )
        found.append(Finding("leaks", told))
    return tuple(found)


def treatment_findings(
    pools: BloodPools, base: Base, voxel: float, thickened: bool
) -> tuple[Finding, ...]:
    """What was done with wall, muscles and base.

    Parameters
    ----------
    pools : BloodPools
        Of which papillary muscles were made a part.
    base : Base
        Of the heart, perhaps truncated.
    voxel : float
        Edge of a cube with the volume of a voxel, mm.
    thickened : bool
        Whether the wall was given the least thickness somewhere.
    """
    found = []
    muscle_voxels = sum(cavity.muscle_voxels for cavity in pools)
    if thickened:
        found.append(
            Finding(
                "thin wall",
                "the wall is thinner than a voxel in places: the mesh is given "
                f"{LEAST_WALL * voxel:.2g} mm there",
            )
        )
    if muscle_voxels:
        found.append(
            Finding(
                "papillary muscles",
                f"{muscle_voxels * voxel**3 / 1000:.2g} ml of papillary muscle and "
                "trabeculae were taken as part of the blood pool",
            )
        )
    if base.truncation is not None:
        reference = "the rim" if isinstance(base.surface, BasalSurface) else "the basal plane"
        found.append(
            Finding(
                "truncation",
                f"the base was truncated {base.truncation:.3g} mm below {reference} (which rises "
                f"and falls by {base.irregularity:.2g} mm)",
            )
        )
    return tuple(found)
