"""Mesh convergence: error against the number of elements; and quality against Gauss points.

usage: python -m benchmarks.convergence elements [MASK...] [--spacings 1.0,0.5] [--quality 0.01]
       python -m benchmarks.convergence gauss [MASK...]
each with [--phantoms cup,lifelike,biv] [--lod K] [--jobs N] [--output FILE.jsonl]; by default LoD 5
for the elements and LoD 3 for the Gauss points.

elements: the smooth phantoms, whose true surface is known, and masks if any are given, are fitted
with more and more elements. The quality dial is low, so that the fit and not the quality weight
decides. The error of a phantom is the mean distance of the mesh's surface from the true one, side
surfaces only (the base is flat); that to the mask, which voxels bound from below, stands beside it.
The order is that of h, one over the number of longitudinal elements (all directions in the surface
are refined alike), between two meshes. Bicubic surfaces can reach order 4, until the voxels decide.

gauss: the mean and least Jacobian ratio of the same meshes by 2 to 6 Gauss points per direction,
and by so many (32) that they come close to the true extremes. The paper's metric has 4.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import heartgen
from benchmarks.rows import Row, case_of, elements_of, masks_of, resume, table
from heartgen import samples
from heartgen.errors import HeartgenError
from heartgen.images import Mask
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.surface_faces import sample_faces

PHANTOMS = {"cup": samples.ideal_cup, "lifelike": samples.lifelike_lv, "biv": samples.biv}

ELEMENTS = {
    1: ("1x4x2", "1x6x3", "1x8x4", "1x12x6", "1x16x8", "1x24x12"),
    2: ("2x6x4", "2x9x6", "2x12x8", "2x18x12", "2x24x16"),
}
"""By number of ventricles; each refines the directions in the surface alike."""

SIDES = ("lv_endo", "rv_endo", "epi")
"""Side surfaces of the mesh and of the truth."""

FIGURES = ("truth", "error")
"""Errors whose order is shown."""

SAMPLES = 8
"""Samples per face and direction."""

POINTS = (2, 3, 4, 5, 6, 32)


def main() -> None:
    """Fit and tabulate."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=("elements", "gauss"))
    parser.add_argument("masks", type=Path, nargs="*")
    parser.add_argument("--phantoms", default=",".join(PHANTOMS))
    parser.add_argument("--spacings", default="1.0,0.5")
    parser.add_argument("--quality", type=float, default=0.01)
    parser.add_argument("--lod", type=int)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/convergence.jsonl"))
    a = parser.parse_args()
    masks = [{"mask": str(p)} for p in masks_of(a.masks)]
    phantoms = list(filter(None, a.phantoms.split(",")))
    if a.what == "gauss":
        hearts = [{"phantom": name, "spacing": 1.0} for name in phantoms]
        common = {"what": a.what, "lod": a.lod or 3}
        print(
            gauss_table(resume(a.output, [common | h for h in hearts + masks], by_points, a.jobs))
        )
        return
    spacings = [float(s) for s in a.spacings.split(",")]
    hearts = [{"phantom": name, "spacing": s} for name in phantoms for s in spacings]
    common = {"what": a.what, "lod": a.lod or 5, "quality": a.quality}
    jobs = [common | h for h in hearts + masks]
    print(elements_table(resume(a.output, jobs, by_elements, a.jobs)))


def by_elements(job: Row) -> list[Row]:
    """Errors of one heart with more and more elements."""
    mask, truth = heart_of(job)
    try:
        first = heartgen.personalize(mask, lod=1, optimize=False)
    except HeartgenError as error:
        return [{"case": mask.name, "elements": "", "failure": str(error)}]
    rows = []
    for elements in ELEMENTS[1 if first.anatomy.rv is None else 2]:
        row: Row = {"case": mask.name, "elements": elements}
        try:
            result = heartgen.personalize(
                mask, lod=job["lod"], elements=elements_of(elements), quality=job["quality"]
            )
        except HeartgenError as error:
            rows.append(row | {"failure": str(error)})
            continue
        rows.append(
            row
            | {
                "truth": None if truth is None else against_truth(result.mesh, truth),
                "error": result.report.accuracy.mean,
                "quality": result.report.quality.mean,
                "valid": result.report.quality.valid,
            }
        )
    return rows


