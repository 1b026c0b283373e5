"""The 17 segments of the left ventricle (Cerqueira et al. 2002, doi:10.1161/hc0402.102975)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.fields.axes import HeartAxes
from heartgen.fields.coordinate_lines import lines
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.quadrature import gauss_cube

Array = NDArray[np.float64]

SEGMENTS = {
    1: "basal anterior",
    2: "basal anteroseptal",
    3: "basal inferoseptal",
    4: "basal inferior",
    5: "basal inferolateral",
    6: "basal anterolateral",
    7: "mid anterior",
    8: "mid anteroseptal",
    9: "mid inferoseptal",
    10: "mid inferior",
    11: "mid inferolateral",
    12: "mid anterolateral",
    13: "apical anterior",
    14: "apical septal",
    15: "apical inferior",
    16: "apical lateral",
    17: "apex",
}
"""Names of the segments."""

APEX = 17

NO_SEGMENT = 0
"""Of the right ventricle's free wall, which has none."""

GAUSS = 4
"""Points per direction by which an element is given to the segment that has most of it."""


def aha_segment(points: Array, axes: HeartAxes) -> NDArray[np.intp]:
    """Segment of points in the wall of the left ventricle.

    Levels are thirds of the long axis of the cavity; what lies below its end is the apex. Around
    it, the border between the two septal segments of a level, and the middle of the apical one,
    point to the middle of the septum; each segment has 60 degrees, 90 at the apical level.

    Parameters
    ----------
    points : (n, 3) float64
        mm, world (LPS).
    axes : HeartAxes
        Of the left ventricle.

    Returns
    -------
    (n,) int
        1 to 17.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import SEGMENTS, aha_segment, heart_axes
    >>> axes = heart_axes(mesh)
    >>> points = [axes.base + 25 * axes.anterior, axes.apex - 5 * axes.longitudinal]
    >>> [SEGMENTS[int(aha_segment(point[None], axes)[0])] for point in points]
    ['basal anterior', 'apex']
    """
    level = axes.level(points)
    from_septum = -np.degrees(axes.angle(points))  # towards the inferior wall
    sixth = (2 + np.floor(from_septum / 60).astype(int)) % 6
    quarter = (1 + np.floor((from_septum + 45) / 90).astype(int)) % 4
    segment = np.where(level >= 2 / 3, 1 + sixth, np.where(level >= 1 / 3, 7 + sixth, 13 + quarter))
    return np.asarray(np.where(level < 0, APEX, segment), dtype=np.intp)


def segments_of_elements(mesh: HexMesh, axes: HeartAxes) -> NDArray[np.intp]:
    """Segment of each element: the one that has most of its volume.

    Elements across the wall share one. So do those around a pole or an apical hole whether they
    are the apex: no wedge of the apical segments reaches into it.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    axes : HeartAxes
        Of the left ventricle.

    Returns
    -------
    (e,) int
        1 to 17, or 0 in the free wall of the right ventricle.
    """
    topology = mesh.topology
    left = np.ones(mesh.n_elements, dtype=bool)
    left[topology.parts.get("right ventricle", [])] = False
    xi, weights = gauss_cube((GAUSS,) * 3)
    parts = np.abs(determinants(mesh, xi)) * weights
    segment = aha_segment(mesh.evaluate(xi).reshape(-1, 3), axes).reshape(parts.shape)
    votes = np.stack([(parts * (segment == s)).sum(1) for s in SEGMENTS], -1)
    for line in lines(topology, 2, left):
        votes[line] = votes[line].sum(0)
    if len(topology.collapsed) or "apical_rim" in topology.surfaces:
        row = topology.index[:, 2]
        for place in np.unique(row[left]):
            ring = left & (row == place)
            if votes[ring].sum(0).argmax() == APEX - 1:
                votes[ring, : APEX - 1] = 0
            else:
                votes[ring, APEX - 1] = 0
    return np.where(left, 1 + votes.argmax(1), NO_SEGMENT)
