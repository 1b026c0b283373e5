"""DICOM structure sets (RTSTRUCT): contours in parallel planes, filled by the even-odd rule."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.images.checks import check_size, report
from heartgen.images.file_kinds import refuse
from heartgen.images.repairs import MARGIN
from heartgen.images.structures import Structures
from heartgen.images.volume import Coded, Volume

CLOSED = ("CLOSED_PLANAR", "CLOSEDPLANAR_XOR")
"""Kinds of contours that bound an area (DICOM PS3.3, C.8.8.6); points and open lines do not."""

PIXELS = 160
"""Pixels across the contours: 1 mm for the ventricles of a human heart."""

AROUND = 20
"""Pixels of background around the contours: a right ventricular wall that has to be built fits."""

SAME_PLANE = 0.02
"""Distance, as a share of that between planes, within which points lie in one plane."""

ON_PIXELS = 0.1
"""Pixels by which the steps of a contour that was traced along pixels may be off, by rounding."""

PARALLEL = 5e-3
"""Largest sine of the angle between planes that is still rounding."""


@dataclass(frozen=True, eq=False)
class _ContourGrid:
    """Voxels around contours: places of planes along their normal, and an affine."""

    axes: NDArray[np.float64]  # (3, 3), columns: in-plane i and j, normal k; LPS
    origin: NDArray[np.float64]  # (3,) mm along these axes
    spacing: NDArray[np.float64]  # (3,) mm
    shape: tuple[int, int, int]
    traced: bool = False  # contours run through the centers of border pixels

    @property
    def affine(self) -> NDArray[np.float64]:
        """Voxel index to world, mm, LPS."""
        affine = np.eye(4)
        affine[:3, :3] = self.axes * self.spacing
        affine[:3, 3] = self.axes @ self.origin
        return affine


def structure_set(dataset: Any, file: str) -> Structures:
    """Structures of a structure set.

    Parameters
    ----------
    dataset : pydicom.Dataset
        A whole RTSTRUCT.
    file : str
        Name of the file, for messages.

    Returns
    -------
    Structures
        Those that have closed contours.

    Raises
    ------
    InputError
        If there is none.
    """
    labels = {int(roi.ROINumber): roi for roi in dataset.get("StructureSetROISequence") or ()}
    contours: dict[int, list[NDArray[np.float64]]] = {}
    for item in dataset.get("ROIContourSequence") or ():
        closed = [
            np.asarray(contour.ContourData, dtype=np.float64).reshape(-1, 3)
            for contour in item.get("ContourSequence") or ()
            if str(contour.get("ContourGeometricType")) in CLOSED
            and len(contour.get("ContourData") or ()) >= 9
        ]
        number = int(item.ReferencedROINumber)
        if closed and number in labels:
            contours[number] = closed
    if not contours:
        refuse(file, "The structure set holds no closed contours: export the structures again.")
    names = {number: str(labels[number].get("ROIName") or "") for number in contours}

    def load(numbers: Sequence[int], _: int) -> Volume:
        return _rasterized({number: contours[number] for number in numbers}, file)

    return Structures(file, names, load, _codes(dataset), kind="structure")


def _codes(dataset: Any) -> dict[int, Coded]:
    """Codes of structures that have some."""
    codes = {}
    for item in dataset.get("RTROIObservationsSequence") or ():
        found = item.get("RTROIIdentificationCodeSequence") or ()
        if found:
            values = tuple(str(code.get("CodeValue")) for code in found)
            meanings = tuple(str(code.get("CodeMeaning") or "") for code in found)
            codes[int(item.ReferencedROINumber)] = Coded(values, meanings)
    return codes


def _rasterized(contours: Mapping[int, list[NDArray[np.float64]]], file: str) -> Volume:
    """Fill the contours (n, 3), mm, LPS, of each structure."""
    from skimage import draw

    fill: Any = draw.polygon2mask
    border: Any = draw.polygon_perimeter
    grid = _grid([contour for closed in contours.values() for contour in closed], file)
    inside = np.zeros((*grid.shape, len(contours)), dtype=bool)
    for layer, closed in enumerate(contours.values()):
        for contour in closed:
            index = (contour @ grid.axes - grid.origin) / grid.spacing
            plane = round(float(index[:, 2].mean()))
            # Where contours of a structure overlap, the inner one is a hole.
            inside[:, :, plane, layer] ^= fill(grid.shape[:2], index[:, :2])
        if grid.traced:
            for contour in closed:
                index = np.rint((contour @ grid.axes - grid.origin) / grid.spacing).astype(int)
                rows, columns = border(index[:, 0], index[:, 1], clip=False)
                inside[rows, columns, index[0, 2], layer] = True
    return Volume(inside, grid.affine)


def _grid(contours: list[NDArray[np.float64]], file: str) -> _ContourGrid:
    """Voxels around contours: the pixels they were traced along, or as fine ones."""
    axes, pixels = _axes(contours, file), None
    turned = _chain_axes(contours, axes[:, 2])
    if turned is not None:
        axes, pixels = turned
    local = [contour @ axes for contour in contours]
    heights = np.array([points[:, 2].mean() for points in local])
    levels, step = _planes(heights, file)
    flat = max(float(np.ptp(points[:, 2])) for points in local)
    if flat > SAME_PLANE * step:
        refuse(file, "The contours do not lie in parallel planes: export them slice by slice.")
    points = np.concatenate(local)
    low, high = points.min(axis=0), points.max(axis=0)
    pixel = min(step, float((high - low)[:2].max()) / PIXELS)
    spacing = np.array([*((pixel, pixel) if pixels is None else pixels), step])
    low[2], high[2] = levels[0], levels[-1]
    # Contours end where the structures do, not the image: background lies around them.
    margin = np.array([AROUND, AROUND, MARGIN])
    origin = low - margin * spacing
    counts = np.rint((high - low) / spacing).astype(int) + 1 + 2 * margin
    shape = (int(counts[0]), int(counts[1]), int(counts[2]))
    report(file, [check_size(shape)])
    return _ContourGrid(axes, origin, spacing, shape, traced=pixels is not None)


def _axes(contours: list[NDArray[np.float64]], file: str) -> NDArray[np.float64]:
    """Axes of the planes in which contours lie, (3, 3), the normal last."""
    areas = np.array([_area_vector(contour) for contour in contours])
    sizes = np.linalg.norm(areas, axis=1)
    if not np.isfinite(areas).all() or sizes.max() <= 0:
        refuse(file, "The contours enclose no area: export the structures again.")
    normal = areas[sizes.argmax()] / sizes.max()
    normal *= np.sign(normal[np.abs(normal).argmax()])
    large = sizes > sizes.max() / PIXELS  # a contour of three pixels has no certain normal
    tilt = np.linalg.norm(np.cross(areas[large], normal), axis=1) / sizes[large]
    if tilt.max() > PARALLEL:
        refuse(file, "The contours do not lie in parallel planes: export them slice by slice.")
    # The world's own axes, if the planes are those of a transverse, coronal or sagittal image.
    first = np.eye(3)[(int(np.abs(normal).argmax()) + 1) % 3]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(normal, first), normal])


def _chain_axes(
    contours: list[NDArray[np.float64]], normal: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Axes (3, 3) and size (2,), mm, of the pixels along whose centers contours were traced.

    OpenCV, and what writes its contours, goes from the center of a border pixel to that of the
    next, also diagonally; the area is half a pixel larger on all sides. None for other contours.
    """
    edges = np.concatenate([np.roll(contour, -1, axis=0) - contour for contour in contours])
    lengths = np.linalg.norm(edges, axis=1)
    edges, lengths = edges[lengths > 0], lengths[lengths > 0]
    first = edges[lengths.argmin()] / lengths.min()
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    axes = np.column_stack([first, np.cross(normal, first), normal])
    steps = np.abs(edges @ axes[:, :2])
    pixels = np.array([along[along > lengths.min() / 2].min(initial=np.inf) for along in steps.T])
    if not np.isfinite(pixels).all():
        return None
    steps /= pixels
    whole = np.rint(steps)
    diagonal = (whole > 0).all(axis=1)
    straight = not (whole[diagonal, 0] != whole[diagonal, 1]).any()
    if np.abs(steps - whole).max() > ON_PIXELS or not diagonal.any() or not straight:
        return None
    return axes, pixels


def _area_vector(contour: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normal of a closed contour (n, 3), as long as its area is large, mm^2."""
    spokes = contour - contour.mean(axis=0)
    return np.asarray(np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0) / 2)


def _planes(heights: NDArray[np.float64], file: str) -> tuple[NDArray[np.float64], float]:
    """Places of the planes along their normal and the distance of neighbors, mm."""
    levels = np.unique(np.round(heights, 3))
    gaps = np.diff(levels)
    gaps = gaps[gaps > SAME_PLANE * gaps.max(initial=0)]
    if not len(gaps):
        refuse(file, "The contours lie in a single plane: give those of all slices of the heart.")
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    steps = (levels - levels[0]) / step
    if np.abs(steps - np.rint(steps)).max() > len(levels) * SAME_PLANE:
        refuse(
            file,
            "The planes of the contours are not evenly spaced: export the structures as one "
            "volume, NIfTI or DICOM-SEG.",
        )
    return levels, step
