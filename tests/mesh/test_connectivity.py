"""What is one and what is not."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal

from heartgen.mesh.connectivity import merge_coincident

PLACES = arrays(
    float, st.tuples(st.integers(1, 30), st.integers(1, 3)), elements=st.integers(-2, 2)
)


@given(PLACES, st.integers(0, 2**32 - 1))
def test_equal_places_get_equal_numbers_in_order_of_appearance(places, seed):
    jitter = 1e-13 * np.random.default_rng(seed).standard_normal(places.shape)
    number, first = merge_coincident(places + jitter)
    known = list(dict.fromkeys(map(tuple, places.tolist())))
    assert number.tolist() == [known.index(tuple(place)) for place in places.tolist()]
    assert_array_equal(places[first], known)
    assert_array_equal(number[first], np.arange(len(known)))
