"""Cubic Hermite topology of a cup: a wall that closes in a smooth pole, C1 everywhere.

The degrees of freedom are a tensor product: a radial cubic Hermite line (value and slope at each of
``radial + 1`` layers) times a surface space. The surface space has four degrees of freedom (value,
d/dxi1, d/dxi2, d2/dxi1dxi2) at every regular node and three at the pole: its position and the two
vectors a, b of its tangent plane. The longitudinal derivative of the element line that leaves the
pole at angle theta is ``a cos(theta) + b sin(theta)``, so the surface has one tangent plane there
and cannot form a cusp.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein, bernstein_derivative
from heartgen.mesh.hexmesh import Topology

POLE_DOFS = 3
NODE_DOFS = 4
LINEAR = (1.0, 1.0)
"""Grading of a wall whose depth is proportional to xi."""

MIN_CIRCUMFERENTIAL = 3
"""Fewer elements around cannot carry the tangent plane of the pole."""


def cup_topology(shape: tuple[int, int, int], grading: tuple[float, float] = LINEAR) -> Topology:
    """Topology of a cup with a collapsed, smooth apex.

    Parameters
    ----------
    shape : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    grading : (float, float)
        Slope of the depth at endo- and epicardium once the wall is straightened, see `depth`.

    Returns
    -------
    Topology
        Surfaces ``lv_endo``, ``epi``, ``base``; degrees of freedom ordered (layer, radial
        derivative, surface degree of freedom), see `surface_dofs`.

    Raises
    ------
    MeshError
        If a direction has too few elements.
    """
    radial, around, along = shape
    if radial < 1 or along < 1 or around < MIN_CIRCUMFERENTIAL:
        raise MeshError(
            f"elements {radial}x{around}x{along} cannot make a ventricle: use at least 1 radial, "
            f"{MIN_CIRCUMFERENTIAL} circumferential and 1 longitudinal element"
        )
    surface = surface_extraction(around, along)
    line = line_extraction(radial)
    ones = np.zeros(surface.shape[1])
    ones[0], ones[POLE_DOFS::NODE_DOFS] = 1, 1
    index = np.array(
        [(r, c, s) for r in range(radial) for s in range(along) for c in range(around)],
        dtype=np.intp,
    )
    element = np.arange(len(index)).reshape(radial, along, around)

    def faces(elements: NDArray[np.intp], face: int) -> NDArray[np.intp]:
        return np.stack([elements.ravel(), np.full(elements.size, face)], -1)

    return Topology(
        extraction=tensor_extraction(line, surface),
        shape=shape,
        index=index,
        surfaces={
            "lv_endo": faces(element[0], 4),
            "epi": faces(element[-1], 5),
            "base": faces(element[:, -1], 3),
        },
        collapsed=faces(element[:, 0], 2),
        nodes=_corner_nodes(radial, around, along),
        constant=np.tile(np.concatenate([ones, 0 * ones]), radial + 1),
        straightening=_straightening(radial, surface.shape[1], grading),
    )


def surface_dofs(around: int, along: int) -> int:
    """Degrees of freedom of the surface space of a cup."""
    return POLE_DOFS + NODE_DOFS * around * along


def node_dofs(column: int, row: int, around: int) -> int:
    """First surface degree of freedom of a regular node; row 1 is the first above the pole."""
    return POLE_DOFS + NODE_DOFS * ((row - 1) * around + column % around)


def even_angles(around: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles at which evenly spaced columns leave the pole, and their derivative by xi1."""
    step = 2 * np.pi / around
    return step * np.arange(around, dtype=float), np.full(around, step)


