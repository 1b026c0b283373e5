"""What is written of a result: files, and the fields that they hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import heartgen
from heartgen.errors import InputError
from heartgen.result import Personalization


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formats", "made"),
    [((), []), (("stl", "cheart"), []), (("pts", "stl"), ["fibers"]), (("pts", "vtu"), "all")],
)
def test_fields_are_made_for_formats_that_hold_them(fitted, tmp_path, monkeypatch, formats, made):
    asked = []
    monkeypatch.setattr(
        "heartgen.result.make_fields", lambda mesh, names, **_: asked.append(list(names)) or ()
    )
    fitted.write(tmp_path, formats)
    assert asked == [list(heartgen.fields.FIELDS) if made == "all" else made]


def test_an_invalid_mesh_whose_fields_cannot_be_made_has_a_report(fitted, tmp_path):
    broken = replace(fitted, mesh=fitted.mesh.with_dofs(np.full_like(fitted.mesh.dofs, np.nan)))
    assert [path.name for path in broken.write(tmp_path, ())] == ["report.json"]
    with pytest.raises(InputError, match="'fiber' is not known"):
        broken.write(tmp_path, (), fields=["fiber"])


def test_write_gives_three_files(fitted: Personalization, tmp_path: Path) -> None:
    paths = fitted.write(tmp_path / "out")
    assert [p.name for p in paths] == ["mesh.exf", "mesh.vtu", "report.json"]
    assert all(p.stat().st_size > 0 for p in paths)
