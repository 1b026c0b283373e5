"""Images from meshes."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from heartgen import samples
from heartgen.errors import InputError, MeshError
from heartgen.images import Mask
from heartgen.images.reading import read_grid
from heartgen.images.writing import write_image
from heartgen.mesh.jacobian import volume
from heartgen.mesh.rasterization import rasterize
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh

SPACING = np.array([1.5, 2.0, 2.5])


def sphere_cup(apex="collapsed"):
    """Half of a thick spherical shell, of radii 20 and 30 mm, or nearly so."""
    shape = TruncatedEllipsoid(
        center=np.zeros(2),
        lean=np.zeros(2),
        section=20 * np.eye(2),
        axis=20.0,
        cut=0.0,
        wall=10.0,
        apex=10.0,
    )
    return ellipsoid_mesh(shape, (1, 12, 6), apex=apex, hole=6.0)


@pytest.fixture(scope="module", params=["collapsed", "patch", "hole"])
def cup(request):
    return sphere_cup(request.param)


def around(mesh, spacing=SPACING, margin=2.3):
    """Shape and affine of a grid around a mesh."""
    points = mesh.lagrange_points().reshape(-1, 3)
    low = points.min(0) - margin * spacing
    shape = tuple(np.ceil((points.max(0) - low) / spacing + margin).astype(int).tolist())
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = low
    return shape, affine


@pytest.mark.slow
def test_partial_volumes_sum_up_to_the_volume(cup):
    shape, affine = around(cup)
    image = rasterize(cup, shape, affine, partial=True)
    assert image.min() == 0
    assert image.max() == 1
    assert image.sum() * SPACING.prod() == pytest.approx(volume(cup), rel=5e-4)


@pytest.mark.slow
def test_voxels_are_inside_if_their_center_is():
    cup = sphere_cup()
    shape, affine = around(cup)
    image = rasterize(cup, shape, affine)
    assert set(np.unique(image)) == {0, 1}
    centers = np.moveaxis(np.indices(shape), 0, -1) * SPACING + affine[:3, 3]
    points = cup.lagrange_points().reshape(-1, 3)
    base = points[:, 2].max()
    depth = np.linalg.norm(centers - [0, 0, base], axis=-1)
    inside = (depth > 20) & (depth < 30) & (centers[..., 2] < base)
    clear = np.minimum(np.abs(depth - 20), np.abs(depth - 30)) > 0.4
    clear &= np.abs(centers[..., 2] - base) > 0.1
    assert clear.mean() > 0.8
    assert_array_equal(image[clear] > 0, inside[clear])


@pytest.mark.slow
def test_every_orientation_of_the_grid_gives_the_same_image(cup):
    shape, affine = around(cup)
    image = rasterize(cup, shape, affine, partial=False)
    for axes, flips in product([(0, 1, 2), (2, 0, 1), (1, 0, 2)], [(1, 1, 1), (-1, 1, -1)]):
        other = np.eye(4)
        other[:3, :3] = affine[:3, :3][:, axes] * flips
        ends = [(np.array(shape)[axes[n]] - 1) if flips[n] < 0 else 0 for n in range(3)]
        other[:3, 3] = affine[:3, 3] - other[:3, :3] @ np.array(ends)
        turned = rasterize(cup, tuple(shape[a] for a in axes), other)
        back = turned[tuple(slice(None, None, f) for f in flips)].transpose(np.argsort(axes))
        # Where the surface passes within the flatness of the triangles, centers may be either.
        assert np.count_nonzero(back != image) < 2e-3 * image.sum()


@pytest.mark.slow
def test_corners_of_the_mesh_on_lines_of_voxels_leave_no_hole():
    cup = sphere_cup()  # its poles, seams and rim lie on whole millimeters
    affine = np.eye(4)
    affine[:3, 3] = np.floor(cup.lagrange_points().min((0, 1))) - [2, 2, 2.5]
    image = rasterize(cup, (70, 70, 40), affine)
    outside = np.ones_like(image, dtype=bool)
    outside[1:-1, 1:-1, 1:-1] = False
    assert not image[outside].any()
    assert image.sum() == pytest.approx(volume(cup), rel=0.01)


@pytest.mark.slow
def test_only_what_is_on_the_grid_is_drawn(cup):
    shape, affine = around(cup)
    whole = rasterize(cup, shape, affine, partial=True)
    part = affine.copy()
    part[:3, 3] += SPACING * [5, 6, 7]
    cut = rasterize(cup, (8, 9, 6), part, partial=True)
    assert_allclose(cut, whole[5:13, 6:15, 7:13], rtol=0, atol=1e-4)
    far = affine.copy()
    far[:3, 3] += 1000
    assert not rasterize(cup, shape, far).any()


@pytest.mark.slow
def test_mesh_of_both_ventricles_keeps_its_cavities_open():
    from heartgen.anatomy import analyze
    from heartgen.templates import biventricular_template

    mask = samples.biv(2.5).mask
    mesh = biventricular_template(analyze(mask, "auto", "biv"), (2, 12, 8))
    image = mesh.rasterize(mask, partial=True)
    assert image.shape == mask.voxels.shape
    assert image.sum() * np.prod(mask.spacing) == pytest.approx(volume(mesh), rel=2e-3)
    binary = mesh.rasterize(mask) > 0
    overlap = 2 * np.count_nonzero(binary & mask.voxels) / (binary.sum() + mask.voxels.sum())
    assert overlap > 0.8  # a template that nothing was fitted with


@pytest.mark.slow
def test_image_is_read_where_it_was_drawn(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    cup = sphere_cup()
    shape, affine = around(cup)
    image = rasterize(cup, shape, affine, partial=True)
    write_image(image, affine, tmp_path / "cup.nii.gz")
    read = nibabel.load(tmp_path / "cup.nii.gz")
    assert_allclose(read.affine, np.diag([-1, -1, 1, 1]) @ affine, rtol=0, atol=1e-4)
    assert_allclose(np.asarray(read.dataobj), image, rtol=0, atol=1e-6)
    again, placed = read_grid(tmp_path / "cup.nii.gz")
    assert again == shape
    assert_allclose(placed, affine, rtol=0, atol=1e-4)


@pytest.mark.slow
def test_like_takes_what_has_voxels_and_affine(cup):
    shape, affine = around(cup)
    like = Mask(np.zeros(shape, dtype=bool), affine)
    assert_array_equal(cup.rasterize(like), rasterize(cup, shape, affine))


@pytest.mark.parametrize(
    ("shape", "affine"),
    [((3, 3), np.eye(4)), ((3, 3, 3, 2), np.eye(4)), ((3, 3, 3), np.zeros((4, 4)))],
)
def test_grids_that_are_no_volume_are_refused(cup, shape, affine):
    with pytest.raises(InputError, match="is no volume"):
        rasterize(cup, shape, affine)


@pytest.mark.slow
def test_mesh_with_openings_has_no_inside(cup):
    surfaces = {n: f for n, f in cup.topology.surfaces.items() if n != "base"}
    cut = replace(cup, topology=replace(cup.topology, surfaces=surfaces))
    with pytest.raises(MeshError, match="leave openings"):
        rasterize(cut, (3, 3, 3), np.eye(4))


def test_images_have_endings_of_images(tmp_path):
    with pytest.raises(InputError, match=r"end the name in \.nii, "):
        write_image(np.zeros((2, 2, 2), np.uint8), np.eye(4), tmp_path / "cup.png")


@pytest.mark.slow
def test_fitted_meshes_overlap_with_their_masks(shared_data):
    import heartgen

    mask = heartgen.read_mask(shared_data / "lv" / "mesa0054_ED.nii.gz")
    mesh = heartgen.personalize(mask, lod=1).mesh
    image = mesh.rasterize(mask) > 0
    overlap = 2 * np.count_nonzero(image & mask.voxels) / (image.sum() + mask.voxels.sum())
    assert overlap > 0.97
