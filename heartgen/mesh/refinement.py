"""Refinement: every element is split, and the geometry and its degrees of freedom stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.mesh.bernstein import subdivision
from heartgen.mesh.connectivity import corner_nodes
from heartgen.mesh.topology import Topology


def refine(topology: Topology, pieces: tuple[int, int, int]) -> Topology:
    """Topology with every element split.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    pieces : (int, int, int)
        Along (xi1, xi2, xi3).

    Returns
    -------
    Topology
    """
    split = [subdivision(n) for n in pieces]
    cells = [
        (i, j, k) for k in range(pieces[2]) for j in range(pieces[1]) for i in range(pieces[0])
    ]
    blocks = [np.kron(split[2][k], np.kron(split[1][j], split[0][i])) for i, j, k in cells]
    n_cells, n_old = len(cells), topology.n_elements
    extraction = sp.csr_array(
        sp.kron(sp.eye_array(n_old), sp.csr_array(np.concatenate(blocks))) @ topology.extraction
    )
    cell = np.array(cells)
    in_structure = cell[:, [2, 0, 1]]
    factor = np.array([pieces[2], pieces[0], pieces[1]])
    index = (topology.index[:, None, :] * factor + in_structure[None]).reshape(-1, 3)

    def split_faces(faces: NDArray[np.intp]) -> NDArray[np.intp]:
        out = []
        for element, face in faces:
            axis, end = divmod(int(face), 2)
            on_face = np.flatnonzero(cell[:, axis] == (pieces[axis] - 1 if end else 0))
            out.append(np.stack([element * n_cells + on_face, np.full(len(on_face), face)], -1))
        return np.concatenate(out) if out else np.zeros((0, 2), dtype=np.intp)

    return replace(
        topology,
        extraction=extraction,
        shape=tuple(int(n * f) for n, f in zip(topology.shape, factor, strict=True)),  # type: ignore[arg-type]
        index=index,
        surfaces={name: split_faces(f) for name, f in topology.surfaces.items()},
        collapsed=split_faces(topology.collapsed),
        nodes=corner_nodes(extraction, topology.generic_dofs),
        parts={
            name: (n_cells * part[:, None] + np.arange(n_cells)).ravel()
            for name, part in topology.parts.items()
        },
        patches={name: split_faces(f) for name, f in topology.patches.items()},
        hermite=None if topology.hermite is None else refine(topology.hermite, pieces),
    )
