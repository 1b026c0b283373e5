"""The tailored template of both ventricles (paper, section 2.1, figure 2).

The left ventricle's endocardium is a truncated ellipsoid fitted to its pool; rays across its wall
tell the shape of the rest (`heartgen.templates.biventricular_surface`).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy
from heartgen.errors import AnatomyError
from heartgen.mesh.biventricular_topology import biventricular_topology, patch_corner
from heartgen.mesh.dof_map import DofMap
from heartgen.mesh.hermite import chart_of
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.surface_chart import Apex
from heartgen.templates.biventricular_surface import BiventricularSurface, fit_biventricular_surface
from heartgen.templates.ellipsoid import TruncatedEllipsoid, fit_ellipsoid
from heartgen.templates.meridian import Meridians, best_meridians
from heartgen.templates.patch_map import FACE_GAUSS, ApicalPatchMap, fit_patch_map, radius_of
from heartgen.templates.rays import RayGrid, cast_rays
from heartgen.templates.spacing import Spacing, best_spacing

FIRST_EVEN_ROW = 2
"""First row of elements whose nodes lie in columns and rows where there is a square patch."""

SHIFT = 1e-9
"""Share of the largest diagonal entry added to all: the pole's degrees of freedom are nearly
free."""


def biventricular_template(
    anatomy: Anatomy,
    elements: tuple[int, int, int],
    graded: bool = True,
    apex: Apex = "collapsed",
    hole: float = 0.0,
    shape: TruncatedEllipsoid | None = None,
) -> HexMesh:
    """Template of both ventricles fitted to an anatomy, as a cubic Hermite mesh.

    Parameters
    ----------
    anatomy : Anatomy
        With a right ventricle.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the depth across the left ventricle's wall is graded for quality; otherwise linear.
    apex : {"collapsed", "hole", "patch"}
        In a pole, a hole or a square patch.
    hole : float
        Radius of the apical hole on the left endocardium, mm.
    shape : TruncatedEllipsoid, optional
        The left ventricle's, by `heartgen.templates.ellipsoid.fit_ellipsoid`; fitted if omitted.

    Returns
    -------
    HexMesh
        In the world (LPS), mm; straight across the wall.

    Raises
    ------
    AnatomyError
        If the right ventricle does not lie beside the left one.
    """
    if anatomy.rv is None:
        raise AnatomyError("the mask holds no right ventricle: fit a template of the left one")
    shape = shape or fit_ellipsoid(anatomy)
    _, around, along = elements
    spacing: Spacing | Meridians
    if apex == "collapsed":
        spacing = best_meridians(shape, elements, graded)
    else:
        # Over a patch, between the ventricles' different walls, rows of their own cost shear.
        spacing = best_spacing(shape, elements, graded, apex, hole, by_row=apex == "hole")
    grid = RayGrid(shape, spacing)
    first_row = max(chart_of(apex, around, along).first_row, 1)
    intersections = cast_rays(anatomy, grid)
    biventricle = fit_biventricular_surface(
        grid, intersections, elements, anatomy.rv.wall_thickness, first_row
    )
    topology = biventricular_topology(
        elements, biventricle.opening, grid.spacing.grading, biventricle.pole_angles(), apex
    )
    patch_map = _laid_out(biventricle) if apex == "patch" else None
    return _fit_surfaces(topology, biventricle, patch_map).transformed(anatomy.frame)


def _laid_out(biventricle: BiventricularSurface) -> ApicalPatchMap:
    """Faces of a square patch, laid out on a disc around which the columns are even."""
    around, corner = biventricle.around, patch_corner(biventricle.opening, biventricle.around)
    per_column = 2 * np.pi / around

    def surface(angle: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float64]:
        endo, _, _, epi = biventricle.surfaces(angle / per_column % around, row)
        return (endo + epi) / 2

    def polar(row: NDArray[np.float64]) -> NDArray[np.float64]:
        rays = np.asarray(biventricle.rows(row))
        return (
            biventricle.grid.spacing.polar(0, rays) + biventricle.grid.spacing.polar(1, rays)
        ) / 2

    chart = chart_of("patch", around, biventricle.along, corner=corner)
    radius = radius_of(polar, biventricle.along)
    return fit_patch_map(chart, corner, lambda column: per_column * column, radius, surface)


def _fit_surfaces(
    topology: Topology, biventricle: BiventricularSurface, patch_map: ApicalPatchMap | None
) -> HexMesh:
    """Least-squares fit of the surfaces' degrees of freedom to the parametric ones."""
    dof_map = DofMap(topology)
    uv, _ = gauss_square(FACE_GAUSS)
    parts = (
        topology.surfaces["lv_endo"],
        topology.patches["rv_septum"],
        topology.patches["rv_free_wall"],
        topology.surfaces["epi"],
    )
    rows, values = [], []
    for which, faces in enumerate(parts):
        face, place = faces.repeat(len(uv), axis=0), np.tile(uv, (len(faces), 1))
        column, row = (topology.index[face[:, 0], 1:] + place).T
        if patch_map is not None:
            # The patch, and the ring that leads to it, are not laid out in columns and rows.
            angle, radius = (x[faces[:, 0] % len(x)].ravel() for x in patch_map.polar(uv))
            near = topology.index[face[:, 0], 2] < FIRST_EVEN_ROW
            column = np.where(near, angle / (2 * np.pi) % 1 * biventricle.around, column)
            row = np.where(near, radius, row)
        rows.append(dof_map.on_faces(face, place)[0])
        values.append(biventricle.surfaces(column, row)[which])
    basis = sp.csr_array(sp.vstack(rows))
    normal = sp.csc_array(basis.T @ basis)
    normal = sp.csc_array(normal + SHIFT * normal.diagonal().max() * sp.eye_array(dof_map.n))
    q = spla.splu(normal).solve(np.asarray(basis.T @ np.concatenate(values)))
    return HexMesh(np.asarray(dof_map.straight @ q), topology)
