"""Further views of a heart: long-axis slices beside a short-axis stack."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.anatomy import analyze, with_views
from heartgen.errors import AnatomyError, HeartgenError, InputError
from heartgen.images.mask import Mask
from heartgen.images.writing import write_mask
from heartgen.mesh.surface_faces import sample_faces

SPARSE = (1.5, 1.5, 10.0)


@pytest.fixture(scope="module")
def stack() -> Mask:
    return samples.lifelike_lv(SPARSE).mask


@pytest.fixture(scope="module")
def dense() -> Mask:
    return samples.lifelike_lv(1.5).mask


@pytest.fixture(scope="module")
def views(dense: Mask) -> list[Mask]:
    """Two long-axis slices through the middle of the heart, across each other."""
    middle = np.argwhere(dense.voxels).mean(0).astype(int)
    planes = []
    for axis in (0, 1):
        voxels = np.zeros_like(dense.voxels)
        chosen = tuple(middle[a] if a == axis else slice(None) for a in range(3))
        voxels[chosen] = dense.voxels[chosen]
        planes.append(replace(dense, voxels=voxels, name=f"long axis {axis}"))
    return planes


def test_contours_go_to_the_surfaces_that_they_show(stack: Mask, views: list[Mask]) -> None:
    alone = analyze(stack)
    more = with_views(alone, views)
    assert more.slices is not None
    assert alone.slices is not None
    truth = samples.lifelike_lv(1.5).truth
    for name, true in (("lv_endo", "endo"), ("epi", "epi")):
        added = more.slices.contours[name].points[len(alone.slices.contours[name].points) :]
        assert len(added) > 50
        assert np.median(truth.distance(added, true)) < 0.75  # half a voxel
    assert len(more.slices.outline.points) == len(alone.slices.outline.points) + sum(
        len(more.slices.contours[n].points) - len(alone.slices.contours[n].points)
        for n in alone.slices.contours
    )


@pytest.mark.slow
def test_long_axes_tell_where_the_apex_is(stack: Mask, views: list[Mask]) -> None:
    truth = samples.lifelike_lv(1.5).truth
    errors = []
    for given in (stack, [stack, *views]):
        result = heartgen.personalize(given)
        epi = result.mesh.topology.surfaces["epi"]
        points, _, area = sample_faces(result.mesh, epi, 5)
        low = result.anatomy.to_heart(points)[:, 2] < -0.75 * result.anatomy.length
        errors.append(np.average(truth.distance(points[low], "epi"), weights=area[low]))
        assert result.report.quality.valid
    assert errors[1] < 0.95 * errors[0]


def test_a_view_of_something_else_is_refused(stack: Mask, views: list[Mask]) -> None:
    affine = views[0].affine.copy()
    affine[:3, 3] += 40
    with pytest.raises(AnatomyError, match="long axis 0 shows another heart"):
        with_views(analyze(stack), [replace(views[0], affine=affine)])


def test_no_image_at_all_is_refused() -> None:
    with pytest.raises(InputError, match="no image"):
        heartgen.personalize([])


def test_a_dense_image_needs_no_views(dense: Mask, views: list[Mask]) -> None:
    with pytest.raises(AnatomyError, match="no stack"):
        with_views(analyze(dense), views)


def test_a_single_slice_is_read_as_a_view_only(views: list[Mask], tmp_path) -> None:
    path = tmp_path / "long.nii.gz"
    write_mask(views[0], path)
    with pytest.raises(HeartgenError, match="flat"):
        heartgen.read_mask(path)
    found = heartgen.read_mask(path, view=True)
    assert found.voxels.sum() == views[0].voxels.sum()
