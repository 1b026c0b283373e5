"""Fields on a mesh."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.errors import MeshError
from heartgen.mesh import MeshField
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.surface_faces import field_on_faces


def test_between_the_lattice_a_field_is_cubic() -> None:
    def cubic(xi):  # (q, 3) to (q, 2)
        return np.stack([xi[:, 0] ** 3 * xi[:, 2], 1 - xi[:, 1] ** 3 * xi[:, 2] ** 2], -1)

    field = MeshField("cubic", np.stack([cubic(lattice()), 2 * cubic(lattice())]))
    xi = np.random.default_rng(0).random((20, 3))
    assert_allclose(field.evaluate(xi), [cubic(xi), 2 * cubic(xi)], atol=1e-13)
    assert field.components == 2
    assert not field.per_element


def test_one_value_per_element_is_constant_in_it() -> None:
    field = MeshField("segment", np.array([3, 1, 2]))
    assert field.per_element
    assert field.values.dtype == np.float64
    assert_array_equal(field.evaluate(lattice())[..., 0], np.repeat([[3], [1], [2]], 64, axis=1))


@pytest.mark.parametrize(
    ("name", "values", "message"),
    [
        ("", np.zeros(3), "cannot hold this name"),
        (" padded", np.zeros(3), "cannot hold this name"),
        ("two\nlines", np.zeros(3), "cannot hold this name"),
        ("number", np.float64(1), "is no field"),
        ("coarse", np.zeros((3, 8, 1)), r"\(e, 64, k\)"),
        ("words", np.array(["a", "b"]), "is no field"),
        ("complex", np.array([1j]), "is no field"),
        ("unknown", np.array([1.0, np.nan]), "not finite"),
    ],
)
def test_what_is_no_field_is_refused(name, values, message) -> None:
    with pytest.raises(MeshError, match=message):
        MeshField(name, values)


def test_on_a_face_a_field_is_what_it_is_in_the_element() -> None:
    values = np.random.default_rng(1).random((2, 64, 3))
    field = MeshField("any", values)
    uv = np.array([[0.2, 0.7], [0.9, 0.1]])
    ends = {0: (0, 0.0), 1: (0, 1.0), 2: (1, 0.0), 3: (1, 1.0), 4: (2, 0.0), 5: (2, 1.0)}
    for face, (axis, end) in ends.items():
        xi = np.insert(uv, axis, end, axis=1)
        on_face = field_on_faces(field, np.array([[1, face]]), uv)
        assert_allclose(on_face[0], field.evaluate(xi)[1], atol=1e-13)
