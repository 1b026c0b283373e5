"""Meshes drawn back into the voxels of their masks: how much of the two is the same.

usage: python -m benchmarks.raster MASK_OR_FOLDER... [--lod 3] [--elements 1x12x6] [--jobs N]
                                   [--output FILE]

Prints the Dice coefficient of the mask and of the mesh's voxels, those whose center it holds, and
the volume of its partial volumes against its own. Rows go to FILE, see `benchmarks.rows.resume`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import heartgen
from benchmarks.rows import Row, case_of, column, elements_of, jobs_of_masks, resume, table
from heartgen.mesh.jacobian import volume

LIMIT = 0.97
"""Dice coefficient that each case is to reach."""


def main() -> None:
    """Run the benchmark."""
    jobs, a = jobs_of_masks(__doc__, "raster")
    rows = resume(a.output, jobs, draw, a.jobs)
    heads = ("case", "Dice", "partial volumes")
    print(table(heads, ((r["case"], r["dice"], f"{r['partial']:+.4%}") for r in rows)))
    dice = column(rows, "dice")
    print(
        f"\n{len(dice)} hearts: Dice {np.median(dice):.4f} median, {dice.min():.4f} worst; above "
        f"{LIMIT} in {np.sum(dice > LIMIT)}"
    )


def draw(job: Row) -> list[Row]:
    """Dice coefficient of one mask and its mesh, and how far the partial volumes are off."""
    mask = heartgen.read_mask(job["mask"])
    mesh = heartgen.personalize(mask, lod=job["lod"], elements=elements_of(job["elements"])).mesh
    inside = mesh.rasterize(like=mask) > 0
    both = np.sum(inside & mask.voxels)
    voxel = abs(np.linalg.det(mask.affine[:3, :3]))
    shares = mesh.rasterize(like=mask, partial=True)
    return [
        {
            "case": case_of(Path(job["mask"])),
            "dice": float(2 * both / (inside.sum() + mask.voxels.sum())),
            "partial": float(shares.sum(dtype=float) * voxel / volume(mesh) - 1),
        }
    ]


if __name__ == "__main__":
    main()
