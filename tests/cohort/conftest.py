"""A small cohort: two hearts, and two images that are none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")
pytest.importorskip("pandas")

import SimpleITK

from heartgen import samples

SPACING = 3.0
"""mm; coarse, so that a fit takes a second."""


def save(voxels: np.ndarray, path: Path) -> Path:
    """Write an image."""
    image = SimpleITK.GetImageFromArray(voxels.astype(np.uint8).transpose(2, 1, 0))
    image.SetSpacing([SPACING] * 3)
    SimpleITK.WriteImage(image, str(path))
    return path


@pytest.fixture(scope="session")
def hearts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two hearts, a block without a cavity, one slice only, and a text."""
    folder = tmp_path_factory.mktemp("cohort") / "masks"
    (folder / "odd").mkdir(parents=True)
    save(samples.lifelike_lv(SPACING).mask.voxels, folder / "a.nii.gz")
    heart = samples.lifelike_lv(SPACING, noise=0.1, seed=1).mask.voxels
    save(heart, folder / "b.nrrd")
    block, slice_ = np.zeros_like(heart), np.zeros_like(heart)
    block[4:14, 4:14, 4:14] = 1
    middle = heart.shape[2] // 2
    slice_[:, :, middle] = heart[:, :, middle]
    save(block, folder / "odd" / "block.nii.gz")
    save(slice_, folder / "odd" / "slice.nii.gz")
    (folder / "odd" / "text.nii.gz").write_text("hello")
    return folder
