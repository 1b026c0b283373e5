"""Whatever holds a mask is taken for one, or refused in one sentence."""

from __future__ import annotations

import json
import subprocess
import sys

import nibabel as nib
import numpy as np
import pytest
import SimpleITK
from numpy.testing import assert_allclose, assert_array_equal

from heartgen import samples
from heartgen.errors import InputError, MissingFileError
from heartgen.images import Mask
from heartgen.images.accepting import accept, accept_all, read_again
from heartgen.images.reading import read_labels, read_mask
from heartgen.images.writing import write_mask
from heartgen.report import mask_sha256

SPACING = 3.0


@pytest.fixture(scope="module")
def mask() -> Mask:
    """An oblique cup."""
    cup = samples.ideal_cup(SPACING).mask
    turn = np.eye(4)
    c, s = np.cos(0.4), np.sin(0.4)
    turn[:3, :3] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    turn[:3, 3] = [7.5, -20.25, 3.0]
    return Mask(cup.voxels, turn @ cup.affine, "cup")


@pytest.fixture
def path(mask, tmp_path):
    write_mask(mask, tmp_path / "cup.nii.gz")
    return tmp_path / "cup.nii.gz"


def same(found: Mask, mask: Mask) -> None:
    """Both show the same heart in the same place."""
    assert_array_equal(found.voxels, mask.voxels)
    assert_allclose(found.affine, mask.affine, atol=1e-4)  # a NIfTI-1 has single precision


def test_paths_are_read(mask, path):
    same(accept(path), mask)
    same(accept(str(path)), mask)
    assert accept(path).source == {"path": str(path)}


def test_masks_are_taken_as_they_are(mask):
    assert accept(mask) is mask


def test_arrays_need_a_place(mask):
    same(accept(mask.voxels, affine=mask.affine), mask)
    found = accept(mask.voxels.astype(float), spacing=(1, 2, 3))
    assert_allclose(found.spacing, [1, 2, 3])
    assert_allclose(accept(mask.voxels, spacing=2).spacing, 2)
    with pytest.raises(InputError, match=r"give affine=.* or spacing="):
        accept(mask.voxels)
    with pytest.raises(InputError, match="give one"):
        accept(mask.voxels, affine=mask.affine, spacing=1)


@pytest.mark.parametrize("spacing", [0, -1, "wide", (1, 2), np.nan, [[1, 2, 3], [1, 2, 3]]])
def test_spacing_that_is_none_is_refused(mask, spacing):
    with pytest.raises(InputError, match="is no size of voxels"):
        accept(mask.voxels, spacing=spacing)


@pytest.mark.parametrize("kind", [nib.Nifti1Image, nib.Nifti2Image, nib.MGHImage])
def test_images_of_nibabel_are_ras(mask, kind):
    to_ras = np.diag([-1.0, -1.0, 1.0, 1.0])
    image = kind(mask.voxels.astype(np.uint8), to_ras @ mask.affine)
    same(accept(image), mask)


def test_analyze_image_of_nibabel_is_refused_as_its_file_is(mask):
    image = nib.Spm99AnalyzeImage(mask.voxels.astype(np.uint8), np.eye(4))
    with pytest.raises(InputError, match="does not say which side is left"):
        accept(image)


def test_files_of_nibabel_keep_name_scaling_and_unit(mask, path):
    image = nib.load(path)
    assert accept(image).name == "cup.nii.gz"
    same(accept(image), mask)
    meters = nib.Nifti1Image(
        mask.voxels.astype(np.uint8), image.affine @ np.diag([1e-3, 1e-3, 1e-3, 1])
    )
    meters.header.set_xyzt_units("meter")
    assert_allclose(accept(meters).spacing, SPACING, rtol=1e-5)


def test_images_of_simpleitk_are_lps(mask, path):
    image = SimpleITK.ReadImage(str(path))
    same(accept(image), mask)
    same(accept(SimpleITK.Cast(image, SimpleITK.sitkFloat32)), mask)


def test_flat_and_vector_images_of_simpleitk_are_refused():
    with pytest.raises(InputError, match="give a volume of labels"):
        accept(SimpleITK.Image(4, 4, SimpleITK.sitkUInt8))
    with pytest.raises(InputError, match="numbers a voxel"):
        accept(SimpleITK.Image([4, 4, 4], SimpleITK.sitkVectorUInt8, 3))
    with pytest.raises(InputError, match="no voxels in the world"):
        accept(SimpleITK.AffineTransform(3))


@pytest.mark.parametrize("wrong", [None, 3, 2.5, {"mask": 1}, b"heart.nii", object(), len])
def test_what_is_no_mask_is_refused_in_one_sentence(wrong):
    with pytest.raises(InputError, match=r"a mask cannot be made of .*: give a path"):
        accept_all(wrong)


def test_place_beside_a_file_is_refused(mask, path):
    with pytest.raises(InputError, match="spacing can be given for an array alone"):
        accept(path, spacing=1)
    with pytest.raises(InputError, match="affine can be given for an array alone"):
        accept(mask, affine=np.eye(4))


def test_label_map_gets_the_sentence_of_the_reader(mask, tmp_path):
    labels = mask.voxels.astype(np.uint8)
    labels[:, :, : labels.shape[2] // 2] *= 2
    image = SimpleITK.GetImageFromArray(labels.transpose(2, 1, 0))
    SimpleITK.WriteImage(image, str(tmp_path / "labels.nii.gz"))
    with pytest.raises(InputError, match="read_labels") as by_path:
        accept(tmp_path / "labels.nii.gz")
    with pytest.raises(InputError) as by_reader:
        read_mask(tmp_path / "labels.nii.gz")
    assert str(by_path.value) == str(by_reader.value)


def test_several_images_are_a_mask_and_its_views(mask, path):
    both = accept_all([mask, path])
    assert both[0] is mask
    assert both[1].source == {"path": str(path), "view": True}
    with pytest.raises(InputError, match="there is no image of the heart"):
        accept_all([])


def test_missing_file_is_also_the_error_of_python(tmp_path):
    with pytest.raises(FileNotFoundError, match="There is no such file") as error:
        accept(tmp_path / "none.nii")
    assert isinstance(error.value, MissingFileError | InputError)
    assert isinstance(error.value, ValueError)


def test_source_reads_the_same_mask_again(mask, tmp_path):
    labels = mask.voxels.astype(np.uint8) * 5
    image = SimpleITK.GetImageFromArray(labels.transpose(2, 1, 0))
    image.SetSpacing([SPACING] * 3)
    SimpleITK.WriteImage(image, str(tmp_path / "labels.nii.gz"))
    found = [
        read_mask(tmp_path / "labels.nii.gz", label=np.int64(5)),
        read_labels(tmp_path / "labels.nii.gz", {"lv_myocardium": (5,)}, ventricles="lv"),
    ]
    for each in found:
        source = json.loads(json.dumps(each.source))
        assert mask_sha256(read_again(source, tmp_path)) == mask_sha256(each)
        moved = source | {"path": "/nowhere/labels.nii.gz"}
        assert mask_sha256(read_again(moved, tmp_path)) == mask_sha256(each)


@pytest.mark.slow
def test_arrays_load_neither_library():
    code = (
        "import sys, numpy as np, json\n"
        "import heartgen.images.accepting as a\n"
        "a._library(np.ones((3, 3, 3)))\n"
        "print(json.dumps([name in sys.modules for name in ('nibabel', 'SimpleITK')]))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert json.loads(answer.stdout) == [False, False]
