"""Meshes that carry fields: one of the left ventricle, one of both, and exact solids."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.solids import LAND, ellipsoid
from heartgen import samples
from heartgen.anatomy import Anatomy, analyze
from heartgen.mesh import HexMesh
from heartgen.options import Apex
from heartgen.templates import biventricular_template
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh


def oval(apex: Apex) -> HexMesh:
    """An oval, bent cup."""
    shape = TruncatedEllipsoid(
        center=np.array([3.0, -2.0]),
        lean=np.array([0.1, -0.05]),
        section=np.array([[22.0, 1.0], [1.0, 19.0]]),
        axis=55.0,
        cut=0.5,
        wall=10.0,
        apex=7.0,
        bend=np.array([0.001, 0.002]),
    )
    return ellipsoid_mesh(shape, (1, 12, 6), apex=apex, hole=5.0 if apex == "hole" else 0.0)


@pytest.fixture(scope="session")
def lv() -> HexMesh:
    return oval("collapsed")


@pytest.fixture(scope="session")
def holed() -> HexMesh:
    return oval("hole")


@pytest.fixture(scope="session")
def patched() -> HexMesh:
    return oval("patch")


@pytest.fixture(scope="session")
def biv_sample() -> samples.Sample:
    return samples.biv(2.0)


@pytest.fixture(scope="session")
def biv_anatomy(biv_sample: samples.Sample) -> Anatomy:
    return analyze(biv_sample.mask)


@pytest.fixture(scope="session")
def biv(biv_anatomy: Anatomy) -> HexMesh:
    """Both ventricles, with the insertion line and its creases."""
    return biventricular_template(biv_anatomy, (2, 12, 8))


@pytest.fixture(scope="session")
def biv_patched(biv_anatomy: Anatomy) -> HexMesh:
    return biventricular_template(biv_anatomy, (2, 12, 8), apex="patch")


@pytest.fixture(scope="session", params=["lv", "holed", "patched", "biv", "biv_patched"])
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
