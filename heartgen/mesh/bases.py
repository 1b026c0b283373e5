"""Change of basis: cubic Hermite, cubic Lagrange; the same elements with another extraction."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.bernstein import (
    DEGREE,
    HERMITE_TO_BERNSTEIN,
    cube,
    lagrange_to_bernstein,
    lattice,
)
from heartgen.mesh.connectivity import merge_coincident
from heartgen.mesh.corner_parameters import PARAMETERS, corner_parameters, cube_by_ends
from heartgen.mesh.topology import COEFFICIENTS, Topology

if TYPE_CHECKING:
    from heartgen.mesh.hexmesh import HexMesh

FITS = 1e-11
"""Distance, relative to the extent of the mesh, within which a geometry lies in a space."""

DENSE = 9
"""Points per direction in an element at which meshes are compared."""


def to_lagrange(mesh: HexMesh, order: int = DEGREE) -> HexMesh:
    """See `HexMesh.to_lagrange`.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    order : {1, 2, 3}
        Of the elements.

    Raises
    ------
    MeshError
        If there is no such order.
    """
    if order not in range(1, DEGREE + 1):
        raise MeshError(f"Lagrange elements of order {order} do not exist here: choose 1, 2 or 3")
    topology, xi = mesh.topology, lattice(order + 1)
    if topology.basis == "lagrange" and order == DEGREE:
        return mesh
    number, first = topology.numbered(xi)
    lagrange = replace(
        topology,
        extraction=lagrange_extraction(number.ravel(), len(first), order),
        constant=np.ones(len(first)),
        straightening=None,
        basis="lagrange",
        hermite=topology if order == DEGREE else None,
        generic_dofs=None,
    )
    return replace(mesh, dofs=mesh.evaluate(xi).reshape(-1, 3)[first], topology=lagrange)


def to_hermite(mesh: HexMesh) -> HexMesh:
    """See `HexMesh.to_hermite`.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    if mesh.topology.basis == "hermite":
        return mesh
    if mesh.topology.hermite is not None:
        before = mesh.topology.hermite
        found = replace(mesh, dofs=_fitted(before, mesh.control), topology=before)
        if np.abs(found.control - mesh.control).max() <= FITS * _extent(mesh):
            return found
    return _with_versions(mesh)


def deviation(mesh: HexMesh, other: HexMesh) -> float:
    """Largest distance between the same material points of two meshes of the same elements, mm.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    other : HexMesh
        Of the same elements; mm, world (LPS).
    """
    xi = lattice(DENSE)
    return float(np.linalg.norm(mesh.evaluate(xi) - other.evaluate(xi), axis=-1).max())


def lagrange_extraction(number: NDArray[np.intp], n: int, order: int = DEGREE) -> sp.csr_array:
    """Extraction of elements from values on their lattices.

    Parameters
    ----------
    number : (e m,) int
        Which of n values each element has at each of the m points of its lattice.
    n : int
        Number of values.
    order : int
        Of the elements; the lattice has order + 1 points per direction.

    Returns
    -------
    (64 e, n) sparse
    """
    one = sp.csr_array(cube(lagrange_to_bernstein(order)))
    n_elements = len(number) // one.shape[1]
    return sp.csr_array(sp.kron(sp.eye_array(n_elements), one) @ _gather(number, n))


def nodal_extraction(weights: sp.csr_array) -> sp.csr_array:
    """Extraction of elements whose corner parameters are known.

    Parameters
    ----------
    weights : (64 e, n) sparse
        Parameters of all elements, by (element, corner, derivative), from n degrees of freedom.

    Returns
    -------
    (64 e, n) sparse
        Bernstein coefficients from these.
    """
    # (4, end, derivative) to (64, corner, derivative)
    line = np.moveaxis(HERMITE_TO_BERNSTEIN.reshape(-1, 2, 2), 0, -1)
    one = cube_by_ends(line).reshape(-1, COEFFICIENTS).T
    return sp.csr_array(sp.kron(sp.eye_array(weights.shape[0] // COEFFICIENTS), one) @ weights)


def _with_versions(mesh: HexMesh) -> HexMesh:
    """Cubic Hermite mesh whose corners share the parameters that are the same in all of them."""
    topology = mesh.topology
    values = np.einsum("cpa,eax->ecpx", corner_parameters(), mesh.control)
    slot = PARAMETERS * topology.nodes[..., None] + np.arange(PARAMETERS)
    key = np.column_stack([values.reshape(-1, 3) / _extent(mesh), slot.ravel()])
    number, first = merge_coincident(key)
    weights = _gather(number, len(first))
    dofs = values.reshape(-1, 3)[first]
    return replace(
        mesh,
        dofs=dofs,
        topology=replace(
            topology,
            extraction=nodal_extraction(weights),
            constant=(slot.ravel()[first] % PARAMETERS == 0).astype(float),
            basis="hermite",
            hermite=None,
            generic_dofs=dofs / _extent(mesh),
        ),
    )


def _gather(number: NDArray[np.intp], n: int) -> sp.csr_array:
    """Sparse (m, n) that picks these of n numbers."""
    entries = (np.ones(len(number)), (np.arange(len(number)), number))
    return sp.csr_array(sp.coo_array(entries, shape=(len(number), n)))


def _fitted(topology: Topology, control: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees of freedom whose elements come closest to these coefficients (e, 64, 3)."""
    matrix, wanted = topology.extraction, control.reshape(-1, 3)
    factor = spla.splu(
        sp.csc_array(matrix.T @ matrix),
        permc_spec="MMD_AT_PLUS_A",
        options={"SymmetricMode": True},
    )
    dofs = factor.solve(np.asarray(matrix.T @ wanted))
    # A step of iterative refinement: normal equations lose half of the digits.
    return np.asarray(dofs + factor.solve(np.asarray(matrix.T @ (wanted - matrix @ dofs))))


def _extent(mesh: HexMesh) -> float:
    """Largest side of the box around the coefficients, mm."""
    return float(np.ptp(mesh.control.reshape(-1, 3), axis=0).max())
