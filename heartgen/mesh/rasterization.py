"""Binary images, and images of partial volumes, from meshes.

The surface of the mesh is cut into triangles that lie closer to it than a small part of a voxel.
Where a line of voxels enters the mesh through one of them and where it leaves it is found exactly,
so that along these lines partial volumes are exact; across them, several lines a voxel are taken.
Triangles share their corners bit for bit, and which of two neighbors has a line through their
common edge is decided in whole numbers: no line slips through.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba as nb
import numpy as np
from numpy.typing import NDArray

from heartgen.errors import InputError, MeshError
from heartgen.mesh.connectivity import merge_coincident
from heartgen.mesh.surface_faces import face_grid, tessellate

if TYPE_CHECKING:
    from heartgen.mesh.hexmesh import HexMesh

FLATNESS = 0.02
"""Distance of triangles from the surface, over the size of a voxel, that is close enough."""

START, FINEST = 4, 64
"""Pieces of an element's edge: the first try, and the most."""

LINES = 4
"""Lines of voxels per voxel and direction for partial volumes."""

FRACTION = 1 << 20
"""Steps per voxel to which corners are rounded across the lines."""


def rasterize(
    mesh: HexMesh, shape: tuple[int, ...], affine: NDArray[np.float64], partial: bool = False
) -> NDArray[np.float32]:
    """Image of a mesh on a grid of voxels.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    shape : (int, int, int)
        Voxels along i, j, k.
    affine : (4, 4) float64
        Voxel index to world coordinates, mm, LPS.
    partial : bool
        Give the share of each voxel that is in the mesh, not whether its center is.

    Returns
    -------
    (nx, ny, nz) float32
        0 to 1; without `partial`, 0 or 1.

    Raises
    ------
    InputError
        If the grid has no three axes.
    MeshError
        If the named surfaces do not enclose the mesh.
    """
    if len(shape) != 3 or not np.isfinite(affine).all() or np.linalg.det(affine[:3, :3]) == 0:
        raise InputError(f"a grid of {shape} voxels is no volume: give an image with three axes")
    corners = _triangles(mesh, np.asarray(np.linalg.inv(affine)))
    lines = LINES if partial else 1
    across = np.round(((corners[..., :2] + 0.5) * lines - 0.5) * FRACTION).astype(np.int64)
    image = np.zeros((*shape[:2], shape[2] + 1))
    _fill(across, np.ascontiguousarray(corners[..., 2]), lines, partial, image)
    inside = np.cumsum(image, axis=2)[..., :-1] / lines**2
    return np.clip(inside if partial else np.round(inside), 0, 1).astype(np.float32)


def _triangles(mesh: HexMesh, to_index: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners (t, 3, 3) of the outer surface in voxels, counter-clockwise seen from outside."""
    faces = mesh.topology.external
    n = START
    while n < FINEST and _sag(mesh, faces, n, to_index) > FLATNESS:
        n *= 2
    points, quads = tessellate(mesh, faces, n)
    number, first = merge_coincident(face_grid(mesh.topology.generic, faces, n))
    corner = number[quads]
    triangles = np.concatenate([corner[:, [0, 1, 2]], corner[:, [0, 2, 3]]])
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(1)]  # none at the pole
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)]), axis=0)
    _, users = np.unique(ends[0] * len(first) + ends[1], return_counts=True)
    if np.any(users != 2):
        raise MeshError("the named surfaces of the mesh leave openings: it has no inside")
    out = (points[first] @ to_index[:3, :3].T + to_index[:3, 3])[triangles]
    mirrored = np.einsum("tx,tx->t", out[:, 0], np.cross(out[:, 1], out[:, 2])).sum() < 0
    return np.asarray(out[:, ::-1] if mirrored else out)


def _sag(mesh: HexMesh, faces: NDArray[np.intp], n: int, to_index: NDArray[np.float64]) -> float:
    """Largest distance in voxels of the surface from the chords of `n` pieces an edge."""
    points = face_grid(mesh.control, faces, 2 * n) @ to_index[:3, :3].T
    grid = points.reshape(len(faces), 2 * n + 1, 2 * n + 1, 3)
    knots = grid[:, ::2, ::2]
    along = (knots[:, 1:] + knots[:, :-1]) / 2 - grid[:, 1::2, ::2]
    aside = (knots[:, :, 1:] + knots[:, :, :-1]) / 2 - grid[:, ::2, 1::2]
    middle = (knots[:, 1:, 1:] + knots[:, :-1, :-1]) / 2 - grid[:, 1::2, 1::2]
    return max(float(np.linalg.norm(d, axis=-1).max()) for d in (along, aside, middle))


@nb.njit(cache=True)
def _fill(across, height, lines, partial, image):  # type: ignore[no-untyped-def]
    """Add to the voxels what begins and ends in them along k, triangle by triangle."""
    nx, ny, nz = image.shape[0] * lines, image.shape[1] * lines, image.shape[2] - 1
    for t in range(len(across)):
        ax, ay = across[t, 0]
        bx, by = across[t, 1]
        cx, cy = across[t, 2]
        za, zb, zc = height[t]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        sign = -1.0  # seen from above counter-clockwise: the line leaves the mesh
        if area < 0:
            bx, by, zb, cx, cy, zc = cx, cy, zc, bx, by, zb
            area, sign = -area, 1.0
        first_i = max(-((-min(ax, bx, cx)) // FRACTION), 0)
        last_i = min(max(ax, bx, cx) // FRACTION, nx - 1)
        first_j = max(-((-min(ay, by, cy)) // FRACTION), 0)
        last_j = min(max(ay, by, cy) // FRACTION, ny - 1)
        for i in range(first_i, last_i + 1):
            x = i * FRACTION
            for j in range(first_j, last_j + 1):
                y = j * FRACTION
                wa = _side(bx, by, cx, cy, x, y)
                wb = _side(cx, cy, ax, ay, x, y)
                wc = _side(ax, ay, bx, by, x, y)
                if wa < 0 or wb < 0 or wc < 0:
                    continue
                if (
                    (wa == 0 and not _owns(bx, by, cx, cy))
                    or (wb == 0 and not _owns(cx, cy, ax, ay))
                    or (wc == 0 and not _owns(ax, ay, bx, by))
                ):
                    continue
                z = (wa * za + wb * zb + wc * zc) / area
                _cross(image[i // lines, j // lines], z, sign, partial, nz)


@nb.njit(cache=True)
def _side(px, py, qx, qy, x, y):  # type: ignore[no-untyped-def]
    """Twice the area of the triangle of an edge and a point: positive on its left."""
    return (qx - px) * (y - py) - (qy - py) * (x - px)


@nb.njit(cache=True)
def _owns(px, py, qx, qy):  # type: ignore[no-untyped-def]
    """Whether points on an edge count as in the triangle on its left; on its right they do not."""
    return qy < py or (qy == py and qx < px)


@nb.njit(cache=True)
def _cross(line, z, sign, partial, nz):  # type: ignore[no-untyped-def]
    """Begin (+1) or end (-1) the mesh at height z of a line of voxels, whose sum is to be taken."""
    k = int(np.floor(z + 0.5)) if partial else int(np.ceil(z))
    if k < 0:
        line[0] += sign
    elif k < nz:
        share = k + 0.5 - z if partial else 1.0
        line[k] += sign * share
        line[k + 1] += sign * (1.0 - share)
