"""Faces of the elements as bicubic patches, and the named surfaces they form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import ORDER, bernstein, bernstein_derivative
from heartgen.mesh.field import MeshField
from heartgen.mesh.quadrature import EXACT, gauss_square

if TYPE_CHECKING:
    from heartgen.mesh.hexmesh import HexMesh

FACE_COEFFICIENTS = ORDER**2


def face_coefficients() -> NDArray[np.intp]:
    """Which of an element's 64 coefficients make up each face, (6, 16) int."""
    a = np.arange(ORDER**3).reshape(ORDER, ORDER, ORDER)  # k, j, i
    ends = (0, ORDER - 1)
    return np.stack([np.take(a, end, axis=2 - axis).ravel() for axis in range(3) for end in ends])


def face_signs() -> NDArray[np.float64]:
    """+1 where the cross product of a face's two tangents points out of the element, (6,)."""
    return np.array([-1.0, 1.0, 1.0, -1.0, -1.0, 1.0])


def face_control(mesh: HexMesh, faces: NDArray[np.intp]) -> NDArray[np.float64]:
    """Bernstein coefficients of faces.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : (f, 2) int
        (element, face).

    Returns
    -------
    (f, 16, 3) float64, mm, world (LPS)
    """
    return on_faces(mesh.control, faces)


def on_faces(control: NDArray[np.float64], faces: NDArray[np.intp]) -> NDArray[np.float64]:
    """Coefficients (f, 16, k) of faces, of those (e, 64, k) of the elements.

    Parameters
    ----------
    control : (e, 64, k) float64
        Bernstein coefficients of whatever lives on the elements.
    faces : (f, 2) int
        (element, face).
    """
    return np.asarray(control[faces[:, 0, None], face_coefficients()[faces[:, 1]]])


def tabulate_face(
    uv: NDArray[np.float64], derivative: tuple[int, int] = (0, 0)
) -> NDArray[np.float64]:
    """Bicubic Bernstein functions, or a derivative of them, at (q, 2) parameters: (q, 16).

    Parameters
    ----------
    uv : (q, 2) float64
        Parameters in the unit square.
    derivative : (int, int)
        Order along u and v.
    """
    u = bernstein_derivative(uv[:, 0], derivative[0])
    v = bernstein_derivative(uv[:, 1], derivative[1])
    return np.asarray(np.einsum("qj,qi->qji", v, u).reshape(len(uv), FACE_COEFFICIENTS))


def evaluate_faces(
    mesh: HexMesh, faces: NDArray[np.intp], uv: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points and outward area vectors on faces.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : (f, 2) int
        (element, face).
    uv : (q, 2) float64
        Parameters on each face.

    Returns
    -------
    points : (f, q, 3) float64, mm, world (LPS)
    area : (f, q, 3) float64
        Outward normal times area per unit of parameter, mm^2.
    """
    control = face_control(mesh, faces)
    points = np.matmul(tabulate_face(uv), control)
    tangents = [np.matmul(tabulate_face(uv, d), control) for d in ((1, 0), (0, 1))]
    return points, np.cross(*tangents) * face_signs()[faces[:, 1], None, None]


def field_on_faces(
    field: MeshField, faces: NDArray[np.intp], uv: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values (f, q, k) of a field at parameters (q, 2) of faces (f, 2).

    Parameters
    ----------
    field : MeshField
        Of k components, on the mesh.
    faces : (f, 2) int
        (element, face).
    uv : (q, 2) float64
        Parameters on each face.
    """
    return np.asarray(np.matmul(tabulate_face(uv), on_faces(field.coefficients, faces)))


def surface_area(mesh: HexMesh, faces: NDArray[np.intp], n: int = 8) -> float:
    """Area of faces in mm^2, by n x n Gauss points a face.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : (f, 2) int
        (element, face).
    n : int
        Gauss points per direction.
    """
    uv, weights = gauss_square(n)
    _, area = evaluate_faces(mesh, faces, uv)
    return float(np.einsum("fq,q->", np.linalg.norm(area, axis=-1), weights))


def enclosed_volume(mesh: HexMesh) -> float:
    """Volume in mm^3 by the divergence theorem over the named surfaces (exact).

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    uv, weights = gauss_square(EXACT)
    points, area = evaluate_faces(mesh, mesh.topology.external, uv)
    return float(np.einsum("fqx,fqx,q->", points, area, weights) / 3)


def sample_faces(
    mesh: HexMesh, faces: NDArray[np.intp], n: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Area-weighted samples at n x n Gauss points a face.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : (f, 2) int
        (element, face).
    n : int
        Gauss points per direction.

    Returns
    -------
    points : (m, 3) float64, mm, world (LPS)
    normals : (m, 3) float64
        Outward unit normals; zero where the face is degenerate.
    weights : (m,) float64
        Areas, mm^2.
    """
    uv, w = gauss_square(n)
    points, area = evaluate_faces(mesh, faces, uv)
    size = np.linalg.norm(area, axis=-1)
    normals = area / np.where(size > 0, size, 1)[..., None]
    return points.reshape(-1, 3), normals.reshape(-1, 3), (size * w).ravel()


def tessellate(
    mesh: HexMesh, faces: NDArray[np.intp], n: int
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Flat quadrilaterals for display, n x n a face.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : (f, 2) int
        (element, face).
    n : int
        Quadrilaterals per direction.

    Returns
    -------
    points : (f (n+1)^2, 3) float64, mm, world (LPS)
    quads : (f n^2, 4) int
        Corners, counter-clockwise seen from outside.
    """
    grid = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quad = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], -1).reshape(-1, 4)
    quads = quad[None] + np.arange(len(faces))[:, None, None] * (n + 1) ** 2
    inward = face_signs()[faces[:, 1]] < 0
    quads[inward] = quads[inward][..., ::-1]
    return face_grid(mesh.control, faces, n), quads.reshape(-1, 4)


def face_grid(control: NDArray[np.float64], faces: NDArray[np.intp], n: int) -> NDArray[np.float64]:
    """Even grids of n + 1 points along both directions of faces, (f (n+1)^2, 3).

    Parameters
    ----------
    control : (e, 64, 3) float64
        Bernstein coefficients of the elements.
    faces : (f, 2) int
        (element, face).
    n : int
        Pieces per direction.
    """
    basis = bernstein(np.linspace(0, 1, n + 1))
    patches = on_faces(control, faces).reshape(-1, ORDER, ORDER, 3)
    return np.asarray(np.einsum("fbax,va,ub->fuvx", patches, basis, basis).reshape(-1, 3))
