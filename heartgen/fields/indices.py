"""Clinical indices of a mesh: volumes, mass, wall thickness by segment, lengths and ratios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from heartgen.fields.axes import HeartAxes, heart_axes
from heartgen.fields.rims import enclosed_cavity
from heartgen.fields.segments import SEGMENTS, aha_segment
from heartgen.fields.wall_shape import opposite
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.quadrature import EXACT, gauss_cube, gauss_square
from heartgen.mesh.surface_faces import evaluate_faces
from heartgen.renamed import takes_former_keywords

Array = NDArray[np.float64]

ML = 1000.0
"""mm^3 in a milliliter."""

DENSITY = 1.05
"""Of myocardium, g/ml (Grothues et al. 2002, doi:10.1016/S0002-9149(02)02381-0)."""

SAMPLES = 6
"""Points per face and direction at which the thickness is measured."""


@dataclass(frozen=True)
class Indices:
    """Clinical indices, ml, g and mm.

    Attributes
    ----------
    lv_cavity_volume : float
        Of the left ventricle up to the plane of its basal rim, ml.
    rv_cavity_volume : float or None
        Likewise of the right one; None if there is none.
    myocardial_volume, myocardial_mass : float
        Of all muscle in the mesh, ml and g.
    lv_mass, rv_mass : float, and float or None
        Of the left ventricle with the septum, and of the right one's free wall, g.
    wall_thickness : dict of int to float
        Mean by AHA segment, mm; segments of which the mesh has no endocardium are absent.
    long_axis_length : float
        From the endocardium's apex to the middle of its basal rim, mm.
    sphericity : float
        Volume of the left cavity over that of the ball whose diameter is the long axis.
    rv_lv_ratio : float or None
        Of the cavities' volumes.
    septum : {"measured", "given", "assumed"}
        How the direction to the septum, from which segments are counted, is known: from the right
        ventricle, from the user, or not at all.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import clinical_indices
    >>> indices = clinical_indices(mesh)
    >>> round(indices.long_axis_length), len(indices.wall_thickness)
    (78, 17)
    """

    lv_cavity_volume: float
    rv_cavity_volume: float | None
    myocardial_volume: float
    myocardial_mass: float
    lv_mass: float
    rv_mass: float | None
    wall_thickness: dict[int, float]
    long_axis_length: float
    sphericity: float
    rv_lv_ratio: float | None
    septum: Literal["measured", "given", "assumed"]


@takes_former_keywords
def clinical_indices(mesh: HexMesh, septal_direction: Sequence[float] | None = None) -> Indices:
    """Measure the clinical indices of a mesh.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, world (LPS), see `heart_axes`.

    Returns
    -------
    Indices

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import clinical_indices
    >>> indices = clinical_indices(mesh)
    >>> round(indices.lv_cavity_volume), indices.rv_cavity_volume  # ml
    (86, None)
    """
    axes = heart_axes(mesh, septal_direction)
    left = enclosed_cavity(mesh, "lv_endo") / ML
    volume = element_volumes(mesh) / ML
    free = mesh.topology.parts.get("right ventricle")
    right = None if free is None else enclosed_cavity(mesh, "rv_endo") / ML
    of_right = None if free is None else float(volume[free].sum())
    total = float(volume.sum())
    return Indices(
        lv_cavity_volume=left,
        rv_cavity_volume=right,
        myocardial_volume=total,
        myocardial_mass=DENSITY * total,
        lv_mass=DENSITY * (total - (of_right or 0.0)),
        rv_mass=None if of_right is None else DENSITY * of_right,
        wall_thickness=thickness_by_segment(mesh, axes),
        long_axis_length=axes.length,
        sphericity=left * ML / (np.pi / 6 * axes.length**3),
        rv_lv_ratio=None if right is None else right / left,
        septum=axes.known,
    )


def element_volumes(mesh: HexMesh) -> Array:
    """Volume of each element, (e,) mm^3; exact.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    xi, weights = gauss_cube((EXACT,) * 3)
    return np.asarray(determinants(mesh, xi) @ weights)


def thickness_by_segment(mesh: HexMesh, axes: HeartAxes) -> dict[int, float]:
    """Mean wall thickness of each AHA segment over the left endocardium, mm.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    axes : HeartAxes
        Of the left ventricle.
    """
    middle, thickness, area = left_thickness(mesh)
    segment = aha_segment(middle, axes)
    return {
        s: float(np.average(thickness[segment == s], weights=area[segment == s]))
        for s in SEGMENTS
        if np.any(segment == s)
    }


def left_thickness(mesh: HexMesh) -> tuple[Array, Array, Array]:
    """Wall thickness of the left ventricle at samples of its endocardium.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    middle : (n, 3) float64
        Half-way across the wall, mm, world (LPS).
    thickness : (n,) float64
        mm.
    area : (n,) float64
        Of the endocardium, that each sample stands for, mm^2.
    """
    faces = mesh.topology.surfaces["lv_endo"]
    uv, weights = gauss_square(SAMPLES)
    points, normal = evaluate_faces(mesh, faces, uv)
    across = opposite(mesh, faces[:, 0], points)
    thickness = np.linalg.norm(across - points, axis=-1).ravel()
    area = (np.linalg.norm(normal, axis=-1) * weights).ravel()
    return ((points + across) / 2).reshape(-1, 3), thickness, area
