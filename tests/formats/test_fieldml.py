"""FieldML: written by zinc, and refused where the file would say something else.

That zinc reads it as it is meant is told by `test_foreign.py`, for every kind of mesh.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec

import numpy as np
import pytest

from heartgen.errors import HeartgenError, MeshError
from heartgen.formats import exf, fieldml, write_mesh
from heartgen.mesh import MeshField

needs_zinc = pytest.mark.skipif(not find_spec("cmlibs"), reason="no wheel of zinc")


@needs_zinc
def test_groups_that_are_lost_are_told(small, tmp_path):
    written = write_mesh(small, tmp_path / "mesh.fieldml")
    assert written.files == (tmp_path / "mesh.fieldml",)
    assert written.notes == ("mesh.fieldml does not hold the 5 named groups of the mesh",)
    assert "tricubicHermite" in written.files[0].read_text("latin-1")


@needs_zinc
@pytest.mark.parametrize("part", ["coordinates", "depth"])
def test_a_file_that_says_something_else_is_not_written(small, tmp_path, monkeypatch, part):
    moved = MeshField("depth", np.full((small.n_elements, 64, 1), 0.5))
    other = small.with_dofs(small.dofs + 1e-6) if part == "coordinates" else small
    fields = [MeshField("depth", moved.values + 1e-6)] if part == "depth" else [moved]

    def wrong(_):
        return exf.exf_text(fieldml.ex_model(other, fields))

    monkeypatch.setattr(fieldml, "exf_text", wrong)
    named = "the coordinates" if part == "coordinates" else "the field 'depth'"
    with pytest.raises(MeshError, match=rf"m\.fieldml: FieldML cannot hold {named} of this mesh"):
        write_mesh(small, tmp_path / "m.fieldml", [moved])
    assert list(tmp_path.iterdir()) == []


@needs_zinc
def test_what_zinc_cannot_read_is_a_sentence(small, tmp_path, monkeypatch):
    monkeypatch.setattr(fieldml, "exf_text", lambda model: "EX Version: 3\nNode: 1\n")
    with pytest.raises(HeartgenError, match=r"FieldML: .*read node as no nodeset"):
        write_mesh(small, tmp_path / "m.fieldml")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [*fieldml.OWN_NAMES, "real.1d", "nodes.argument"])
def test_names_that_fieldml_has_taken_are_refused(small, tmp_path, name):
    # Zinc itself would crash.
    field = MeshField(name, np.zeros((small.n_elements, 64, 1)))
    with pytest.raises(MeshError, match=f"field '{name}': FieldML has this name"):
        write_mesh(small, tmp_path / "m.fieldml", [field])
    assert list(tmp_path.iterdir()) == []


def test_without_zinc_its_extra_is_named(small, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "cmlibs.zinc.context", None)
    with pytest.raises(HeartgenError, match=r"FieldML needs .* pip install 'heartgen\[fieldml\]'"):
        write_mesh(small, tmp_path / "m.fieldml")
    assert list(tmp_path.iterdir()) == []
