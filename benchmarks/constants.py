"""What becomes of stacks if a constant of the shape analysis is a fifth smaller or larger.

usage: python -m benchmarks.constants STACKS... [--every N] [--jobs N] [--output FILE.jsonl]

For each constant in `CONSTANTS`, each factor and each stack (label maps by the scheme acdc, others
as masks): whether other ventricles are seen, other slices taken, or slices moved elsewhere by more
than a pixel; for those of the interpolation and of the template, whether the volume of a pool
changes by more than a percent, or the template follows a pool that it did not. No mesh is made. A
constant whose change changes nothing lies in a gap of what hearts show.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import nibabel
import numpy as np

import heartgen
from benchmarks.rows import Row, case_of, masks_of, resume, table
from heartgen.anatomy import analyze
from heartgen.anatomy.short_axis_contours import find_sections
from heartgen.anatomy.slice_alignment import without_shifts
from heartgen.errors import HeartgenError
from heartgen.images import Mask
from heartgen.images.stack import stack_of
from heartgen.templates.ellipsoid import fit_ellipsoid

CONTOURS = {
    "heartgen.anatomy.short_axis_contours": (
        *("CLOSED", "LEAST_RING", "ISLAND", "SECOND_SLICES", "FAINT", "LEAST_SHARE", "FREE"),
        *("WIDE", "NARROW", "RIGHT_WIDE"),
    ),
    "heartgen.anatomy.slice_alignment": ("CLEAR", "AGREEMENT", "STEP", "ALONE", "TOGETHER"),
    "heartgen.images.stack": ("TAPERED",),
    "heartgen.anatomy.ends": ("SPECK", "NARROWS", "FILLED", "CAP", "SOLID", "COVERED", "NOTCH"),
}
SHAPES = {
    "heartgen.anatomy.interpolation": ("OVERLAP",),
    "heartgen.templates.ellipsoid": ("OFF_AXIS", "TAPER_LIMIT"),
}
CONSTANTS = [(m, n) for part in (CONTOURS, SHAPES) for m, names in part.items() for n in names]
"""Module and name."""

FACTORS = (0.8, 1.2)

SAME_VOLUME = 0.01
"""Relative change of a pool's volume up to which it is the same."""


@contextmanager
def changed(module: str, name: str, factor: float) -> Iterator[None]:
    """A constant times a factor, for a while."""
    owner = importlib.import_module(module)
    usual = getattr(owner, name)
    setattr(owner, name, factor * usual)
    try:
        yield
    finally:
        setattr(owner, name, usual)


def contours(mask: Mask) -> Any:
    """What is seen in the slices: heights of those taken, ventricles, and shifts."""
    stack = stack_of(mask)
    assert stack is not None
    try:
        found = find_sections(stack, "auto")
    except HeartgenError as error:
        return str(error)
    if found is None:
        return "no short-axis stack"
    found = without_shifts(found)
    up = bool(found.stack.heights[-1] > found.stack.heights[0])
    return (sorted(found.stack.heights), up, found.right is None, found.shifts)


def same_contours(one: Any, other: Any, pixel: float) -> bool:
    """Whether two of these say the same."""
    if isinstance(one, str) or isinstance(other, str):
        return bool(isinstance(one, str) and isinstance(other, str) and one == other)
    if one[1:3] != other[1:3] or len(one[0]) != len(other[0]):
        return False
    near = np.allclose(one[0], other[0], atol=1e-6)
    return bool(near and np.abs(one[3] - other[3]).max() < pixel)


def shapes(mask: Mask) -> Any:
    """Volumes of the pools, mm^3, and whether the template follows the left one."""
    try:
        anatomy = analyze(mask)
    except HeartgenError as error:
        return str(error)
    right = 0.0 if anatomy.rv is None else anatomy.rv.pool_volume
    return np.array([anatomy.pool_volume, right]), bool(fit_ellipsoid(anatomy).sway.any())


def same_shapes(one: Any, other: Any, pixel: float) -> bool:
    """Whether two of these say the same."""
    if isinstance(one, str) or isinstance(other, str):
        return bool(isinstance(one, str) and isinstance(other, str) and one == other)
    return bool(one[1] == other[1] and np.allclose(one[0], other[0], rtol=SAME_VOLUME))


def measure(job: Row) -> list[Row]:
    """A row for each constant and factor: whether it changes what is found in a stack."""
    path = Path(job["path"])
    labeled = np.asarray(nibabel.load(path).dataobj).max() > 1
    mask = heartgen.read_labels(path, "acdc") if labeled else heartgen.read_mask(path)
    rows = []
    for part, look, same in ((CONTOURS, contours, same_contours), (SHAPES, shapes, same_shapes)):
        usual = look(mask)
        for module, names in part.items():
            for name in names:
                for factor in FACTORS:
                    with changed(module, name, factor):
                        differs = not same(usual, look(mask), mask.pixel)
                    rows.append(
                        {
                            "case": case_of(path),
                            "constant": f"{module.split('.')[-1]}.{name}",
                            "factor": factor,
                            "differs": differs,
                        }
                    )
    return rows


def summary(rows: Sequence[Row]) -> str:
    """How many stacks each change of a constant changes."""
    lines = []
    for module, name in CONSTANTS:
        constant = f"{module.split('.')[-1]}.{name}"
        mine = [r for r in rows if r["constant"] == constant]
        parts = [[r["case"] for r in mine if r["differs"] and r["factor"] == f] for f in FACTORS]
        value = getattr(importlib.import_module(module), name)
        counts = [str(len(part)) for part in parts]
        lines.append(
            [constant, f"{value:g}", len(mine) // 2, *counts, ", ".join(parts[0] + parts[1])]
        )
    heads = ["constant", "value", "stacks", *(f"changed at {f:g}" for f in FACTORS), "which"]
    return table(heads, lines)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("stacks", nargs="+", type=Path)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/constants.jsonl"))
    a = parser.parse_args()
    jobs = [{"path": str(p)} for p in masks_of(a.stacks)[:: a.every]]
    print(summary(resume(a.output, jobs, measure, a.jobs)))


if __name__ == "__main__":
    main()
