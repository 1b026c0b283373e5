"""One measurement of `benchmarks.speed`, in a process of its own.

usage: python -m benchmarks.timing JOB OUT.json

JOB is a row of `benchmarks.speed` as JSON; the process' environment sets the number of threads.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import pyvista
import SimpleITK as sitk  # noqa: N813 - its documented short name
from numpy.typing import NDArray

import heartgen
from benchmarks.peers import PEERS
from benchmarks.rows import Row, elements_of
from heartgen import samples
from heartgen.anatomy import Anatomy, analyze
from heartgen.images import Mask
from heartgen.mesh import HexMesh
from heartgen.mesh.quadrature import gauss_cube
from heartgen.mesh.surface_faces import tessellate
from heartgen.options import BIV_ELEMENTS, LV_ELEMENTS
from heartgen.registration import register
from heartgen.templates import biventricular_template, lv_template

Array = NDArray[np.float64]
Map = Callable[[Array], Array]
T = TypeVar("T")

MARGIN = 8
"""Voxels around template and patient."""

PIECES = 12
"""Flat pieces per face and direction that stand for a curved surface: they miss it by 0.01 mm."""

INSIDE = 4
"""Points per element and direction at which the local volume change of a map is taken."""

COARSE = 3.0
"""mm; voxels of the phantom whose fit loads the compiled kernels."""

MEGABYTE = 1024.0


def main() -> None:
    """Measure, and write the row."""
    job = json.loads(sys.argv[1])
    row = against_peers(job) if job["what"] == "peers" else cost(job)
    Path(sys.argv[2]).write_text(json.dumps(row))


def against_peers(job: Row) -> Row:
    """Time and overlap of one tool on one mask."""
    mask = heartgen.read_mask(job["mask"])
    analyze(samples.biv(COARSE).mask)
    analysis, anatomy = timed(lambda: analyze(mask), job["repeats"])
    template = template_of(anatomy)
    surface = triangles(template)
    patient, fixed = images(anatomy, surface, anatomy.voxel)
    row: Row = {"voxels": "x".join(str(n) for n in patient.GetSize())}
    shell, inside = np.asarray(surface.points, dtype=float), stencil(template, anatomy.voxel)
    points = np.concatenate([shell, inside.reshape(-1, 3)])
    if job["tool"] in PEERS:
        _, _, run = PEERS[job["tool"]]
        answers = [run(fixed, patient, points, job["threads"]) for _ in range(job["repeats"])]
        row["seconds"], moved = min(answers, key=lambda a: a[0])
    else:
        lod = int(job["tool"].split()[-1])
        ours(anatomy, template, 1)
        row["analysis"] = analysis
        row["seconds"], deform = timed(lambda: ours(anatomy, template, lod), job["repeats"])
        moved = deform(points)
    volume = volume_change(inside, moved[len(shell) :].reshape(inside.shape))
    return row | {
        "dice": dice(patient, moved[: len(shell)], surface),
        "start": dice(patient, shell, surface),
        "least_volume": float(volume.min()),
        "folded": float(np.mean(volume <= 0)),
    }


def ours(anatomy: Anatomy, template: HexMesh, lod: int) -> Map:
    """Our registration, as the pipeline calls it."""
    size = anatomy.voxel, anatomy.length
    return register(template, anatomy.surfaces, anatomy.frame, *size, lod)[-1]


def template_of(anatomy: Anatomy) -> HexMesh:
    """The pipeline's template, of the default elements."""
    if anatomy.rv is None:
        return lv_template(anatomy, LV_ELEMENTS)
    return biventricular_template(anatomy, BIV_ELEMENTS)


def stencil(mesh: HexMesh, voxel: float) -> Array:
    """Points (n, 3, 2, 3) half a voxel to both sides, along x, y, z, of points in the wall."""
    centers = mesh.evaluate(gauss_cube((INSIDE,) * 3)[0]).reshape(-1, 1, 1, 3)
    offsets = 0.5 * voxel * np.eye(3)[:, None] * np.array([-1.0, 1.0])[:, None]
    return np.asarray(centers + offsets)


def volume_change(before: Array, after: Array) -> Array:
    """Determinant (n,) of the difference quotient of a map at the points of a stencil."""
    length = (before[:, :, 1] - before[:, :, 0]).sum(-1)
    return np.asarray(np.linalg.det((after[:, :, 1] - after[:, :, 0]) / length[..., None]))


def triangles(mesh: HexMesh) -> pyvista.PolyData:
    """The closed surface of a mesh, in flat pieces."""
    points, quads = tessellate(mesh, mesh.topology.external, PIECES)
    return pyvista.PolyData.from_regular_faces(points, quads).triangulate()


