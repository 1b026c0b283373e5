"""What is seen of a 3-D view."""

from __future__ import annotations

import io
import time

import numpy as np
import pytest

SATURATED = 40
"""Difference of color channels from which a pixel is no gray."""


def view(page):
    """Pixels (h, w, 3) of the 3-D view, without its buttons."""
    image = pytest.importorskip("PIL.Image")
    shot = page.locator(".hg-frame").screenshot()
    return np.asarray(image.open(io.BytesIO(shot)).convert("RGB"), dtype=int)[50:, 10:-10]


def is_colored(pixels):
    """Whether something colored is there, such as a mask, which has one color."""
    return np.mean(np.ptp(pixels, axis=2) > SATURATED) > 0.03


def is_mesh(pixels):
    """Whether something of many colors is there: blank and black views are not."""
    return is_colored(pixels) and len(np.unique((pixels // 16).reshape(-1, 3), axis=0)) > 40


def wait_for_view(page, ready, act=lambda: None):
    """Pixels of the 3-D view as soon as they are as wanted, acting before each look."""
    end = time.monotonic() + 60
    while True:
        act()
        pixels = view(page)
        if ready(pixels):
            return pixels
        assert time.monotonic() < end, "the view does not come"
        time.sleep(0.5)
