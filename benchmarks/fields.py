"""Fields and clinical indices against what is known.

usage: python -m benchmarks.fields [LABELS_FOLDER_OR_FILE...] [--ventricles auto|lv] [--jobs N]

- fibers on the ellipsoid of Land et al. (2015) against their rule;
- cavity, wall and thickness of ellipsoids: meshed exactly, and fitted to voxels in any orientation;
- the share of the wall that each AHA segment has;
- if label maps (ACDC) are given, the left cavity of the mesh against the label's volume.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import nibabel as nib
import numpy as np

import heartgen
from benchmarks.rows import Row, case_of, masks_of, resume, table
from benchmarks.solids import LAND, cut_volume, ellipsoid, land_fibers
from heartgen import samples
from heartgen.errors import HeartgenError
from heartgen.fields import SEGMENTS, FiberRule, aha_segment, fiber_frames, heart_axes
from heartgen.fields.indices import ML, clinical_indices, left_thickness
from heartgen.images.schemes import scheme_from_text
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.quadrature import gauss_cube

ELEMENTS = ((1, 12, 6), (2, 12, 8), (1, 24, 12))
CUP = (22.0, 60.0, 10.0, 20.0)
"""Sizes of the ellipsoid that is fitted, mm, see `benchmarks.solids.ellipsoid`."""
ORIENTATIONS = 4
VOXELS = 1.0
"""mm."""
LIMIT = 0.06
"""Deviation of the cavity from the label's volume that is to be undercut by half of the cases."""
POOL = 3
"""Label of the left pool in ACDC."""


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("labels", type=Path, nargs="*")
    parser.add_argument("--ventricles", choices=("auto", "lv"), default="auto")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/fields.jsonl"))
    a = parser.parse_args()
    if a.labels:
        jobs = [{"labels": str(p), "ventricles": a.ventricles} for p in masks_of(a.labels)]
        print(of_labels(resume(a.output, jobs, measure, a.jobs)))
        return
    known()


def known() -> None:
    """Print the tables of what is known exactly."""
    print("fibers against the rule of Land et al. (2015), problem 3, degrees\n")
    heads = ["elements", "mean", "99 %", "max", "mean in the apical row"]
    print(table(heads, map(fibers, ELEMENTS)))
    print("\nellipsoid: deviation from the analytic value\n")
    print(table(["mesh", "cavity", "wall", "thickness"], solids()))
    print("\nshare of each AHA segment: degrees around its level, volume of the wall\n")
    print(table(["segment", "name", "degrees", "volume"], segments()))


def fibers(elements: tuple[int, int, int]) -> list[object]:
    """Angles between the fibers of a mesh and the rule."""
    mesh = ellipsoid(*LAND, elements)
    found = fiber_frames(mesh, FiberRule(helix=(90.0, -90.0)))[..., 0].reshape(-1, 3)
    points = mesh.lagrange_points().reshape(-1, 3)
    cosine = np.einsum("nx,nx->n", found, land_fibers(points))
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    apical = np.repeat(mesh.topology.index[:, 2] == 0, 64)
    beside = apical & (np.hypot(points[:, 0], points[:, 1]) > 0.01)  # at the pole there is none
    away = angle[~apical]
    name = "x".join(map(str, elements))
    p99 = float(np.percentile(away, 99))
    return [name, float(away.mean()), p99, float(away.max()), float(angle[beside].mean())]


def solids() -> Iterator[list[object]]:
    """Relative deviations of volumes and mean thickness of ellipsoids."""
    radius, length, wall, top = CUP
    cavity = cut_volume(radius, length, top)
    outer = cut_volume(radius + wall, length + wall, top)
    truth = samples.ideal_cup(2.0).truth
    across = true_thickness(truth)
    for elements in ELEMENTS[:2]:
        mesh = ellipsoid(*CUP, elements)
        yield deviations(mesh, "x".join(map(str, elements)), cavity, outer - cavity, across)
    for seed in range(ORIENTATIONS):
        sample = samples.ideal_cup(VOXELS, rotation=seed)
        mesh = heartgen.personalize(sample.mask).mesh
        name = f"fitted at {VOXELS:g} mm, orientation {seed}"
        yield deviations(mesh, name, cavity, outer - cavity, across)


