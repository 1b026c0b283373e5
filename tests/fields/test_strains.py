"""Strains of segments, of motions that are known."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.solids import ellipsoid
from heartgen.errors import MeshError
from heartgen.fields import SEGMENTS, global_strains, segment_strains

RELAXED, SQUEEZED = (22.0, 60.0, 10.0, 20.0), (15.0, 52.0, 14.0, 17.0)
ELEMENTS = (1, 12, 6)


def test_size_alone_is_the_same_everywhere():
    mesh = ellipsoid(*RELAXED, ELEMENTS)
    found = segment_strains(mesh, mesh.transformed(np.diag([0.9, 0.9, 0.9, 1.0])))
    assert set(found) == set(SEGMENTS)
    for strain in found.values():
        assert strain.whole
        assert (strain.longitudinal, strain.circumferential, strain.radial) == pytest.approx(
            (-0.1, -0.1, -0.1)
        )


def test_segments_of_a_round_heart_are_alike_and_make_up_the_whole():
    before, after = ellipsoid(*RELAXED, ELEMENTS), ellipsoid(*SQUEEZED, ELEMENTS)
    found, whole = segment_strains(before, after), global_strains(before, after)
    for level in (range(1, 7), range(7, 13)):
        radial = [found[n].radial for n in level]
        assert np.ptp(radial) < 0.01
    all_radial = [strain.radial for strain in found.values()]
    assert min(all_radial) < whole.radial < max(all_radial)


def test_other_elements_are_refused():
    with pytest.raises(MeshError, match="elements correspond"):
        segment_strains(ellipsoid(*RELAXED, ELEMENTS), ellipsoid(*SQUEEZED, (1, 12, 8)))
