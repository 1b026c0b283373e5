"""A batch that is killed again and again: cases lost, and cases done twice.

usage: python -m benchmarks.kills [FOLDER] [--kills 20] [--cases 12] [--jobs 2] [--seed 0]
                                  [--longest 15]

Runs ``heartgen batch`` on the masks of FOLDER (or on that many phantoms of 3 mm voxels), kills it
with SIGKILL at random moments up to --longest seconds after its start, and starts it again. If all
cases are done before it was killed often enough, it begins anew in another folder. After every kill
it looks whether what was done is still there and untouched, whether its processes have ended, and
after the last whether every case is there once and whole. Ends with 1 if anything is amiss.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import pandas as pd
import psutil

from heartgen import samples
from heartgen.cohort import find_cases
from heartgen.images.writing import write_mask

SPACING = 3.0
"""Voxels of the phantoms, mm."""

FLIPPED = 0.02
"""More of the boundary voxels flipped in each phantom than in the one before."""

ENDING = 20.0
"""Seconds after which the processes of a batch that was killed have to be gone."""

FILES = {"mesh.exf", "mesh.vtu", "report.json", "rows.json"}

Seen = dict[str, tuple[int, int]]
"""Number and time of the file that says that a case is done, by case."""


def main() -> None:
    """Kill, look, and tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--longest", type=float, default=15.0)
    a = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="heartgen-kills-") as place:
        folder = a.folder or phantoms(Path(place) / "masks", a.cases)
        chance, kills, rounds, amiss = random.Random(a.seed), 0, 0, []
        while kills < a.kills:
            out = Path(place) / f"out{rounds}"
            more, found = disturbed(folder, out, a.kills - kills, a.jobs, a.longest, chance)
            kills, rounds, amiss = kills + more, rounds + 1, amiss + found
    cases = len(find_cases(folder)) if a.folder else a.cases
    print(f"{kills} kills, {rounds} batches of {cases} cases: {len(amiss)} lost or done twice")
    print("\n".join(amiss))
    sys.exit(1 if amiss else 0)


def disturbed(
    folder: Path, out: Path, kills: int, jobs: int, longest: float, chance: random.Random
) -> tuple[int, list[str]]:
    """Run one batch to its end, killed on the way; how often it was, and what is amiss."""
    command = [sys.executable, "-c", "from heartgen.cli import main; main()", "batch", str(folder)]
    command += ["-o", str(out), "--jobs", str(jobs)]
    seen: Seen = {}
    amiss: list[str] = []
    done = 0
    while True:
        batch = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        try:
            batch.wait(chance.uniform(0.0, longest) if done < kills else None)
            break
        except subprocess.TimeoutExpired:
            family = psutil.Process(batch.pid).children(recursive=True)
            batch.kill()
            batch.wait()
            done += 1
            now = state(out)
            amiss += compare(seen, now)
            left = psutil.wait_procs(family, timeout=ENDING)[1]
            amiss += [f"process {process.pid} outlived the batch" for process in left]
            seen = state(out)
            print(f"kill {done}: {len(seen)} cases done", flush=True)
    amiss += compare(seen, state(out))
    amiss += whole(folder, out)
    return done, amiss


def state(out: Path) -> Seen:
    """The cases that are done."""
    files = (out / "cases").rglob("rows.json")
    found = {f.parent.relative_to(out / "cases").as_posix(): f.stat() for f in files}
    return {
        name: (s.st_ino, s.st_mtime_ns) for name, s in found.items() if not name.startswith(".")
    }


def compare(before: Seen, after: Seen) -> list[str]:
    """Cases that were done and are not, or are again."""
    lost = [f"{name} was lost" for name in before if name not in after]
    return lost + [f"{n} was done twice" for n in before if n in after and after[n] != before[n]]


def whole(folder: Path, out: Path) -> list[str]:
    """Cases that are not there once, or not with all their files, after the end."""
    table = pd.read_csv(out / "results.csv")
    amiss = []
    for case in find_cases(folder):
        row = table[table["case"] == case.name]
        home = out / "cases" / case.name
        if len(row) != 1:
            amiss.append(f"{case.name} is {len(row)} times in the table")
        elif not row["status"].iloc[0].startswith("failed"):
            if {file.name for file in home.iterdir()} != FILES:
                amiss.append(f"{case.name} is not whole")
            json.loads((home / "report.json").read_text())
    return amiss


def phantoms(folder: Path, cases: int) -> Path:
    """Write masks of a ventricle, each more carelessly segmented than the one before."""
    folder.mkdir()
    for n in range(cases):
        mask = samples.lifelike_lv(SPACING, noise=FLIPPED * n / cases, seed=n).mask
        write_mask(mask, folder / f"heart{n:02d}.nii.gz")
    return folder


if __name__ == "__main__":
    main()
