"""Label maps that are spoiled as scanners and observers spoil them: what comes of each.

usage: python -m benchmarks.mutations FOLDER... [--every 10] [--ventricles biv lv] [--jobs N]
                                      [--sheets FOLDER] [--output FILE.jsonl]

Every label map (0 background, 1 right pool, 2 left wall, 3 left pool) is read by the scheme acdc
and meshed, as it is and once for each mutation. The table counts successes (by our rule: see
`heartgen.report`), meshes that the report says are none, refusals and crashes. Cavities are
compared with those of the map as it was; with --sheets, SHEETS/NAME.png shows the mesh over that
map.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import nibabel
import numpy as np
from numpy.typing import NDArray

import heartgen
from benchmarks.labels import OUTCOMES, POOLS, cavity, draw, is_upward, outcome_of, slices_of
from benchmarks.rows import Row, resume, table
from heartgen.errors import HeartgenError

Labels = NDArray[np.uint8]

WALL, LEFT = 2, 3

SHIFT = 8.0
"""By which one slice is moved, mm."""

ELEMENTS = {"lv": (1, 12, 6), "biv": (2, 9, 8)}
LEVELS = {"lv": 1, "biv": 2}


def walled(labels: Labels) -> NDArray[np.intp]:
    """Slices (n,) that show a wall, along the last axis."""
    return np.flatnonzero((labels == WALL).any(axis=(0, 1)))


def without(labels: Labels, index: int) -> Labels:
    """Without one of the slices."""
    labels[..., walled(labels)[index]] = 0
    return labels


def filled(labels: Labels, index: int) -> Labels:
    """With the left pool of one slice taken for wall."""
    plane = labels[..., walled(labels)[index]]
    plane[plane == LEFT] = WALL
    return labels


def open_top(labels: Labels, base: int) -> Labels:
    """With a C-shaped wall in the basal slice."""
    plane = labels[..., walled(labels)[base]]
    center = np.argwhere(plane == LEFT).mean(0) if (plane == LEFT).any() else (0, 0)
    i, j = np.indices(plane.shape)
    plane[(plane == WALL) & (i > center[0]) & (np.abs(j - center[1]) < (i - center[0]) / 2)] = 0
    return labels


def with_gaps(labels: Labels, base: int) -> Labels:
    """With a gap of one pixel in the left wall of every other slice."""
    for k in walled(labels)[::2]:
        plane = labels[..., k]
        row = int(np.argwhere(plane == WALL)[:, 0].mean())
        right = np.argwhere(plane[row] == WALL)
        plane[row, right[right > plane.shape[1] // 2 if base < 0 else right >= 0]] = 0
    return labels


def shifted(labels: Labels, pixels: int) -> Labels:
    """With a slice in the middle moved."""
    k = walled(labels)[len(walled(labels)) // 2]
    labels[..., k] = np.roll(labels[..., k], pixels, axis=0)
    return labels


def halved(labels: Labels) -> Labels:
    """With every other slice alone."""
    keep = np.zeros(labels.shape[2], dtype=bool)
    keep[walled(labels)[::2]] = True
    labels[..., ~keep] = 0
    return labels


def mutations(labels: Labels, pixel: float) -> dict[str, Callable[[Labels], Labels]]:
    """Mutations by name, of a map whose right ventricle tells where the base is."""
    base, apex = (-1, 0) if is_upward(labels) else (0, -1)
    return {
        "as it is": lambda x: x,
        "without the apical slice": lambda x: without(x, apex),
        "without the basal slice": lambda x: without(x, base),
        "apical slice filled": lambda x: filled(x, apex),
        "basal slice filled": lambda x: filled(x, base),
        "basal slice C-shaped": lambda x: open_top(x, base),
        "gaps of a pixel": lambda x: with_gaps(x, base),
        "a slice shifted": lambda x: shifted(x, round(SHIFT / pixel)),
        "every other slice": halved,
    }


def measure(job: Row) -> list[Row]:
    """Mesh a mutated map: a row of what came of it."""
    try:
        return [job | _meshed(job)]
    except HeartgenError as error:
        return [job | {"outcome": "refused", "why": str(error)}]
    except Exception as error:
        return [job | {"outcome": "crashed", "why": repr(error)}]


def _meshed(job: Row) -> Row:
    """Figures of the mesh of a mutated map."""
    image = nibabel.load(job["path"])
    given = np.asarray(image.dataobj).astype(np.uint8)
    pixel = float(np.linalg.norm(image.affine[:3, 0]))
    changed = mutations(given, pixel)[job["mutation"]](given.copy())
    kind = job["ventricles"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, Path(job["path"]).name)
        nibabel.save(nibabel.Nifti1Image(changed, image.affine), path)
        mask = heartgen.read_labels(path, "acdc", ventricles=kind)
        result = heartgen.personalize(mask, lod=LEVELS[kind], elements=ELEMENTS[kind])
    report = result.report
    walls, labels = slices_of(Path(job["path"]), result)
    if job["sheets"] is not None:
        name = f"{job['case']} {kind} {job['mutation']}"
        draw(Path(job["sheets"]), name, walls, labels, report.success)
    return {
        "outcome": outcome_of(Path(job["path"]), result),
        "why": "; ".join(report.shortcomings),
        "error": report.accuracy.mean,
        "largest": report.accuracy.max,
        "quality": report.quality.mean,
        "slice contour": report.coverage.slice_contour,
        "stray": report.coverage.stray,
        "stray on": report.coverage.stray_on,
        "left cavity": cavity(walls, labels, POOLS["left"]),
        "right cavity": cavity(walls, labels, POOLS["right"]),
        "seconds": sum(report.seconds.values()),
        "notes": "; ".join(f.message for f in report.findings),
    }


def summary(rows: Sequence[Row]) -> str:
    """Outcomes by mutation and kind."""
    heads = ["ventricles", "mutation", "maps", *OUTCOMES, "error (mm)"]
    lines = []
    for kind in ELEMENTS:
        for name in dict.fromkeys(r["mutation"] for r in rows if r["ventricles"] == kind):
            mine = [r for r in rows if (r["ventricles"], r["mutation"]) == (kind, name)]
            count = [sum(r["outcome"] == outcome for r in mine) for outcome in OUTCOMES]
            errors = [r["error"] for r in mine if "error" in r]
            error = float(np.median(errors)) if errors else "none"
            lines.append([kind, name, len(mine), *count, error])
    told = [
        f"- {r['case']} {r['ventricles']}, {r['mutation']}: {r['outcome']}: {r['why']}"
        for r in rows
        if r["outcome"] != "success"
    ]
    return "\n".join([table(heads, lines), "", *told])


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--every", type=int, default=10)
    parser.add_argument("--ventricles", nargs="+", default=list(ELEMENTS), choices=list(ELEMENTS))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--sheets", type=Path)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/mutations.jsonl"))
    given = parser.parse_args()
    paths = sorted(p for f in given.folders for p in f.glob("*.nii.gz"))[:: given.every]
    sheets = None if given.sheets is None else str(given.sheets)
    names = mutations(np.ones((3, 3, 3), dtype=np.uint8), 1.0)
    jobs = [
        {
            "case": p.name.removesuffix(".nii.gz"),
            "path": str(p),
            "mutation": m,
            "ventricles": v,
            "sheets": sheets,
        }
        for p in paths
        for v in given.ventricles
        for m in names
    ]
    print(summary(resume(given.output, jobs, measure, given.jobs)))


if __name__ == "__main__":
    main()
