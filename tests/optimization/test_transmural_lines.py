"""The inside of the wall: it may move for quality, the surfaces may not."""

from __future__ import annotations

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.assessment import assess_quality
from heartgen.errors import Cancelled, InputError
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surface_faces import face_control
from heartgen.optimization import curve_transmural_lines
from heartgen.result import Personalization

pytestmark = pytest.mark.slow

HEARTS = {"lv": samples.lifelike_lv, "biv": samples.biv}


@pytest.fixture(scope="module", params=[*HEARTS, "patch"])
def straight(request: pytest.FixtureRequest) -> Personalization:
    heart = HEARTS.get(request.param, samples.lifelike_lv)(2.0)
    apex = "patch" if request.param == "patch" else "collapsed"
    return heartgen.personalize(heart.mask, apex=apex)


@pytest.fixture(scope="module")
def relaxed(straight: Personalization) -> HexMesh:
    return curve_transmural_lines(straight.mesh)


def test_surfaces_are_bit_equal(straight: Personalization, relaxed: HexMesh) -> None:
    mesh = straight.mesh
    faces = mesh.topology.external
    assert np.array_equal(face_control(mesh, faces), face_control(relaxed, faces))
    assert not np.array_equal(mesh.dofs, relaxed.dofs)
    np.testing.assert_allclose(volume(relaxed), volume(mesh), rtol=1e-9)


def test_elements_are_better_and_proven(straight: Personalization, relaxed: HexMesh) -> None:
    before, after = straight.report.quality, assess_quality(relaxed)
    assert after.valid
    assert after.mean > before.mean
    assert after.scaled_mean > before.scaled_mean - 0.02


def test_the_pipeline_relaxes_what_it_optimized() -> None:
    mask = samples.ideal_cup(2.0).mask
    one, other = (
        heartgen.personalize(mask, elements=(1, 8, 4), transmural_lines=i)
        for i in ("straight", "curved")
    )
    # Sums of the linear algebra library depend on its threads.
    np.testing.assert_allclose(other.mesh.dofs, curve_transmural_lines(one.mesh).dofs, atol=1e-9)
    assert other.report.quality.valid


def test_progress_can_cancel(straight: Personalization) -> None:
    def stop(done: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        curve_transmural_lines(straight.mesh, progress=stop)


def test_interior_belongs_to_the_optimization() -> None:
    with pytest.raises(InputError, match="allow the optimization"):
        heartgen.Options(transmural_lines="curved", optimize=False)
