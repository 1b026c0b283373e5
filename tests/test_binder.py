"""Binder's folder is what repo2docker, which builds the image, takes it for."""

from __future__ import annotations

from pathlib import Path

import pytest


def test_binder_folder_is_built_as_it_says(
    repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    app = pytest.importorskip("repo2docker.app", reason="jupyter-repo2docker is not installed")
    monkeypatch.chdir(repository)
    builder = app.Repo2Docker()
    packs = (kind(builder.base_image) for kind in builder.buildpacks)
    pack = next(pack for pack in packs if pack.detect())
    pack.platform = "linux/amd64"
    dockerfile = pack.render({})
    assert type(pack).__name__ == "PythonBuildPack"
    assert (repository / "binder" / "runtime.txt").read_text().strip() == (
        f"python-{pack.python_version}"
    )
    assert 'pip install --no-cache-dir -r "binder/requirements.txt"' in dockerfile
    assert "RUN ./binder/postBuild" in dockerfile
    for package in (repository / "binder" / "apt.txt").read_text().split():
        assert package in dockerfile
