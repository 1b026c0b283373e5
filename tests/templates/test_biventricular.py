"""The left endocardium of the template of both ventricles is the ellipsoid fitted to the pool."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen import samples
from heartgen.anatomy import Anatomy, analyze
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.surface_faces import sample_faces
from heartgen.options import Apex
from heartgen.templates import biventricular_template
from heartgen.templates.ellipsoid import fit_ellipsoid
from tests.templates.shapes import distance, radius

COARSE = 2.0
"""Voxel size, mm."""


@pytest.fixture(scope="module")
def anatomy() -> Anatomy:
    return analyze(samples.biv(COARSE).mask)


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["collapsed", "hole", "patch"])
def test_the_endocardium_is_the_ellipsoid(anatomy: Anatomy, apex: Apex) -> None:
    shape = fit_ellipsoid(anatomy)
    mesh = biventricular_template(anatomy, (2, 12, 8), apex=apex, hole=5.0)
    in_heart = mesh.transformed(np.linalg.inv(anatomy.frame))
    points, _, _ = sample_faces(in_heart, mesh.topology.surfaces["lv_endo"], 6)
    assert distance(shape, points, 0).max() < 5e-3 * radius(shape, 0)
    assert jacobian_ratio(mesh).mean() > 0.55
