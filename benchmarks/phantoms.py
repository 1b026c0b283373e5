"""Fit phantoms and compare with their true surfaces and volumes.

usage: python -m benchmarks.phantoms
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import heartgen
from heartgen import samples
from heartgen.images.writing import write_mask
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surface_faces import sample_faces

ORIENTATIONS = 6
SAMPLES = 5
UPRIGHT: dict[str, Callable[[], samples.Sample]] = {
    "cup": samples.ideal_cup,
    "lifelike": samples.lifelike_lv,
    "biv": samples.biv,
}
"""Phantoms whose third index axis is the long axis, by the names of their files."""

TRUE_NAMES = {"lv_endo": "endo", "epi": "epi"}


def main() -> None:
    """Print the tables."""
    print("smooth cup at 1 mm, random orientations, against its true surface")
    print("| orientation | LoD | mean error (mm) | wall volume | cavity volume | Q |")
    print("|---|---|---|---|---|---|")
    for seed in range(ORIENTATIONS):
        sample = samples.ideal_cup(1.0, rotation=seed)
        for lod in (1, 3, 5):
            result = heartgen.personalize(sample.mask, lod=lod)
            error, wall, cavity = against_truth(result.mesh, sample.truth)
            q = result.report.quality.mean
            print(f"| {seed} | {lod} | {error:.3f} | {wall:+.2%} | {cavity:+.2%} | {q:.3f} |")
    print("\nnamed samples at level 1, side surfaces against the truth free of muscles and noise")
    print("| sample | endo (mm) | epi (mm) | error to the mask (mm) | Q | valid |")
    print("|---|---|---|---|---|---|")
    for name in samples.names(1):
        sample = samples.load(name)
        result = heartgen.personalize(sample.mask)
        endo, epi = (_distance(result.mesh, sample.truth, s) for s in TRUE_NAMES)
        r = result.report
        print(
            f"| {name} | {endo:.3f} | {epi:.3f} | {r.accuracy.mean:.3f} | {r.quality.mean:.3f} "
            f"| {r.quality.valid} |"
        )


def written(folder: Path) -> list[Path]:
    """Mask files of phantoms, upright, for benchmarks that were given no masks."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, make in UPRIGHT.items():
        path = folder / f"{name}.nii.gz"
        if not path.exists():
            write_mask(make().mask, path)
        paths.append(path)
    return paths


def against_truth(mesh: HexMesh, truth: samples.Truth) -> tuple[float, float, float]:
    """Mean distance of the mesh's surface, mm, and relative errors of wall and cavity volume."""
    points, _, weights = sample_faces(mesh, mesh.topology.external, SAMPLES)
    error = float(np.average(truth.distance(points), weights=weights))
    endo, normals, area = sample_faces(mesh, mesh.topology.surfaces["lv_endo"], SAMPLES)
    center = truth.basal_plane[0]
    cavity = float(np.einsum("nx,nx,n->", endo - center, -normals, area)) / 3
    return error, volume(mesh) / truth.wall_volume - 1, cavity / truth.cavity_volume - 1


def _distance(mesh: HexMesh, truth: samples.Truth, surface: str) -> float:
    """Mean distance of one surface of the mesh from the true one, mm."""
    points, _, weights = sample_faces(mesh, mesh.topology.surfaces[surface], SAMPLES)
    return float(np.average(truth.distance(points, TRUE_NAMES[surface]), weights=weights))


if __name__ == "__main__":
    main()