def true_thickness(truth: samples.Truth, n: int = 4000) -> float:
    """Mean distance from endo- to epicardium over the endocardium of a phantom, mm."""
    points, weights = truth.surface(n, "endo")
    return float(np.average(truth.distance(points, "epi"), weights=weights))


def deviations(mesh: HexMesh, name: str, cavity: float, wall: float, across: float) -> list[object]:
    """Deviations of the indices of a mesh from the truth in mm^3 and mm."""
    found = clinical_indices(mesh)
    _, thickness, area = left_thickness(mesh)
    ratios = (
        found.lv_cavity_volume * ML / cavity,
        found.myocardial_volume * ML / wall,
        float(np.average(thickness, weights=area)) / across,
    )
    return [name, *(f"{ratio - 1:+.3%}" for ratio in ratios)]


def segments() -> Iterator[list[object]]:
    """Extent of the segments of an ellipsoid."""
    mesh = ellipsoid(*CUP, ELEMENTS[0])
    axes = heart_axes(mesh)
    xi, weights = gauss_cube((12, 12, 6))
    parts = (np.abs(determinants(mesh, xi)) * weights).ravel()
    points = mesh.evaluate(xi).reshape(-1, 3)
    segment, level = aha_segment(points, axes), axes.level(points)
    turn = np.linspace(-np.pi, np.pi, 3600, endpoint=False) + np.radians(0.05)
    for number, name in SEGMENTS.items():
        height = float(np.mean(level[segment == number]))
        ring = np.cos(turn)[:, None] * axes.septal + np.sin(turn)[:, None] * axes.anterior
        ring = axes.apex + height * axes.length * axes.longitudinal + ring
        degrees = 360 * float(np.mean(aha_segment(ring, axes) == number))
        share = float(parts[segment == number].sum() / parts.sum())
        yield [number, name, f"{degrees:.1f}", f"{share:.1%}"]


def measure(job: Row) -> list[Row]:
    """Left cavity of the mesh of a label map, and the volume of the label, ml."""
    path = Path(job["labels"])
    scheme = scheme_from_text("acdc")
    image = nib.load(path)
    labels = np.asarray(image.dataobj) == POOL
    label = float(labels.sum() * abs(np.linalg.det(image.affine[:3, :3])) / ML)
    row: Row = {"case": case_of(path), "label": label}
    try:
        mask = heartgen.read_labels(path, scheme, ventricles=job["ventricles"])
        result = heartgen.personalize(mask)
    except HeartgenError as error:
        return [row | {"failure": str(error)}]
    found = result.report.indices
    truncation = result.report.measurements.truncation
    return [row | {"mesh": found.lv_cavity_volume, "truncation": truncation}]


def of_labels(rows: list[Row]) -> str:
    """Table of the volumes, and the median deviation."""
    done = [row for row in rows if "mesh" in row]
    lines = [[r["case"], r["label"], r["mesh"], f"{r['mesh'] / r['label'] - 1:+.1%}"] for r in done]
    lines = [[*line, r["truncation"] or "none"] for line, r in zip(lines, done, strict=True)]
    heads = ["case", "label (ml)", "mesh (ml)", "deviation", "truncation (mm)"]
    share = np.array([abs(r["mesh"] / r["label"] - 1) for r in done])
    failed = [f"- {r['case']}: {r['failure']}" for r in rows if "failure" in r]
    verdict = "reached" if len(share) and np.median(share) < LIMIT else "not reached"
    summary = (
        f"{len(done)} of {len(rows)} meshed; median deviation {np.median(share):.1%}, "
        f"90 % below {np.percentile(share, 90):.1%} ({LIMIT:.0%} {verdict})"
    )
    return "\n".join([table(heads, lines), "", summary, *failed])


if __name__ == "__main__":
    main()
