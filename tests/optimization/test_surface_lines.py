"""Course of the lines: what costs, what is free, and how much, where the answer is known."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from heartgen.mesh import HexMesh
from heartgen.mesh.dof_map import DofMap, FaceDofMap
from heartgen.mesh.surface_faces import tabulate_face
from heartgen.optimization.surface_lines import SurfaceLines
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh
from heartgen.warping import warp
from tests.optimization.hearts import Heart

WIDE, HIGH = 9.0, 14.0
"""Sides of the flat face along xi1 and xi2, mm."""

SLIGHT = 0.01
"""Bend of its lines, mm, whose square is nothing beside the sides."""

SHAPE = (1, 12, 6)


FAR = 1000.0
"""A movement beside which those of the tests are small, mm."""


def lines(
    unoptimized: np.ndarray, faces: object = None, movement: float = FAR, **weights: float
) -> SurfaceLines:
    """The term; a face is free in its 16 coefficients unless `faces` are given."""
    n = len(unoptimized)
    numbers = np.arange(16 * n).reshape(n, 16)
    single = SimpleNamespace(
        dofs=numbers, extraction=np.tile(np.eye(48), (n, 1, 1)), at=lambda q: q.reshape(n, 16, 3)
    )
    of = {name: np.full(n, weights.get(name, 0.0) / n) for name in ("fair", "smooth", "place")}
    return SurfaceLines(faces or single, unoptimized, movement=movement, **of)  # type: ignore[arg-type]


def flat(
    change: Callable[[np.ndarray, np.ndarray], tuple[object, ...]] = lambda u, v: (0, 0, 0),
) -> np.ndarray:
    """Coefficients (1, 16, 3) of a plane rectangle with straight lines, changed by a cubic, mm."""
    uv = np.stack(np.meshgrid(*2 * [np.linspace(0, 1, 4)], indexing="ij"), -1).reshape(-1, 2)
    u, v = uv.T
    points = np.stack([WIDE * u, HIGH * v, 0 * u], -1)
    points += np.stack(np.broadcast_arrays(*change(u, v), 0 * u)[:3], -1)
    return np.linalg.solve(tabulate_face(uv), points)[None]


def cost(x: np.ndarray, unoptimized: np.ndarray, **weights: float) -> float:
    """Term of faces (f, 16, 3) against the unoptimized ones."""
    return lines(unoptimized, **weights).near(x.reshape(-1, 3)).value(x.reshape(-1, 3))


@pytest.mark.parametrize(
    "slide",
    [
        lambda u, v: (0, 3 * v**2, 0),
        lambda u, v: (2 * u**2 - u**3, 0, 0),
        lambda u, v: (1.5, -0.7, 2.0),
        lambda u, v: (0.3 * WIDE * u, -0.1 * HIGH * v, 0),
    ],
    ids=["rows along", "columns around", "shift", "stretch"],
)
def test_movement_along_straight_lines_is_free(slide: Callable[..., tuple[object, ...]]) -> None:
    assert cost(flat(slide), flat(), fair=1.0) < 1e-12
    assert FAR**2 * cost(flat(slide), flat(), place=1.0) > 1e-2


def test_a_longitudinal_line_is_to_be_straight_whatever_it_was() -> None:
    bent = flat(lambda u, v: (SLIGHT * v**2, 0, 0))
    expected = pytest.approx((2 * SLIGHT / HIGH) ** 2, rel=1e-3)
    assert cost(bent, flat(), fair=1.0) == expected
    assert cost(bent, bent, fair=1.0) == expected


def test_a_circumferential_line_is_to_be_as_it_was() -> None:
    bent = flat(lambda u, v: (0, SLIGHT * u**2, 0))
    expected = pytest.approx((2 * SLIGHT / WIDE) ** 2, rel=1e-3)
    assert cost(bent, flat(), fair=1.0) == expected
    assert cost(flat(), bent, fair=1.0) == expected
    assert cost(bent, bent, fair=1.0) < 1e-20


def test_a_twist_costs_by_the_area() -> None:
    twisted = flat(lambda u, v: (SLIGHT * u * v, 0, 0))
    expected = pytest.approx(SLIGHT**2 / (WIDE * HIGH), rel=1e-2)
    assert cost(twisted, flat(), fair=1.0) == expected
    assert cost(twisted, twisted, fair=1.0) < 1e-20


@pytest.mark.parametrize(
    ("bulge", "expected"),
    [
        (lambda u, v: (0, 0, SLIGHT * u**2), (2 * SLIGHT / WIDE) ** 2),
        (lambda u, v: (0, 0, SLIGHT * v**2), (2 * SLIGHT / HIGH) ** 2),
        (lambda u, v: (0, 0, SLIGHT * u * v), SLIGHT**2 / (WIDE * HIGH)),
    ],
    ids=["around", "along", "twist"],
)
def test_a_bulge_is_no_lateral_bend_and_costs_smoothness(
    bulge: Callable[..., tuple[object, ...]], expected: float
) -> None:
    assert cost(flat(bulge), flat(), smooth=1.0) == pytest.approx(expected, rel=1e-3)
    assert cost(flat(bulge), flat(), fair=1.0) < 1e-4 * expected
    assert cost(flat(bulge), flat(bulge), smooth=1.0) < 1e-20


def test_smoothness_does_not_know_movement_within_the_plane() -> None:
    swung = flat(lambda u, v: (SLIGHT * v**3, SLIGHT * u * v, 0))
    assert cost(swung, flat(), smooth=1.0) < 1e-20


def test_place_counts_what_moves_within_the_surface() -> None:
    moved = flat(lambda u, v: (0.3, 0.4, 7.0))
    assert FAR**2 * cost(moved, flat(), place=1.0) == pytest.approx(0.3**2 + 0.4**2)


def test_place_draws_back_harder_what_moved_far() -> None:
    def pull(movement: float) -> float:
        """Slope along a movement (mm) in units of itself; 2 for a spring."""
        q = flat(lambda u, v: (movement, 0, 0)).reshape(-1, 3)
        blocks = lines(flat(), movement=1.0, place=1.0).near(q).blocks
        return float(blocks.gradient.reshape(-1, 3)[:, 0].sum() * 2 / movement)

    assert pull(0.1) == pytest.approx(2, rel=1e-3)
    assert pull(2.0) == pytest.approx(2 * (1 + 2.0**4))


@pytest.fixture(scope="module")
def cup() -> HexMesh:
    """A body of revolution about z."""
    round_cup = TruncatedEllipsoid(
        center=np.zeros(2),
        lean=np.zeros(2),
        section=20 * np.eye(2),
        axis=50.0,
        cut=0.4,
        wall=10.0,
        apex=8.0,
        taper=(0.0, 0.0),
        bend=np.zeros(2),
    )
    return ellipsoid_mesh(round_cup, SHAPE)


def walls(mesh: HexMesh) -> np.ndarray:
    """Faces of endo- and epicardium, (f, 16, 3)."""
    faces = FaceDofMap(DofMap(mesh.topology), mesh.topology)
    rows = np.concatenate([np.arange(len(faces.faces))[faces.rows[n]] for n in ("lv_endo", "epi")])
    return np.asarray(faces.control(mesh)[rows])


def wave(points: np.ndarray) -> np.ndarray:
    """A wave of a millimeter along the cup."""
    return np.sin(points[:, 2] / 6)


def swung(points: np.ndarray) -> np.ndarray:
    """Every height turned about the axis, this way and that."""
    turn = Rotation.from_rotvec(np.outer(wave(points) / 20, [0, 0, 1]))
    return np.asarray(turn.apply(points))


def slid(points: np.ndarray) -> np.ndarray:
    """Every height moved along the axis, this way and that."""
    return points + np.outer(wave(points), [0, 0, 1])


def test_meridians_cost_nothing(cup: HexMesh) -> None:
    rest = cost(walls(cup), walls(cup), fair=1.0)
    swing = warp(cup, swung)
    assert rest < 1e-4
    assert cost(walls(swing), walls(swing), fair=1.0) > 100 * rest


def test_rows_may_be_spaced_as_elements_like_but_meridians_not_swing(cup: HexMesh) -> None:
    rest = cost(walls(cup), walls(cup), fair=1.0)
    slide, swing = (walls(warp(cup, how)) for how in (slid, swung))
    # Both move as far; the one along the meridians, which stay meridians.
    moved = [FAR * np.sqrt(cost(x, walls(cup), place=1.0)) for x in (slide, swing)]
    assert moved[0] == pytest.approx(moved[1], rel=0.5)
    assert cost(slide, slide, fair=1.0) < 2 * rest + 1e-6
    assert cost(swing, walls(cup), fair=1.0) > 10 * cost(slide, walls(cup), fair=1.0)


def test_templates_have_fair_lines(left: Heart) -> None:
    # Of an oval, lean and bent cup: not quite meridians, but next to those of a disturbed mesh.
    noise = np.random.default_rng(0).standard_normal(left.mesh.dofs.shape)
    disturbed = left.mesh.with_dofs(left.mesh.dofs + noise)
    rest, other = (cost(walls(m), walls(m), fair=1.0) for m in (left.mesh, disturbed))
    assert rest < 0.1 * other


@pytest.mark.parametrize("weight", ["fair", "smooth", "place"])
def test_a_motion_of_mesh_and_unoptimized_mesh_changes_nothing(cup: HexMesh, weight: str) -> None:
    moved = walls(warp(cup, lambda p: swung(slid(p)) + np.outer(wave(p), [0.2, 0.1, 0.0])))
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    there = [x @ turn.T + [300.0, -200.0, 100.0] for x in (moved, walls(cup))]
    here = cost(moved, walls(cup), **{weight: 1.0})
    assert here > 0
    assert cost(there[0], there[1], **{weight: 1.0}) == pytest.approx(here, rel=1e-6)


def test_fairness_and_smoothness_do_not_know_size(cup: HexMesh) -> None:
    moved = walls(warp(cup, swung))
    for weight, power in (("fair", 0), ("smooth", 0), ("place", 2)):
        here = cost(moved, walls(cup), **{weight: 1.0})
        there = cost(0.1 * moved, 0.1 * walls(cup), **{weight: 1.0})
        assert there == pytest.approx(0.1**power * here, rel=1e-6)
