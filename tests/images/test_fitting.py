"""What lies in the left ventricle's wall, or on its pool, is no right ventricle."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen import read_labels
from heartgen.errors import InputError

POOL, WALL, SCAR = 1, 2, 3
DEPTHS = {
    "transmural": (20.0, 30.0),
    "subendocardial": (20.0, 24.0),
    "mid-wall": (23.0, 27.0),
    "subepicardial": (26.0, 30.0),
}


@pytest.fixture(scope="module", params=[(2.0, 2.0, 2.0), (1.5, 1.5, 9.0)], ids=["dense", "stack"])
def left(request, heart):
    """Affine of an image, places of its voxels, and the left ventricle in it: pool and wall."""
    affine, at = heart.image(np.array(request.param))
    labels = heart.labels(at, {"rv_pool": 0, "lv_myocardium": WALL, "lv_pool": POOL})
    return affine, at, labels


def scarred(left, depth: str, degrees: float = 70.0) -> np.ndarray:
    """The left ventricle with a scar over part of its circumference, at some depth of its wall."""
    _, at, labels = left
    radius, angle = np.linalg.norm(at, axis=-1), np.degrees(np.arctan2(at[..., 1], at[..., 0]))
    low, high = DEPTHS[depth]
    there = (labels == WALL) & (np.abs(angle) < degrees / 2) & (radius > low) & (radius <= high)
    return np.where(there & (at[..., 2] > -20), SCAR, labels)


@pytest.mark.parametrize("degrees", [30.0, 70.0, 150.0])
@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("scheme", ["auto", "emidec"])
def test_a_scar_is_a_part_of_the_wall(scheme, depth, degrees, left, save):
    affine, _, labels = left
    scar = scarred(left, depth, degrees)
    mask = read_labels(save(scar, affine, "scar.nii.gz"), scheme)
    assert mask.voxels.sum() == (labels == WALL).sum()
    told = [finding.message for finding in mask.findings if finding.check == "labels"]
    assert told == (["The labels were read by the scheme emidec."] if scheme == "auto" else [])


@pytest.mark.parametrize("depth", DEPTHS)
def test_no_reflow_within_the_scar(depth, left, save):
    affine, at, labels = left
    scar = scarred(left, depth)
    scar[(scar == SCAR) & (np.abs(at[..., 1]) < 4)] = 4
    mask = read_labels(save(scar, affine, "scar.nii.gz"), "auto")
    assert mask.voxels.sum() == (labels == WALL).sum()


@pytest.mark.parametrize("ventricles", ["auto", "lv"])
@pytest.mark.parametrize(
    "scheme", ["ukbb", "mnms", {"lv_myocardium": WALL, "lv_pool": POOL, "rv_pool": SCAR}]
)
def test_nor_is_it_one_because_a_scheme_says_so(scheme, ventricles, left, save):
    path = save(scarred(left, "transmural"), left[0], "scar.nii.gz")
    with pytest.raises(InputError, match=r"label 3\) lies within the left ventricle's wall \(2\)"):
        read_labels(path, scheme, ventricles=ventricles)


def test_scar_under_the_number_of_a_right_pool(left, save):
    numbers = np.array([0, 3, 2, 1], dtype=np.int16)  # as in ACDC, whose 1 is the right pool
    path = save(numbers[scarred(left, "subendocardial")], left[0], "scar.nii.gz")
    with pytest.raises(InputError, match=r"No scheme fits .*not acdc because .*as a scar does"):
        read_labels(path, "auto")


def test_an_atrium_is_no_right_ventricle(left, save):
    affine, at, labels = left
    atrium = np.linalg.norm(at - [0, 0, 26], axis=-1) <= 27
    path = save(np.where(atrium & (at[..., 2] > 0), SCAR, labels), affine, "atrium.nii.gz")
    with pytest.raises(InputError, match=r"No scheme fits .*\(label 3\) touches the left .*\(1\)"):
        read_labels(path, "auto")


def test_scar_outside_the_wall_is_none(left, heart, save):
    affine, at, _ = left
    labels = heart.labels(at, {"rv_pool": 3, "lv_myocardium": WALL, "lv_pool": POOL})
    path = save(labels, affine, "both.nii.gz")
    assert read_labels(path, "auto").findings[0].message.endswith("scheme ukbb, as in mnms.")
    with pytest.raises(InputError, match=r"scar \(label 3 and 4\) lies outside .* wall \(2\)"):
        read_labels(path, "emidec")


@pytest.mark.slow
def test_real_right_pools_are_right_pools(shared_data):
    paths = sorted((shared_data / "stacks" / "labels").glob("*.nii.gz"))
    assert paths
    for path in paths[::8]:
        assert "scheme acdc" in read_labels(path, "auto").findings[0].message
