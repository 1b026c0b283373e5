"""Contours in the plane of a slice."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.images.contours import contour, slits
from heartgen.images.isosurface import Isosurface

I, J = np.indices((80, 80))
AWAY = np.hypot(I - 40, J - 40)


def outline(shape: np.ndarray) -> Isosurface:
    """The contour of a shape, pixels of 1 mm."""
    found = contour(shape, np.ones(2))
    points, normals = (np.c_[x, np.zeros(len(x))] for x in (found.points, found.normals))
    return Isosurface(points, np.zeros((0, 3), dtype=np.intp), found.lengths, normals)


@pytest.mark.parametrize("wall", [2.0, 15.0])
def test_a_ring_has_no_slits_however_thin(wall: float) -> None:
    assert not slits(outline((20 + wall > AWAY) & (AWAY >= 20)), 2.0).any()


def test_the_sides_of_a_slit_are_found_and_nothing_else() -> None:
    ring = (AWAY < 35) & (AWAY >= 20)
    ring[40, :40] = False
    found = outline(ring)
    side = (np.abs(found.points[:, 0] - 40) < 1) & (found.points[:, 1] < 40)
    side &= np.abs(AWAY[40, found.points[:, 1].astype(int)] - 27.5) < 5  # away from its ends
    told = slits(found, 2.0)
    assert side.sum() > 10
    assert told[side].all()
    assert not told[np.abs(found.points[:, 0] - 40) > 3].any()
