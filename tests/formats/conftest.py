"""Meshes to write: cups of several sizes, some refined, and one whose elements are turned.

And hearts: a template of every topology there is.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import get_args

import numpy as np
import pytest
import scipy.sparse as sp

from heartgen import samples
from heartgen.anatomy import Anatomy, analyze
from heartgen.mesh import HexMesh
from heartgen.mesh.hermite import cup_topology
from heartgen.options import Apex
from heartgen.templates import biventricular_template, lv_template
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh

HEARTS = [(ventricles, apex) for ventricles in ("lv", "biv") for apex in get_args(Apex)]
"""Ventricles and kind of apex of every topology there is."""

HOLE = 4.0
"""Radius of the apical hole, mm."""


@cache
def anatomy(ventricles: str) -> Anatomy:
    mask = samples.lifelike_lv(2.5).mask if ventricles == "lv" else samples.biv(2.5).mask
    return analyze(mask, "auto", ventricles)  # type: ignore[arg-type]


@pytest.fixture(scope="session", params=HEARTS, ids=[" ".join(heart) for heart in HEARTS])
def heart(request: pytest.FixtureRequest) -> HexMesh:
    """The template of a sample, in the Hermite basis."""
    ventricles, apex = request.param
    if ventricles == "lv":
        return lv_template(anatomy("lv"), (1, 8, 3), apex=apex, hole=HOLE)
    return biventricular_template(anatomy("biv"), (2, 8, 4), apex=apex, hole=HOLE)


@pytest.fixture(params=["hermite", "lagrange"])
def based(request: pytest.FixtureRequest, heart: HexMesh) -> HexMesh:
    """It in either basis."""
    return heart.to_lagrange() if request.param == "lagrange" else heart


CUPS = {
    "1x12x6": ((1, 12, 6), None),
    "2x12x8": ((2, 12, 8), None),
    "1x3x1": ((1, 3, 1), None),
    "1x12x6 refined": ((1, 12, 6), (2, 1, 3)),
    "1x3x1 refined": ((1, 3, 1), (2, 3, 2)),
}


def cup(name: str, apex: str = "collapsed") -> HexMesh:
    """A cup, tilted and slightly uneven so that no two places or derivatives agree by symmetry."""
    elements, pieces = CUPS[name]
    shape = TruncatedEllipsoid(
        center=np.zeros(2),
        lean=np.array([0.1, -0.05]),
        section=np.array([[22.0, 1.0], [1.0, 20.0]]),
        axis=60.0,
        cut=0.5,
        wall=10.0,
        apex=7.0,
    )
    mesh = ellipsoid_mesh(shape, elements, apex=apex, hole=6.0)
    uneven = 0.05 * np.random.default_rng(3).standard_normal(mesh.dofs.shape)
    tilt = np.linalg.qr(np.array([[2.0, 1.0, 0.5], [-1.0, 2.0, 0.3], [0.1, -0.4, 2.0]]))[0]
    tilt *= np.linalg.det(tilt)
    mesh = mesh.with_dofs((mesh.dofs + uneven) @ tilt.T)
    return mesh.refined(*pieces) if pieces else mesh


@pytest.fixture(scope="session", params=list(CUPS))
def mesh(request: pytest.FixtureRequest) -> HexMesh:
    return cup(request.param)


@pytest.fixture(scope="session")
def small() -> HexMesh:
    return cup("1x3x1")


@pytest.fixture(scope="session")
def usual() -> HexMesh:
    return cup("1x12x6")


@pytest.fixture(scope="session")
def turned() -> HexMesh:
    """Two bricks side by side that share a face but not their local axes; only C0 there."""
    i, j, k = np.meshgrid(*[np.arange(4)] * 3, indexing="ij")
    local = np.stack([i, j, k], -1).transpose(2, 1, 0, 3).reshape(64, 3)  # xi1 fastest
    second = local[:, [2, 0, 1]] + [3, 0, 0]  # its xi3 continues the xi1 of the first
    places = np.concatenate([local, second])
    unique, number = np.unique(places, axis=0, return_inverse=True)
    extraction = sp.csr_array(sp.eye_array(len(unique)).tocsr()[number.ravel()])
    corners = np.array([a + 4 * b + 16 * c for c in (0, 3) for b in (0, 3) for a in (0, 3)])
    nodes = np.unique(number.reshape(2, 64)[:, corners], return_inverse=True)[1].reshape(2, 8)
    topology = replace(
        cup_topology((1, 3, 1)),  # for what no writer asks of a mesh
        extraction=extraction,
        shape=(1, 2, 1),
        index=np.array([[0, 0, 0], [0, 1, 0]]),
        surfaces={"epi": np.array([[0, 5], [1, 3]])},
        collapsed=np.zeros((0, 2), dtype=np.intp),
        nodes=nodes,
    )
    uneven = 0.1 * np.random.default_rng(4).standard_normal(unique.shape)
    return HexMesh(unique + uneven, topology)


@pytest.fixture(scope="session")
def bricks(turned: HexMesh) -> HexMesh:
    """The same two bricks with all of their outside named: no element collapses."""
    outside = [(0, 0), (0, 2), (0, 3), (0, 4), (0, 5), (1, 0), (1, 1), (1, 2), (1, 3), (1, 5)]
    named = replace(turned.topology, surfaces={"epi": np.array(outside)})
    return replace(turned, topology=named)


@pytest.fixture(scope="session")
def biv() -> HexMesh:
    """Both ventricles."""
    return biventricular_template(analyze(samples.biv(2.5).mask, "auto", "biv"), (2, 12, 8))


@pytest.fixture(scope="session")
def hole() -> HexMesh:
    return cup("1x12x6", "hole")


@pytest.fixture(scope="session")
def patch() -> HexMesh:
    return cup("1x12x6", "patch")
