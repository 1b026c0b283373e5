"""Importing heartgen is instant and complete."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

import heartgen

HEAVY = {
    "IPython",
    "SimpleITK",
    "ipywidgets",
    "matplotlib",
    "numba",
    "pyvista",
    "scipy",
    "skimage",
    "trame_vtk",
}


def modules_after(statement: str) -> set[str]:
    """Top-level modules that a fresh interpreter has loaded after a statement."""
    code = f"{statement}; import json, sys; print(json.dumps(sorted(sys.modules)))"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    return {name.partition(".")[0] for name in json.loads(answer.stdout)}


def test_import_loads_nothing_heavy() -> None:
    loaded = modules_after("import heartgen")
    assert "heartgen" in loaded
    assert not loaded & HEAVY


@pytest.mark.parametrize("name", heartgen.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(heartgen, name) is not None
    assert name in dir(heartgen)


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="nonsense"):
        _ = heartgen.nonsense
