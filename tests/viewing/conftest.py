"""Results to look at: made once, on coarse voxels."""

from __future__ import annotations

import pytest

import heartgen
from heartgen import samples


@pytest.fixture(scope="session")
def result():
    return heartgen.personalize(samples.lifelike_lv(2.0).mask)


@pytest.fixture(scope="session")
def stack():
    """Fitted to slices far apart."""
    return heartgen.personalize(samples.lifelike_lv((1.5, 1.5, 8.0)).mask)
