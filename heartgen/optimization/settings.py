"""All numbers of the optimization: the weights of its terms, and what its numerics need.

Where a number comes from is said with it: a *law* of geometry or numerics, a *study* in
``benchmarks/`` (sensitivity, convergence, ablation), or the *cohort* of those studies, on which
error, Jacobian ratio, scaled Jacobian and fairness were weighed against each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from heartgen.mesh.topology import Topology

# Weights, relative to the squared distances.

LEVELS = (1.4, 1.1, 0.8, 0.5, 0.25)
"""Weight of the elements' quality, and of the surface's smoothness, at each level of detail, over
that of the settings (cohort)."""

USUAL_COLUMNS = 12
"""Elements around the left ventricle that the weights are for."""


@dataclass(frozen=True)
class FitSettings:
    """Weights of the terms of the energy, and of what constrains it.

    Attributes
    ----------
    even : float
        Of the variance of log det J (cohort).
    pole : float
        The same in elements that collapse in the apex, over that of the others: det J grows from
        zero there whatever one does, and what little could be gained would blunt the apex (cohort,
        study: truth).
    angles : float
        Of the squared cosines between the elements' directions (cohort).
    fair : float
        Of the lateral bending of the surfaces' lines (cohort: from 3 to 30 nothing else suffers).
    smooth : float
        Of the bending of the surfaces' displacement along the normal (cohort: no error).
    place : float
        Of the movement of material points of the left ventricle along the surface, in units of
        `MOVEMENT` of its length (cohort: of the left ventricle alone none moves 3 mm).
    distance : float
        Distance that weighs as much as one unit of the other terms, voxels: about the error of a
        voxel surface (study: sensitivity).
    cut : float
        Weight of distances at the base and at an apical hole over that of the others: the rim
        belongs to two surfaces (cohort).
    apex : float
        The same in the elements around the apex, where the wall turns within one of them (cohort).
    right_apex : float
        The same at the right ventricle's apex: draws the insertion line, square in the template,
        onto the round one of the anatomy, where the elements alone would rather stay square.
    """

    even: float = 38.0
    pole: float = 0.2
    angles: float = 10.0
    fair: float = 8.0
    smooth: float = 30.0
    place: float = 10.0
    distance: float = 0.3
    cut: float = 5.0
    apex: float = 3.0
    right_apex: float = 1.0


@dataclass(frozen=True)
class HeartWeights:
    """The weights for hearts of a kind: of a left ventricle alone, or of both.

    Attributes
    ----------
    dense : FitSettings
        For a mask whose voxels fill the heart.
    stack : FitSettings
        For slices far apart. They are met closely whatever lies between them: there is room for
        better elements (cohort).
    interior : (float, float)
        Of even Jacobians and of right angles between the surfaces: so much shear that the right
        angles of straight walls are kept (cohort).
    wider : float
        Power of the elements' width with which quality weighs more in dense masks where there are
        fewer than `USUAL_COLUMNS`: wide elements bend more (cohort).
    """

    dense: FitSettings
    stack: FitSettings
    interior: tuple[float, float]
    wider: float


LV_WEIGHTS = HeartWeights(
    dense=FitSettings(),
    stack=FitSettings(even=32.0, angles=4.0, fair=4.0, smooth=0.05, place=0.1, pole=1.0),
    interior=(45.0, 32.0),
    wider=0.0,
)

BIV_WEIGHTS = HeartWeights(
    # The corners of the right ventricle would be paid for with shear.
    dense=FitSettings(even=32.0, angles=42.0, smooth=2.0, place=2.0, pole=1.0),
    stack=FitSettings(even=68.0, angles=45.0, fair=12.0, smooth=0.05, place=0.1, pole=1.0),
    interior=(30.0, 26.0),
    wider=2.8,
)

ROUNDED = 16.0
"""`right_apex` where the insertion line is to follow the anatomy (study: apex)."""

MOVEMENT = 1 / 38
"""Unit of movement along the surface over the length of the ventricle: 2.4 mm of 90."""


def weights_of(topology: Topology) -> HeartWeights:
    """The weights for hearts like that of a mesh.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    """
    return BIV_WEIGHTS if "rv_endo" in topology.surfaces else LV_WEIGHTS


def settings_for(
    lod: int,
    quality: float = 1.0,
    heart: HeartWeights = LV_WEIGHTS,
    stack: bool = False,
    rounded: bool = True,
    columns: int = USUAL_COLUMNS,
) -> FitSettings:
    """Settings for a level of detail.

    Parameters
    ----------
    lod : int
        Level of detail, 1 to 5.
    quality : float
        Factor of the weight of quality; 1 is the default of the level.
    heart : HeartWeights
        `LV_WEIGHTS` or `BIV_WEIGHTS`.
    stack : bool
        Whether it is fitted to slices far apart.
    rounded : bool
        Whether the insertion line is to follow the anatomy around the right ventricle's apex.
    columns : int
        Elements around the left ventricle.

    Returns
    -------
    FitSettings
    """
    plain = heart.stack if stack else heart.dense
    wide = 1.0 if stack else max(1.0, USUAL_COLUMNS / columns) ** heart.wider
    factor = LEVELS[lod - 1] * quality * wide
    # Where quality weighs more than usual, more holds the lines and the surface against it.
    held = max(1.0, quality)
    return replace(
        plain,
        even=factor * plain.even,
        angles=factor * plain.angles,
        fair=held * plain.fair,
        smooth=LEVELS[lod - 1] * held * plain.smooth,
        right_apex=ROUNDED if rounded else 1.0,
    )


# The data.

VOXELS_PER_LENGTH = 75.0
"""The unit of distance is a voxel of an image at least this fine over the ventricle's length: a
finer one shows no more of a mesh of usual size (study: resolution)."""

POINTS = 8000
"""Points of a surface that suffice: 100 to an element's face (study: convergence)."""

