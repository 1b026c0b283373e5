from __future__ import annotations

import dataclasses

import numpy as np
import pytest

pytest.importorskip("pyvista")

from heartgen.viewing.differences import difference_rows, difference_scale, signed_distances


def test_a_mesh_is_nowhere_from_itself(result):
    np.testing.assert_allclose(signed_distances(result.mesh, result.mesh), 0, atol=1e-4)


def test_a_swollen_mesh_reaches_beyond_on_the_outside_and_stays_within_the_cavity(result):
    mesh = result.mesh
    affine = np.diag([1.05, 1.05, 1.05, 1.0])
    affine[:3, 3] = -0.05 * mesh.points.mean(0)
    grown = mesh.transformed(affine)
    distances = signed_distances(grown, mesh)
    sizes = [len(part) for part in mesh.topology.surfaces.values()]
    names = np.repeat(list(mesh.topology.surfaces), sizes)
    of_points = np.repeat(names, len(distances) // len(names))
    assert np.median(distances[of_points == "epi"]) > 0.5
    assert np.median(distances[of_points == "lv_endo"]) < -0.3
    low, high = difference_scale(distances).limits
    assert low == -high
    assert np.percentile(np.abs(distances), 90) <= high


def test_rows_say_what_one_has_more(result):
    report = result.report
    better = dataclasses.replace(
        report, accuracy=dataclasses.replace(report.accuracy, mean=report.accuracy.mean + 0.5)
    )
    rows = {name: values for name, *values in difference_rows(better, report)}
    assert rows["error, mean (mm)"][2] == "+0.500"
    assert rows["quality Q, mean"][2] == "+0.000"
