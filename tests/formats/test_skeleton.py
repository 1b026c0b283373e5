"""Faces and lines of a mesh."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from heartgen.mesh.skeleton import COLLAPSED, skeleton


@pytest.mark.slow
def test_every_face_has_one_or_two_elements_and_the_outer_ones_are_the_named(mesh):
    faces = skeleton(mesh.topology).faces
    users = np.bincount(faces[faces != COLLAPSED])
    assert set(users) == {1, 2}
    outside = mesh.topology.external
    assert_array_equal(np.sort(faces[outside[:, 0], outside[:, 1]]), np.flatnonzero(users == 1))


def test_only_the_pole_collapses(mesh):
    faces = skeleton(mesh.topology).faces
    assert_array_equal(np.argwhere(faces == COLLAPSED), np.sort(mesh.topology.collapsed, axis=0))
