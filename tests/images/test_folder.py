"""A file for each structure: a folder as TotalSegmentator writes it."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen import read_labels, read_mask
from heartgen.cohort import find_cases
from heartgen.errors import InputError

NAMES = {"heart_myocardium": 2, "heart_ventricle_left": 3, "heart_ventricle_right": 1}


@pytest.fixture
def parts(heart, save, tmp_path):
    """A folder of structures, and the label map that they are the parts of."""
    affine, at = heart.image(np.array([2.0, 2.0, 4.0]))
    labels = heart.labels(at)
    folder = tmp_path / "s0001"
    folder.mkdir()

    def write(names=NAMES, ending=".nii.gz"):
        for name, label in names.items():
            save((labels == label).astype(np.uint8), affine, f"s0001/{name}{ending}")
        for name in ("aorta", "spleen", "heart_atrium_left"):
            save(np.zeros(labels.shape, np.uint8), affine, f"s0001/{name}{ending}")
        return folder

    return write, save(labels, affine, "whole.nii.gz")


@pytest.mark.parametrize("ending", [".nii.gz", ".nrrd", ".mha"])
def test_structures_of_a_folder_are_joined(ending, parts):
    write, whole = parts
    folder, expected = write(ending=ending), read_labels(whole, "acdc")
    roles = {"lv_myocardium": "heart_myocardium", "lv_pool": "heart_ventricle_left"}
    roles |= {"rv_pool": "heart_ventricle_right"}
    for mask in (read_mask(folder), read_labels(folder, "auto"), read_labels(folder, roles)):
        np.testing.assert_array_equal(mask.voxels, expected.voxels)
        assert mask.name == "s0001"
    alone = read_mask(folder, label="heart_myocardium")
    np.testing.assert_array_equal(alone.voxels, read_mask(whole, label=2).voxels)


def test_names_that_say_nothing(parts):
    write, _ = parts
    folder = write({"a": 1, "b": 2, "c": 3})
    with pytest.raises(InputError, match=r"holds the structures 1 'a', 2 'aorta', .*: pass the"):
        read_mask(folder)
    assert read_mask(folder, label="b").voxels.any()


def test_files_on_different_grids(parts, save):
    write, _ = parts
    folder = write()
    save(np.ones((9, 9, 9), np.uint8), np.eye(4), "s0001/heart_ventricle_right.nii.gz")
    with pytest.raises(InputError, match=r"s0001: heart_ventricle_right\.nii\.gz has other voxels"):
        read_mask(folder)


def test_a_damaged_file_is_named(parts):
    write, _ = parts
    folder = write()
    (folder / "heart_myocardium.nii.gz").write_bytes(b"hello")
    with pytest.raises(InputError, match=r"heart_myocardium\.nii\.gz: The file is not gzip"):
        read_mask(folder)


def test_in_a_cohort_it_is_one_case(parts, save):
    write, _ = parts
    folder = write()
    assert [case.name for case in find_cases(folder.parent)] == ["s0001", "whole"]
    assert [case.source for case in find_cases(folder)] == [folder]
    save(np.ones((9, 9, 9), np.uint8), np.eye(4), "s0001/other_myocardium.nii.gz")
    assert len(find_cases(folder)) == 7  # the hearts of several patients: files by themselves