def surface_extraction(
    around: int,
    along: int,
    angles: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> sp.csr_array:
    """Bicubic Bernstein coefficients of the faces of a cup from its surface degrees of freedom.

    Parameters
    ----------
    around, along : int
        Faces.
    angles : (around,) and (around,) float64, optional
        Angles at which the columns leave the pole, and their derivative by xi1, rad; even if
        omitted.

    Returns
    -------
    (16 faces, dofs) sparse
        xi1 fastest; face (row, column).
    """
    angle, step = angles or even_angles(around)
    to_bernstein = np.kron(HERMITE_TO_BERNSTEIN, HERMITE_TO_BERNSTEIN)
    rows, columns, values = [], [], []
    for s in range(along):
        for c in range(around):
            hermite = np.zeros((16, surface_dofs(around, along)))
            for end_s in (0, 1):
                for end_c in (0, 1):
                    local = 4 * (2 * end_s) + 2 * end_c  # (value | slope along) x (value | around)
                    if s + end_s == 0:
                        column = (c + end_c) % around
                        cos, sin = np.cos(angle[column]), np.sin(angle[column])
                        hermite[local, 0] = 1
                        hermite[local + 4, 1:3] = cos, sin
                        hermite[local + 5, 1:3] = -step[column] * sin, step[column] * cos
                        continue
                    first = node_dofs(c + end_c, s + end_s, around)
                    hermite[[local, local + 1, local + 4, local + 5], first + np.arange(4)] = 1
            block = to_bernstein @ hermite
            row, dof = np.nonzero(block)
            rows.append(row + 16 * (s * around + c))
            columns.append(dof)
            values.append(block[row, dof])
    shape = (16 * around * along, surface_dofs(around, along))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(entries, shape=shape))


def line_extraction(radial: int) -> NDArray[np.float64]:
    """(radial, 4, 2 (radial + 1)): Bernstein coefficients across each layer of elements."""
    out = np.zeros((radial, 4, 2 * (radial + 1)))
    for r in range(radial):
        out[r, :, 2 * r : 2 * r + 4] = HERMITE_TO_BERNSTEIN
    return out


def tensor_extraction(line: NDArray[np.float64], surface: sp.csr_array) -> sp.csr_array:
    """Extraction matrix of a wall from those of a line across it and of its surfaces.

    Parameters
    ----------
    line : (layers, 4, 2 (layers + 1)) float64
        Bernstein coefficients across each layer of elements.
    surface : (16 faces, dofs) sparse

    Returns
    -------
    (64 layers faces, 2 (layers + 1) dofs) sparse
        Element (layer, face), coefficient 16 k + surface coefficient.
    """
    layers, n_faces = len(line), surface.shape[0] // 16
    flat = sp.csr_array(sp.kron(sp.csr_array(line.reshape(4 * layers, -1)), surface))
    r, face, k, a = np.meshgrid(
        np.arange(layers), np.arange(n_faces), np.arange(4), np.arange(16), indexing="ij"
    )
    order = ((4 * r + k) * n_faces + face) * 16 + a
    return sp.csr_array(flat[order.ravel()])


def _corner_nodes(radial: int, around: int, along: int) -> NDArray[np.intp]:
    """(e, 8) corner nodes; each layer has one pole node and around x along regular ones."""
    per_layer = 1 + around * along

    def node(layer: int, column: int, row: int) -> int:
        return layer * per_layer + (0 if row == 0 else 1 + (row - 1) * around + column % around)

    return np.array(
        [
            [node(r + k, c + i, s + j) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
            for r in range(radial)
            for s in range(along)
            for c in range(around)
        ],
        dtype=np.intp,
    )


def depth(
    xi: NDArray[np.float64], grading: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relative depth in a graded wall: the cubic from 0 to 1 with given slopes at its ends.

    Parameters
    ----------
    xi : (n,) float64
        Transmural coordinate, 0 endocardium to 1 epicardium.
    grading : (float, float)
        Slopes at endo- and epicardium; (1, 1) is linear.

    Returns
    -------
    value, slope : (n,) float64
    """
    coefficients = HERMITE_TO_BERNSTEIN @ np.array([0.0, grading[0], 1.0, grading[1]])
    return bernstein(xi) @ coefficients, bernstein_derivative(xi) @ coefficients


def _straightening(radial: int, n_surface: int, grading: tuple[float, float]) -> sp.csr_array:
    """Straight across the whole wall: each layer follows from endo- and epicardium."""
    line = np.zeros((2 * (radial + 1), 2 * (radial + 1)))
    value, slope = depth(np.linspace(0, 1, radial + 1), grading)
    line[0::2, 0], line[0::2, 2 * radial] = 1 - value, value
    line[1::2, 0], line[1::2, 2 * radial] = -slope / radial, slope / radial
    line[0, 0] = line[-2, 2 * radial] = 1.0
    line[0, 2 * radial] = line[-2, 0] = 0.0
    return sp.csr_array(sp.kron(sp.csr_array(line), sp.eye_array(n_surface)))
