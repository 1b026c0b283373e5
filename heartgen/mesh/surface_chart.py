"""Spaces of the surfaces of a cup, one for each kind of apex: C1 charts of bicubic faces.

A regular node has four degrees of freedom: value, d/dxi1, d/dxi2, d2/dxi1dxi2. What comes before
the first regular row is the apex: nothing where it is open; one pole of three degrees of freedom
where its faces collapse; or a square patch of faces (`heartgen.mesh.apical_patch`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN

Apex = Literal["collapsed", "hole", "patch"]
"""Kinds of apex: elements that collapse in a pole, a hole, or a square patch of elements."""

POLE_DOFS = 3
NODE_DOFS = 4

Angles = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Angles (around,) at which the columns leave the pole, and their derivative by xi1, rad."""

NONE = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class SurfaceChart:
    """Space of one surface of a cup.

    Attributes
    ----------
    extraction : (16 f, n) sparse
        Bicubic Bernstein coefficients of the faces, xi1 fastest, from the degrees of freedom.
    index : (f, 2) int
        Column and row of each face; the faces of a square patch are in row 0, counted through.
    nodes : (f, 4) int
        Corner nodes of each face, xi1 fastest.
    values : (v,) int
        Degrees of freedom that are positions: 1 in the function 1, where all others are 0.
    rows : (n,) int
        Row of the node of each degree of freedom, 0 inside a square patch.
    rising : (m, 2) int
        Degrees of freedom that are derivatives by xi2, and those that they are derivatives of.
    around : int
        Columns.
    first_row, apex_dofs : int
        First row of nodes that are regular, and degrees of freedom before theirs.
    collapsed, rim : (m,) int
        Faces whose edge at xi2 = 0 is the pole, and those where it is the rim of the hole.
    """

    extraction: sp.csr_array
    index: NDArray[np.intp]
    nodes: NDArray[np.intp]
    values: NDArray[np.intp]
    rows: NDArray[np.intp]
    rising: NDArray[np.intp]
    around: int
    first_row: int
    apex_dofs: int
    collapsed: NDArray[np.intp]
    rim: NDArray[np.intp]

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return int(self.extraction.shape[1])

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return len(self.index)

    def node(self, column: int, row: int) -> int:
        """First degree of freedom of a regular node.

        Parameters
        ----------
        column : int
            Around; counted on beyond the last.
        row : int
            From the apex to the base.
        """
        place = (row - self.first_row) * self.around + column % self.around
        return self.apex_dofs + NODE_DOFS * place


def even_angles(around: int) -> Angles:
    """Angles of evenly spaced columns.

    Parameters
    ----------
    around : int
        Number of columns.
    """
    step = 2 * np.pi / around
    return step * np.arange(around, dtype=float), np.full(around, step)


def collapsed_chart(around: int, along: int, angles: Angles | None = None) -> SurfaceChart:
    """Chart that closes in a smooth pole: its position, and two vectors a, b of its tangent plane.

    The longitudinal derivative of the line that leaves the pole at angle theta is
    ``a cos(theta) + b sin(theta)``, so the surface has one tangent plane there and cannot form a
    cusp.

    Parameters
    ----------
    around, along : int
        Faces.
    angles : Angles, optional
        Even if omitted.

    Returns
    -------
    SurfaceChart
    """
    angle, step = angles or even_angles(around)
    cos, sin = np.cos(angle), np.sin(angle)
    n = POLE_DOFS + NODE_DOFS * around * along
    pole = np.zeros((around, NODE_DOFS, n))
    pole[:, 0, 0] = 1
    pole[:, 2, 1:3] = np.stack([cos, sin], -1)
    pole[:, 3, 1:3] = np.stack([-step * sin, step * cos], -1)
    parameters = sp.vstack(
        [
            sp.csr_array(pole.reshape(-1, n)),
            sp.eye_array(n, format="csr")[POLE_DOFS:],
        ]
    )
    index = grid_index(around, range(along))
    node = np.array(
        [
            [0 if s == 0 else 1 + (s - 1) * around + c for c in range(around)]
            for s in range(along + 1)
        ]
    )
    return SurfaceChart(
        extraction=extraction_of(parameters, ring_corners(index, around)),
        index=index,
        nodes=node_corners(index, node),
        values=np.r_[0, np.arange(POLE_DOFS, n, NODE_DOFS)],
        rows=np.r_[POLE_DOFS * [0], np.repeat(np.arange(along) + 1, NODE_DOFS * around)],
        rising=rising(np.arange(POLE_DOFS, n)),
        around=around,
        first_row=1,
        apex_dofs=POLE_DOFS,
        collapsed=np.arange(around),
        rim=NONE,
    )


