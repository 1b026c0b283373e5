"""What each ingredient of the optimization is worth: one taken away at a time.

usage: python -m benchmarks.ablation MASK... [--lod 3]

Prints a table of the means over the masks: error, quality, scaled Jacobian, wriggle of the lines in
degrees, and how many meshes are proven valid.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import heartgen
from heartgen.anatomy import Anatomy
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.enhancement import enhance
from heartgen.fairness import assess_fairness
from heartgen.heart_kinds import kind_of
from heartgen.mesh import HexMesh
from heartgen.optimization import FitSettings, fit_target, optimize, settings_for
from heartgen.result import Personalization

TERMS = ("even", "angles", "fair", "smooth", "place")
"""Weights of the terms that are left out one at a time."""

FIGURES = ("error", "Q", "Q worst", "scaled", "scaled worst", "wriggle along", "wriggle around")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("masks", type=Path, nargs="+")
    parser.add_argument("--lod", type=int, default=3)
    a = parser.parse_args()
    figures: dict[str, list[tuple[float, ...]]] = {}
    for path in a.masks:
        mask = heartgen.read_mask(path)
        paper = heartgen.personalize(mask, lod=a.lod, optimize=False)
        linear = heartgen.personalize(mask, lod=a.lod, optimize=False, transmural_grading=False)
        for name, mesh in meshes(paper, linear, a.lod):
            figures.setdefault(name, []).append(measured(mesh, paper.anatomy))
    print(f"{len(a.masks)} masks, level of detail {a.lod}")
    print(f"| variant | {' | '.join(FIGURES)} | valid |")
    print("|---" * (len(FIGURES) + 2) + "|")
    for name, rows in figures.items():
        cells = " | ".join(f"{x:.3f}" for x in np.mean([r[:-1] for r in rows], axis=0))
        print(f"| {name} | {cells} | {sum(r[-1] for r in rows):.0f} |")


def meshes(
    paper: Personalization, linear: Personalization, lod: int
) -> Iterator[tuple[str, HexMesh]]:
    """Every variant by name."""
    anatomy, target = paper.anatomy, fit_target(paper.anatomy)
    full = settings_for(
        lod,
        heart=kind_of(anatomy).weights,
        stack=anatomy.slices is not None,
        columns=paper.mesh.topology.shape[1],
    )

    def optimized(mesh: HexMesh, settings: FitSettings = full) -> HexMesh:
        return optimize(mesh, target, settings).mesh

    yield "paper's four steps", paper.mesh
    yield "paper's, depth proportional", linear.mesh
    yield "paper's, without enhancement", paper.warped
    yield "optimized", optimized(paper.mesh)
    yield "... depth proportional", optimized(linear.mesh)
    yield "... without registration", optimized(enhance(paper.template))
    for term in TERMS:
        yield f"... without {term}", optimized(paper.mesh, replace(full, **{term: 0.0}))
    yield "... base like the rest", optimized(paper.mesh, replace(full, cut=1.0))


def measured(mesh: HexMesh, anatomy: Anatomy) -> tuple[float, ...]:
    """The figures, and whether the mesh is valid."""
    accuracy = assess_accuracy(mesh, anatomy.myocardium, anatomy.wall_volume)
    q, lines = assess_quality(mesh), assess_fairness(mesh)
    wriggle = lines.longitudinal_median, lines.circumferential_median
    quality = q.mean, q.min, q.scaled_mean, q.scaled_min
    return accuracy.mean, *quality, *wriggle, float(q.valid)


if __name__ == "__main__":
    main()