def images(
    anatomy: Anatomy, surface: pyvista.PolyData, voxel: float
) -> tuple[sitk.Image, sitk.Image]:
    """Patient's myocardium and template, 0 and 1, on one isotropic grid along the mask's axes."""
    level = anatomy.myocardium
    axes = level.affine[:3, :3] / np.linalg.norm(level.affine[:3, :3], axis=0)
    inside = np.argwhere(level.values < 0) @ level.affine[:3, :3].T + level.affine[:3, 3]
    places = np.concatenate([inside, surface.points]) @ axes
    low = places.min(0) - MARGIN * voxel
    size = np.ceil((places.max(0) + MARGIN * voxel - low) / voxel).astype(int) + 1
    grid = sitk.Image([int(n) for n in size], sitk.sitkFloat32)
    grid.SetSpacing([voxel] * 3)
    grid.SetOrigin((axes @ low).tolist())
    grid.SetDirection(axes.ravel().tolist())
    index = np.stack(np.meshgrid(*(np.arange(n) for n in size), indexing="ij"), -1).reshape(-1, 3)
    value, _ = level.sample((index * voxel + low) @ axes.T)
    return filled(grid, (value < 0).reshape(size)), filled(grid, rasterized(grid, surface))


def filled(grid: sitk.Image, voxels: NDArray[np.bool_]) -> sitk.Image:
    """Image of voxels (nx, ny, nz) on a grid."""
    out = sitk.GetImageFromArray(voxels.transpose(2, 1, 0).astype(np.float32))
    out.CopyInformation(grid)
    return out


def rasterized(grid: sitk.Image, surface: pyvista.PolyData) -> NDArray[np.bool_]:
    """Which voxels (nx, ny, nz) of a grid have their center inside a closed surface."""
    axes = np.array(grid.GetDirection()).reshape(3, 3)
    here = surface.copy()
    here.points = (np.asarray(surface.points, float) - grid.GetOrigin()) @ axes / grid.GetSpacing()
    reference = pyvista.ImageData(dimensions=grid.GetSize())
    mask = here.voxelize_binary_mask(reference_volume=reference)
    return np.asarray(mask["mask"]).reshape(grid.GetSize(), order="F") > 0


def dice(patient: sitk.Image, points: Array, surface: pyvista.PolyData) -> float:
    """Overlap of the patient's voxels with those inside the surface at other points (n, 3)."""
    moved = surface.copy()
    moved.points = points
    a = sitk.GetArrayFromImage(patient).transpose(2, 1, 0) > 0
    b = rasterized(patient, moved)
    return float(2 * np.sum(a & b) / (a.sum() + b.sum()))


def cost(job: Row) -> Row:
    """Time of the steps and peak memory of one fit of a phantom."""
    if "size" in job:
        make, elements = samples.biv, BIV_ELEMENTS
        mask = in_cube(make, job["size"])
    else:
        elements = elements_of(job["elements"])
        make = samples.lifelike_lv if elements[0] == 1 else samples.biv
        mask = make(1.0).mask
    heartgen.personalize(make(COARSE).mask, lod=1)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MEGABYTE
    whole, result = timed(
        lambda: heartgen.personalize(mask, lod=job["lod"], elements=elements), job["repeats"]
    )
    return {
        "seconds": result.report.seconds,
        "whole": whole,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MEGABYTE,
        "memory_before": before,
        "elements": int(np.prod(elements)),
        "voxels": int(mask.voxels.size),
        "error": result.report.accuracy.mean,
        "quality": result.report.quality.mean,
        "valid": result.report.quality.valid,
    }


def in_cube(make: Callable[[float], samples.Sample], size: int) -> Mask:
    """A phantom whose image has `size` voxels along each axis, as fine as that allows."""
    spacing = 1.0
    extent = max(make(spacing).mask.voxels.shape) * spacing
    spacing = extent / size
    while max((mask := make(spacing).mask).voxels.shape) > size:
        spacing *= max(mask.voxels.shape) / size
    room = [size - n for n in mask.voxels.shape]
    voxels = np.pad(mask.voxels, [(r // 2, r - r // 2) for r in room])
    affine = mask.affine.copy()
    affine[:3, 3] -= affine[:3, :3] @ [r // 2 for r in room]
    return Mask(voxels, affine, f"{mask.name} {size}^3")


def timed(call: Callable[[], T], repeats: int) -> tuple[float, T]:
    """Shortest time of the repeats, and the last result."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - start)
    return min(times), result


if __name__ == "__main__":
    main()
