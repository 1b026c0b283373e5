"""A label map is read by its scheme, whatever its numbers, or refused with a clear sentence."""

from __future__ import annotations

import nibabel as nib
import numpy as np
import pytest
import scipy.ndimage as ndi
import SimpleITK

from heartgen import read_labels, read_mask
from heartgen.errors import InputError, sentence
from heartgen.images import Scheme
from heartgen.images.mask import BESIDE
from heartgen.saved_result import keep_mask

PARTS = ("rv_pool", "lv_myocardium", "lv_pool")
NUMBERS = {
    "acdc": (1, 2, 3),
    "mmwhs": (600, 205, 500),
    "ukbb": (3, 2, 1),
    "mnms": (3, 2, 1),
    "totalsegmentator": (5, 1, 3),
}
IN_PLANE = ndi.generate_binary_structure(3, 1) & np.array([False, True, False])
FREE = {"rv_pool": 1, "lv_myocardium": 2, "lv_pool": 3}


@pytest.fixture(scope="module")
def image(heart):
    """Affine and ACDC labels of a heart."""
    affine, at = heart.image(np.array([2.0, 2.0, 2.0]))
    labels = heart.labels(at)
    labels.setflags(write=False)
    return affine, labels


@pytest.fixture
def acdc(image, save):
    """File of a heart labeled as in ACDC."""
    affine, labels = image
    return save(labels, affine, "heart.nii.gz")


def relabeled(labels, numbers):
    """ACDC labels with other numbers for right pool, left wall and left pool."""
    return np.array([0, *numbers], dtype=np.int16)[labels]


@pytest.mark.slow
@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("given", ["name", "auto", "mapping", "Scheme"])
def test_every_scheme_gives_the_same_heart(name, given, image, save, acdc):
    affine, labels = image
    roles = dict(zip(PARTS, NUMBERS[name], strict=True))
    scheme = {
        "name": name.upper(),
        "auto": "auto",
        "mapping": roles,
        "Scheme": Scheme("own", **{role: (number,) for role, number in roles.items()}),
    }[given]
    mask = read_labels(save(relabeled(labels, NUMBERS[name]), affine, "other.nrrd"), scheme)
    expected = read_labels(acdc, "acdc")
    np.testing.assert_array_equal(mask.voxels, expected.voxels)
    np.testing.assert_allclose(mask.affine, expected.affine, atol=1e-4)
    told = [f.message for f in mask.findings if f.check == "labels"]
    known = {"ukbb": "ukbb, as in mnms", "mnms": "ukbb, as in mnms"}.get(name, name)
    assert told == ([f"The labels were read by the scheme {known}."] if given == "auto" else [])


@pytest.mark.parametrize("off", [2e-8, -1e-4, 9e-4])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_labels_that_come_back_from_floating_point(kind, off, image, save, acdc):
    affine, labels = image
    path = save((labels * (1 + off / 3)).astype(kind), affine, "floats.nii.gz")
    for scheme in ("acdc", "auto"):
        expected = read_labels(acdc, scheme)
        np.testing.assert_array_equal(read_labels(path, scheme).voxels, expected.voxels)
    assert read_mask(path, label=2).voxels.sum() == (labels == 2).sum()
    with pytest.raises(InputError, match=r"holds the labels 1 \(\d+ voxels\), 2 "):
        read_mask(path)


def test_labels_scaled_into_bytes(image, acdc, tmp_path):
    affine, labels = image
    byte = nib.Nifti1Image(labels.astype(np.uint8), np.diag([-1, -1, 1, 1]) @ affine)
    floats = nib.Nifti1Image(byte.get_fdata(), byte.affine, byte.header)
    nib.save(floats, tmp_path / "scaled.nii.gz")
    mask = read_labels(tmp_path / "scaled.nii.gz", "acdc")
    np.testing.assert_array_equal(mask.voxels, read_labels(acdc, "acdc").voxels)


def test_labels_farther_from_whole_numbers_are_none(image, save):
    affine, labels = image
    path = save(labels * np.float32(1.01), affine, "gray.nii.gz")
    with pytest.raises(InputError, match="not a mask"):
        read_labels(path, "acdc")


def test_a_mask_that_is_kept_knows_the_pool_beside_it(acdc, tmp_path):
    alone = read_labels(acdc, "acdc", ventricles="lv")
    assert (alone.blood == BESIDE).any()
    kept = read_labels(keep_mask(alone, tmp_path), "heartgen")
    np.testing.assert_array_equal(kept.voxels, alone.voxels)
    np.testing.assert_array_equal(kept.blood, alone.blood)


