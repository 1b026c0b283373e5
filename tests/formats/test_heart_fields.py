"""The fields of a heart as other people's readers find them."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv

from heartgen.fields import SEGMENTS, make_fields
from heartgen.formats import write_mesh


@pytest.fixture(scope="module")
def fields(usual):
    return {field.name: field for field in make_fields(usual)}


def test_zinc_finds_fibres_and_segments(usual, fields, tmp_path):
    zinc = pytest.importorskip("cmlibs.zinc.context")
    write_mesh(usual, tmp_path / "mesh.exf", fields.values())
    context = zinc.Context("test")
    region = context.getDefaultRegion()
    assert region.readFile(str(tmp_path / "mesh.exf")) == 1
    module = region.getFieldmodule()
    mesh, cache = module.findMeshByDimension(3), module.createFieldcache()
    xi = np.random.default_rng(5).uniform(size=(4, 3))
    for name in ("fibre", "sheet", "transmural", "curvature"):
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
    for name in ("fibre", "sheet", "sheet normal"):
        assert np.linalg.norm(grid[name], axis=1) == pytest.approx(1)
    assert np.abs(np.einsum("nx,nx->n", grid["fibre"], grid["sheet"])).max() < 1e-12
    assert np.array_equal(grid.cell_data["aha segment"], fields["aha segment"].values[:, 0])
    # Where a field jumps, its points are there more than once: nothing is averaged.
    turn = grid["circumferential"]
    for cell in range(usual.n_elements):
        inside = turn[grid.get_cell(cell).point_ids]
        assert np.ptp(inside) < np.pi
