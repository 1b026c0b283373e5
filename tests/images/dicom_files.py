"""DICOM files as others write them: slices, segmentations, structure sets."""

from __future__ import annotations

import highdicom as hd
import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sr.codedict import codes
from pydicom.uid import ExplicitVRLittleEndian, MRImageStorage, generate_uid

RTSTRUCT = "1.2.840.10008.5.1.4.1.1.481.3"


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


def segmentation(
    segments: dict[str, np.ndarray], affine: np.ndarray, **options: object
) -> hd.seg.Segmentation:
    """Named segments, each (nx, ny, nz), as one SEG."""
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
    return hd.seg.Segmentation(
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


def structure_set(
    structures: dict[str, list[np.ndarray]], kind: str = "CLOSED_PLANAR"
) -> pydicom.Dataset:
    """Named structures, each a list of contours (n, 3), as a structure set."""
    ds = Dataset()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = RTSTRUCT
    ds.SOPInstanceUID = ds.file_meta.MediaStorageSOPInstanceUID = generate_uid()
    ds.Modality = "RTSTRUCT"
    ds.StructureSetROISequence, ds.ROIContourSequence = [], []
    for number, (name, contours) in enumerate(structures.items(), start=1):
        roi, drawn = Dataset(), Dataset()
        roi.ROINumber, roi.ROIName = number, name
        drawn.ReferencedROINumber, drawn.ContourSequence = number, []
        for points in contours:
            contour = Dataset()
            contour.ContourGeometricType = kind
            contour.NumberOfContourPoints = len(points)
            contour.ContourData = [f"{x:.6g}" for x in points.ravel()]
            drawn.ContourSequence.append(contour)
        ds.StructureSetROISequence.append(roi)
        ds.ROIContourSequence.append(drawn)
    return ds