def test_which_ventricles(image, save, acdc):
    affine, labels = image
    left = read_mask(acdc, label=2)
    alone = read_labels(acdc, "acdc", ventricles="lv")
    np.testing.assert_array_equal(alone.voxels, left.voxels)
    assert alone.findings == left.findings
    both = read_labels(acdc, "acdc")
    assert both.voxels.sum() > left.voxels.sum()
    assert [f.check for f in both.findings] == ["rv wall"]
    np.testing.assert_array_equal(read_labels(acdc, "acdc", ventricles="biv").voxels, both.voxels)
    no_right = save(np.where(labels == 1, 0, labels), affine, "left.nii")
    for scheme in ("acdc", "auto", {"lv_myocardium": 2, "lv_pool": 3}, {"lv_myocardium": 2}):
        np.testing.assert_array_equal(read_labels(no_right, scheme).voxels, left.voxels)
    with pytest.raises(InputError, match=r"No right ventricle is labeled .* 2 \(\d+ voxels\)"):
        read_labels(no_right, "acdc", ventricles="biv")


def test_labeled_right_wall_is_taken_as_it_is(image, save, acdc):
    affine, labels = image
    both = read_labels(acdc, "acdc", rv_wall=5.0)
    origin = np.rint(np.linalg.solve(affine, both.affine[:, 3]))[:3].astype(int)
    assert not origin.any()
    walled = np.where(both.voxels & (labels == 0), 8, labels)
    path = save(walled, affine, "walled.nii")
    mask = read_labels(path, FREE | {"rv_myocardium": 8})
    np.testing.assert_array_equal(mask.voxels, both.voxels)
    assert mask.findings == ()


def test_what_was_seen_before_a_refusal_is_told_with_it(image, save):
    affine, labels = image
    few = np.where((labels == 2) & (np.indices(labels.shape)[2] // 2 != 5), 0, labels)
    few[2, 2, 2] = 14
    with pytest.raises(InputError, match="so it is flat") as refusal:
        read_labels(save(few, affine, "few.nii"), "acdc", ventricles="lv")
    (note,) = refusal.value.__notes__
    assert note.startswith("Seen before: The scheme acdc does not know the labels 14")
    assert sentence(refusal.value).endswith(note)


def test_thickness_is_taken(acdc):
    walls = [read_labels(acdc, "acdc", rv_wall=t).voxels.sum() for t in (2.0, 3.0, 4.0)]
    alone = read_labels(acdc, "acdc", ventricles="lv").voxels.sum()
    thin, _, thick = (walls - alone) / (walls[1] - alone)
    assert thin == pytest.approx(2 / 3, rel=0.05)
    assert thick == pytest.approx(4 / 3, rel=0.05)


def test_labels_by_name_and_several_for_a_role(image, acdc, tmp_path):
    _, labels = image
    halves = np.where((labels == 2) & (np.indices(labels.shape)[1] < 20), 9, labels)
    picture = SimpleITK.GetImageFromArray(halves.T)
    picture.SetSpacing([2.0] * 3)
    for n, (value, name) in enumerate([("1", "RV"), ("2", "Wall"), ("9", "Front"), ("3", "LV")]):
        picture.SetMetaData(f"Segment{n}_LabelValue", value)
        picture.SetMetaData(f"Segment{n}_Name", name)
    SimpleITK.WriteImage(picture, str(tmp_path / "named.seg.nrrd"))
    roles = {"lv_myocardium": ["wall", 9], "lv_pool": "LV", "rv_pool": "rv"}
    mask = read_labels(tmp_path / "named.seg.nrrd", roles)
    np.testing.assert_array_equal(mask.voxels, read_labels(acdc, "acdc").voxels)


def test_labels_unknown_to_the_scheme_are_background_and_told(image, save, acdc):
    affine, labels = image
    more = labels.copy()
    more[2:5, 2:5, 2:5] = 14
    mask = read_labels(save(more, affine, "more.nii"), "acdc")
    np.testing.assert_array_equal(mask.voxels, read_labels(acdc, "acdc").voxels)
    assert mask.findings[0].check == "labels"
    assert "does not know the labels 14 (27 voxels)" in mask.findings[0].message
    free = read_labels(save(more, affine, "more.nii"), FREE)
    assert "labels" not in [f.check for f in free.findings]


@pytest.mark.parametrize(
    ("scheme", "words"),
    [
        ("mmwhs", r"no label 205 in the image, which holds 1 \(\d+ voxels\), 2 .*scheme="),
        ("ukbb", r"do not fit the scheme ukbb.*label 2\) encloses .*\(3\) and not .*\(1\)"),
        ("ACDC2", "scheme of labels 'ACDC2' is unknown: give one of acdc, mmwhs, ukbb, mnms"),
        ({"lv_myocardium": 1, "rv_pool": 9}, "no label 9 in the image"),
        ({"lv_wall": 2}, "no role lv_wall: give some of lv_myocardium, lv_pool, rv_pool, rv_myo"),
        ({"lv_pool": 3}, "label of lv_myocardium is missing"),
        ({}, "label of lv_myocardium is missing"),
        ({"lv_myocardium": []}, "no label given for lv_myocardium"),
        ({"lv_myocardium": "septum"}, "no label 'septum' for lv_myocardium"),
        ({"lv_myocardium": [2, 3], "lv_pool": 3}, "Label 3 is given twice"),
        ({"lv_myocardium": 2, "lv_pool": 1, "rv_pool": 3}, "do not fit the scheme given"),
    ],
)
def test_scheme_that_does_not_fit_is_told_in_a_sentence(scheme, words, acdc):
    with pytest.raises(InputError, match=words) as refusal:
        read_labels(acdc, scheme)
    message = str(refusal.value)
    assert message.startswith("heart.nii.gz: ")
    assert message.endswith(".")
    assert "\n" not in message


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"ventricles": "rv"}, "'auto', 'lv' or 'biv'"),
        ({"rv_wall": 0}, "wall of 0 mm is not possible"),
        ({"rv_wall": -3}, "wall of -3 mm is not possible"),
        ({"rv_wall": np.nan}, "wall of nan mm is not possible"),
        ({"rv_wall": 300}, "from 0.05 to 30"),
    ],
)
def test_choices_that_there_are_not(options, words, acdc):
    with pytest.raises(InputError, match=words):
        read_labels(acdc, "acdc", **options)


