"""An apical hole: a cone through the apex that is cut out of the anatomy as the base is cut off."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.analysis import Anatomy
from heartgen.anatomy.fit_surfaces import heights
from heartgen.images.levelset import LevelSet
from heartgen.images.mask import Finding
from heartgen.mesh.hermite import RIM
from heartgen.mesh.hexmesh import HexMesh


@dataclass(frozen=True, eq=False)
class Cone:
    """The side of an apical hole: a straight line turned about an axis.

    Attributes
    ----------
    origin : (3,) float64
        Middle of the hole on the endocardium, mm, world (LPS).
    axis : (3,) float64
        Unit vector from there into the cavity.
    radius : float
        On the endocardium, mm.
    widening : float
        Growth of the radius on the way out, mm per mm; not negative.
    """

    origin: NDArray[np.float64]
    axis: NDArray[np.float64]
    radius: float
    widening: float

    def depth(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signed distance (n,) of points (n, 3), mm, world, to the side, positive in the hole.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        offset = points - self.origin
        height = offset @ self.axis
        aside = np.linalg.norm(offset - height[:, None] * self.axis, axis=1)
        inside = self.radius - self.widening * height - aside
        return np.asarray(inside / np.hypot(1, self.widening))


def cone_through(endo: NDArray[np.float64], epi: NDArray[np.float64]) -> Cone:
    """Cone through the rims of a hole.

    Parameters
    ----------
    endo, epi : (n, 3) float64
        Points of the rims on endo- and epicardium, mm, world (LPS).

    Returns
    -------
    Cone
    """
    origin, outside = endo.mean(0), epi.mean(0)
    depth = float(np.linalg.norm(origin - outside))
    radius, outer = (float(np.linalg.norm(rim - rim.mean(0), axis=1).mean()) for rim in (endo, epi))
    return Cone(origin, (origin - outside) / depth, radius, max(outer - radius, 0) / depth)


def rim_cone(mesh: HexMesh) -> Cone:
    """Cone through the rims of the apical hole of a mesh.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    radial = mesh.topology.index[mesh.topology.surfaces[RIM][:, 0], 0]
    rims = []
    for layer, face in ((0, 0.0), (radial.max(), 1.0)):
        elements = mesh.topology.surfaces[RIM][radial == layer, 0]
        rims.append(mesh.evaluate(np.array([[0.0, 0.0, face]]))[elements, 0])
    return cone_through(*rims)


def with_hole(anatomy: Anatomy, cone: Cone) -> Anatomy:
    """Cut a hole into an anatomy.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    cone : Cone
        The hole; mm, world (LPS).

    Returns
    -------
    Anatomy
        With a surface ``apex``, the side of the hole; its wall, against which accuracy is measured,
        ends there.
    """
    level = anatomy.myocardium
    index = np.argwhere(np.ones(level.values.shape, dtype=bool))
    points = index @ level.affine[:3, :3].T + level.affine[:3, 3]
    depth = cone.depth(points).astype(np.float32).reshape(level.values.shape)
    lost = (level.values < 0) & (depth > 0) & (heights(level, anatomy.base.surface) < 0)
    removed = float(np.sum(lost)) * anatomy.voxel**3
    note = (
        f"an apical hole of {cone.radius:.2g} mm radius was cut into the mask: its "
        f"{removed / 1000:.2g} ml of wall count neither as error nor as volume"
    )
    return replace(
        anatomy,
        surfaces={**anatomy.surfaces, "apical_rim": LevelSet(depth, level.affine)},
        myocardium=LevelSet(
            np.maximum(level.values, depth / np.float32(anatomy.voxel)), level.affine
        ),
        wall_volume=anatomy.wall_volume - removed,
        findings=(*anatomy.findings, Finding("apical hole", note)),
        uncut=anatomy,
    )
