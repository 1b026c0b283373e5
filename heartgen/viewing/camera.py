"""Where one looks at a heart from: the side and a little above, the base up."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.fields import HeartAxes
from heartgen.mesh import HexMesh

Array = NDArray[np.float64]

ELEVATION = 30.0
"""Degrees above the plane across the long axis from which one looks, to see into the cavity."""

AZIMUTH = -60.0
"""Degrees around the long axis, from the wider axis of the pool, at which one stands."""

UPRIGHT = 90.0
"""Elevation straight from above, degrees."""

VIEW_ANGLE = 30.0
"""Degrees the camera sees; browsers know only this one, the default of VTK."""

FILL = 1.05
"""Height of the view over that of the ball around the mesh."""


def camera_around(
    points: Array, azimuth: float = AZIMUTH, elevation: float = ELEVATION
) -> tuple[Array, Array]:
    """Place the camera so that points are in view.

    Parameters
    ----------
    points : (n, 3) float64
        mm, heart frame.
    azimuth, elevation : float
        Degrees around the long axis and above the plane across it from which one looks.

    Returns
    -------
    eye, center : (3,) float64
        Where the camera is, and what it looks at.
    """
    center = (points.min(0) + points.max(0)) / 2
    radius = float(np.linalg.norm(points - center, axis=1).max())
    towards = direction_of(azimuth, elevation)
    return center + FILL * radius / np.sin(np.radians(VIEW_ANGLE / 2)) * towards, center


def direction_of(azimuth: float = AZIMUTH, elevation: float = ELEVATION) -> Array:
    """Unit vector (3,) from the heart towards who looks at it, heart frame.

    Parameters
    ----------
    azimuth, elevation : float
        As of `camera_around`.
    """
    around, above = np.radians([azimuth, elevation])
    return np.array([np.cos(around) * np.cos(above), np.sin(around) * np.cos(above), np.sin(above)])


def look_at(
    plotter: Any,
    mesh: HexMesh,
    frame: Array,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
) -> None:
    """Place the camera of a plotter so that a mesh stands upright.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Whose camera is placed.
    mesh : HexMesh
        mm, world (LPS).
    frame : (4, 4) float64
        Heart to world: z from apex to base, x to the right ventricle or along the wider axis. mm.
    azimuth, elevation : float
        As of `camera_around`; straight from above or below, y is up.
    """
    rotation, origin = frame[:3, :3], frame[:3, 3]
    points = (mesh.lagrange_points().reshape(-1, 3) - origin) @ rotation
    eye, center = camera_around(points, azimuth, elevation)
    place = np.stack([center, eye]) @ rotation.T + origin
    aim(plotter, place[1], place[0], rotation[:, 1 if abs(elevation) == UPRIGHT else 2])
    plotter.reset_camera_clipping_range()


def aim(plotter: Any, eye: Array, center: Array, up: Array) -> None:
    """Place the camera of a plotter.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Whose camera is placed.
    eye, center, up : (3,) float64
        Where the camera is, what it looks at, and the direction that is up in the picture.
    """
    plotter.camera.focal_point = center
    plotter.camera.position = eye
    plotter.camera.up = up
    plotter.camera.view_angle = VIEW_ANGLE


def frame_of(axes: HeartAxes) -> Array:
    """Heart to world (4, 4): x to the septum, y to the anterior wall, z to the base.

    Parameters
    ----------
    axes : HeartAxes
        Of the left ventricle.
    """
    frame = np.eye(4)
    frame[:3, :3] = np.stack([axes.septal, axes.anterior, axes.longitudinal], -1)
    frame[:3, 3] = axes.base
    return frame
