"""A disk that takes no more: one sentence, the old files as they were, and nothing cut off.

A limit on the size of files stands for the full disk: it fails in the middle of a write, in
libraries as well, and needs no rights.
"""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("resource")

OLD = "as it was"

START = """
import resource, sys
from pathlib import Path
import numpy as np
from heartgen.errors import HeartgenError
from heartgen.formats import FORMATS, file_name, read_mesh, write_mesh
from heartgen.images.writing import write_image
from heartgen.mesh import MeshField

def tried(write, *arguments):
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, hard))
    try:
        write(*arguments)
        print("no error")
    except HeartgenError as error:
        print(error)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
"""


def run(code, *arguments):
    """What a process of its own prints."""
    answer = subprocess.run(
        [sys.executable, "-c", START + code, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    assert not answer.stderr
    return answer.stdout.splitlines()


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".nii", ".nii.gz", ".nrrd", ".mha"])
@pytest.mark.parametrize("limit", [0, 100, 20_000])
def test_an_image_is_whole_or_not_there(tmp_path, ending, limit):
    path = tmp_path / f"image{ending}"
    path.write_text(OLD)
    code = """
noise = np.random.default_rng(0).integers(0, 255, (40, 40, 40)).astype(np.uint8)
tried(write_image, noise, np.eye(4), sys.argv[1])
"""
    (said,) = run(f"LIMIT = {limit}\n{code}", path)
    assert said.startswith(f"{path}: The file cannot be written")
    assert "choose a folder with free space" in said
    assert path.read_text() == OLD
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
def test_meshes_are_whole_or_not_there(usual, tmp_path):
    """In every format that there is; of several files, either all are new or none."""
    from heartgen.formats import FORMATS, write_mesh

    write_mesh(usual, tmp_path / "mesh.exf")
    code = """
LIMIT = 3000
folder = Path(sys.argv[1])
mesh = read_mesh(folder / "mesh.exf")
fiber = MeshField("fiber", np.tile([1.0, 0.0, 0.0], (mesh.n_elements, 64, 1)))
for name in FORMATS:
    if name == "fieldml":
        continue
    path = folder / name / file_name("heart", name)
    files = write_mesh(mesh, path, [fiber], name).files
    for file in files:
        file.write_text("as it was")
    tried(write_mesh, mesh, path, [fiber], name)
    there = sorted(file for file in path.parent.iterdir())
    untouched = all(file.read_text() == "as it was" for file in there)
    print(name, "untouched" if untouched and there == sorted(files) else there)
"""
    said = run(code, tmp_path)
    assert said[1::2] == [f"{name} untouched" for name in FORMATS if name != "fieldml"]
    assert all("cannot be written (File too large)" in line for line in said[::2])
