"""Surfaces of mesh and mask as VTK poly data, with what is shown on them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.assessment import distance_to
from heartgen.images.isosurface import Isosurface, isosurface
from heartgen.images.levelset import LevelSet
from heartgen.mesh import HexMesh, MeshField, Topology
from heartgen.mesh.closest import closest_points
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.surface_faces import evaluate_faces, field_on_faces, tessellate

SUBDIVISION = 8
"""Flat pieces of an element's edge: 4 degrees of a ring of 12 elements, which looks round."""

FACES = 6
"""Of an element."""

INWARD = 1e-3
"""Shift of the parameters at which normals are taken, off the pole, where a face has none."""

MAX_TRIANGLES = 40_000
"""Triangles of the mask's surface that a browser still turns with ease."""

SAME = 1e-6
"""Distance over the size of the mesh below which two element edges are one."""


def mesh_surface(mesh: HexMesh, n: int = SUBDIVISION) -> pv.PolyData:
    """External surface of a mesh.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    n : int
        Pieces per element edge.

    Returns
    -------
    PolyData
        Quadrilaterals, mm, world (LPS), with exact normals; cell arrays ``quality`` (Jacobian
        ratio of the element) and ``region`` (place of the surface in `Topology.surfaces`).
    """
    faces = mesh.topology.external
    points, quads = tessellate(mesh, faces, n)
    t = np.clip(np.linspace(0, 1, n + 1), INWARD, 1 - INWARD)
    v, u = np.meshgrid(t, t, indexing="ij")
    _, area = evaluate_faces(mesh, faces, np.stack([u.ravel(), v.ravel()], -1))
    normals = area / np.linalg.norm(area, axis=-1, keepdims=True)
    sizes = [len(part) for part in mesh.topology.surfaces.values()]
    surface = poly_data(points, quads, normals.reshape(-1, 3))
    surface.cell_data["quality"] = np.repeat(jacobian_ratio(mesh)[faces[:, 0]], n * n)
    surface.cell_data["region"] = np.repeat(np.repeat(np.arange(len(sizes)), sizes), n * n)
    return surface


def on_surface(field: MeshField, topology: Topology, n: int = SUBDIVISION) -> NDArray[np.float64]:
    """Values of a field at the points of `mesh_surface`, (points, k) float64.

    Parameters
    ----------
    field : MeshField
        Of k components, on the mesh.
    topology : Topology
        Of the mesh.
    n : int
        Pieces of a face per direction, as for `mesh_surface`.
    """
    t = np.linspace(0, 1, n + 1)
    v, u = (grid.ravel() for grid in np.meshgrid(t, t, indexing="ij"))
    values = field_on_faces(field, topology.external, np.stack([u, v], -1))
    return values.reshape(-1, field.components)


def element_faces(mesh: HexMesh, n: int = SUBDIVISION) -> pv.PolyData:
    """All faces of all elements, those inside the wall as well: quadrilaterals, mm, world (LPS).

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    n : int
        Pieces of a face per direction.
    """
    faces = np.stack(np.divmod(np.arange(FACES * mesh.n_elements), FACES), -1)
    points, quads = tessellate(mesh, faces, n)
    rows = np.insert(quads, 0, quads.shape[1], axis=1)
    return pv.PolyData(points.astype(np.float32), faces=rows.ravel())


