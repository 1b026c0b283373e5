"""DICOM segmentations written by highdicom come back in the same place of the world."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import highdicom as hd
import numpy as np
import pydicom
import pytest
from pydicom.dataset import FileMetaDataset
from pydicom.sr.codedict import codes
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRLittleEndian,
    MRImageStorage,
    RLELossless,
    generate_uid,
)

from heartgen import read_labels, read_mask
from heartgen.errors import InputError

Writer = Callable[..., Path]


def slices(shape: tuple[int, int, int], affine: np.ndarray) -> list[pydicom.Dataset]:
    """MR slices k = 0, 1, ... of an image of (columns i, rows j, slices k) placed by an affine."""
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    study, series, frame = (generate_uid() for _ in range(3))
    datasets = []
    for k in range(shape[2]):
        ds = pydicom.Dataset()
        ds.file_meta = FileMetaDataset()
        ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = MRImageStorage
        ds.SOPInstanceUID = ds.file_meta.MediaStorageSOPInstanceUID = generate_uid()
        ds.StudyInstanceUID, ds.SeriesInstanceUID, ds.FrameOfReferenceUID = study, series, frame
        ds.Modality = "MR"
        ds.PatientID, ds.PatientName = "cup", "Cup^Coffee"
        for key in ("PatientBirthDate", "PatientSex", "AccessionNumber", "StudyID"):
            setattr(ds, key, "")
        for key in (
            "StudyDate",
            "StudyTime",
            "ReferringPhysicianName",
            "PositionReferenceIndicator",
        ):
            setattr(ds, key, "")
        ds.SeriesNumber, ds.InstanceNumber = 1, k + 1
        ds.Columns, ds.Rows = shape[:2]
        ds.PixelSpacing = [float(spacing[1]), float(spacing[0])]
        ds.SliceThickness = float(spacing[2])
        row, column = affine[:3, 0] / spacing[0], affine[:3, 1] / spacing[1]
        ds.ImageOrientationPatient = [round(float(x), 14) for x in (*row, *column)]
        position = affine[:3, 3] + k * affine[:3, 2]
        ds.ImagePositionPatient = [round(float(x), 10) for x in position]
        ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, "MONOCHROME2"
        ds.BitsAllocated = ds.BitsStored = 16
        ds.HighBit, ds.PixelRepresentation = 15, 0
        ds.PixelData = np.zeros((ds.Rows, ds.Columns), np.uint16).tobytes()
        datasets.append(ds)
    return datasets


@pytest.fixture
def write_seg(tmp_path: Path) -> Writer:
    """Write named segments, each (nx, ny, nz), as one SEG file."""

    def write(segments: dict[str, np.ndarray], affine: np.ndarray, name: str = "m.dcm", **options):
        descriptions = [
            hd.seg.SegmentDescription(
                segment_number=number,
                segment_label=label,
                segmented_property_category=codes.SCT.AnatomicalStructure,
                segmented_property_type=codes.SCT.Heart,
                algorithm_type=hd.seg.SegmentAlgorithmTypeValues.MANUAL,
            )
            for number, label in enumerate(segments, start=1)
        ]
        shape = next(iter(segments.values())).shape
        pixels = np.stack([s.transpose(2, 1, 0) for s in segments.values()], axis=-1)
        seg = hd.seg.Segmentation(
            source_images=slices(shape, affine),
            pixel_array=pixels,
            segmentation_type=options.pop("kind", "BINARY"),
            segment_descriptions=descriptions,
            series_instance_uid=generate_uid(),
            series_number=2,
            sop_instance_uid=generate_uid(),
            instance_number=1,
            manufacturer="heartgen",
            manufacturer_model_name="tests",
            software_versions="1",
            device_serial_number="1",
            **options,
        )
        seg.save_as(tmp_path / name)
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
    with pytest.raises(InputError, match="segments 1 'LV myocardium', 2 'RV wall': pass"):
        read_mask(path)
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
    with pytest.raises(InputError, match=r"no segmentation \(SEG\), its modality is MR"):
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
    with pytest.raises(InputError, match=r"segments 1 'RV', 2 'Wall'.*read_labels or --labels"):
        read_mask(path)


def test_segments_that_overlap_are_no_labels(cup, write_seg):
    path = write_seg({"wall": cup, "heart": np.maximum(cup, np.roll(cup, 1, 0))}, np.eye(4))
    with pytest.raises(InputError, match="Segments of the file overlap"):
        read_labels(path, {"lv_myocardium": "wall"})
