"""Label maps of short-axis stacks: meshes, verdicts, cavity volumes, and a picture of each.

usage: python -m benchmarks.labels FOLDER... [--ventricles biv] [--lod 2] [--elements 2x9x8]
                                   [--every N] [--jobs N] [--sheets FOLDER] [--output FILE.jsonl]

Every label map (0 background, 1 right pool, 2 left wall, 3 left pool) is read by the scheme acdc
and meshed. The tables count what came of it, and compare the cavities of the mesh with the labels'
pools, area by area over the slices that the mesh spans: a slice counts if the mesh's wall encloses
its pool there. With --sheets, SHEETS/NAME.png shows every slice of the map with the mesh's wall
drawn over it, each slice where it was moved to: whether a mesh is right is seen there, and by no
figure.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import nibabel
import numpy as np
import scipy.ndimage as ndi
from matplotlib.colors import ListedColormap
from numpy.typing import NDArray

import heartgen
from benchmarks.rows import Row, case_of, elements_of, masks_of, resume, table
from heartgen.errors import HeartgenError
from heartgen.images.volume import LPS_FROM_RAS
from heartgen.mesh.rasterization import rasterize

Array = NDArray[np.float64]

POOLS = {"left": 3, "right": 1}
"""Labels of the pools."""

FINER = 2
"""Samples of the mesh for each pixel of a slice, along each axis."""

COLUMNS = 6
"""Slices side by side in a picture."""

LABEL_COLORS = ListedColormap(["white", "#b9d7ea", "#e7b7b0", "#f6e3b0"])
WALL_COLOR = "#0b3d91"

BOUNDS = {"left": (0.015, 0.06), "right": (0.04, 0.12)}
"""Deviation of the cavities that the median and 95 % of the maps are to undercut."""


def measure(job: Row) -> list[Row]:
    """Mesh a label map: a row of what came of it."""
    path = Path(job["path"])
    row: Row = {"case": case_of(path)}
    try:
        mask = heartgen.read_labels(path, "acdc", ventricles=job["ventricles"])
        result = heartgen.personalize(mask, lod=job["lod"], elements=elements_of(job["elements"]))
    except HeartgenError as error:
        return [row | {"outcome": "refused", "why": str(error)}]
    except Exception as error:
        return [row | {"outcome": "crashed", "why": repr(error)}]
    report = result.report
    walls, labels = slices_of(path, result)
    if job["sheets"] is not None:
        draw(Path(job["sheets"]), row["case"], walls, labels, report.success)
    return [
        row
        | {
            "outcome": outcome_of(path, result),
            "why": "; ".join(report.shortcomings),
            "both": result.anatomy.rv is not None,
            "valid": report.quality.valid,
            "error": report.accuracy.mean,
            "largest": report.accuracy.max,
            "quality": report.quality.mean,
            "least": report.quality.min,
            "wriggle": report.fairness.longitudinal_median,
            "wall": report.coverage.wall,
            "contour": report.coverage.contour,
            "slice contour": report.coverage.slice_contour,
            "stray": report.coverage.stray,
            "stray on": report.coverage.stray_on,
            "blood": report.coverage.blood,
            "seconds": sum(report.seconds.values()),
            "optimization": report.seconds.get("optimization", 0.0),
            "notes": "; ".join(f.message for f in report.findings),
            **{f"{name} cavity": cavity(walls, labels, code) for name, code in POOLS.items()},
        }
    ]


def outcome_of(path: Path, result: heartgen.Result) -> str:
    """What came of a map, one of `OUTCOMES`: its right ventricle tells where the base is."""
    if not result.report.success:
        return "told"
    image = nibabel.load(path)
    labels = np.asarray(image.dataobj).round().astype(np.uint8)
    base = (LPS_FROM_RAS * image.affine)[:3, 2] * (1 if is_upward(labels) else -1)
    return "success" if base @ result.anatomy.frame[:3, 2] > 0 else "turned over"


def is_upward(labels: NDArray[np.uint8]) -> bool:
    """Whether the base is at the upper end of a map's last axis: the right pool is wider there."""
    right = (labels == POOLS["right"]).sum(axis=(0, 1))
    shown = right[right > 0]
    return bool(shown[:2].sum() < shown[-2:].sum())


def slices_of(path: Path, result: heartgen.Result) -> tuple[NDArray[np.bool_], NDArray[np.uint8]]:
    """The mesh's wall, and the labels, in each slice of a map, on the same fine pixels.

    Slices that were moved are moved as they were; the mesh is cut by the middle of each slice.
    """
    image = nibabel.load(path)
    labels = np.asarray(image.dataobj).round().astype(np.uint8)
    affine = LPS_FROM_RAS * image.affine
    affine[:3, 3] += affine[:3, :2] @ np.full(2, 0.5 / FINER - 0.5)
    affine[:3, :2] /= FINER
    labels = labels.repeat(FINER, axis=0).repeat(FINER, axis=1)
    if result.anatomy.slices is None or not result.anatomy.slices.shifts.any():
        return rasterize(result.mesh, labels.shape, affine) > 0, labels
    walls = np.zeros(labels.shape, dtype=bool)
    for k in np.flatnonzero(labels.any(axis=(0, 1))):
        place = affine.copy()
        place[:3, 3] += k * affine[:3, 2]
        place[:3, 3] -= result.anatomy.slices.shift_at(place[None, :3, 3])[0]
        walls[..., k] = rasterize(result.mesh, (*labels.shape[:2], 1), place)[..., 0] > 0
    return walls, labels


