"""The 4 x 4 x 4 lattices of the elements as one set of points, shared where elements meet."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.connectivity import merge_coincident
from heartgen.mesh.field import MeshField
from heartgen.mesh.surface_faces import face_coefficients
from heartgen.mesh.topology import Topology


def shared_points(
    topology: Topology, fields: Iterable[MeshField] = ()
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Number the lattice points of a mesh.

    At the pole each element keeps its own points, because merged there they would give readers
    that build faces a face with many neighbors. Where a field jumps, a point is there once for
    each value.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    fields : iterable of MeshField
        Those per element have no say.

    Returns
    -------
    number : (e, 64) int
        Counted from 0 in order of first appearance, xi1 fastest.
    first : (m,) int
        Where each point appears first among the 64 e.
    """
    generic, xi = topology.generic, lattice()
    key = np.zeros((topology.n_elements, len(xi), 6))
    key[..., :3] = np.matmul(tabulate(xi), generic)
    slopes = [np.matmul(tabulate(xi, d), generic) for d in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    for element, face in topology.collapsed:
        # The points of a collapsed face are told apart by the direction in which they leave it.
        on = face_coefficients()[face]
        key[element, on, 3:] = slopes[face // 2][element, on]
    number, first = merge_coincident(key.reshape(-1, 6))
    values = [f.values.reshape(len(number), -1) for f in fields if not f.per_element]
    if values:
        largest = [max(float(np.abs(v).max()), np.finfo(float).tiny) for v in values]
        relative = [v / size for v, size in zip(values, largest, strict=True)]
        number, first = merge_coincident(np.column_stack([number, *relative]))
    return number.reshape(len(key), -1), first
