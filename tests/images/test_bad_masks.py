"""Images that hold no heart to mesh are refused by one error that names what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel as nib
import numpy as np
import pytest
import SimpleITK

from heartgen import mask_from_array
from heartgen.errors import InputError

NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 24 22 20\nencoding: raw\n"
META = "NDims = 3\nDimSize = 24 22 20\nElementType = MET_UCHAR\n"
LOCAL = "ElementDataFile = LOCAL\n"
LPS = "space: left-posterior-superior\nspace origin: (0,0,0)\n"

Maker = Callable[[Any, np.ndarray], Path]
bad_masks: dict[str, tuple[Maker, str]] = {}


def bad(words: str) -> Callable[[Maker], Maker]:
    """Register a way to write a bad image into a folder, with words of the sentence it earns."""
    return lambda make: bad_masks.setdefault(make.__name__, (make, words))[0]


@bad("not binary.* labels 1 .*, 2 .*label=")
def two_labels(folder, cup):
    return folder.nifti(cup * np.repeat([[[1]], [[2]]], 12, axis=0).astype(np.uint8))


@bad("gray and not a mask.*different values.*threshold")
def probabilities(folder, cup):
    return folder.nifti(cup * np.linspace(0.1, 0.9, cup.shape[2]).astype(np.float32))


@bad("gray and not a mask.*27 different values from 0 to 192.*threshold")
def bytes_of_gray(folder, cup):
    gray = np.indices(cup.shape).sum(0) * 7 % 100 * 2 * cup
    return folder.nifti(gray.astype(np.uint8))


@bad("mask is empty, no voxel")
def nothing_set(folder, cup):
    return folder.nifti(0 * cup)


@bad("Every voxel is set")
def everything_set(folder, cup):
    return folder.nifti(np.ones_like(cup))


@bad("swapped: invert")
def inside_out(folder, cup):
    return folder.nifti(1 - cup)


@bad("3 frames")
def cine(folder, cup):
    return folder.nifti(np.stack([cup] * 3, axis=-1))


@bad("5 frames")
def cine_nrrd(folder, cup):
    image = SimpleITK.JoinSeries([SimpleITK.GetImageFromArray(cup.T)] * 5)
    SimpleITK.WriteImage(image, str(folder / "m.nrrd"))
    return folder / "m.nrrd"


@bad("two-dimensional")
def one_slice(folder, cup):
    return folder.nifti(cup[:, :, 8])


@bad("two-dimensional .*24 x 22 x 1")
def one_slice_in_three_axes(folder, cup):
    return folder.nifti(cup[:, :, 8:9])


@bad("only 2 voxels along the k axis")
def two_slices(folder, cup):
    flat = 0 * cup
    flat[:, :, 8:10] = cup[:, :, 8:10]
    return folder.nifti(flat)


@bad("only 27 voxels, too few")
def speck(folder, cup):
    few = 0 * cup
    few[5:8, 5:8, 5:8] = 1
    return folder.nifti(few)


@bad("only 13 voxels, too few")
def dust(folder, cup):
    specks = 0 * cup
    specks[1::4, 1::4, 1::4] = 1
    specks[1:3, 1:3, 1:3] = 1
    return folder.nifti(specks)


@bad("NaN or infinity stands in 1 voxel:")
def not_a_number(folder, cup):
    values = cup.astype(np.float32)
    values[0, 0, 0] = np.nan
    return folder.nifti(values)


@bad("NaN or infinity stands in 20 voxels:")
def infinite(folder, cup):
    values = cup.astype(np.float64)
    values[3, 3] = np.inf
    return folder.nifti(values)


@bad("complex numbers")
def complex_numbers(folder, cup):
    return folder.nifti(cup.astype(np.complex64))


@bad("complex numbers")
def complex_numbers_nrrd(folder, cup):
    image = SimpleITK.GetImageFromArray(cup.T.astype(np.complex64))
    SimpleITK.WriteImage(image, str(folder / "m.nrrd"))
    return folder / "m.nrrd"


@bad("colors or vectors")
def colors(folder, cup):
    rgb = np.zeros(cup.shape, dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
    return folder.nifti(rgb)


@bad("colors or vectors")
def vectors(folder, cup):
    image = SimpleITK.GetImageFromArray(np.stack([cup.T] * 3, axis=-1), isVector=True)
    SimpleITK.WriteImage(image, str(folder / "m.mha"))
    return folder / "m.mha"


@bad("voxel size of 0 x 1 x 1 mm.*not positive")
def zero_spacing(folder, cup):
    return folder.nifti(cup, pixdim=[1, 0, 1, 1, 0, 0, 0, 0])


@bad("voxel size of 1 x -2 x 1 mm.*not positive")
def negative_spacing(folder, cup):
    return folder.nifti(cup, pixdim=[1, 1, -2, 1, 0, 0, 0, 0])


@bad("voxel size of 1 -2 1 mm.*not positive")
def negative_spacing_mha(folder, cup):
    return folder.text("m.mha", META + "ElementSpacing = 1 -2 1\n" + LOCAL, cup.tobytes("F"))


@bad("voxel size of 1 0 1 mm.*not positive")
def zero_spacing_nrrd(folder, cup):
    return folder.text("m.nrrd", NRRD + "spacings: 1 0 1\n\n", cup.tobytes("F"))


@bad("500 x 500 x 500 mm is not possible")
def half_meter_voxels(folder, cup):
    nib.save(nib.Nifti1Image(cup, np.diag([500, 500, 500, 1])), folder / "m.nii")
    return folder / "m.nii"


@bad("1e-06 mm is not possible")
def nanometer_voxels(folder, cup):
    nib.save(nib.Nifti1Image(cup, np.diag([1e-6, 1e-6, 1e-6, 1])), folder / "m.nii")
    return folder / "m.nii"


@bad("two of them meet at 7[67].* degrees.*resample")
def sheared_nifti(folder, cup):
    affine = np.eye(4)
    affine[0, 2] = 0.25
    image = nib.Nifti1Image(cup, affine)
    image.set_qform(None, 0)
    nib.save(image, folder / "m.nii")
    return folder / "m.nii"


@bad("sheared")
def sheared_nrrd(folder, cup):
    axes = "space directions: (1,0,0) (0.2,1,0) (0,0,1)\n\n"
    return folder.text("m.nrrd", NRRD + LPS + axes, cup.tobytes("F"))


@bad("two voxel sizes, 1 x 1 x 1 mm by its sform and 2 x 1 x 1 mm by its pixdim")
def two_voxel_sizes(folder, cup):
    return folder.nifti(cup, pixdim=[1, 2, 1, 1, 0, 0, 0, 0])


@bad("sform and the qform of the header are mirror images")
def mirrored_transforms(folder, cup):
    image = nib.Nifti1Image(cup, np.eye(4))
    image.set_sform(np.diag([-1.0, 1, 1, 1]), 1)
    image.set_qform(np.eye(4), 1)
    nib.save(image, folder / "m.nii")
    return folder / "m.nii"


@bad("header is damaged")
def impossible_rotation(folder, cup):
    return folder.nifti(cup, qform_code=1, quatern_b=3.0)


@bad("not a sensible number")
def nowhere_nan(folder, cup):
    return folder.nifti(cup, srow_x=[1, 0, 0, np.nan])


@pytest.mark.parametrize("kind", bad_masks)
def test_bad_mask_is_refused_with_a_clear_sentence(kind, folder, cup, assert_refused):
    make, words = bad_masks[kind]
    assert_refused(make(folder, cup), words)


def test_all_problems_are_named_at_once(cup):
    values = cup.astype(float)
    values[0, 0, 0] = np.nan
    affine = np.eye(4)
    affine[0, 1] = 0.5
    with pytest.raises(InputError, match="case 7: 2 problems") as refusal:
        mask_from_array(values, affine, name="case 7")
    assert "sheared" in str(refusal.value)
    assert "NaN" in str(refusal.value)


@pytest.mark.parametrize(
    ("label", "words"),
    [
        (7, "no label 7 in the image, which holds 1 .*, 2"),
        ([1, 8], "no label 8 "),
        ("septum", "no label 'septum' "),
        (1.5, "no label 1.5 "),
        (None, "not binary"),
        ([], "empty"),
        ([[1, 2]], r"no label \[1, 2\] "),
    ],
)
def test_labels_that_are_not_there(label, words, cup):
    labels = cup.copy()
    labels[:12] *= 2
    with pytest.raises(InputError, match=words):
        mask_from_array(labels, np.eye(4), label=label)


@pytest.mark.parametrize(
    ("affine", "words"),
    [
        (np.eye(3), "4 x 4 matrix"),
        (np.zeros((4, 4)), "last row 0 0 0 1"),
        (np.diag([1.0, 0.0, 1.0, 1.0]), "1 x 0 x 1 mm is not possible"),
        (np.diag([1.0, np.inf, 1.0, 1.0]), "not a sensible number"),
        ("identity", "not a matrix of numbers"),
    ],
)
def test_bad_affines(affine, words, cup):
    with pytest.raises(InputError, match=words):
        mask_from_array(cup, affine)


@pytest.mark.parametrize("voxels", [np.zeros(0), np.zeros((0, 3, 3)), [["a"]], np.array(None), 3])
def test_arrays_that_are_no_images(voxels):
    with pytest.raises(InputError):
        mask_from_array(voxels, np.eye(4))


def test_an_unknown_frame(cup):
    with pytest.raises(InputError, match="'LPS' or 'RAS'"):
        mask_from_array(cup, np.eye(4), frame="RSA")