def test_auto_names_labels_and_schemes_if_none_fits(image, save):
    affine, labels = image
    binary = save((labels == 2).astype(np.int16), affine, "binary.nii")
    strange = save(np.where(labels == 3, 17, labels), affine, "strange.nii")
    for path, found in [(binary, r"1 \(\d+ voxels\)"), (strange, r"1 .*, 2 .*, 17 \(\d+ voxels\)")]:
        with pytest.raises(
            InputError, match=f"No scheme fits the labels {found}: give one of acdc"
        ):
            read_labels(path, "auto")


def spoilt(labels, kind):
    """Label maps that are none."""
    return {
        "frames": np.stack([labels] * 3, axis=-1),
        "empty": 0 * labels,
        "gray": labels * np.linspace(0.1, 0.9, labels.shape[2], dtype=np.float32),
        "nan": np.where(np.indices(labels.shape)[0] == 0, np.nan, labels.astype(np.float32)),
    }[kind]


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("frames", "3 frames"),
        ("empty", "holds only 0"),
        ("gray", "not a mask.*different values"),
        ("nan", "NaN or infinity"),
    ],
)
@pytest.mark.parametrize("scheme", ["acdc", "auto"])
def test_what_is_no_label_map_is_refused(kind, words, scheme, image, tmp_path):
    if (kind, scheme) == ("empty", "auto"):
        words = "No scheme fits the labels only 0"
    nib.save(nib.Nifti1Image(spoilt(image[1], kind), image[0]), tmp_path / "m.nii")
    with pytest.raises(InputError, match=words):
        read_labels(tmp_path / "m.nii", scheme)


def test_sheared_label_map_is_refused_for_that(image, save, tmp_path):
    affine = image[0].copy()
    affine[0, 2] = 0.5
    sheared = nib.Nifti1Image(image[1], affine)
    sheared.set_qform(None, 0)
    nib.save(sheared, tmp_path / "m.nii")
    with pytest.raises(InputError, match="sheared") as refusal:
        read_labels(tmp_path / "m.nii", "acdc")
    assert "problems" not in str(refusal.value)


def test_mask_without_a_word_about_its_labels_is_pointed_to_them(acdc):
    with pytest.raises(InputError, match=r"what they all are with read_labels"):
        read_mask(acdc)


@pytest.mark.slow
def test_real_stacks_are_read_by_name_and_by_themselves(shared_data):
    paths = sorted((shared_data / "stacks" / "labels").glob("*.nii.gz"))
    assert len(paths) >= 40
    for path in paths:
        mask = read_labels(path, "auto")
        checks = [finding.check for finding in mask.findings]
        assert checks[:2] == ["labels", "rv wall"]
        assert "scheme acdc" in mask.findings[0].message
        assert "components" not in checks  # all of the wall hangs together
        image = nib.load(path)
        corner = np.array([[-1.0, -1.0, 1.0]]) * image.affine[:3, 3]
        first = np.rint(mask.to_index(corner)[0]).astype(int)
        there = tuple(slice(i, i + n) for i, n in zip(first, image.shape, strict=True))
        labels, wall = np.asarray(image.dataobj), mask.voxels[there]
        assert wall[labels == 2].all()
        assert not wall[(labels == 1) | (labels == 3)].any()
        around = ndi.binary_dilation(labels == 1, IN_PLANE) & (labels == 0)
        assert wall[around & (labels == 2).any(axis=(0, 1))].mean() > 0.98  # but for openings
    np.testing.assert_array_equal(mask.voxels, read_labels(path, "acdc").voxels)
