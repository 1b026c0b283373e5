"""What each ingredient of the refinement is worth: one taken away at a time.

usage: python -m benchmarks.ablation MASK... [--lod 3]

Prints a table of the means over the masks: error, quality, scaled Jacobian, and how many meshes are
proven valid.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import heartgen
from heartgen.anatomy import Anatomy
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.enhancement import enhance
from heartgen.mesh import HexMesh
from heartgen.pipeline import Personalization
from heartgen.refinement import Weights, patient_of, refine, weights_for

Variant = Callable[[Personalization, Weights], HexMesh]


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
        paper = heartgen.personalize(mask, lod=a.lod, refine=False)
        linear = heartgen.personalize(mask, lod=a.lod, refine=False, depth="linear")
        for name, mesh in meshes(paper, linear, a.lod):
            figures.setdefault(name, []).append(measured(mesh, paper.anatomy))
    print(f"{len(a.masks)} masks, level of detail {a.lod}")
    print("| variant | error | Q | Q worst | scaled | scaled worst | valid |")
    print("|---|---|---|---|---|---|---|")
    for name, rows in figures.items():
        cells = " | ".join(f"{x:.3f}" for x in np.mean([r[:5] for r in rows], axis=0))
        print(f"| {name} | {cells} | {sum(r[5] for r in rows):.0f} |")


def meshes(
    paper: Personalization, linear: Personalization, lod: int
) -> Iterator[tuple[str, HexMesh]]:
    """Every variant by name."""
    full = weights_for(lod, 1.0, paper.anatomy.rv is not None)
    patient = patient_of(paper.anatomy)
    yield "paper's four steps", paper.mesh
    yield "paper's, depth proportional", linear.mesh
    yield "paper's, without enhancement", paper.warped
    yield "refined", refine(paper.mesh, patient, full)
    yield "... depth proportional", refine(linear.mesh, patient, full)
    yield "... without registration", refine(enhance(paper.template), patient, full)
    for left_out in ("spread", "shear", "bending", "drift"):
        yield (
            f"... without {left_out}",
            refine(paper.mesh, patient, replace(full, **{left_out: 0.0})),
        )
    yield "... base like the rest", refine(paper.mesh, patient, replace(full, cut=1.0))
    for steps in (2, 5, 20):
        yield f"... {steps} steps", refine(paper.mesh, patient, full, steps=steps)


def measured(mesh: HexMesh, anatomy: Anatomy) -> tuple[float, ...]:
    """Error, quality, least quality, scaled Jacobian, least one, whether it is valid."""
    accuracy = assess_accuracy(mesh, anatomy.myocardium, anatomy.wall_volume)
    q = assess_quality(mesh)
    return accuracy.mean, q.mean, q.min, q.scaled_mean, q.scaled_min, float(q.valid)


if __name__ == "__main__":
    main()