def mesh_edges(mesh: HexMesh, n: int = SUBDIVISION, like: HexMesh | None = None) -> pv.PolyData:
    """Edges of the elements on the external surface: each once, as a line of `n` pieces.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    n : int
        Pieces of an edge.
    like : HexMesh, optional
        Of the same topology: edges are told from each other in this one, so that both have the
        same, in the same order.
    """
    told = _face_edges(like or mesh, n)
    same = SAME * float(np.ptp(told.reshape(-1, 3), axis=0).max())
    long = np.flatnonzero(np.linalg.norm(np.diff(told, axis=1), axis=-1).sum(1) > same)
    told = told[long]
    middle = told[:, n // 2] if n % 2 == 0 else told[:, n // 2 : n // 2 + 2].mean(1)
    _, first = np.unique(np.round(middle / same), axis=0, return_index=True)
    edges = told[first] if like is None else _face_edges(mesh, n)[long[first]]
    places = np.arange(edges.size // 3).reshape(-1, n + 1)
    lines = np.insert(places, 0, n + 1, axis=1)
    return pv.PolyData(edges.reshape(-1, 3).astype(np.float32), lines=lines.ravel())


def _face_edges(mesh: HexMesh, n: int) -> NDArray[np.float64]:
    """Points (edges, n + 1, 3) of the four edges of every external face, mm."""
    points, _ = tessellate(mesh, mesh.topology.external, n)
    grid = points.reshape(-1, n + 1, n + 1, 3)
    return np.concatenate([grid[:, 0], grid[:, -1], grid[:, :, 0], grid[:, :, -1]])


_isosurface = lru_cache(2)(isosurface)
"""Of the hearts that are looked at, whose meshes are drawn and measured one after the other."""


def mask_surface(myocardium: LevelSet, limit: int | None = None) -> pv.PolyData:
    """Isosurface of the mask.

    Parameters
    ----------
    myocardium : LevelSet
        Zero on the surface.
    limit : int, optional
        Most triangles; a finer surface is thinned out.

    Returns
    -------
    PolyData
        Triangles, mm, world (LPS), with normals.
    """
    target = _isosurface(myocardium)
    surface = poly_data(target.points, target.triangles, target.normals)
    if limit is None or surface.n_cells <= limit:
        return surface
    thin = surface.decimate_pro(1 - limit / surface.n_cells)  # keeps some vertices, moves none
    kept, corners = np.unique(thin.regular_faces, return_inverse=True)
    points = np.asarray(thin.points[kept], dtype=float)
    _, slope = myocardium.sample(points)
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    normals = slope / np.maximum(length, np.finfo(float).tiny)
    return poly_data(points, corners.reshape(-1, 3), normals)


def to_mask(points: NDArray[Any], myocardium: LevelSet) -> NDArray[np.float64]:
    """Distance of the surface of a mesh to that of the mask, as a report measures it.

    Parameters
    ----------
    points : (n, 3) float
        On the surface of the mesh, mm, world (LPS).
    myocardium : LevelSet
        That of an `Anatomy`: cut where the base was, and interpolated between the slices of a
        stack, through their contours; not the voxels, whose steps are as high as slices are apart.

    Returns
    -------
    (n,) float64, mm
    """
    return distance_to(_isosurface(myocardium), np.asarray(points, dtype=float))


def to_surface(points: NDArray[np.float64], surface: pv.PolyData) -> NDArray[np.float64]:
    """Distance (n,), mm, of points (n, 3), mm, to a finely divided surface with point normals.

    Parameters
    ----------
    points : (n, 3) float64
        mm, in the frame of the surface.
    surface : pyvista.PolyData
        Triangles, mm.
    """
    count = surface.n_points
    vertices = Isosurface(
        np.asarray(surface.points, dtype=float),
        np.empty((0, 3), dtype=np.intp),
        np.full(count, surface.area / count),
        np.asarray(surface.point_data["Normals"], dtype=float),
    )
    return distance_to(vertices, np.asarray(points, dtype=float))


def to_mesh(points: NDArray[np.float64], mesh: HexMesh) -> NDArray[np.float64]:
    """Distance (n,), mm, of points (n, 3), mm, world (LPS), to the external surface of the mesh.

    Parameters
    ----------
    points : (n, 3) float64
        mm, world (LPS).
    mesh : HexMesh
        mm, world (LPS).
    """
    return closest_points(mesh, mesh.topology.external, np.asarray(points, dtype=float)).distance


def poly_data(
    points: NDArray[np.float64], faces: NDArray[np.intp], normals: NDArray[np.float64]
) -> pv.PolyData:
    """Poly data of polygons with an equal number of corners; single precision, for display.

    Parameters
    ----------
    points : (n, 3) float64
        mm.
    faces : (f, k) int
        Points of each polygon, counted from 0.
    normals : (n, 3) float64
        Unit normals at the points.
    """
    rows = np.insert(faces, 0, faces.shape[1], axis=1)
    surface = pv.PolyData(points.astype(np.float32), faces=rows.ravel())
    surface.point_data["Normals"] = normals.astype(np.float32)
    surface.point_data.active_normals_name = "Normals"
    return surface