SCATTER = np.sqrt([2.0, 3.0, 5.0])
"""Irrational directions along which the fractional part of a place is as good as random, but the
same for every order of an image's axes (law)."""

FROM_CUT = 1.0
"""Voxels from a cut at which the other surfaces' points begin: what lies closer is its rim."""

INTERPOLATED, NEAR_SLICE = 0.2, 0.15
"""Weight of what was interpolated between slices against what they show; and distance from a slice,
over that between slices, at which its say has fallen to 1/e (study: slice distance)."""

FACE_GAUSS = 6
"""Samples per face and direction for the distance from mesh to patient (study: convergence)."""

FACING = 0.3
"""Least cosine between the normals of patient and mesh at points that belong together."""

OUTLIER = 3.0
"""Distance, voxels, at which a point of the patient counts half."""

# The elements.

COLLOCATED, COLLOCATION = 0.1, 4
"""Weight of the points on an element's faces, where folds begin, against its Gauss points, and
their number along an edge. They crowd towards the corners, as folds do."""

ANGLE_GAUSS = 3
"""Points per direction at which angles are measured (study: convergence)."""

LEAST_SCALED = 0.3
"""Scaled Jacobian below which angles gain no more weight."""

FOLDED, SHIFT = 1e-3, 0.1
"""det J over its mean in an element below which it has to be untangled; and the shift, over the
same mean, by which all det J are lifted smoothly above zero until it is."""

LINE_GAUSS = 4
"""Points per face and direction for the surfaces' lines: exact for the bending of a cubic (law)."""

# Driver and policy.

STEPS, CONVERGED, SHORTEST = 10, 5e-3, 2.0**-10
"""Gauss-Newton steps at most; relative decrease of the energy below which there is no further one;
and share of a step below which none is made."""

INTERIOR_STEPS = 6
"""Steps on what lies between the surfaces, whose every step is nearly the last (study)."""

RIDGE = 1e-10
"""Share of the largest diagonal entry of a system added to all of them: the pole's are nearly free
(law: far above rounding, far below what moves a mesh)."""

ROUNDS, MORE_ROUNDS = 8, 12
"""Times a mesh is fitted, at most, until it meets the constraints, and once more where neighbors
weigh more, too (cohort: of 160 stacks, those that came free alone did in 6, the others in 11)."""

GROWTH = 2.0
"""Factor by which elements that fold or cross weigh more after the first round; after the second it
is twice that, after the third three times. Those that did weigh more keep this factor once all are
valid, when the line search alone keeps the mesh from folding again."""

RELAXING, MOST_RELAXED = 7.0, 0.5
"""Power of the misfit over the largest allowed by which all but the data weighs less; and the least
factor of a round (cohort: halving the weights takes a tenth of the misfit)."""

RELAXED_ROUNDS, AIMED_MISFIT = 4, 0.98
"""Rounds in which that may be so; and misfit aimed at, over the largest allowed: the last percent
would take rounds of its own."""

MOST_RAISED, RAISED_ROUNDS = 4.0, 6
"""Factor by which an element below the least Jacobian ratio weighs more in a round, at most; and
number of such rounds."""

AIM = 1.1
"""Jacobian ratio aimed at, over the least: the closer elements are, the less they still gain."""