def by_points(job: Row) -> list[Row]:
    """Quality of the meshes of one heart by the number of Gauss points."""
    mask, _ = heart_of(job)
    try:
        result = heartgen.personalize(mask, lod=job["lod"])
    except HeartgenError as error:
        return [{"case": mask.name, "failure": str(error)}]
    meshes = {"template": result.template, "enhanced": result.enhanced, "optimized": result.mesh}
    rows = []
    for name, mesh in meshes.items():
        ratios = {n: jacobian_ratio(mesh, n) for n in POINTS}
        means = {f"mean {n}": float(r.mean()) for n, r in ratios.items()}
        least = {f"min {n}": float(r.min()) for n, r in ratios.items()}
        rows.append({"case": mask.name, "mesh": name} | means | least)
    return rows


def heart_of(job: Row) -> tuple[Mask, samples.Truth | None]:
    """Mask of a job, and its truth if it is a phantom."""
    if "mask" in job:
        mask = heartgen.read_mask(job["mask"])
        return Mask(mask.voxels, mask.affine, case_of(Path(job["mask"])), mask.findings), None
    sample = PHANTOMS[job["phantom"]](job["spacing"])
    name = f"{job['phantom']} {job['spacing']:g} mm"
    return Mask(sample.mask.voxels, sample.mask.affine, name), sample.truth


def against_truth(mesh: HexMesh, truth: samples.Truth) -> float:
    """Mean distance of the side surfaces of a mesh from the true ones, mm."""
    distances, areas = [], []
    for name in mesh.topology.surfaces:
        if name in SIDES:
            points, _, area = sample_faces(mesh, mesh.topology.surfaces[name], SAMPLES)
            distances.append(truth.distance(points, name))
            areas.append(area)
    return float(np.average(np.concatenate(distances), weights=np.concatenate(areas)))


def elements_table(rows: Sequence[Row]) -> str:
    """Errors and observed orders."""
    heads = ["heart", "elements", "to the truth (mm)", "order", "to the mask (mm)", "order"]
    lines = []
    before: Row = {"case": None}
    for r in rows:
        if "failure" in r:
            lines.append([r["case"], r["elements"], r["failure"], *[""] * 5])
            continue
        orders = [order(before, r, f) if before["case"] == r["case"] else "" for f in FIGURES]
        truth = "" if r["truth"] is None else f"{r['truth']:.4f}"
        figures = [truth, orders[0], f"{r['error']:.4f}", orders[1], r["quality"], r["valid"]]
        lines.append([r["case"], r["elements"], *figures])
        before = r
    return table([*heads, "Q", "valid"], lines)


def order(coarse: Row, fine: Row, figure: str) -> str:
    """Observed order of convergence between two meshes."""
    if coarse[figure] is None:
        return ""
    finer = np.log(int(fine["elements"].split("x")[2]) / int(coarse["elements"].split("x")[2]))
    return f"{np.log(coarse[figure] / fine[figure]) / finer:.1f}"


def gauss_table(rows: Sequence[Row]) -> str:
    """Mean (least) Jacobian ratio by the number of points per direction."""
    lines = []
    for r in rows:
        if "failure" in r:
            lines.append([r["case"], r["failure"], *[""] * len(POINTS)])
        else:
            figures = [f"{r[f'mean {n}']:.3f} ({r[f'min {n}']:.3f})" for n in POINTS]
            lines.append([r["case"], r["mesh"], *figures])
    return table(["heart", "mesh", *(f"Q by {n}" for n in POINTS)], lines)


if __name__ == "__main__":
    main()
