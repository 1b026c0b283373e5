"""Meshes for the tests of the kernel."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.mesh import HexMesh
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh

SHAPES = [(1, 12, 6), (2, 9, 4), (1, 3, 1), (3, 5, 2)]


@pytest.fixture(scope="session")
def oval() -> TruncatedEllipsoid:
    """A lean, oval, bent cup."""
    return TruncatedEllipsoid(
        center=np.array([3.0, -2.0]),
        lean=np.array([0.1, -0.05]),
        section=np.array([[22.0, 1.0], [1.0, 19.0]]),
        axis=55.0,
        cut=0.5,
        wall=10.0,
        apex=7.0,
        taper=(0.1, -0.1),
        bend=np.array([0.001, 0.002]),
    )


@pytest.fixture(params=SHAPES, ids=lambda s: "x".join(map(str, s)))
def cup(request: pytest.FixtureRequest, oval: TruncatedEllipsoid) -> HexMesh:
    """Its mesh."""
    return ellipsoid_mesh(oval, request.param)


@pytest.fixture
def disturbed(cup: HexMesh) -> HexMesh:
    """The same with every degree of freedom disturbed: no symmetry left."""
    noise = np.random.default_rng(1).standard_normal(cup.dofs.shape)
    return cup.with_dofs(cup.dofs + 0.05 * noise)
