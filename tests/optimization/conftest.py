"""Hearts, small enough to be optimized in a moment."""

from __future__ import annotations

import pytest

from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.optimization import fit_target
from heartgen.templates import biventricular_template, lv_template
from tests.optimization.hearts import Heart

COARSE = 2.0
"""Voxel size that keeps the tests quick, mm."""

LEFT, BOTH = (1, 8, 4), (2, 6, 3)
"""Elements of the small meshes."""


@pytest.fixture(scope="session")
def left() -> Heart:
    """A left ventricle alone."""
    anatomy = analyze(samples.lifelike_lv(COARSE).mask)
    return Heart(anatomy, fit_target(anatomy), lv_template(anatomy, LEFT))


@pytest.fixture(scope="session")
def both() -> Heart:
    """Both ventricles."""
    anatomy = analyze(samples.biv(COARSE).mask)
    return Heart(anatomy, fit_target(anatomy), biventricular_template(anatomy, BOTH))


@pytest.fixture(scope="session", params=["left", "both"])
def heart(request: pytest.FixtureRequest) -> Heart:
    """Either of them."""
    found: Heart = request.getfixturevalue(request.param)
    return found
