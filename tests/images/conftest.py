"""A small cup-shaped heart, and ways to save it with other people's writers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import SimpleITK
from numpy.typing import NDArray

RAS_FROM_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


@pytest.fixture(scope="session")
def cup() -> NDArray[np.uint8]:
    """A cup, closed below and open above, with background on every side."""
    i, j, k = np.mgrid[:24, :22, :20] - np.array([12.0, 11.0, 11.0])[:, None, None, None]
    r = np.sqrt(i**2 + j**2 + k**2)
    voxels = ((r <= 8) & (r > 5) & (k < 3)).astype(np.uint8)
    voxels.setflags(write=False)  # all tests share it
    return voxels


@pytest.fixture
def oblique() -> NDArray[np.float64]:
    """An affine, mm, LPS: anisotropic, permuted, rotated, mirrored and off the origin."""
    angle = np.radians(30)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    swap = np.array([[0, 0, 1], [-1, 0, 0], [0, 1, 0]])
    affine = np.eye(4)
    affine[:3, :3] = turn @ swap @ np.diag([1.0, 1.25, -2.0])
    affine[:3, 3] = [-31.0, 12.5, 240.0]
    return affine


@pytest.fixture
def save(tmp_path: Path) -> Callable[..., Path]:
    """Save voxels (nx, ny, nz) under a name, by the writer its ending asks for."""

    def write(voxels: NDArray, affine: NDArray, name: str) -> Path:
        path = tmp_path / name
        if name.endswith((".nii", ".nii.gz")):
            nib.save(nib.Nifti1Image(voxels, RAS_FROM_LPS @ affine), path)
            return path
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        image = SimpleITK.GetImageFromArray(np.ascontiguousarray(voxels.T))
        image.SetSpacing(spacing.tolist())
        image.SetOrigin(affine[:3, 3].tolist())
        image.SetDirection((affine[:3, :3] / spacing).ravel().tolist())
        SimpleITK.WriteImage(image, str(path), useCompression=True)
        return path

    return write
