"""The tailored template of both ventricles (paper, section 2.1, figure 2).

The left ventricle's endocardium is a truncated ellipsoid fitted to its pool; rays across its wall
tell the shape of the rest (`heartgen.templates.chart`).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from heartgen.anatomy import Anatomy
from heartgen.errors import AnatomyError
from heartgen.mesh.biventricular import biventricular_topology
from heartgen.mesh.freedom import Freedom
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.quadrature import gauss_square
from heartgen.templates.chart import Chart, fit_chart
from heartgen.templates.ellipsoid import fit_ellipsoid
from heartgen.templates.rays import RayGrid, cast_rays
from heartgen.templates.spacing import best_spacing

FACE_GAUSS = 5
"""Points per face and direction at which the mesh is fitted to the chart: more than its 4."""

SHIFT = 1e-9
"""Share of the largest diagonal entry added to all: the pole's degrees of freedom are nearly
free."""


def biventricular_template(
    anatomy: Anatomy, elements: tuple[int, int, int], graded: bool = True
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
    shape = fit_ellipsoid(anatomy)
    grid = RayGrid(shape, best_spacing(shape, elements[0], elements[2], graded))
    chart = fit_chart(grid, cast_rays(anatomy, grid), elements, anatomy.rv.wall_thickness)
    topology = biventricular_topology(
        elements, chart.opening, grid.spacing.grading, chart.pole_angles()
    )
    return _fit_surfaces(topology, chart).transformed(anatomy.frame)


def _fit_surfaces(topology: Topology, chart: Chart) -> HexMesh:
    """Least-squares fit of the surfaces' degrees of freedom to the chart."""
    freedom = Freedom(topology)
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
        _, column, row = topology.index[face[:, 0]].T
        rows.append(freedom.on_faces(face, place)[0])
        values.append(chart.surfaces(column + place[:, 0], row + place[:, 1])[which])
    basis = sp.csr_array(sp.vstack(rows))
    normal = sp.csc_array(basis.T @ basis)
    normal = sp.csc_array(normal + SHIFT * normal.diagonal().max() * sp.eye_array(freedom.n))
    q = spla.splu(normal).solve(np.asarray(basis.T @ np.concatenate(values)))
    return HexMesh(np.asarray(freedom.straight @ q), topology)
