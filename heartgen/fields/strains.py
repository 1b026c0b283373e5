"""How a heart moves: strains of the left ventricle between meshes with corresponding points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.fields.axes import heart_axes
from heartgen.fields.frames import frames_at
from heartgen.fields.segments import SEGMENTS, aha_segment
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.quadrature import gauss_cube

Array = NDArray[np.float64]

GAUSS = 4
"""Points per direction at which strains are averaged."""


SEPTUM, RIGHT = "septum", "right ventricle"
"""Parts that tell where the wall opens into the right ventricle."""

WHOLE = 1 - 1e-9
"""Share of the wall, but for rounding, from which on strains are those of all of it."""


@dataclass(frozen=True)
class Strains:
    """Mean relative change of length of the left ventricle's wall, with the septum.

    Attributes
    ----------
    longitudinal, circumferential, radial : float
        Along the directions of the wall before; negative where it shortens.
    share : float
        Of the wall's volume whose elements correspond. The right ventricle may begin one row of
        elements higher or lower in the other mesh.

    Examples
    --------
    >>> from heartgen.fields import Strains
    >>> Strains(longitudinal=-0.2, circumferential=-0.25, radial=0.4).whole
    True
    """

    longitudinal: float
    circumferential: float
    radial: float
    share: float = 1.0

    @property
    def whole(self) -> bool:
        """Whether all of the wall corresponds."""
        return self.share > WHOLE


def global_strains(before: HexMesh, after: HexMesh) -> Strains:
    """Strains from one mesh to another in which the same local coordinates are the same tissue.

    With F the deformation gradient and d a direction of the wall in the first mesh, ``|F d| - 1``
    is averaged over the volume of the wall there. Meshes are fitted to surfaces: motion along
    these, such as torsion, is not seen.

    Parameters
    ----------
    before, after : HexMesh
        Of the same elements; if they have both ventricles, the right one between the same columns.

    Returns
    -------
    Strains

    Raises
    ------
    MeshError
        If their elements do not correspond.

    Examples
    --------
    >>> import heartgen
    >>> import numpy as np
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import global_strains
    >>> strains = global_strains(mesh, mesh.transformed(np.diag([1.0, 1.0, 0.8, 1.0])))
    >>> strains.longitudinal < strains.circumferential < 0, strains.share
    (True, 1.0)
    """
    wall, both = _wall(before, after)
    stretch, volume = _stretch(before, after)
    share = np.where(both[:, None], volume, 0)
    return _mean(stretch, share, float(volume[wall].sum()))


def segment_strains(
    before: HexMesh, after: HexMesh, septal_direction: Sequence[float] | None = None
) -> dict[int, Strains]:
    """Strains of each AHA segment, as `global_strains` has them of the whole wall.

    Parameters
    ----------
    before, after : HexMesh
        As of `global_strains`; segments are those of the first.
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, see `heart_axes`.

    Returns
    -------
    dict of int to Strains
        Segments of which the meshes have no wall that corresponds are absent.

    Raises
    ------
    MeshError
        If their elements do not correspond.

    Examples
    --------
    >>> import heartgen
    >>> import numpy as np
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import segment_strains
    >>> strains = segment_strains(mesh, mesh.transformed(np.diag([0.9, 0.9, 0.9, 1.0])))
    >>> len(strains), round(strains[7].circumferential, 3)
    (17, -0.1)
    """
    wall, both = _wall(before, after)
    stretch, volume = _stretch(before, after)
    xi, _ = gauss_cube((GAUSS,) * 3)
    points = before.evaluate(xi)
    axes = heart_axes(before, septal_direction)
    segment = aha_segment(points.reshape(-1, 3), axes).reshape(volume.shape)
    found = {}
    for number in SEGMENTS:
        own = np.where(segment == number, volume, 0)
        share = np.where(both[:, None], own, 0)
        if share.any():
            found[number] = _mean(stretch, share, float(own[wall].sum()))
    return found


def _stretch(before: HexMesh, after: HexMesh) -> tuple[Array, Array]:
    """Stretches along the directions of the wall (e, q, 3), and volumes (e, q) before, mm^3."""
    xi, weights = gauss_cube((GAUSS,) * 3)
    gradient = after.gradient(xi) @ np.linalg.inv(before.gradient(xi))
    stretch = np.linalg.norm(gradient @ frames_at(before, xi), axis=-2)
    return stretch, np.abs(determinants(before, xi)) * weights


def _mean(stretch: Array, share: Array, whole: float) -> Strains:
    """Mean over the volumes (e, q) of a share, of a wall that has a volume in all, mm^3."""
    around, along, across = np.einsum("eqd,eq->d", stretch, share) / share.sum() - 1
    return Strains(float(along), float(around), float(across), float(share.sum() / whole))


def _wall(one: HexMesh, other: HexMesh) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Elements (e,) of the left ventricle's wall in the first mesh, and those of it in both.

    Those count that are septum in both or in neither: only these reach as deep in both.
    """
    a, b = one.topology, other.topology
    columns = [set(mesh.index[mesh.parts.get(SEPTUM, []), 1].tolist()) for mesh in (a, b)]
    if not np.array_equal(a.index, b.index) or columns[0] != columns[1]:
        raise MeshError(
            "strains need meshes whose elements correspond, and these have different numbers of "
            "elements, or the right ventricle lies between different ones"
        )
    septum, right = (
        [np.isin(np.arange(mesh.n_elements), mesh.parts.get(part, [])) for mesh in (a, b)]
        for part in (SEPTUM, RIGHT)
    )
    return ~right[0], ~right[0] & ~right[1] & (septum[0] == septum[1])
