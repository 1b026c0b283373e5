"""`heartgen rasterize`, `heartgen render`, and `heartgen convert` to linear or quadratic cells."""

from __future__ import annotations

import numpy as np
import pytest

import heartgen

pytestmark = pytest.mark.slow

nibabel = pytest.importorskip("nibabel")


@pytest.mark.parametrize("partial", [False, True])
def test_rasterize_fills_the_voxels_of_the_other_image(
    run, fitted, mask_file, tmp_path, names, partial
):
    out = tmp_path / "mesh.nii.gz"
    more = ["--partial"] if partial else []
    outcome = run("rasterize", fitted[1] / "mesh.exf", mask_file, "-o", out, *more)
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout.split() == [str(out)]
    assert "% of the volume of the mesh are in the image" in outcome.stderr
    drawn, like = nibabel.load(out), nibabel.load(mask_file)
    np.testing.assert_allclose(drawn.affine, like.affine, atol=1e-4)
    image, mask = np.asarray(drawn.dataobj), np.asarray(like.dataobj) > 0
    overlap = 2 * np.sum((image > 0.5) & mask) / (np.sum(image > 0.5) + mask.sum())
    assert overlap > 0.95
    assert (len(np.unique(image)) > 2) == partial
    assert names(tmp_path) == ["mesh.nii.gz"]


def test_render_draws_rows_and_columns(run, fitted, mask_file, tmp_path):
    pv = pytest.importorskip("pyvista")
    out = tmp_path / "heart.png"
    outcome = run("render", fitted[1] / "mesh.exf", mask_file, "-o", out, "--view", "basal",
                  "--view", "septal", "--view", "apical")  # fmt: skip
    if "graphics library" in outcome.stderr:
        pytest.skip(outcome.stderr)
    assert outcome.exit_code == 0, outcome.output
    size = pv.read(out).dimensions
    assert size[0] / size[1] == pytest.approx(3 / 2)


@pytest.mark.parametrize(
    ("target", "options", "note"),
    [
        ("heart.inp", ["--cells", "tet4", "--pieces", "1x1x1"], "resampled to 396 tet4"),
        ("heart.feb", ["--cells", "hex20"], "hex20 and 24 wedge15"),
        ("heart.vtu", ["--pieces", "1x1x1"], "60 hex8 and 12 wedge6"),
        ("heart.stl", [], "triangles: 0."),
    ],
)
def test_convert_resamples_and_says_what_it_costs(run, fitted, tmp_path, target, options, note):
    outcome = run("convert", fitted[1] / "mesh.exf", tmp_path / target, *options)
    assert outcome.exit_code == 0, outcome.output
    assert note in outcome.stderr
    assert (tmp_path / target).stat().st_size > 0


def test_what_cannot_be_done_is_a_sentence(run, fitted, mask_file, tmp_path, names):
    mesh = fitted[1] / "mesh.exf"
    wrong = {
        ("rasterize", mesh, mask_file, "-o", tmp_path / "mesh.png"): "end the name in .nii",
        ("rasterize", mesh, mesh, "-o", tmp_path / "mesh.nii"): "mesh.exf",
        ("rasterize", tmp_path / "no.exf", mask_file, "-o", tmp_path / "m.nii"): "no.exf",
        ("render", mesh, "-o", tmp_path / "mesh.pdf"): "end the name in .png",
        ("render", mesh, "-o", tmp_path / "m.png", "--color", "error"): "needs the mask",
        ("render", mesh, "-o", tmp_path / "m.png", "--view", "above"): "view 'above' is not known",
        ("convert", mesh, tmp_path / "m.exf", "--cells", "tet4"): "leave out the choice of cells",
        ("convert", mesh, tmp_path / "m.inp", "--cells", "tet5"): "'tet5' are not known",
        ("convert", mesh, tmp_path / "m.inp", "--pieces", "two"): "are not three positive numbers",
    }
    for arguments, sentence in wrong.items():
        outcome = run(*arguments)
        assert outcome.exit_code == 1, outcome.output
        assert sentence in " ".join(outcome.stderr.split()), outcome.stderr
    assert names(tmp_path) == []
    assert heartgen.read_mesh(mesh).n_elements == 72
