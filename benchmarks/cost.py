"""Time of each step and peak memory of one fit.

usage: python -m benchmarks.cost [MASK]

Without MASK a lifelike phantom at 1 mm is fitted. The first run includes loading (and, on a fresh
installation, compiling) the numerical kernels; the others are the rule. Peak memory is that of the
process, libraries included.
"""

from __future__ import annotations

import resource
import sys
import time

import heartgen
from heartgen import samples
from heartgen.options import STEPS

RUNS = 3
MEGABYTE = 1024.0


def main() -> None:
    """Print the table."""
    arguments = sys.argv[1:] if sys.argv[0].endswith("cost.py") else []
    mask = heartgen.read_mask(arguments[0]) if arguments else samples.load("lifelike").mask
    print(f"{mask.name}: {mask.voxels.shape} voxels of {mask.spacing.round(3)} mm")
    print("| LoD | run | " + " | ".join(STEPS) + " | whole (s) |")
    print("|---|---|" + "---|" * (len(STEPS) + 1))
    for lod in (1, 5):
        for run in range(1, RUNS + 1):
            start = time.perf_counter()
            seconds = heartgen.personalize(mask, lod=lod).report.seconds
            whole = time.perf_counter() - start
            steps = " | ".join(f"{seconds[s]:.2f}" for s in STEPS)
            print(f"| {lod} | {run} | {steps} | {whole:.2f} |")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / MEGABYTE
    print(f"peak memory {peak:.0f} MB")


if __name__ == "__main__":
    main()
