"""Changes of basis: what stays as it is, and what is lost where something must be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from heartgen.enhancement import enhance
from heartgen.errors import MeshError
from heartgen.mesh import HexMesh
from heartgen.mesh.bases import corner_parameters, deviation, nodal_extraction
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.biventricular_topology import RvAttachment, biventricular_topology
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surface_faces import enclosed_volume

SAME = 1e-10
"""mm, where meshes are the same."""


TOPOLOGIES = {
    "cup": cup_topology((2, 5, 3)),
    "both ventricles": biventricular_topology((2, 9, 4), RvAttachment(4, 2, 1)),
}


@pytest.fixture(params=TOPOLOGIES)
def mesh(request: pytest.FixtureRequest) -> HexMesh:
    """Any degrees of freedom: what holds for them holds for every heart."""
    topology = TOPOLOGIES[request.param]
    noise = np.random.default_rng(1).standard_normal((topology.extraction.shape[1], 3))
    return HexMesh(20 * noise, topology)


def test_cubic_lagrange_is_the_same_mesh(mesh: HexMesh) -> None:
    lagrange = mesh.to_lagrange()
    assert lagrange.topology.basis == "lagrange"
    assert deviation(mesh, lagrange) < SAME
    assert_allclose(lagrange.topology.extraction @ lagrange.topology.constant, 1, atol=1e-13)
    assert volume(lagrange) == pytest.approx(volume(mesh), rel=1e-12)
    assert lagrange.to_lagrange() is lagrange
    assert mesh.to_hermite() is mesh


def test_lagrange_elements_stay_joined_whatever_the_values(mesh: HexMesh) -> None:
    topology = mesh.to_lagrange().topology
    values = np.random.default_rng(2).standard_normal((len(topology.constant), 3))
    any_mesh = HexMesh(values, topology)
    assert volume(any_mesh) == pytest.approx(enclosed_volume(any_mesh), rel=1e-9, abs=1e-9)


def test_there_and_back_is_the_identity(mesh: HexMesh) -> None:
    back = mesh.to_lagrange().to_hermite()
    assert back.topology is mesh.topology
    assert_allclose(back.dofs, mesh.dofs, rtol=0, atol=SAME)


def test_bernstein_to_hermite_parameters_and_back_is_the_identity(mesh: HexMesh) -> None:

    parameters = np.einsum("cpa,eax->ecpx", corner_parameters(), mesh.control).reshape(-1, 3)
    again = nodal_extraction(sp.csr_array(sp.eye_array(len(parameters)))) @ parameters
    assert_allclose(again.reshape(mesh.control.shape), mesh.control, rtol=0, atol=SAME)


@pytest.mark.slow
def test_without_its_hermite_topology_a_smooth_mesh_finds_one(disturbed: HexMesh) -> None:
    lagrange = disturbed.to_lagrange()
    orphan = HexMesh(lagrange.dofs, replace(lagrange.topology, hermite=None))
    found = orphan.to_hermite()
    assert deviation(found, disturbed) < 1e-9
    radial, around, along = disturbed.topology.shape
    regular = 8 * (radial + 1) * around * along
    # At the pole: value and d/dxi3; d/dxi2 and its three cross derivatives for every column; and
    # zeros for d/dxi1 and d2/dxi1dxi3.
    pole = (radial + 1) * (4 + 4 * around)
    assert len(found.dofs) == regular + pole
    assert_allclose(found.topology.extraction @ found.topology.constant, 1, atol=1e-13)


@pytest.mark.slow
def test_a_mesh_that_is_not_smooth_gets_versions(disturbed: HexMesh) -> None:
    lagrange = disturbed.to_lagrange()
    noise = 0.1 * np.random.default_rng(3).standard_normal(lagrange.dofs.shape)
    rough = lagrange.with_dofs(lagrange.dofs + noise)
    hermite = rough.to_hermite()
    assert hermite.topology.basis == "hermite"
    assert deviation(hermite, rough) < 1e-9
    assert len(hermite.dofs) > len(disturbed.dofs)


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
def test_lower_orders_pass_through_their_lattice_and_converge(order: int) -> None:
    topology = cup_topology((1, 3, 1))
    noise = np.random.default_rng(1).standard_normal((topology.extraction.shape[1], 3))
    errors = []
    for pieces in (4, 8):
        fine = HexMesh(noise, topology).refined(pieces, pieces, pieces)
        coarse = fine.to_lagrange(order)
        xi = lattice(order + 1)
        assert_allclose(coarse.evaluate(xi), fine.evaluate(xi), atol=SAME)
        errors.append(deviation(coarse, fine))
    assert np.log2(errors[0] / errors[1]) > order + 0.6  # order + 1 in the limit


@pytest.mark.slow
def test_a_linear_mesh_has_straight_edges(cup: HexMesh) -> None:
    linear = cup.to_lagrange(1)
    ends = linear.evaluate(np.array([[0.0, 1, 0], [0.3, 1, 0], [1, 1, 0]]))
    assert_allclose(ends[:, 1], 0.7 * ends[:, 0] + 0.3 * ends[:, 2], atol=1e-12)


@pytest.mark.slow
def test_refined_lagrange_mesh_finds_back(disturbed: HexMesh) -> None:
    fine = disturbed.to_lagrange().refined(circumferential=2)
    back = fine.to_hermite()
    assert back.n_elements == 2 * disturbed.n_elements
    assert_allclose(back.dofs, disturbed.dofs, rtol=0, atol=SAME)


def test_moved_lagrange_mesh_is_the_moved_mesh(mesh: HexMesh) -> None:
    affine = np.eye(4)
    affine[:3] = np.random.default_rng(4).standard_normal((3, 4))
    assert deviation(mesh.to_lagrange().transformed(affine), mesh.transformed(affine)) < SAME


@pytest.mark.slow
@pytest.mark.parametrize("order", [0, 4])
def test_other_orders_are_refused(cup: HexMesh, order: int) -> None:
    with pytest.raises(MeshError, match=f"order {order} do not exist"):
        cup.to_lagrange(order)


@pytest.mark.slow
def test_what_needs_the_hermite_wall_says_so(cup: HexMesh) -> None:
    with pytest.raises(MeshError, match="cannot be straightened"):
        enhance(cup.to_lagrange())
