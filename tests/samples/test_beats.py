"""Hearts in two states are those of one heart."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.errors import InputError
from heartgen.samples.beats import BEATS, DIASTOLE, SYSTOLE, beat


@pytest.mark.slow
@pytest.mark.parametrize("name", BEATS)
def test_wall_keeps_its_volume_and_the_cavity_empties(name: str) -> None:
    large, small = beat(name, 3.0).values()
    assert (large.mask.name, small.mask.name) == (DIASTOLE, SYSTOLE)
    assert small.truth.wall_volume == pytest.approx(large.truth.wall_volume, rel=0.03)
    assert 0.5 < 1 - small.truth.cavity_volume / large.truth.cavity_volume < 0.6
    voxels = [np.count_nonzero(s.mask.voxels) * 27.0 for s in (large, small)]
    assert voxels == pytest.approx([large.truth.wall_volume, small.truth.wall_volume], rel=0.03)


def test_other_hearts_are_refused() -> None:
    with pytest.raises(InputError, match="lv, biv"):
        beat("rv")
