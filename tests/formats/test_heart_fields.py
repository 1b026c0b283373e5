"""The fields of a heart as other people's readers find them."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from heartgen.fields import SEGMENTS, FiberRule, fiber_frames, make_fields
from heartgen.fields.frames import at_pole, local_frames
from heartgen.fields.wall import wall_of
from heartgen.formats import file_name, read_mesh_file, write_mesh
from heartgen.mesh import MeshField
from heartgen.mesh.bernstein import lattice


@pytest.fixture(scope="module")
def fields(usual):
    return {field.name: field for field in make_fields(usual)}


@pytest.mark.slow
def test_zinc_finds_fibers_and_segments(usual, fields, tmp_path):
    zinc = pytest.importorskip("cmlibs.zinc.context")
    write_mesh(usual, tmp_path / "mesh.exf", fields.values())
    context = zinc.Context("test")
    region = context.getDefaultRegion()
    assert region.readFile(str(tmp_path / "mesh.exf")) == 1
    module = region.getFieldmodule()
    mesh, cache = module.findMeshByDimension(3), module.createFieldcache()
    xi = np.random.default_rng(5).uniform(size=(4, 3))
    for name in ("fiber", "sheet", "transmural", "curvature"):
        expected = fields[name].evaluate(xi)
        field = module.findFieldByName(name)
        for element in (0, 17, usual.n_elements - 1):
            for q, place in enumerate(xi.tolist()):
                cache.setMeshLocation(mesh.findElementByIdentifier(element + 1), place)
                answer, found = field.evaluateReal(cache, fields[name].components)
                assert answer == 1
                assert np.abs(found - expected[element, q]).max() < 1e-9
    segment = fields["aha segment"].values[:, 0]
    for number, name in SEGMENTS.items():
        group = module.findFieldByName(f"AHA segment {number} {name}").castGroup()
        expected = 1 + np.flatnonzero(segment == number)
        if len(expected):
            assert group.getMeshGroup(mesh).getSize() == len(expected)
            for element in expected:
                assert group.getMeshGroup(mesh).containsElement(
                    mesh.findElementByIdentifier(int(element))
                )


def test_vtk_finds_directions_of_length_one_and_segments(usual, fields, tmp_path):
    write_mesh(usual, tmp_path / "mesh.vtu", fields.values())
    grid = pv.read(tmp_path / "mesh.vtu")
    for name in ("fiber", "sheet", "sheet normal"):
        assert np.linalg.norm(grid[name], axis=1) == pytest.approx(1)
    assert np.abs(np.einsum("nx,nx->n", grid["fiber"], grid["sheet"])).max() < 1e-12
    assert np.array_equal(grid.cell_data["aha segment"], fields["aha segment"].values[:, 0])
    # Where a field jumps, its points are there more than once: nothing is averaged.
    turn = grid["circumferential"]
    for cell in range(usual.n_elements):
        inside = turn[grid.get_cell(cell).point_ids]
        assert np.ptp(inside) < np.pi


@pytest.mark.slow
@pytest.mark.parametrize("form", ["exf", "ex1", "fieldml"])
def test_zinc_makes_our_fibers_of_the_angles(heart, tmp_path, form):
    zinc = pytest.importorskip("cmlibs.zinc.context")
    rule = FiberRule(transverse=(-20, 30), sheet=(-65, 25))
    (angles,) = make_fields(heart, ["angles"], rule=rule)
    files = write_mesh(heart, tmp_path / file_name("mesh", form), [angles], form).files
    context = zinc.Context("test")
    region = context.getDefaultRegion()
    assert [region.readFile(str(file)) for file in files] == [1] * len(files)
    module = region.getFieldmodule()
    found = module.findFieldByName("fiber angles")
    if form != "fieldml":  # which has no kinds of fields
        assert found.getCoordinateSystemType() == found.COORDINATE_SYSTEM_TYPE_FIBRE
    axes = module.createFieldFibreAxes(found, module.findFieldByName("coordinates"))
    mesh, cache = module.findMeshByDimension(3), module.createFieldcache()
    expected = np.swapaxes(fiber_frames(heart, rule), -1, -2).reshape(heart.n_elements, 64, 9)
    apart = ~at_pole(heart)
    for element in range(heart.n_elements):
        for place in np.flatnonzero(apart[element])[::7]:
            cache.setMeshLocation(
                mesh.findElementByIdentifier(element + 1), lattice()[place].tolist()
            )
            answer, values = axes.evaluateReal(cache, 9)
            assert answer == 1
            assert np.abs(values - expected[element, place]).max() < 1e-9


@pytest.mark.slow
def test_angles_follow_the_fibers_between_the_nodes(heart):
    """Far from where directions meet, axes from the angles stay those of the interpolated fiber."""
    (angles,) = make_fields(heart, ["angles"])
    xi = np.random.default_rng(6).uniform(size=(20, 3))
    turn, incline = np.moveaxis(angles.evaluate(xi), -1, 0)[:2]
    one, aside, normal = np.moveaxis(local_frames(heart, xi), -1, 0)
    plane = np.cos(turn)[..., None] * one + np.sin(turn)[..., None] * aside
    fiber = np.cos(incline)[..., None] * plane - np.sin(incline)[..., None] * normal
    ours = MeshField("fiber", fiber_frames(heart)[..., 0]).evaluate(xi)
    cosine = np.einsum("eqx,eqx->eq", fiber, ours) / np.linalg.norm(ours, axis=-1)
    away = ~at_pole(heart).any(1) & (heart.topology.index[:, 2] > 0)
    assert np.degrees(np.arccos(np.clip(cosine[away], -1, 1))).mean() < 1


def test_zinc_knows_what_the_angles_are(usual, fields, tmp_path):
    write_mesh(usual, tmp_path / "mesh.exf", [fields["fiber angles"]])
    text = (tmp_path / "mesh.exf").read_text()
    assert "1) fiber angles, anatomical, fibre, real, #Components=3" in text
    again = read_mesh_file(tmp_path / "mesh.exf")
    write_mesh(again.mesh, tmp_path / "again.exf", again.fields)
    assert (tmp_path / "again.exf").read_text() == text


def test_angles_of_a_plain_rule_are_those_of_the_rule(usual):
    (angles,) = make_fields(usual, ["angles"], rule=FiberRule(helix=(60, -60)))
    depth = wall_of(usual).depth
    helix, imbrication, sheet = np.degrees(np.moveaxis(angles.values, -1, 0))
    off = ~at_pole(usual)
    assert np.abs(helix - (60 - 120 * depth))[off].max() < 1e-6
    assert np.abs(imbrication[off]).max() < 1e-6
    assert np.abs(sheet[off] - 90).max() < 1e-6
