"""A small heart as a mask and as a label map, and the command line to try on them."""

from __future__ import annotations

import numpy as np
import pytest
import SimpleITK
from scipy.ndimage import binary_fill_holes as fill
from typer.testing import CliRunner

from heartgen import samples
from heartgen.cli.cohort import app


@pytest.fixture(scope="session")
def files():
    """Names of all that a fit writes."""
    return ["mesh.exf", "mesh.vtu", "report.json"]


@pytest.fixture(scope="session")
def run():
    """Outcome of a command."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="session")
def save():
    """Write an image with any values."""

    def write(voxels, path, spacing=2.0):
        image = SimpleITK.GetImageFromArray(np.asarray(voxels, dtype=np.uint8).transpose(2, 1, 0))
        image.SetSpacing([spacing] * 3)
        SimpleITK.WriteImage(image, str(path))
        return path

    return write


@pytest.fixture(scope="session")
def names():
    """Names of all files and folders in a folder, hidden ones as well."""
    return lambda folder: sorted(path.name for path in folder.iterdir())


@pytest.fixture(scope="session")
def mask_file(save, tmp_path_factory):
    heart = samples.lifelike_lv(2.0).mask
    return save(heart.voxels, tmp_path_factory.mktemp("mask") / "heart.nii.gz")


@pytest.fixture(scope="session")
def label_map(save, tmp_path_factory):
    """The same heart as in the challenge ACDC, with a blood pool that fills its cavity."""
    wall = samples.lifelike_lv(2.0).mask.voxels
    filled = np.stack([fill(plane) for plane in np.moveaxis(wall, 2, 0)], axis=2)
    labels = 2 * wall + 3 * (filled & ~wall)
    return save(labels, tmp_path_factory.mktemp("labels") / "labels.nii.gz")


@pytest.fixture(scope="session")
def fitted(run, mask_file, tmp_path_factory):
    out = tmp_path_factory.mktemp("fit") / "new" / "folder"
    return run("fit", mask_file, "-o", out), out
