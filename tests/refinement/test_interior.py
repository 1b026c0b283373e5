"""The inside of the wall: it may move for quality, the surfaces may not."""

from __future__ import annotations

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.errors import InputError
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surfaces import face_control
from heartgen.pipeline import Personalization

HEARTS = {"lv": samples.lifelike_lv, "biv": samples.biv}


@pytest.fixture(scope="module", params=[*HEARTS, "patch"])
def pair(request: pytest.FixtureRequest) -> tuple[Personalization, Personalization]:
    heart = HEARTS.get(request.param, samples.lifelike_lv)(2.0)
    apex = "patch" if request.param == "patch" else "collapsed"
    straight, relaxed = (
        heartgen.personalize(heart.mask, apex=apex, interior=interior)
        for interior in ("straight", "relaxed")
    )
    return straight, relaxed


def test_surfaces_are_bit_equal(pair: tuple[Personalization, Personalization]) -> None:
    straight, relaxed = (r.mesh for r in pair)
    faces = straight.topology.external
    assert np.array_equal(face_control(straight, faces), face_control(relaxed, faces))
    assert not np.array_equal(straight.dofs, relaxed.dofs)
    np.testing.assert_allclose(volume(relaxed), volume(straight), rtol=1e-9)


def test_elements_are_better_and_proven(pair: tuple[Personalization, Personalization]) -> None:
    straight, relaxed = (r.report.quality for r in pair)
    assert relaxed.valid
    assert relaxed.mean > straight.mean
    assert relaxed.scaled_mean > straight.scaled_mean - 0.02


def test_interior_belongs_to_the_refinement() -> None:
    with pytest.raises(InputError, match="allow the refinement"):
        heartgen.Options(interior="relaxed", refine=False)
