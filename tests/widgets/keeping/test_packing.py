"""What is written down is read as it was, and makes nothing else."""

from __future__ import annotations

import json
import zipfile

import numpy as np
import pytest

from heartgen import samples
from heartgen.errors import InputError
from heartgen.widgets.keeping.packing import pack, unpack
from heartgen.widgets.links import Link


@pytest.mark.slow
def test_what_is_packed_is_the_same_and_shares_what_was_shared(finished, tmp_path):
    result = finished.shown.result
    known = (result.mask, result.anatomy)
    pack(known, tmp_path / "known")
    pack(result, tmp_path / "result", known)
    again_known = unpack(tmp_path / "known")
    again = unpack(tmp_path / "result", again_known)
    assert again.anatomy is again_known[1]
    assert again.template.topology is again.mesh.topology
    assert again.report == result.report
    assert again.options == result.options
    np.testing.assert_array_equal(again.mesh.dofs, result.mesh.dofs)
    assert again.deformations[0].least_determinant() == result.deformations[0].least_determinant()
    assert (tmp_path / "result").stat().st_size < (tmp_path / "known").stat().st_size


def test_a_packed_file_makes_nothing_but_what_is_listed(tmp_path):
    with pytest.raises(TypeError, match="cannot be packed"):
        pack(Link(), tmp_path / "link")
    with zipfile.ZipFile(tmp_path / "evil", "w") as archive:
        archive.writestr("graph.json", json.dumps({"class": "Popen", "fields": {"args": "ls"}}))
    with pytest.raises(InputError, match="no file of a heartgen session"):
        unpack(tmp_path / "evil")
    with zipfile.ZipFile(tmp_path / "pickle", "w") as archive:
        with archive.open("0.npy", "w") as member:
            np.save(member, np.array([{}], dtype=object), allow_pickle=True)
        archive.writestr("graph.json", json.dumps({"array": 0}))
    with pytest.raises(InputError, match="no file of a heartgen session"):
        unpack(tmp_path / "pickle")


@pytest.mark.slow
def test_a_stack_is_packed_with_its_slices(tmp_path):
    from heartgen.anatomy import analyze

    mask = samples.load("stack").mask
    anatomy = analyze(mask)
    pack((mask, anatomy), tmp_path / "stack")
    again = unpack(tmp_path / "stack")[1]
    np.testing.assert_array_equal(again.slices.heights, anatomy.slices.heights)
