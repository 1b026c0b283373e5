"""`heartgen demo`: a sample, its mesh and its page."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import heartgen
from heartgen import samples

pytestmark = pytest.mark.slow


def test_demo_makes_everything(run, names, files, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    pytest.importorskip("trame_vtk")
    out = tmp_path / "demo"
    outcome = run("demo", "-o", out, "--sample", "tilted")
    assert outcome.exit_code == 0, outcome.output
    assert names(out) == ["index.html", "mask.nii.gz", *files]
    assert str(out / "index.html") in outcome.stdout
    image, mask = nibabel.load(out / "mask.nii.gz"), samples.load("tilted").mask
    assert_array_equal(np.asarray(image.dataobj) > 0, mask.voxels)
    assert_allclose(np.diag([-1, -1, 1, 1]) @ image.affine, mask.affine, atol=1e-4)
    again = heartgen.read_mask(out / "mask.nii.gz")
    assert_array_equal(again.voxels, mask.voxels)
    assert_allclose(again.affine, mask.affine, atol=1e-4)


@pytest.mark.parametrize("missing", ["pyvista", "trame_vtk", "matplotlib"])
def test_without_what_draws_the_mesh_is_there_and_the_page_is_missed(
    names, missing, files, tmp_path
):
    code = f"import sys; sys.modules[{missing!r}] = None; from heartgen.cli import main; main()"
    answer = subprocess.run(
        [sys.executable, "-c", code, "demo", "-o", "out", "--sample", "ideal"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    assert names(tmp_path / "out") == ["mask.nii.gz", *files]
    told = " ".join(answer.stderr.split())
    assert "There is no page: " in told
    assert f"need the package {missing}" in told
    assert "pip install 'heartgen[plot]'" in answer.stderr
    assert answer.stdout.endswith("The mesh is in out.\n")
