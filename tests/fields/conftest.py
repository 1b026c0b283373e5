"""Meshes that carry fields: one of the left ventricle, one of both, and exact solids."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.solids import LAND, ellipsoid
from heartgen import samples
from heartgen.anatomy import analyse
from heartgen.mesh import HexMesh
from heartgen.templates import biventricular_template
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh


@pytest.fixture(scope="session")
def lv() -> HexMesh:
    """An oval, bent cup."""
    shape = TruncatedEllipsoid(
        centre=np.array([3.0, -2.0]),
        lean=np.array([0.1, -0.05]),
        section=np.array([[22.0, 1.0], [1.0, 19.0]]),
        axis=55.0,
        cut=0.5,
        wall=10.0,
        apex=7.0,
        bend=np.array([0.001, 0.002]),
    )
    return ellipsoid_mesh(shape, (1, 12, 6))


@pytest.fixture(scope="session")
def biv_sample() -> samples.Sample:
    return samples.biv(2.0)


@pytest.fixture(scope="session")
def biv(biv_sample: samples.Sample) -> HexMesh:
    """Both ventricles, with the insertion line and its creases."""
    return biventricular_template(analyse(biv_sample.mask), (2, 12, 8))


@pytest.fixture(scope="session", params=["lv", "biv"])
def mesh(request: pytest.FixtureRequest) -> HexMesh:
    found: HexMesh = request.getfixturevalue(request.param)
    return found


@pytest.fixture(scope="session")
def ball() -> HexMesh:
    """Half of a hollow ball: radius 20 to 30 mm."""
    return ellipsoid(20.0, 20.0, 10.0, 0.0, (1, 12, 6))


@pytest.fixture(scope="session")
def land() -> HexMesh:
    """The ventricle of Land et al. (2015), its apex at z = -20 mm, its base at 5 mm."""
    return ellipsoid(*LAND, (1, 12, 6))