def open_chart(around: int, along: int) -> SurfaceChart:
    """Chart that is open at the apex too: a tube, whose rim below is that of the apical hole.

    Parameters
    ----------
    around, along : int
        Faces.
    """
    n = NODE_DOFS * around * (along + 1)
    index = grid_index(around, range(along))
    return SurfaceChart(
        extraction=extraction_of(sp.eye_array(n, format="csr"), ring_corners(index, around)),
        index=index,
        nodes=node_corners(index, np.arange(around * (along + 1)).reshape(-1, around)),
        values=np.arange(0, n, NODE_DOFS),
        rows=np.repeat(np.arange(along + 1), NODE_DOFS * around),
        rising=rising(np.arange(n)),
        around=around,
        first_row=0,
        apex_dofs=0,
        collapsed=NONE,
        rim=np.arange(around),
    )


def rising(dofs: NDArray[np.intp]) -> NDArray[np.intp]:
    """Derivatives by xi2 among the degrees of freedom (4 m,) of regular nodes, and of what.

    Parameters
    ----------
    dofs : (4 m,) int
        Of m regular nodes, four each.
    """
    value, along_1, along_2, cross = dofs.reshape(-1, NODE_DOFS).T
    return np.concatenate([np.stack([along_2, value], -1), np.stack([cross, along_1], -1)])


def grid_index(around: int, rows: range) -> NDArray[np.intp]:
    """Column and row of faces, row by row, (f, 2).

    Parameters
    ----------
    around : int
        Columns.
    rows : range
        Numbers of the rows.
    """
    return np.array([(c, s) for s in rows for c in range(around)], dtype=np.intp).reshape(-1, 2)


def ring_corners(index: NDArray[np.intp], around: int) -> NDArray[np.intp]:
    """Parameters (f, 2, 2, 4) at the corners (xi2, xi1) of faces, four a node, row by row.

    Parameters
    ----------
    index : (f, 2) int
        Column and row of each face.
    around : int
        Columns.
    """
    ends = np.arange(2)
    column = (index[:, 0, None, None] + ends) % around
    row = index[:, 1, None, None] + ends[:, None]
    return NODE_DOFS * (row * around + column)[..., None] + np.arange(NODE_DOFS)


def node_corners(index: NDArray[np.intp], node: NDArray[np.intp]) -> NDArray[np.intp]:
    """Nodes (f, 4) of faces from the numbers (rows + 1, around) of the nodes.

    Parameters
    ----------
    index : (f, 2) int
        Column and row of each face.
    node : (rows + 1, around) int
        Numbers of the nodes.
    """
    column = (index[:, :1] + [0, 1, 0, 1]) % node.shape[1]
    return np.asarray(node[index[:, 1:] + [0, 0, 1, 1], column])


def extraction_of(parameters: sp.csr_array, corners: NDArray[np.intp]) -> sp.csr_array:
    """Bernstein coefficients of faces from their Hermite parameters.

    Parameters
    ----------
    parameters : (p, n) sparse
        Parameters of nodes (value, d/dxi1, d/dxi2, d2/dxi1dxi2) from the degrees of freedom.
    corners : (f, 2, 2, 4) int
        Which of them each face has at its corners (xi2, xi1).

    Returns
    -------
    (16 f, n) sparse
    """
    # The derivative by xi2 is slow in a node's parameters, and belongs to the corner's end in xi2.
    along = corners.reshape(-1, 2, 2, 2, 2).transpose(0, 1, 3, 2, 4)
    hermite = sp.csr_array(sp.csr_array(parameters)[along.ravel()])
    to_bernstein = np.kron(HERMITE_TO_BERNSTEIN, HERMITE_TO_BERNSTEIN)
    rows, columns, values = [], [], []
    for face in range(len(corners)):
        block = to_bernstein @ hermite[16 * face : 16 * (face + 1)].toarray()
        row, dof = np.nonzero(block)
        rows.append(row + 16 * face)
        columns.append(dof)
        values.append(block[row, dof])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(entries, shape=hermite.shape))