def cavity(walls: NDArray[np.bool_], labels: NDArray[np.uint8], code: int) -> float | None:
    """Area of a cavity over that of its label, less one, in the slices where a wall encloses it.

    None if there is no such slice.
    """
    ours = theirs = 0
    for wall, label in zip(walls.transpose(2, 0, 1), labels.transpose(2, 0, 1), strict=True):
        pieces, count = ndi.label(ndi.binary_fill_holes(wall) & ~wall)
        most = np.bincount(pieces[label == code], minlength=count + 1)[1:]
        if not len(most) or not most.any():
            continue
        ours += int(np.sum(pieces == 1 + np.argmax(most)))
        theirs += int(np.sum(label == code))
    return ours / theirs - 1 if theirs else None


def draw(
    folder: Path,
    name: str,
    walls: NDArray[np.bool_],
    labels: NDArray[np.uint8],
    success: bool,
) -> None:
    """Picture of all slices, with the outline of the mesh's wall."""
    shown = np.flatnonzero(labels.any(axis=(0, 1)))
    rows, columns = (np.flatnonzero((labels > 0).any(axis=axis)) for axis in ((1, 2), (0, 2)))
    room = 4 * FINER
    box = tuple(slice(max(0, a[0] - room), a[-1] + room) for a in (rows, columns))
    lines = -(-len(shown) // COLUMNS)
    figure, axes = plt.subplots(
        lines, COLUMNS, figsize=(2 * COLUMNS, 2 * lines), squeeze=False, layout="constrained"
    )
    for ax in axes.flat:
        ax.set_axis_off()
    for ax, k in zip(axes.flat, shown, strict=False):
        ax.imshow(labels[..., k][box].T, cmap=LABEL_COLORS, vmin=0, vmax=3)
        if walls[..., k][box].any():
            ax.contour(walls[..., k][box].T, [0.5], colors=WALL_COLOR, linewidths=1.2)
        ax.set_title(str(k + 1), fontsize=7)
    figure.suptitle(f"{name}: {'success' if success else 'no success'}", fontsize=10)
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / f"{name}.png", dpi=60)
    plt.close(figure)


def summary(rows: Sequence[Row]) -> str:
    """Outcomes, figures, and cavities against labels."""
    meshed = [r for r in rows if "error" in r]
    count = {name: sum(r["outcome"] == name for r in rows) for name in OUTCOMES}
    lines = [
        f"{len(rows)} maps: " + ", ".join(f"{n} {name}" for name, n in count.items()),
        f"{sum(r['both'] for r in meshed)} as both ventricles, "
        f"{sum(r['valid'] for r in meshed)} valid",
        "",
    ]
    heads = ["figure", "median", "5 %", "95 %", "least", "most"]
    lines.append(table(heads, [[name, *spread(meshed, name)] for name in FIGURES]))
    lines.append("")
    cavities = []
    for name, bounds in BOUNDS.items():
        off = np.abs([r[f"{name} cavity"] for r in meshed if r[f"{name} cavity"] is not None])
        if len(off):
            found = (np.median(off), np.percentile(off, 95))
            reached = all(f <= b for f, b in zip(found, bounds, strict=True))
            cells = [f"{f:.2%} ({b:.1%})" for f, b in zip(found, bounds, strict=True)]
            cavities.append([name, len(off), *cells, f"{off.max():.1%}", reached])
    heads = ["cavity against its label", "maps", "median (goal)", "95 % (goal)", "most", "reached"]
    lines += [table(heads, cavities), ""]
    lines += [f"- {r['case']}: {r['outcome']}: {r['why']}" for r in rows if r["why"]]
    return "\n".join(lines)


OUTCOMES = ("success", "turned over", "told", "refused", "crashed")
"""A success by our rule; one whose apex lies at the base; a mesh that the report says is none; no
mesh, and a sentence; neither."""

FIGURES = ("error", "quality", "wriggle", "wall", "contour", "blood", "seconds", "optimization")


def spread(rows: Sequence[Row], name: str) -> list[float]:
    """Median, 5th and 95th percentile, least and most of a figure."""
    values = np.array([r[name] for r in rows], dtype=float)
    return [float(v) for v in np.percentile(values, (50, 5, 95, 0, 100))] if len(values) else []


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("maps", nargs="+", type=Path)
    parser.add_argument("--ventricles", default="biv", choices=["auto", "lv", "biv"])
    parser.add_argument("--lod", type=int, default=2)
    parser.add_argument("--elements", default="2x9x8")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/labels.jsonl"))
    a = parser.parse_args()
    common = {"ventricles": a.ventricles, "lod": a.lod, "elements": a.elements}
    common["sheets"] = None if a.sheets is None else str(a.sheets)
    jobs = [{"path": str(p)} | common for p in masks_of(a.maps)[:: a.every]]
    print(summary(resume(a.output, jobs, measure, a.jobs)))


if __name__ == "__main__":
    main()
