"""The named samples, made once."""

from __future__ import annotations

import pytest

from heartgen import samples


@pytest.fixture(scope="session")
def loaded():
    return {name: samples.load(name) for name in samples.names()}
