"""Apical hole and square patch against the collapsed apex, on the same hearts.

usage: python -m benchmarks.apex MASK_OR_FOLDER... [--lod 3] [--elements 1x12x6] [--every 1]
                                 [--jobs N] [--score SCORE.py] [--output FILE]

Each heart is fitted with every kind of apex and the same numbers of elements; a square patch has
some fewer. With --score, an independent script ``SCORE.py`` with a function ``score(mask, [mesh])``
measures the meshes too; it knows of no hole, and counts the mask that was cut out as error. Prints
the medians of error, quality and shear, the worst of them, and in how many hearts a topology is
above the collapsed one. Rows go to FILE, see `benchmarks.rows.resume`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, get_args

import numpy as np

import heartgen
from benchmarks.hearts import independent
from benchmarks.rows import Row, case_of, column, elements_of, masks_of, resume, table
from heartgen.anatomy import analyze
from heartgen.options import Apex

KINDS: tuple[Any, ...] = get_args(Apex)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("masks", type=Path, nargs="+")
    parser.add_argument("--lod", type=int, default=3)
    parser.add_argument("--elements")
    parser.add_argument("--every", type=int, default=1, help="take one mask of so many")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--score", type=Path)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/apex.jsonl"))
    a = parser.parse_args()
    jobs = [
        {
            "mask": str(mask),
            "lod": a.lod,
            "elements": a.elements,
            "score": None if a.score is None else str(a.score),
        }
        for mask in masks_of(a.masks)[:: a.every]
    ]
    print(summary(resume(a.output, jobs, fit, a.jobs)))


def fit(job: Row) -> list[Row]:
    """One heart with every kind of apex: a row each."""
    mask = heartgen.read_mask(job["mask"])
    anatomy = analyze(mask)
    rows = []
    for apex in KINDS:
        result = heartgen.personalize(
            mask,
            lod=job["lod"],
            elements=elements_of(job["elements"]),
            apex=apex,
            anatomy=anatomy,
        )
        accuracy, quality = result.report.accuracy, result.report.quality
        row: Row = {
            "case": case_of(Path(job["mask"])),
            "apex": apex,
            "elements made": result.mesh.n_elements,
            "error": accuracy.mean,
            "max": accuracy.max,
            "quality": quality.mean,
            "quality_min": quality.min,
            "apical": quality.apical_row,
            "scaled": quality.scaled_mean,
            "scaled_min": quality.scaled_min,
            "template": result.report.unoptimized_quality,
            "valid": quality.valid,
            "success": result.report.success,
        }
        if job["score"] is not None:
            row |= independent(job["score"], job["mask"], result.mesh)
        rows.append(row)
    return rows


def summary(rows: list[Row]) -> str:
    """Tables of the results."""
    heads = (
        *("apex", "hearts", "elements", "error median", "worst", "Q median", "worst"),
        *("apical Q", "scaled", "worst", "before optimization", "valid", "success"),
    )
    lines = []
    for apex in KINDS:
        r = [row for row in rows if row["apex"] == apex]
        lines.append(
            (
                apex,
                len(r),
                f"{np.median(column(r, 'elements made')):.0f}",
                float(np.median(column(r, "error"))),
                float(column(r, "error").max()),
                float(np.median(column(r, "quality"))),
                float(column(r, "quality").min()),
                float(np.median(column(r, "apical"))),
                float(np.median(column(r, "scaled"))),
                float(column(r, "scaled").min()),
                float(np.median(column(r, "template"))),
                sum(row["valid"] for row in r),
                sum(row["success"] for row in r),
            )
        )
    out = [table(heads, lines)]
    if all("score_error_mean" in row for row in rows):
        out += ["", "by the independent script:", _scored(rows)]
    return "\n".join([*out, "", *_against_collapsed(rows)])


def _scored(rows: list[Row]) -> str:
    """What the independent script measured."""
    heads = ("apex", "error median", "worst", "Q median", "scaled", "folded points", "success")
    lines = []
    for apex in KINDS:
        r = [row for row in rows if row["apex"] == apex]
        error = column(r, "score_error_mean")
        lines.append(
            (
                apex,
                float(np.median(error)),
                float(error.max()),
                float(np.median(column(r, "score_quality_mean"))),
                float(np.median(column(r, "score_scaled_mean"))),
                sum(row["score_negative_points"] for row in r),
                sum(row["score_success"] for row in r),
            )
        )
    return table(heads, lines)


def _against_collapsed(rows: list[Row]) -> list[str]:
    """In how many hearts error and quality are better than with the collapsed apex."""
    base = {row["case"]: row for row in rows if row["apex"] == "collapsed"}
    lines = []
    for apex in KINDS[1:]:
        pairs = [(row, base[row["case"]]) for row in rows if row["apex"] == apex]
        closer = sum(row["error"] < other["error"] for row, other in pairs)
        better = sum(row["quality"] > other["quality"] for row, other in pairs)
        lines.append(
            f"{apex}: quality above the collapsed apex in {better} of {len(pairs)} hearts, "
            f"error below it in {closer}"
        )
    return lines


if __name__ == "__main__":
    main()
