"""Structure sets: contours become the shapes they bound, in the place they are in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pydicom
import pytest
import scipy.ndimage as ndi

from heartgen import read_labels, read_mask
from heartgen.errors import InputError
from tests.images.dicom_files import structure_set

RADII = {"Myo": (28.0, 20.0), "LV": (20.0,), "BODY": (80.0,)}  # mm; the second bounds a hole
HEIGHTS = np.arange(0.0, 60.0, 4.0)


def circle(radius: float, z: float, points: int = 200) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z + 0 * angle])


def cup(name: str) -> list[np.ndarray]:
    """Contours of a tube, closed below."""
    outer, *inner = RADII[name]
    contours = [circle(outer, z) for z in HEIGHTS[(name == "LV") * 3 :]]
    return contours + [circle(r, z) for r in inner for z in HEIGHTS[3:]]


@pytest.fixture
def write(tmp_path: Path):
    """Write structures, each a list of contours (n, 3), as a structure set."""

    def write(structures: dict[str, list[np.ndarray]], kind: str = "CLOSED_PLANAR") -> Path:
        structure_set(structures, kind).save_as(tmp_path / "rt.dcm", enforce_file_format=True)
        return tmp_path / "rt.dcm"

    return write


def rotation() -> np.ndarray:
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


@pytest.mark.slow
@pytest.mark.parametrize("turn", [np.eye(3), np.eye(3)[[1, 2, 0]], rotation()], ids=str)
def test_contours_bound_what_they_bound(turn, write):
    place = np.array([30.0, -80.0, 200.0])
    path = write({name: [c @ turn.T + place for c in cup(name)] for name in RADII})
    mask = read_mask(path)
    assert "1 'Myo' as lv_myocardium, 2 'LV' as lv_pool" in mask.findings[0].message
    assert [finding.check for finding in mask.findings] == ["labels"]
    points = (mask.to_world(np.argwhere(mask.voxels).astype(float)) - place) @ turn
    radius = np.hypot(points[:, 0], points[:, 1])
    assert 27 < radius.max() < 28.5
    wall = points[:, 2] > HEIGHTS[3] - 1
    assert 19.5 < radius[wall].min() < 21
    expected = np.pi * 4 * (28**2 * len(HEIGHTS) - 20**2 * (len(HEIGHTS) - 3))
    assert mask.volume == pytest.approx(expected, rel=0.02)
    assert read_mask(path, label="LV").volume == pytest.approx(np.pi * 400 * 4 * 12, rel=0.02)


def test_a_structure_by_itself(write):
    path = write({"Heart": cup("Myo")})
    assert read_mask(path).findings == ()
    with pytest.raises(InputError, match="no structure 'LV' in the file, which holds 1 'Heart'"):
        read_mask(path, label="LV")


def test_contours_along_pixels_have_the_pixels(shared_data):
    """OpenCV draws contours through the centers of the outermost pixels, also around holes."""
    folder = shared_data / "foreign_seg"
    contours = folder / "rt_utils" / "bivme_patient1_frame0_heart_RTSTRUCT.dcm"
    voxels = folder / "highdicom" / "bivme_patient1_frame0_heart_BINARY.dcm"
    for label in (1, 2, 3):
        drawn, given = (read_mask(path, label=label) for path in (contours, voxels))
        assert drawn.voxels.sum() == given.voxels.sum()
        ends = [m.to_world(np.argwhere(m.voxels).astype(float)) for m in (drawn, given)]
        for end in (np.min, np.max):
            np.testing.assert_allclose(*(end(points, axis=0) for points in ends), atol=0.01)
    both = [read_labels(path, "auto").volume for path in (contours, voxels)]
    assert both[0] == pytest.approx(both[1], rel=0.01)


def chain(shape: np.ndarray, z: float, pixel: float) -> np.ndarray:
    """Pixels of a round line, in their order around its center, mm."""
    at = np.argwhere(shape) - 20.0
    at = at[np.argsort(np.arctan2(at[:, 1], at[:, 0]))]
    return np.column_stack([pixel * at, np.full(len(at), z)])


@pytest.mark.parametrize("turn", [np.eye(3), rotation()], ids=str)
def test_a_ring_traced_along_its_outermost_pixels(turn, write):
    radius = np.hypot(*np.indices((41, 41)) - 20.0)
    disc, hole = radius <= 18, radius <= 10
    lines = (disc & ~ndi.binary_erosion(disc), ndi.binary_dilation(hole) & ~hole)
    contours = [chain(line, z, 1.5) @ turn.T for line in lines for z in HEIGHTS]
    mask = read_mask(write({"Myo": contours}))
    assert mask.voxels.sum() == len(HEIGHTS) * (disc & ~hole).sum()
    np.testing.assert_allclose(np.sort(mask.spacing), [1.5, 1.5, 4.0], rtol=1e-3)


@pytest.mark.parametrize(
    ("structures", "words"),
    [
        ({}, "holds no closed contours"),
        ({"Myo": [circle(20, 0, 2)]}, "holds no closed contours"),
        ({"Myo": [circle(20, 0)]}, "single plane"),
        ({"Myo": [circle(0, z) for z in HEIGHTS]}, "enclose no area"),
        ({"Myo": [circle(20, z) for z in (0, 4, 9, 15)]}, "not evenly spaced"),
        ({"Myo": [circle(20, 0), circle(20, 4) @ rotation().T]}, "do not lie in parallel planes"),
        ({"Myo": [circle(20, z) * 1e6 for z in HEIGHTS]}, "not possible for a heart|sensible"),
        ({"LV": cup("LV"), "RV": cup("LV")}, "structures 1 'LV', 2 'RV': pass the myocardium's"),
    ],
)
def test_what_bounds_no_heart_is_a_sentence(structures, words, write):
    with pytest.raises(InputError, match=words) as refusal:
        read_mask(write(structures))
    assert str(refusal.value).startswith("rt.dcm: ")
    assert "\n" not in str(refusal.value)


def test_points_are_no_contours(write):
    with pytest.raises(InputError, match="holds no closed contours"):
        read_mask(write({"Myo": cup("Myo")}, kind="POINT"))


def test_missing_parts(write):
    path = write({"Myo": cup("Myo")})
    for key in ("StructureSetROISequence", "ROIContourSequence"):
        ds = pydicom.dcmread(path)
        delattr(ds, key)
        ds.save_as(path.with_name("less.dcm"))
        with pytest.raises(InputError, match="holds no closed contours"):
            read_mask(path.with_name("less.dcm"))


def test_the_structure_set_of_a_folder(write):
    assert read_mask(write({"Heart": cup("Myo")}).parent).voxels.any()
