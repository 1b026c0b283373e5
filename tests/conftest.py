"""Fixtures and settings shared by all tests."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

import heartgen
from heartgen import samples
from heartgen.result import Personalization

REPOSITORY = Path(__file__).resolve().parents[1]

settings.register_profile("local", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "local")


@pytest.fixture(autouse=True)
def _broken_pipes_stay_errors() -> Iterator[None]:
    """Undo what Gmsh does to SIGPIPE: a later write to what has gone would end the process."""
    yield
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)


@pytest.fixture(scope="session")
def repository() -> Path:
    """Folder of the checkout."""
    return REPOSITORY


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the real cases, which lie beside the checkout; skip the test without them."""
    folder = REPOSITORY.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"the real cases are not there: {folder}")
    return folder


@pytest.fixture(scope="session")
def lifelike() -> samples.Sample:
    """A real-looking ventricle of voxels of 2 mm, which keep the tests quick."""
    return samples.lifelike_lv(2.0, noise=0.1, seed=4)


@pytest.fixture(scope="session")
def fitted(lifelike: samples.Sample) -> Personalization:
    """Its mesh at the first level of detail; nobody changes it."""
    return heartgen.personalize(lifelike.mask)
