"""Distance transforms agree with SciPy's, wherever the shape lies in its array."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.ndimage as ndi
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from heartgen.images.distance import box_around, inner_distance, near

shapes = hnp.arrays(bool, st.tuples(*[st.integers(1, 7)] * 3)).filter(
    lambda voxels: voxels.any() and not voxels.all()
)
spacings = st.tuples(*[st.floats(0.5, 4.0)] * 3).map(np.array)


@pytest.mark.slow
@given(shapes, spacings)
def test_distance_to_the_outside(voxels, spacing):
    expected = ndi.distance_transform_edt(voxels, sampling=spacing)
    np.testing.assert_allclose(inner_distance(voxels, spacing), expected, rtol=1e-5)


@given(shapes, spacings, st.floats(0.0, 12.0))
def test_near_is_what_the_distance_says(voxels, spacing, reach):
    away = ndi.distance_transform_edt(~voxels, sampling=spacing)
    clear = np.abs(away - reach) > 1e-4
    found = near(voxels, reach, spacing)
    np.testing.assert_array_equal(found[clear], (away <= reach)[clear])


@pytest.mark.slow
@given(shapes, spacings, st.floats(0.0, 12.0))
def test_box_holds_the_shape_and_its_surroundings(voxels, spacing, reach):
    outside = np.ones_like(voxels)
    outside[box_around(voxels, reach, spacing)] = False
    away = ndi.distance_transform_edt(~voxels, sampling=spacing)
    assert not outside[away <= reach].any()


def test_empty_and_full_shapes():
    none, spacing = np.zeros((3, 4, 5), dtype=bool), np.ones(3)
    assert not inner_distance(none, spacing).any()
    assert not near(none, 2.0, spacing).any()
    assert near(~none, 0.0, spacing).all()
