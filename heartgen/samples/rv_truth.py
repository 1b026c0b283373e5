"""What is exactly true of a phantom's right ventricle: sizes, and landmarks in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.samples.biv_shape import BivShape, crossings, right_apex
from heartgen.samples.outline import Piece
from heartgen.samples.placement import Pose

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RightVentricle:
    """Right ventricle of a phantom; points in mm, world (LPS).

    Attributes
    ----------
    cavity_volume : float
        Volume of the right blood pool below the base, mm^3.
    wall : float
        Thickness of the free wall, mm: the distance of its epicardium from its endocardium.
    septum : float
        Thickness of the septum, mm: the distance of its right side from the left endocardium.
    apex : (3,) float64
        Lowest point of the right pool along the long axis of the left ventricle.
    apex_level : float
        Its height above the left endocardial apex along that axis, mm.
    left_centroid, centroid : (3,) float64
        Centroids of the left and of the right blood pool.
    towards : (3,) float64
        Unit vector across the long axis, from the left centroid to the right one.
    insertions : (2, 3) float64
        Where free wall and septum meet on the endocardium, halfway in height between the right
        apex and the base (where it cuts the long axis).
    insertion_angles : (2,) float64, rad
        Angles of these points about the long axis from ``towards``, counterclockwise seen from
        the base; negative first.
    grooves : (2, 3) float64
        Where the two parts of the epicardium meet, at the same height.
    groove_angles : (2,) float64, rad
        Their angles.

    Examples
    --------
    >>> from heartgen import samples
    >>> right = samples.biv(6.0).truth.rv
    >>> right.wall, right.septum, right.insertions.shape
    (3.0, 10.0, (2, 3))
    """

    cavity_volume: float
    wall: float
    septum: float
    apex: Array
    apex_level: float
    left_centroid: Array
    centroid: Array
    towards: Array
    insertions: Array
    insertion_angles: Array
    grooves: Array
    groove_angles: Array


def right_ventricle(shape: BivShape, pose: Pose) -> RightVentricle:
    """Measure the right ventricle of a shape and place it in the world.

    Parameters
    ----------
    shape : BivShape
        Both ventricles.
    pose : Pose
        Heart frame to world.
    """
    apex = right_apex(shape)
    left, right = shape.centroids
    towards = (right - left) * [1.0, 1.0, 0.0]
    towards /= np.linalg.norm(towards)
    middle = (apex[2] + shape.base_height) / 2
    insertions, angles = _meeting(shape.walls["free"], middle, towards)
    grooves, groove_angles = _meeting(shape.walls["epi_rv"], middle, towards)
    landmarks = pose.to_world(np.array([apex, left, right]))
    return RightVentricle(
        cavity_volume=pose.scale**3 * shape.right_volume,
        wall=pose.scale * shape.rv_wall,
        septum=pose.scale * shape.septum,
        apex=landmarks[0],
        apex_level=pose.scale * float(apex[2] - shape.apex[2]),
        left_centroid=landmarks[1],
        centroid=landmarks[2],
        towards=pose.rotation @ towards,
        insertions=pose.to_world(insertions),
        insertion_angles=angles,
        grooves=pose.to_world(grooves),
        groove_angles=groove_angles,
    )


def _meeting(piece: Piece, height: float, towards: Array) -> tuple[Array, Array]:
    """Points (2, 3), mm, of the edge of a piece at a height, and their angles (2,), rad."""
    points = crossings(piece.edge, height) if piece.edge is not None else np.empty((0, 3))
    aside = np.cross([0.0, 0.0, 1.0], towards)
    angles = np.arctan2(points @ aside, points @ towards)
    order = np.argsort(angles)
    return points[order], angles[order]
