"""Warping: both ways reproduce affine maps, and the continuum follows what the nodes do not see."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.mesh import HexMesh
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.quadrature import gauss_cube
from heartgen.warping import warp, warp_nodes

XI = gauss_cube((4, 4, 3))[0]


@pytest.fixture(scope="module")
def cup() -> HexMesh:
    """A round cup with a pole."""
    topology = cup_topology((1, 6, 3))
    flat = HexMesh(np.zeros((len(topology.constant), 3)), topology)
    rows = topology.functionals(np.eye(64))
    angle = 2 * np.pi * (topology.index[:, 1, None] + np.linspace(0, 1, 4)) / 6
    level = np.pi / 2 * (topology.index[:, 2, None] + np.linspace(0, 1, 4)) / 3
    r = np.linspace(20, 30, 4)
    k, j, i = np.meshgrid(np.arange(4), np.arange(4), np.arange(4), indexing="ij")
    i, j, k = i.ravel(), j.ravel(), k.ravel()
    points = r[k][None, :, None] * np.stack(
        [
            np.sin(level[:, j]) * np.cos(angle[:, i]),
            np.sin(level[:, j]) * np.sin(angle[:, i]),
            -np.cos(level[:, j]),
        ],
        -1,
    )
    dofs = np.linalg.lstsq(rows.toarray(), points.reshape(-1, 3), rcond=None)[0]
    return flat.with_dofs(dofs)


def off(mesh: HexMesh, cup: HexMesh, move: object) -> float:
    """Distance of material points from where a map takes them, root of the mean square, mm."""
    goal = move(cup.evaluate(XI).reshape(-1, 3)).reshape(cup.n_elements, -1, 3)  # type: ignore[operator]
    return float(np.sqrt(((mesh.evaluate(XI) - goal) ** 2).sum(-1).mean()))


@pytest.mark.parametrize("way", [warp, warp_nodes])
def test_an_affine_map_comes_back(cup: HexMesh, way: object) -> None:
    affine = np.eye(4)
    affine[0, 2], affine[1, 1], affine[:3, 3] = 0.4, 1.3, [5, -3, 2]
    moved = way(cup, lambda p: p @ affine[:3, :3].T + affine[:3, 3])  # type: ignore[operator]
    assert np.abs(moved.dofs - cup.transformed(affine).dofs).max() < 1e-6


def test_the_continuum_follows_what_lies_between_the_nodes(cup: HexMesh) -> None:
    middle = cup.evaluate(np.full((1, 3), 0.5))[8, 0]

    def bulge(points: np.ndarray) -> np.ndarray:
        near = np.exp(-(((points - middle) / 6) ** 2).sum(-1, keepdims=True))
        return np.asarray(points + 5 * near)

    assert off(warp(cup, bulge), cup, bulge) < 0.9 * off(warp_nodes(cup, bulge), cup, bulge)
