"""DICOM segmentations written by highdicom come back in the same place of the world."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pydicom
import pytest
from pydicom.pixels.utils import pack_bits
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    RLELossless,
)

from heartgen import read_labels, read_mask
from heartgen.errors import InputError
from tests.images.dicom_files import segmentation, slices

Writer = Callable[..., Path]


@pytest.fixture
def write_seg(tmp_path: Path) -> Writer:
    """Write named segments, each (nx, ny, nz), as one SEG file."""

    def write(segments: dict[str, np.ndarray], affine: np.ndarray, name: str = "m.dcm", **options):
        segmentation(segments, affine, **options).save_as(tmp_path / name)
        return tmp_path / name

    return write


def world(voxels: np.ndarray, affine: np.ndarray) -> np.ndarray:
    points = np.argwhere(voxels) @ affine[:3, :3].T + affine[:3, 3]
    return points[np.lexsort(np.round(points, 2).T)]


@pytest.mark.parametrize(
    "options",
    [{}, {"omit_empty_frames": False}, {"kind": "FRACTIONAL", "transfer_syntax_uid": RLELossless},
     {"kind": "LABELMAP"}],
)  # fmt: skip
def test_round_trip(options, cup, oblique, write_seg):
    mask = read_mask(write_seg({"LV": cup}, oblique, **options))
    np.testing.assert_allclose(world(mask.voxels, mask.affine), world(cup, oblique), atol=1e-6)


def test_segments_by_number_by_name_and_united(cup, oblique, write_seg):
    left, right = cup.copy(), cup.copy()
    left[13:], right[:10] = 0, 0  # they overlap
    path = write_seg({"LV myocardium": left, "RV wall": right}, oblique)
    both = read_mask(path)
    assert both.voxels.sum() == cup.sum()
    assert both.findings[0].message.endswith(
        "1 'LV myocardium' as lv_myocardium, 2 'RV wall' as rv_myocardium."
    )
    assert read_mask(path, label=2).voxels.sum() == right.sum()
    assert read_mask(path, label="lv MYOCARDIUM").voxels.sum() == left.sum()
    assert read_mask(path, label=[1, "RV wall"]).voxels.sum() == cup.sum()
    with pytest.raises(InputError, match="no segment 'apex' in the file, which holds 1 'LV"):
        read_mask(path, label="apex")


def test_the_segmentation_of_a_folder(cup, oblique, write_seg, tmp_path):
    for ds in slices(cup.shape, oblique)[:2]:
        ds.save_as(tmp_path / f"{ds.InstanceNumber}.dcm", enforce_file_format=True)
    (tmp_path / "notes.txt").write_text("not DICOM")
    with pytest.raises(InputError, match=r"no segmentation \(SEG\) .* only MR"):
        read_mask(tmp_path)
    write_seg({"LV": cup}, oblique, "seg")
    mask = read_mask(tmp_path)
    np.testing.assert_allclose(world(mask.voxels, mask.affine), world(cup, oblique), atol=1e-6)
    write_seg({"LV": cup}, oblique, "seg2")
    with pytest.raises(InputError, match=r"several segmentations .*: seg, seg2"):
        read_mask(tmp_path)


def test_an_image_is_no_segmentation(cup, oblique, tmp_path):
    slices(cup.shape, oblique)[0].save_as(tmp_path / "mr.dcm", enforce_file_format=True)
    with pytest.raises(InputError, match=r"no segmentation \(SEG\) and .* its modality is MR"):
        read_mask(tmp_path / "mr.dcm")


def test_probabilities_are_refused(cup, oblique, write_seg):
    fractions = cup * np.linspace(0.2, 0.9, cup.shape[2])
    with pytest.raises(InputError, match=r"not a mask, it holds .* different values"):
        read_mask(write_seg({"LV": fractions}, oblique, kind="FRACTIONAL"))


def test_slices_at_uneven_distances(cup, oblique, write_seg):
    path = write_seg({"LV": cup}, oblique)
    ds = pydicom.dcmread(path)
    frame = ds.PerFrameFunctionalGroupsSequence[3]
    position = np.array(frame.PlanePositionSequence[0].ImagePositionPatient)
    frame.PlanePositionSequence[0].ImagePositionPatient = [
        round(float(x), 10) for x in position + 0.3 * oblique[:3, 2]
    ]
    ds.save_as(path)
    with pytest.raises(InputError, match="not parallel and evenly spaced"):
        read_mask(path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"NumberOfFrames": 900000, "Rows": 60000}, "voxels, more than"),
        ({"Rows": 9000, "Columns": 9000}, "truncated, its header declares"),
        ({"Rows": 0}, "impossible size"),
        ({"NumberOfFrames": 3}, "declares 3 frames and places 11"),
        ({"SegmentSequence": None}, "no segment"),
    ],
)
def test_lying_headers(change, words, cup, oblique, write_seg):
    path = write_seg({"LV": cup}, oblique)
    ds = pydicom.dcmread(path)
    for key, value in change.items():
        setattr(ds, key, value)
    ds.save_as(path)
    with pytest.raises(InputError, match=words):
        read_mask(path)


def test_a_truncated_file(cup, oblique, write_seg):
    path = write_seg({"LV": cup}, oblique)
    path.write_bytes(path.read_bytes()[:1500])
    with pytest.raises(InputError, match="damaged"):
        read_mask(path)


def test_a_deflated_file(cup, oblique, write_seg):
    path = write_seg({"LV": cup}, oblique)
    ds = pydicom.dcmread(path)
    ds.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    ds.save_as(path)
    with pytest.raises(InputError, match="deflated"):
        read_mask(path)


def test_without_the_library(cup, oblique, write_seg, monkeypatch):
    path = write_seg({"LV": cup}, oblique)
    monkeypatch.setitem(sys.modules, "highdicom", None)
    with pytest.raises(InputError, match=r"pip install 'heartgen\[dicom\]'"):
        read_mask(path)


@pytest.mark.slow
def test_segments_are_labels(heart, write_seg, save):
    affine, at = heart.image(np.array([2.0, 2.0, 4.0]))
    labels = heart.labels(at)
    expected = read_labels(save(labels, affine, "heart.nrrd"), "acdc")
    named = {name: (labels == n).astype(np.uint8) for n, name in enumerate(["RV", "Wall", "LV"], 1)}
    path = write_seg(named, affine)
    for scheme in ("acdc", "auto", {"lv_myocardium": "wall", "rv_pool": "RV", "lv_pool": 3}):
        left = read_labels(path, scheme, ventricles="lv")
        np.testing.assert_allclose(
            world(left.voxels, left.affine), world(labels == 2, affine), atol=1e-4
        )
        # Where voxels are equally far from the pool, the rounding of DICOM's numbers decides.
        assert read_labels(path, scheme).volume == pytest.approx(expected.volume, rel=1e-3)
    with pytest.raises(InputError, match=r"no label 205 .*1 'RV' \(\d+ voxels\)"):
        read_labels(path, "mmwhs")
    unnamed = dict(zip(["one", "two", "three"], named.values(), strict=True))
    with pytest.raises(InputError, match=r"segments 1 'one', 2 'two'.*label=.*read_labels"):
        read_mask(write_seg(unnamed, affine))


def test_names_choose_the_scheme(heart, write_seg, save):
    affine, at = heart.image(np.array([2.0, 2.0, 4.0]))
    labels = heart.labels(at)
    expected = read_labels(save(labels, affine, "heart.nrrd"), "acdc")
    names = {"Myo": 2, "RV blood pool": 1, "LV cavity": 3}
    path = write_seg({name: (labels == n).astype(np.uint8) for name, n in names.items()}, affine)
    for mask in (read_mask(path), read_labels(path, "auto")):
        assert mask.volume == pytest.approx(expected.volume, rel=1e-3)
        assert mask.findings[0].message == (
            "The labels were read by their names: 1 'Myo' as lv_myocardium, 3 'LV cavity' as "
            "lv_pool, 2 'RV blood pool' as rv_pool."
        )
    swapped = {"LV wall": labels == 2, "RV cavity": labels == 3, "LV cavity": labels == 1}
    with pytest.raises(InputError, match=r"do not fit the scheme of the structures' names: the "):
        read_mask(write_seg({n: v.astype(np.uint8) for n, v in swapped.items()}, affine))


def test_segments_that_overlap(cup, write_seg):
    path = write_seg({"one": cup, "two": np.maximum(cup, np.roll(cup, 1, 0))}, np.eye(4))
    assert read_labels(path, {"lv_myocardium": "one"}).voxels.sum() == cup.sum()
    with pytest.raises(InputError, match="segments 'one' and 'two' overlap: say which are myo"):
        read_labels(path, "auto")


def test_a_pool_is_cut_out_of_the_outline_of_its_wall(heart, write_seg):
    affine, at = heart.image(np.array([2.0, 2.0, 4.0]))
    labels = heart.labels(at)
    outlines = {"LV epicardium": np.isin(labels, (2, 3)), "LV endocardium": labels == 3}
    mask = read_mask(write_seg({n: v.astype(np.uint8) for n, v in outlines.items()}, affine))
    assert mask.voxels.sum() == (labels == 2).sum()
    assert f"overlap in {(labels == 3).sum()} voxels" in mask.findings[1].message


def test_a_file_without_empty_frames_is_not_cut_off(cup, write_seg):
    ends = np.flatnonzero(cup.any(axis=(0, 1)))[[0, -1]]
    filled = cup[:, :, ends[0] : ends[1] + 1]
    assert read_mask(write_seg({"LV": filled}, np.eye(4))).findings == ()
    touching = cup[:, :, ends[0] :]  # with frames that are empty, so that all of the image is there
    mask = read_mask(write_seg({"LV": touching}, np.eye(4), omit_empty_frames=False))
    assert mask.findings[0].check == "border"


MOMENTS = {
    "in turn": lambda place, time: (time, place),
    "place by place": lambda place, time: (place, time),
}


def write_cine(write_seg, shapes, order: str, temporal: bool, **options) -> Path:
    """A segmentation with several frames in every place, as cines have them."""
    affine = np.diag([1.0, 1.0, 2.0, 1.0])
    files = [write_seg({"LV": shapes[0]}, affine, **options)]
    frames, pixels = [], []
    for time, shape in enumerate(shapes):
        ds = pydicom.dcmread(write_seg({"LV": shape}, affine, "moment.dcm", **options))
        for group, image in zip(ds.PerFrameFunctionalGroupsSequence, ds.pixel_array, strict=True):
            z = float(group.PlanePositionSequence[0].ImagePositionPatient[2])
            if temporal:
                group.FrameContentSequence[0].TemporalPositionIndex = time + 1
            frames.append((MOMENTS[order](z, time), len(frames), group))
            pixels.append(image)
    frames.sort(key=lambda frame: frame[:2])
    ds = pydicom.dcmread(files[0])
    ds.PerFrameFunctionalGroupsSequence = [group for *_, group in frames]
    ds.NumberOfFrames = len(frames)
    values = np.stack([pixels[at] for _, at, _ in frames])
    ds.PixelData = pack_bits(values.ravel()) if ds.BitsAllocated == 1 else values.tobytes()
    path = files[0].with_name("cine.dcm")
    ds.save_as(path)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "temporal"), [("in turn", False), ("in turn", True), ("place by place", True)]
)
def test_a_cine_has_frames_to_choose_from(order, temporal, heart, write_seg):
    _, at = heart.image(np.array([1.0, 1.0, 2.0]))
    radius, z = np.linalg.norm(at, axis=-1), at[..., 2]
    shapes = [
        ((radius <= outer) & (radius > outer - 8) & (z <= top)).astype(np.uint8)
        for outer, top in ((30, 0), (26, -4), (22, -2))  # fewer slices than the first
    ]
    path = write_cine(write_seg, shapes, order, temporal)
    with pytest.raises(InputError, match=r"is a cine.* 3 frames; choose .*ED or ES.*as frame="):
        read_mask(path)
    for number, shape in enumerate(shapes, start=1):
        assert read_mask(path, frame=number).voxels.sum() == shape.sum()
    assert read_mask(path, frame="ED").voxels.sum() == shapes[0].sum()
    assert read_mask(path, frame="es", label="lv").voxels.sum() == shapes[2].sum()


@pytest.mark.parametrize("kind", ["FRACTIONAL", "LABELMAP"])
def test_a_cine_of_another_kind(kind, cup, write_seg):
    other = np.where(np.indices(cup.shape)[0] < 14, cup, 0).astype(np.uint8)
    path = write_cine(write_seg, [cup, other], "in turn", temporal=True, kind=kind)
    for number, shape in enumerate([cup, other], start=1):
        assert read_mask(path, frame=number).voxels.sum() == shape.sum()


def test_a_cine_whose_frames_do_not_say_what_belongs_together(cup, write_seg):
    path = write_cine(write_seg, [cup, np.roll(cup, 3, 2)], "place by place", temporal=False)
    with pytest.raises(InputError, match=r"is a cine, .* does not say which of them belong"):
        read_mask(path, frame=1)
