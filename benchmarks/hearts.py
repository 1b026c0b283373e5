"""Fit every mask of some folders at several levels of detail, and tabulate.

usage: python -m benchmarks.hearts FOLDER... [--elements 1x12x6] [--levels 1,2,3,4,5] [--paper]
                                   [--score SCORE.py] [--fairness FAIRNESS.py] [--scored 1,3]
                                   [--every N] [--options k=v,...] [-o OUT]

With --paper the paper's four steps alone, without the optimization. With --score, an independent
script ``SCORE.py`` with a function ``score(mask, [mesh])`` measures the meshes of the levels in
--scored too; with --fairness, one with a function ``fairness(elements, mask)`` of the points
(e, 64, 3) of cubic Lagrange elements. With --every, only the first of every N masks is fitted.
Writes OUT.csv and OUT.jsonl (a line per case and level) and prints the medians, the successes and
certified meshes, the errors by surface, the wriggle of the lines and what the optimization adds to
it, the worst cases, and how error and quality move from level to level.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import json
import multiprocessing
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import heartgen
from heartgen.errors import HeartgenError
from heartgen.formats import write_mesh
from heartgen.options import settings_from_text

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
FALL = 1.02
"""Largest allowed ratio of the error of one level to that of the level before."""

IMAGES = (".nii.gz", ".nii", ".nrrd", ".mha")
WORST = 10
MORE = 10.0
"""Wriggle that the optimization adds, degrees, from which a heart is counted."""

WRIGGLES = {
    "around": "circumferential_median",
    "around_worst": "circumferential_max",
    "along": "longitudinal_median",
    "along_worst": "longitudinal_max",
}
"""Columns of the wriggle, and its names in a report."""

SURFACES = ("lv_endo", "rv_endo", "rv_apex", "epi", "base")


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--elements")
    parser.add_argument("--levels", default="1,2,3,4,5")
    parser.add_argument("--paper", action="store_true")
    parser.add_argument("--options", default="")
    parser.add_argument("--score", type=Path)
    parser.add_argument("--fairness", type=Path)
    parser.add_argument("--scored", default="1,3")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("-o", "--out", type=Path, default=Path("benchmarks/results/hearts"))
    a = parser.parse_args()
    cases = sorted(p for f in a.folders for p in f.iterdir() if p.name.endswith(IMAGES))
    cases = cases[:: a.every]
    levels = tuple(int(k) for k in a.levels.split(","))
    choices: dict[str, Any] = {"optimize": not a.paper}
    if a.elements:
        choices["elements"] = tuple(int(n) for n in a.elements.split("x"))
    given = settings_from_text(filter(None, a.options.split(",")))
    choices |= {name: values[0] for name, values in given.items()}
    scripts = {
        name: str(path) for name, path in (("score", a.score), ("fairness", a.fairness)) if path
    }
    scored = {int(k): scripts for k in a.scored.split(",")}
    jobs = [(str(p), levels, choices, scored) for p in cases]
    rows: list[dict[str, Any]] = []
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # for the workers, which import anew
    with multiprocessing.get_context("spawn").Pool(a.processes) as pool:
        for number, found in enumerate(pool.imap_unordered(fit, jobs), start=1):
            rows.extend(found)
            print(f"\r{number}/{len(jobs)}", end="", file=sys.stderr, flush=True)
    rows.sort(key=lambda r: (r["case"], r["lod"]))
    a.out.parent.mkdir(parents=True, exist_ok=True)
    with open(f"{a.out}.csv", "w", newline="") as f:
        writer = csv.DictWriter(f, fieldnames=list(dict.fromkeys(k for r in rows for k in r)))
        writer.writeheader()
        writer.writerows(rows)
    lines = [json.dumps(row, default=float) + "\n" for row in rows]
    Path(f"{a.out}.jsonl").write_text("".join(lines), encoding="utf-8")
    print(f"\n{summary(rows, len(cases), levels)}")


def fit(
    job: tuple[str, tuple[int, ...], dict[str, Any], dict[int, dict[str, str]]],
) -> list[dict[str, Any]]:
    """One case at all levels: a row each. Scripts, by what they measure, for some of the levels."""
    path, levels, choices, scored = job
    case = Path(path).name.split(".")[0]
    try:
        results = heartgen.personalize_levels(heartgen.read_mask(path), levels, **choices)
    except HeartgenError as error:
        return [{"case": case, "lod": k, "failure": str(error)} for k in levels]
    rows = []
    for lod, result in zip(levels, results, strict=True):
        report = result.report
        accuracy, quality = report.accuracy, report.quality
        row = {
            "case": case,
            "lod": lod,
            "error": accuracy.mean,
            "voxels": accuracy.mean / result.anatomy.voxel,
            "p95": accuracy.p95,
            "max": accuracy.max,
            "reverse": accuracy.reverse_mean,
            "quality": quality.mean,
            "quality_min": quality.min,
            "scaled": quality.scaled_mean,
            "scaled_min": quality.scaled_min,
            **{name: getattr(report.fairness, theirs) for name, theirs in WRIGGLES.items()},
            **{
                f"{name}_added": getattr(report.fairness, theirs)
                - getattr(report.unoptimized_fairness, theirs)
                for name, theirs in WRIGGLES.items()
            },
            "normals": report.fairness.normal_mean,
            "normals_p95": report.fairness.normal_p95,
            "raw_quality": report.unenhanced_quality,
            "valid": quality.valid,
            "success": report.success,
            "paper_success": report.paper_success,
            "dice": accuracy.dice,
            "notes": "; ".join(f.message for f in report.findings),
            **{name: accuracy.by_surface.get(name) for name in SURFACES},
            **{f"seconds {name}": time for name, time in report.seconds.items()},
        }
        scripts = scored.get(lod, {})
        if "score" in scripts:
            row |= independent(scripts["score"], path, result.mesh)
        if "fairness" in scripts:
            row |= independent_fairness(scripts["fairness"], path, result.mesh)
        rows.append(row)
    return rows


def independent(script: str, mask: str, mesh: heartgen.HexMesh) -> dict[str, float]:
    """Scores of a script that shares no code with heartgen."""
    module = _loaded(script)
    with tempfile.TemporaryDirectory() as folder:
        write_mesh(mesh, Path(folder) / "mesh.vtu")
        s = module.score(mask, [str(Path(folder) / "mesh.vtu")])
    names = ("error_mean", "error_p95", "error_max", "quality_mean", "quality_min", "scaled_mean")
    return {f"score_{n}": s[n] for n in (*names, "negative_points", "success")}


def independent_fairness(script: str, mask: str, mesh: heartgen.HexMesh) -> dict[str, float]:
    """Fairness by a script that shares no code with heartgen."""
    found = _loaded(script).fairness(mesh.lagrange_points(), mask)
    return {f"fairness_{name}": value for name, value in found.items()}


def _loaded(script: str) -> Any:
    """A script as a module."""
    spec = importlib.util.spec_from_file_location(f"independent_{Path(script).stem}", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def summary(rows: list[dict[str, Any]], cases: int, levels: tuple[int, ...]) -> str:
    """Markdown tables of the results."""
    done = [r for r in rows if "error" in r]
    first = levels[0]
    lines = [
        f"{cases} cases",
        "",
        "| LoD | error median | 95 % of cases | worst | in voxels | worst | Q median | worst "
        "| scaled | worst | raw Q | valid | success | by the paper | s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for k in levels:
        r = [x for x in done if x["lod"] == k]
        if not r:
            continue
        e, v, q, j = (column(r, n) for n in ("error", "voxels", "quality", "scaled"))
        seconds = [sum(t for n, t in x.items() if n.startswith("seconds")) for x in r]
        lines.append(
            f"| {k} | {np.median(e):.3f} | {np.percentile(e, 95):.3f} | {e.max():.3f} "
            f"| {np.median(v):.3f} | {v.max():.3f} "
            f"| {np.median(q):.3f} | {q.min():.3f} | {np.median(j):.3f} | {j.min():.3f} "
            f"| {np.median(column(r, 'raw_quality')):.3f} "
            f"| {sum(x['valid'] for x in r)} | {sum(x['success'] for x in r)} "
            f"| {sum(x['paper_success'] for x in r)} | {np.median(seconds):.1f} |"
        )
    lines += ["", _by_surface(done, levels), "", _wriggle(done, levels)]
    lines += ["", _independent_lines(done, levels), _monotone(done)]
    worst = sorted((r for r in done if r["lod"] == first), key=lambda r: -r["error"])[:WORST]
    lines += ["", f"worst {WORST} at level {first} (mm):"]
    longest = max((r["error"] for r in worst), default=1.0)
    for r in worst:
        bar = "#" * round(40 * r["error"] / longest)
        lines.append(
            f"  {r['case']:<26} {r['error']:.3f} max {r['max']:.2f} Q {r['quality']:.3f} {bar}"
        )
    lines += [
        f"  not proven valid at level {r['lod']}: {r['case']}" for r in done if not r["valid"]
    ]
    failed = [r for r in rows if "failure" in r and r["lod"] == first]
    lines += [f"  FAILED {r['case']}: {r['failure']}" for r in failed]
    return "\n".join(lines)


def column(rows: list[dict[str, Any]], name: str) -> np.ndarray:
    """One figure of all rows."""
    return np.array([r[name] for r in rows], dtype=float)


def _by_surface(done: list[dict[str, Any]], levels: tuple[int, ...]) -> str:
    """Median and worst error of each surface."""
    lines = ["| LoD | " + " | ".join(SURFACES) + " |", "|---" * (len(SURFACES) + 1) + "|"]
    for k in levels:
        cells = []
        for name in SURFACES:
            e = [r[name] for r in done if r["lod"] == k and r[name] is not None]
            cells.append(f"{np.median(e):.3f} (worst {max(e):.2f})" if e else "")
        lines.append(f"| {k} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _wriggle(done: list[dict[str, Any]], levels: tuple[int, ...]) -> str:
    """Wriggle of the lines, what the optimization adds to it, and how far normals are off."""
    lines = [
        "| LoD | wriggle around (°), median | of hearts, worst | worst line | added, median | worst"
        f" | hearts with more than +{MORE:g} | along, median | of hearts, worst | worst line "
        f"| added, median | worst | hearts with more than +{MORE:g} | normals, median | worst |",
        "|---" * 15 + "|",
    ]
    for k in levels:
        r = [x for x in done if x["lod"] == k and "around" in x]  # stored rows may lack it
        if not r:
            continue
        cells = []
        for name in ("around", "along"):
            own, worst, added = (column(r, name + end) for end in ("", "_worst", "_added"))
            figures = (np.median(own), own.max(), worst.max(), np.median(added), added.max())
            cells += [f"{figure:.1f}" for figure in figures] + [f"{(added > MORE).sum()}"]
        normals = column([x for x in r if x["normals"] is not None], "normals")
        cells += [f"{np.median(normals):.1f}", f"{normals.max():.1f}"] if len(normals) else ["", ""]
        lines.append(f"| {k} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _independent_lines(done: list[dict[str, Any]], levels: tuple[int, ...]) -> str:
    """Independent scores beside our own."""
    lines = []
    for k in levels:
        r = [x for x in done if x["lod"] == k and "score_error_mean" in x]
        if r:
            e, ours = column(r, "score_error_mean"), column(r, "error")
            q, j = column(r, "score_quality_mean"), column(r, "score_scaled_mean")
            lines.append(
                f"independent, level {k}: error median {np.median(e):.3f}, "
                f"95 % {np.percentile(e, 95):.3f}, worst {e.max():.3f}; "
                f"Q median {np.median(q):.3f}, worst {q.min():.3f}; scaled {np.median(j):.3f}; "
                f"success {sum(x['score_success'] for x in r)}; folded points "
                f"{sum(x['score_negative_points'] for x in r)}; our error differs by at most "
                f"{100 * np.max(np.abs(ours / e - 1)):.1f} %"
            )
        r = [x for x in done if x["lod"] == k and "fairness_longitudinal_wriggle_median" in x]
        if r:
            parts = []
            for ours, theirs in (("around", "circumferential"), ("along", "longitudinal")):
                found = column(r, f"fairness_{theirs}_wriggle_median")
                apart = np.abs(found - column(r, ours)).max()
                parts.append(
                    f"wriggle {ours} median {np.median(found):.1f}, worst {found.max():.1f}, "
                    f"ours differs by at most {apart:.1f}"
                )
            lines.append(f"independent, level {k}: {'; '.join(parts)} degrees")
    return "\n".join(lines)


def _monotone(done: list[dict[str, Any]]) -> str:
    """How error and quality change from level to level."""
    by_case: dict[str, list[dict[str, Any]]] = {}
    for r in done:
        by_case.setdefault(r["case"], []).append(r)
    grows, worst, drop = [], 0.0, 0.0
    for case, r in by_case.items():
        e, q = column(r, "error"), column(r, "quality")
        if len(e) < 2:
            continue
        ratio = float((e[1:] / e[:-1]).max())
        worst = max(worst, ratio)
        drop = max(drop, float((q[:-1] - q[1:]).max()))
        if ratio > FALL:
            grows.append(f"{case} (x{ratio:.3f})")
    named = f": {', '.join(grows[:WORST])}" if grows else ""
    return (
        f"error grows by more than 2 % from one level to the next in {len(grows)} cases "
        f"(largest ratio {worst:.3f}){named}; largest fall of Q from one level to the next "
        f"{drop:.3f}"
    )


if __name__ == "__main__":
    main()
