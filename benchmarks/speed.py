"""Registration against other tools on the same images, and cost against voxels and elements.

usage: python -m benchmarks.speed peers MASK... [--levels 1,3] [--threads 2] [--repeats 1]
       python -m benchmarks.speed voxels [--sizes 64,128,192,256,320] [--lod 5]
       python -m benchmarks.speed elements [--elements 1x12x6,...] [--lod 3]
each with [--output FILE.jsonl]; rows already there are not measured again.

peers: the tailored template, placed as the pipeline places it, is registered to the patient by
heartgen and by other tools, which get both as voxels (isotropic, the mask's mean voxel, 0 and 1, on
one grid; the patient cut at the truncation). Every tool gives a map from template to patient, and
all are judged alike: the template's tessellated surface is moved by the map, voxelized, and
compared with the patient's voxels (Dice). The least local volume change of the map, and the share
of the wall that it folds, are taken by difference quotients over a voxel. Times are of the call
alone, after loading libraries and compiled kernels, the shortest of the repeats; each tool in a
process of its own with the same number of threads, one after the other. heartgen registers to
signed distances, which the shape analysis makes among much else: "and analysis" counts all of that
too. Tools that are absent are named as such: ``pip install heartgen[bench]`` brings them.

voxels, elements: time of each step of the pipeline, and peak memory of its process, on the phantom
of both ventricles in an image of N x N x N voxels, or on phantoms at 1 mm with more elements (one
layer: the left ventricle; else both).
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.peers import PEERS
from benchmarks.rows import ONE_THREAD, Row, case_of, masks_of, resume, table
from heartgen.options import STEPS

THREADS = (*ONE_THREAD, "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS")

ELEMENTS = "1x12x6,1x16x12,1x24x24,2x12x8,2x18x16,2x36x28,3x42x40"
"""72 to 5,040 elements."""

SIZES = "64,128,192,256,320"
OURS = "heartgen LoD"
TIMEOUT = 3600
"""Seconds after which a tool is given up."""


def main() -> None:
    """Measure and tabulate."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=("peers", "voxels", "elements"))
    parser.add_argument("masks", type=Path, nargs="*")
    parser.add_argument("--levels", default="1,3")
    parser.add_argument("--lod", type=int)
    parser.add_argument("--sizes", default=SIZES)
    parser.add_argument("--elements", default=ELEMENTS)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/speed.jsonl"))
    a = parser.parse_args()
    common = {"what": a.what, "threads": a.threads, "repeats": a.repeats}
    if a.what == "peers":
        tools = [f"{OURS} {k}" for k in a.levels.split(",")] + list(PEERS)
        jobs = [common | {"mask": str(p), "tool": t} for p in masks_of(a.masks) for t in tools]
        print(peers_table(resume(a.output, jobs, apart)))
    elif a.what == "voxels":
        jobs = [common | {"size": int(n), "lod": a.lod or 5} for n in a.sizes.split(",")]
        print(cost_table(resume(a.output, jobs, apart), "size"))
    else:
        jobs = [common | {"elements": e, "lod": a.lod or 3} for e in a.elements.split(",")]
        print(cost_table(resume(a.output, jobs, apart), "elements"))


def apart(job: Row) -> list[Row]:
    """A job in a process of its own, so that a crash is a row like any other."""
    if job["what"] == "peers" and not job["tool"].startswith(OURS):
        package, module, _ = PEERS[job["tool"]]
        if importlib.util.find_spec(module) is None:
            return [{"failure": f"{package} is not installed"}]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "row.json"
        try:
            answer = subprocess.run(
                [sys.executable, "-m", "benchmarks.timing", json.dumps(job), str(out)],
                env=os.environ | dict.fromkeys(THREADS, str(job["threads"])),
                capture_output=True,
                text=True,
                timeout=TIMEOUT,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return [{"failure": f"no result after {TIMEOUT} s"}]
        if answer.returncode < 0:
            return [{"failure": f"crashed with signal {-answer.returncode}"}]
        if answer.returncode > 0:
            said = answer.stderr.strip().splitlines() or ["no message"]
            return [{"failure": f"failed: {said[-1]}"}]
        return [json.loads(out.read_text())]


def peers_table(rows: Sequence[Row]) -> str:
    """Time, how many times that of each of our levels on the same mask, and overlap."""
    ours = list(dict.fromkeys(r["job"]["tool"] for r in rows if r["job"]["tool"].startswith(OURS)))
    heads = ["mask", "voxels", "tool", "s", *(f"x {name}" for name in ours), "and analysis"]
    heads += ["Dice", "least volume change", "folded"]
    seconds = {(r["job"]["mask"], r["job"]["tool"]): r.get("seconds") for r in rows}
    lines = []
    for r in rows:
        mask, tool = r["job"]["mask"], r["job"]["tool"]
        start = [case_of(Path(mask)), r.get("voxels", ""), tool]
        if "failure" in r:
            lines.append([*start, r["failure"], *[""] * (len(heads) - len(start) - 1)])
            continue
        ratios = [
            f"{r['seconds'] / other:.1f}" if (other := seconds.get((mask, name))) else ""
            for name in ours
        ]
        analysis = f"{r['seconds'] + r['analysis']:.2f}" if "analysis" in r else ""
        ends = [f"{r['dice']:.4f}", f"{r['least_volume']:.2f}", f"{r['folded']:.2%}"]
        lines.append([*start, f"{r['seconds']:.2f}", *ratios, analysis, *ends])
    return table(heads, lines)


def cost_table(rows: Sequence[Row], by: str) -> str:
    """Time of each step and peak memory."""
    heads = [
        "image" if by == "size" else "shape",
        "elements",
        "voxels",
        *STEPS,
        "whole (s)",
        "memory (MB)",
    ]
    lines = []
    for r in rows:
        if "failure" in r:
            lines.append([r["job"][by], r["failure"], *[""] * (len(heads) - 2)])
            continue
        seconds = [f"{r['seconds'][s]:.2f}" for s in STEPS]
        ends = [f"{r['whole']:.2f}", f"{r['memory']:.0f}"]
        lines.append([r["job"][by], r["elements"], r["voxels"], *seconds, *ends])
    return table(heads, lines)


if __name__ == "__main__":
    main()
