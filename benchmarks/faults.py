"""A batch with a fault of every kind among its cases: what ends as what, and how often.

usage: python -m benchmarks.faults [--cases 200] [--jobs 2] [--seed 0] [--limit 0.5]

Runs `heartgen.cohort.batch` on phantoms of a coarse ventricle, small enough to be meshed in a
second, among which 20 others do what they can: files that are no masks, exceptions of all kinds, no
memory, processes and workers that die, one that hangs, and a folder that is in use. Runs it again
on the same folder. Every phantom has to be meshed, every fault to have a row with its reason, no
case to be read more often than it has to be, and none again by the second run. Ends with 1 if
anything is amiss.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.faulty import Faulty
from heartgen import samples
from heartgen.cohort import Case, Workers, batch
from heartgen.images.writing import write_image
from heartgen.options import Options

SPACING = 4.0
"""Voxels of the phantoms, mm."""

QUICK = Options(elements=(1, 8, 3), optimize=False)

READS = {"os._exit": (2, 2), "killed": (2, 2), "crashes": (2, 2), "worker": (2, 4), "taken": (0, 0)}
"""Least and most times that a case may be read that ends its process, or with it the worker, or for
which there is no place; of others, once."""

REASONS = {
    "linalg": "LinAlgError",
    "memory": "more memory than there is",
    "exits": "SystemExit",
    "recursion": "RecursionError",
    "untellable": "CannotBeToldError",
    "os._exit": "exit code 3",
    "killed": "SIGKILL",
    "crashes": "SIGSEGV",
    "worker": "its worker died",
    "hangs": "not done within",
    "text": "not gzip-compressed",
    "nothing": "empty",
    "cut": "",
    "absent": "",
    "zeros": "",
    "ones": "",
    "block": "",
    "slice": "",
    "flat": "",
    "taken": "without the results of this case",
}
"""What the reason of each fault says; nothing in particular where it depends on the reader."""


def main() -> None:
    """Run the batch twice, and tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit", type=float, default=0.5, help="of time, minutes")
    a = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="heartgen-faults-") as place:
        folder = Path(place)
        cases = cohort(folder, a.cases - len(REASONS), random.Random(a.seed))
        workers = Workers(a.jobs, time_limit=a.limit)
        start = time.perf_counter()
        first = run(cases, folder / "out", workers)
        seconds, reads = time.perf_counter() - start, read(folder)
        again = run(cases, folder / "out", workers)
        amiss = checked(cases, first, reads)
        if again != first or read(folder) != reads:
            amiss.append("the second run did something")
    failed = [status for status in first.values() if status.startswith("failed: ")]
    for name in REASONS:
        print(f"{name:12}{first.get(name)}")
    print(
        f"{len(cases)} cases in {seconds:.0f} s by {a.jobs} processes: {len(first) - len(failed)} "
        f"meshes, {len(failed)} failed with their reason, {len(amiss)} amiss"
    )
    print("\n".join(amiss))
    sys.exit(1 if amiss else 0)


def run(cases: list[Case], out: Path, workers: Workers) -> dict[str, str]:
    """How each case ended."""
    table = batch(cases, out, QUICK, workers=workers, formats=("vtu",))
    return dict(zip(table["case"], table["status"], strict=True))


def read(folder: Path) -> Counter[str]:
    """How often each case was read."""
    return Counter((folder / "log").read_text().split())


def checked(cases: list[Case], status: dict[str, str], reads: Counter[str]) -> list[str]:
    """What is amiss."""
    amiss = [f"{case.name} has no row" for case in cases if case.name not in status]
    for name, ended in status.items():
        fault = name if name in REASONS else None
        if fault is None and ended.startswith("failed: "):
            amiss.append(f"{name} should have been meshed: {ended}")
        if fault is not None and not (ended.startswith("failed: ") and REASONS[fault] in ended):
            amiss.append(f"{name} ended as {ended}")
        least, most = READS.get(name, (1, 1))
        if not least <= reads[name] <= most:
            amiss.append(f"{name} was read {reads[name]} times")
    return amiss


def cohort(folder: Path, hearts: int, chance: random.Random) -> list[Case]:
    """So many phantoms, and every fault among them."""
    log = folder / "log"
    masks = [samples.lifelike_lv(SPACING, noise=0.02 * n, seed=n).mask for n in range(8)]
    cases: list[Case] = [Faulty(f"h{n}", masks[n % 8], log=log) for n in range(hearts)]
    files = bad_files(folder / "masks", masks[0].voxels)
    for name in REASONS:
        if name in files:
            cases.append(Faulty(name, files[name], log=log))
        else:
            deed = "" if name == "taken" else name
            cases.append(Faulty(name, masks[0], deed=deed, log=log))
    taken = folder / "out" / "cases" / "taken"
    taken.mkdir(parents=True)
    (taken / "mine.txt").write_text("not of a batch")
    chance.shuffle(cases)
    return cases


def bad_files(folder: Path, heart: np.ndarray) -> dict[str, Path]:
    """Files from which no heart can be meshed."""
    folder.mkdir()
    middle = heart.shape[2] // 2
    images = {name: np.zeros(heart.shape, np.uint8) for name in ("zeros", "block", "slice")}
    images["ones"] = np.ones(heart.shape, np.uint8)
    images["block"][4:10, 4:10, 4:10] = 1
    images["slice"][:, :, middle] = heart[:, :, middle]
    images["flat"] = heart[:, :, middle : middle + 1].astype(np.uint8)
    images["cut"] = heart.astype(np.uint8)
    found = {name: folder / f"{name}.nii.gz" for name in (*images, "text", "nothing", "absent")}
    for name, voxels in images.items():
        write_image(voxels, np.diag([SPACING, SPACING, SPACING, 1.0]), found[name])
    found["cut"].write_bytes(found["cut"].read_bytes()[:-200])
    found["text"].write_text("hello")
    found["nothing"].touch()
    return found


if __name__ == "__main__":
    main()
