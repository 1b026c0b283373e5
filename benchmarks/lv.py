"""Fit the left ventricle in every mask of a folder at all levels of detail, and tabulate.

usage: python -m benchmarks.lv FOLDER [--elements 1x12x6] [--lod 5] [--score SCORE.py] [-o OUT]

Level of detail k is the state after k registration passes, so one run at level 5 gives all five
(tests check that the meshes are the same as those of separate runs); as in `personalize`, a level
whose mesh folds is replaced by the one below it, which column "reached" tells. With --score, an
independent script ``SCORE.py`` with a function ``score(mask, [mesh])`` measures the meshes of
levels 1 and 5 too. Writes OUT.csv (a line per case and level) and prints the table of the medians,
the successes and certified meshes, the worst ten cases, and how error and quality move.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import multiprocessing
import os
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import heartgen
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.enhancement import enhance
from heartgen.errors import HeartgenError
from heartgen.formats import write_mesh
from heartgen.mesh.validity import certify
from heartgen.warping import warp

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
SCORED_LEVELS = (1, 5)
FALL = 1.02
"""Largest allowed ratio of the error of one level to that of the level before."""


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--elements", default="1x12x6")
    parser.add_argument("--lod", type=int, default=5)
    parser.add_argument("--score", type=Path)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("-o", "--out", type=Path, default=Path("benchmarks/results/lv"))
    a = parser.parse_args()
    cases = sorted(
        p for p in a.folder.iterdir() if p.name.endswith((".nii.gz", ".nii", ".nrrd", ".mha"))
    )
    jobs = [(str(p), a.elements, a.lod, str(a.score) if a.score else None) for p in cases]
    rows: list[dict[str, Any]] = []
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # for the workers, which import anew
    with multiprocessing.get_context("spawn").Pool(a.processes) as pool:
        for found in pool.imap_unordered(fit, jobs):
            rows.extend(found)
            print(
                f"\r{len({r['case'] for r in rows})}/{len(jobs)}",
                end="",
                file=sys.stderr,
                flush=True,
            )
    rows.sort(key=lambda r: (r["case"], r["lod"]))
    a.out.parent.mkdir(parents=True, exist_ok=True)
    with open(f"{a.out}.csv", "w", newline="") as f:
        writer = csv.DictWriter(f, fieldnames=list(dict.fromkeys(k for r in rows for k in r)))
        writer.writeheader()
        writer.writerows(rows)
    print(f"\n{summary(rows, len(cases), a.lod)}")


def fit(job: tuple[str, str, int, str | None]) -> list[dict[str, Any]]:
    """One case at all levels: a row each."""
    path, elements, lod, score = job
    case = Path(path).name.split(".")[0]
    shape = tuple(int(n) for n in elements.split("x"))
    start = time.perf_counter()
    try:
        result = heartgen.personalize(heartgen.read_mask(path), lod=lod, elements=shape)
    except HeartgenError as error:
        return [{"case": case, "lod": k, "failure": str(error)} for k in range(1, lod + 1)]
    seconds = time.perf_counter() - start
    rows = []
    mesh, warped, reached = None, None, 0
    for k, deformation in enumerate(result.deformations, start=1):
        candidate = warp(result.template, deformation)
        if mesh is None or certify(enhance(candidate)).all_valid:
            warped, mesh, reached = candidate, enhance(candidate), k
        accuracy = assess_accuracy(mesh, result.anatomy.myocardium, result.anatomy.wall_volume)
        quality = assess_quality(mesh)
        row = {
            "case": case,
            "lod": k,
            "error": accuracy.mean,
            "p95": accuracy.p95,
            "max": accuracy.max,
            "reverse": accuracy.reverse_mean,
            "quality": quality.mean,
            "quality_min": quality.min,
            "scaled": quality.scaled_mean,
            "raw_quality": assess_quality(warped).mean,
            "valid": quality.valid,
            "success": accuracy.mean < result.report.voxel_diagonal and quality.mean > 0.33,
            "dice": accuracy.dice,
            "reached": reached,
            "links": len(deformation.maps),
            "seconds": seconds,
        }
        if score and k in SCORED_LEVELS:
            row |= independent(score, path, mesh)
        rows.append(row)
    return rows


def independent(script: str, mask: str, mesh: heartgen.HexMesh) -> dict[str, float]:
    """Scores of a script that shares no code with heartgen."""
    spec = importlib.util.spec_from_file_location("independent_score", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with tempfile.TemporaryDirectory() as folder:
        write_mesh(mesh, Path(folder) / "mesh.vtu")
        s = module.score(mask, [str(Path(folder) / "mesh.vtu")])
    names = ("error_mean", "error_p95", "error_max", "quality_mean", "quality_min", "scaled_mean")
    return {f"score_{n}": s[n] for n in (*names, "negative_points", "success")}


def summary(rows: list[dict[str, Any]], cases: int, lod: int) -> str:
    """Markdown tables of the results."""
    done = [r for r in rows if "error" in r]
    failed = [r for r in rows if "failure" in r and r["lod"] == 1]
    lines = [
        f"{cases} cases; success at level 1: {sum(r['success'] for r in done if r['lod'] == 1)}; "
        f"certified valid at level 1: {sum(r['valid'] for r in done if r['lod'] == 1)}",
        "",
        "| LoD | error median | 95 % of cases | worst | Q median | worst "
        "| scaled | raw Q | valid | success |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for k in range(1, lod + 1):
        r = [x for x in done if x["lod"] == k]
        e, q = np.array([x["error"] for x in r]), np.array([x["quality"] for x in r])
        lines.append(
            f"| {k} | {np.median(e):.3f} | {np.percentile(e, 95):.3f} | {e.max():.3f} "
            f"| {np.median(q):.3f} | {q.min():.3f} | {np.median([x['scaled'] for x in r]):.3f} "
            f"| {np.median([x['raw_quality'] for x in r]):.3f} "
            f"| {sum(x['valid'] for x in r)} | {sum(x['success'] for x in r)} |"
        )
    lines += ["", _independent_lines(done), "", _monotone(done)]
    first = sorted((r for r in done if r["lod"] == 1), key=lambda r: -r["error"])[:10]
    lines += ["", "worst ten at level 1 (mm):"]
    longest = max((r["error"] for r in first), default=1.0)
    for r in first:
        bar = "#" * round(40 * r["error"] / longest)
        lines.append(
            f"  {r['case']:<22} {r['error']:.3f} max {r['max']:.2f} Q {r['quality']:.3f} {bar}"
        )
    lines += [f"  FAILED {r['case']}: {r['failure']}" for r in failed]
    return "\n".join(lines)


def _independent_lines(done: list[dict[str, Any]]) -> str:
    """Independent scores beside our own."""
    lines = []
    for k in SCORED_LEVELS:
        r = [x for x in done if x["lod"] == k and "score_error_mean" in x]
        if r:
            e = np.array([x["score_error_mean"] for x in r])
            ours = np.array([x["error"] for x in r])
            q = np.array([x["score_quality_mean"] for x in r])
            lines.append(
                f"independent, level {k}: error median {np.median(e):.3f}, "
                f"95 % {np.percentile(e, 95):.3f}, worst {e.max():.3f}; "
                f"Q median {np.median(q):.3f}, worst {q.min():.3f}; "
                f"success {sum(x['score_success'] for x in r)}; folded points "
                f"{sum(x['score_negative_points'] for x in r)}; our error differs by at most "
                f"{100 * np.max(np.abs(ours / e - 1)):.1f} %"
            )
    return "\n".join(lines)


def _monotone(done: list[dict[str, Any]]) -> str:
    """How error and quality change from level to level."""
    by_case: dict[str, list[dict[str, Any]]] = {}
    for r in done:
        by_case.setdefault(r["case"], []).append(r)
    grows, worst, drop = [], 0.0, 0.0
    for case, r in by_case.items():
        e = np.array([x["error"] for x in r])
        q = np.array([x["quality"] for x in r])
        if len(e) < 2:
            continue
        ratio = float((e[1:] / e[:-1]).max())
        worst = max(worst, ratio)
        drop = max(drop, float(-np.diff(q).min()))
        if ratio > FALL:
            grows.append(f"{case} (x{ratio:.3f})")
    return (
        f"error grows by more than 2 % from one level to the next in {len(grows)} cases "
        f"(largest ratio {worst:.3f}): {', '.join(grows) or 'none'}; "
        f"largest fall of Q from one level to the next {drop:.3f}"
    )


if __name__ == "__main__":
    main()
