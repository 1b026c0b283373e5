"""Sides from which one looks at a heart, by the names that cardiology has for them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.fields import HeartAxes
from heartgen.viewing.camera import UPRIGHT, direction_of, frame_of
from heartgen.viewing.rendering import VIEWS

Array = NDArray[np.float64]

USUAL = "oblique"
"""The view that a scene opens with: in the frame of the scene, which all hearts have."""

UPWARDS = [0.0, 0.0, 1.0]


def views_of(frame: Array, axes: HeartAxes | None = None) -> dict[str, Any]:
    """Where to look from: a direction towards the eye and what is up, in the frame of a scene.

    Parameters
    ----------
    frame : (4, 4) float64
        From the scene to the world (LPS), mm; z towards the base.
    axes : HeartAxes, optional
        Tell where the septum is; without them, only what needs no septum has a name.
    """
    views: dict[str, Any] = {USUAL: [direction_of().tolist(), UPWARDS]}
    turn = np.eye(3) if axes is None else frame[:3, :3].T @ frame_of(axes)[:3, :3]
    for name, (azimuth, elevation) in VIEWS.items():
        upright = abs(elevation) == UPRIGHT
        if name != USUAL and (axes is not None or upright):
            towards = turn @ direction_of(azimuth, elevation)
            views[name] = [towards.tolist(), turn[:, 1 if upright else 2].tolist()]
    return {name.capitalize(): view for name, view in views.items()}
