"""Volumes, masses, lengths and strains of solids of which they are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.solids import cut_volume, ellipsoid
from heartgen.errors import MeshError
from heartgen.fields.indices import DENSITY, clinical_indices
from heartgen.fields.rims import basal_rim, enclosed_cavity, rims
from heartgen.fields.strains import global_strains
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import volume


def test_indices_of_an_ellipsoid() -> None:
    mesh = ellipsoid(22.0, 60.0, 10.0, 20.0, (1, 12, 6))
    found = clinical_indices(mesh)
    cavity = cut_volume(22, 60, 20)
    wall = cut_volume(32, 70, 20) - cavity
    assert found.lv_cavity_volume == pytest.approx(cavity / 1000, rel=0.001)
    assert found.myocardial_volume == pytest.approx(wall / 1000, rel=0.001)
    assert found.myocardial_mass == found.lv_mass == DENSITY * found.myocardial_volume
    assert found.long_axis_length == pytest.approx(80, rel=1e-3)
    assert found.sphericity == pytest.approx(cavity / (np.pi / 6 * 80**3), rel=0.001)
    assert set(found.wall_thickness) == set(range(1, 18))
    assert found.wall_thickness[8] == pytest.approx(10, rel=0.03)
    assert found.septum == "assumed"
    assert found.rv_cavity_volume is found.rv_mass is found.rv_lv_ratio is None


def test_indices_of_both_ventricles(biv: HexMesh, biv_sample) -> None:
    found, truth = clinical_indices(biv), biv_sample.truth
    assert found.lv_cavity_volume == pytest.approx(truth.cavity_volume / 1000, rel=0.05)
    assert found.rv_cavity_volume == pytest.approx(truth.rv.cavity_volume / 1000, rel=0.1)
    assert found.rv_lv_ratio == found.rv_cavity_volume / found.lv_cavity_volume
    assert found.lv_mass + found.rv_mass == pytest.approx(found.myocardial_mass)
    assert found.septum == "measured"


def test_indices_do_not_depend_on_pose(biv: HexMesh) -> None:
    affine = np.array([[0, 0, 1, 7], [1, 0, 0, -3], [0, 1, 0, 90], [0, 0, 0, 1.0]])
    one, other = clinical_indices(biv), clinical_indices(biv.transformed(affine))
    assert other.lv_cavity_volume == pytest.approx(one.lv_cavity_volume, rel=1e-9)
    assert other.rv_cavity_volume == pytest.approx(one.rv_cavity_volume, rel=1e-9)
    assert list(other.wall_thickness) == list(one.wall_thickness)
    for segment, thickness in one.wall_thickness.items():
        assert other.wall_thickness[segment] == pytest.approx(thickness, rel=1e-6)


def test_rims_are_where_surfaces_end(biv: HexMesh, land: HexMesh) -> None:
    (rim,) = rims(land, land.topology.surfaces["lv_endo"])
    assert np.linalg.norm(rim.area) == pytest.approx(np.pi * 49 * (1 - 25 / 289), rel=1e-3)
    assert rim.center == pytest.approx([0, 0, 5], abs=1e-3)
    assert len(rims(biv, biv.topology.surfaces["rv_endo"])) == 1
    assert len(rims(biv, biv.topology.surfaces["base"])) == 3
    assert rims(land, land.topology.external) == []


def test_cavity_with_a_hole_is_closed_by_a_flat_lid(land: HexMesh) -> None:
    row = land.topology.index[:, 2]
    surfaces = dict(land.topology.surfaces)
    surfaces["lv_endo"] = surfaces["lv_endo"][row[surfaces["lv_endo"][:, 0]] > 0]
    holed = HexMesh(land.dofs, replace(land.topology, surfaces=surfaces))
    edge = land.evaluate(np.array([[0.0, 1.0, 0.0]]))[row == 0, 0, 2].mean()
    cap = cut_volume(7, 17, edge)
    lost = enclosed_cavity(land, "lv_endo") - enclosed_cavity(holed, "lv_endo")
    assert lost == pytest.approx(cap, rel=0.01)
    assert basal_rim(holed, "lv_endo").center == pytest.approx([0, 0, 5], abs=1e-3)


def test_surface_that_does_not_reach_the_base_is_refused(land: HexMesh) -> None:
    surfaces = dict(land.topology.surfaces)
    surfaces["base"] = surfaces["base"][:0]
    with pytest.raises(MeshError, match="no basal rim"):
        basal_rim(HexMesh(land.dofs, replace(land.topology, surfaces=surfaces)), "lv_endo")


@pytest.mark.slow
def test_strain_of_a_change_of_size(mesh: HexMesh) -> None:
    found = global_strains(mesh, mesh.transformed(np.diag([0.8, 0.8, 0.8, 1.0])))
    assert found.longitudinal == pytest.approx(-0.2)
    assert found.circumferential == pytest.approx(-0.2)
    assert found.radial == pytest.approx(-0.2)


def test_strain_of_a_tube_that_is_shortened() -> None:
    """The wall of a long ventricle stands along the axis: shortening is longitudinal strain."""
    mesh = ellipsoid(20.0, 400.0, 5.0, 0.0, (1, 12, 6))
    found = global_strains(mesh, mesh.transformed(np.diag([1.0, 1.0, 0.85, 1.0])))
    assert found.longitudinal == pytest.approx(-0.15, abs=0.005)
    assert found.circumferential == pytest.approx(0, abs=1e-9)
    assert found.radial == pytest.approx(0, abs=0.005)
    assert volume(mesh) > 0


def test_turning_is_no_strain(mesh: HexMesh) -> None:
    turned = mesh.transformed(np.array([[0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]))
    found = global_strains(mesh, turned)
    for value in (found.longitudinal, found.circumferential, found.radial):
        assert abs(value) < 1e-12


def test_meshes_that_do_not_correspond_have_no_strain(lv: HexMesh, biv: HexMesh) -> None:
    with pytest.raises(MeshError, match="strains need meshes whose elements correspond"):
        global_strains(lv, biv)
