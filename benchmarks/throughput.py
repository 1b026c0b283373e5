"""Cases per minute of a batch with one process and with several, and their memory.

usage: python -m benchmarks.throughput [FOLDER_OR_MASK...] [--cases 40] [--jobs 2] [--lod 1]

Meshes the first so many masks (phantoms if none are given) with one process, then with --jobs, into
new folders. Time counts from when as many cases are done as there are processes: without their
start. Memory is that of all processes of the batch together; it is flat if it does not grow from
the first quarter of the cases to the last. The machine should have nothing else to do.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.kills import phantoms
from benchmarks.rows import case_of, masks_of, table
from heartgen.cohort import Case, Workers, batch

MB = 2**20


def main() -> None:
    """Measure and tabulate."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("masks", type=Path, nargs="*")
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--lod", type=int, default=1)
    a = parser.parse_args()
    heads = ["processes", "cases", "meshed", "s", "cases a minute", "against one"]
    heads += ["MB, first quarter", "MB, last quarter"]
    lines: list[list[Any]] = []
    with tempfile.TemporaryDirectory(prefix="heartgen-throughput-") as place:
        given = masks_of(a.masks) or masks_of([phantoms(Path(place) / "masks", a.cases)])
        cases = [Case(case_of(p), p.absolute()) for p in given[: a.cases]]
        for jobs in (1, a.jobs):
            lines.append(measured(cases, Path(place) / f"out{jobs}", jobs, a.lod))
            lines[-1].insert(5, lines[-1][4] / lines[0][4])
    print(table(heads, lines))


def measured(cases: list[Case], out: Path, jobs: int, lod: int) -> list[Any]:
    """Time and memory of one batch."""
    ends: list[float] = []
    memory: list[float] = []

    def look(done: int, total: int, rows: list[dict[str, Any]]) -> None:
        if not rows:  # it is only about to begin
            return
        ends.append(time.perf_counter())
        family = [me := psutil.Process(), *me.children(recursive=True)]
        memory.append(sum(p.memory_info().rss for p in family) / MB)

    results = batch(cases, out, lod=lod, workers=Workers(jobs), progress=look)
    seconds = ends[-1] - ends[jobs - 1]
    quarter = max(len(memory) // 4, 1)
    meshed = int(results["error_mean"].notna().sum())
    spread = [float(np.median(part)) for part in (memory[:quarter], memory[-quarter:])]
    return [jobs, len(cases), meshed, seconds, 60 * (len(ends) - jobs) / seconds, *spread]


if __name__ == "__main__":
    main()
