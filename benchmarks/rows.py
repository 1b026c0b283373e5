"""What the long benchmarks share: masks, resumable rows, processes of one thread each, tables."""

from __future__ import annotations

import argparse
import csv
import json
import multiprocessing
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

Row = dict[str, Any]

ONE_THREAD = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
IMAGES = (".nii.gz", ".nii", ".nrrd", ".mha")


def jobs_of_masks(doc: str | None, name: str) -> tuple[list[Row], argparse.Namespace]:
    """A job for each mask on the command line, and the other arguments."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("masks", type=Path, nargs="+")
    parser.add_argument("--lod", type=int, default=3)
    parser.add_argument("--elements")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path(f"benchmarks/results/{name}.jsonl"))
    a = parser.parse_args()
    return [{"mask": str(p), "lod": a.lod, "elements": a.elements} for p in masks_of(a.masks)], a


def masks_of(places: Iterable[Path]) -> list[Path]:
    """Mask files: those given, and those in the folders given, in order."""
    out = []
    for place in places:
        if place.is_dir():
            out += sorted(p for p in place.iterdir() if p.name.endswith(IMAGES))
        else:
            out.append(place)
    return out


def case_of(path: Path) -> str:
    """Name of a case: the file's, without its extensions."""
    return path.name.split(".")[0]


def elements_of(text: str | None) -> tuple[int, ...] | None:
    """(radial, circumferential, longitudinal) from a text such as 1x12x6; None for the default."""
    return None if text is None else tuple(int(n) for n in text.split("x"))


def resume(
    output: Path,
    jobs: Sequence[Row],
    work: Callable[[Row], list[Row]],
    processes: int = 1,
) -> list[Row]:
    """Do the jobs whose rows the file does not hold yet, and return the rows of all.

    Each row is a line of JSON that begins with its job, written as soon as the job is done. Delete
    the file to measure anew: rows do not know which version of the code made them.

    Parameters
    ----------
    output : Path
        File of rows; ``.csv`` beside it gets the same as a table.
    jobs : sequence of dict
        Plain values that tell a job from all others.
    work : callable
        Top-level function from a job to its rows.
    processes : int
        Each with one thread.

    Returns
    -------
    list of dict
        In the order of the jobs.
    """
    output.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in output.read_text().splitlines()] if output.exists() else []
    done = {_key(row["job"]) for row in rows}
    todo = [job for job in jobs if _key(job) not in done]
    with output.open("a") as file:
        for number, (job, found) in enumerate(_each(work, todo, processes), start=1):
            for row in found:
                rows.append({"job": job} | row)
                file.write(json.dumps(rows[-1]) + "\n")
            file.flush()
            name = " ".join(str(v) for v in job.values() if v is not None)
            print(f"{number}/{len(todo)} {name}", file=sys.stderr, flush=True)
    order = {_key(job): n for n, job in enumerate(jobs)}
    mine = [row for row in rows if _key(row["job"]) in order]
    mine.sort(key=lambda row: order[_key(row["job"])])
    write_csv(mine, output.with_suffix(".csv"))
    return mine


def write_csv(rows: Sequence[Row], path: Path) -> None:
    """Rows as a table; the values of nested dictionaries become columns."""
    flat = [
        {k: v for part in [row.get("job", {}), row] for k, v in part.items() if k != "job"}
        for row in rows
    ]
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(dict.fromkeys(k for r in flat for k in r)))
        writer.writeheader()
        writer.writerows(flat)


def column(rows: Iterable[Row], name: str) -> np.ndarray:
    """One figure of all rows."""
    return np.array([row[name] for row in rows], dtype=float)


def table(heads: Sequence[str], lines: Iterable[Sequence[Any]]) -> str:
    """Markdown table; numbers with three decimals."""
    cells = [[f"{c:.3f}" if isinstance(c, float) else str(c) for c in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in [heads, ["---"] * len(heads), *cells])


def _each(
    work: Callable[[Row], list[Row]], jobs: Sequence[Row], processes: int
) -> Iterable[tuple[Row, list[Row]]]:
    """Jobs and their rows, as they are done."""
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))  # for the workers, which import anew
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from pool.imap_unordered(_Work(work), jobs)


class _Work:
    """A job together with its rows."""

    def __init__(self, work: Callable[[Row], list[Row]]) -> None:
        self.work = work

    def __call__(self, job: Row) -> tuple[Row, list[Row]]:
        return job, self.work(job)


def _key(job: Row) -> str:
    """The same text for the same job."""
    return json.dumps(job, sort_keys=True)
