"""Ellipsoids of which everything is known."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyval

from heartgen.templates.ellipsoid import TruncatedEllipsoid


def radius(shape: TruncatedEllipsoid, depth: int) -> float:
    return float(np.sqrt(np.linalg.det(shape.semi_axes(depth)[0])))


def distance(shape: TruncatedEllipsoid, points: np.ndarray, depth: int) -> np.ndarray:
    """Distance to a surface without end, mm, by Gauss and Newton on a chart without a pole."""
    section, axis, _ = shape.semi_axes(depth)
    flat = (points[:, :2] - polyval(points[:, 2], shape.middle(depth)).T) @ np.linalg.inv(section).T
    polar = np.arctan2(np.hypot(*flat.T), -(points[:, 2] + shape.cut * shape.axis) / axis)
    angle = np.arctan2(flat[:, 1], flat[:, 0])
    at = polar[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    step = 1e-5 * np.eye(2)

    def on(at: np.ndarray) -> np.ndarray:
        return shape.points(np.arctan2(at[:, 1], at[:, 0]), np.hypot(*at.T), depth)

    for _ in range(10):
        slopes = np.stack([(on(at + h) - on(at - h)) / 2e-5 for h in step], -1)
        normal = np.einsum("nxi,nxj->nij", slopes, slopes)
        gradient = np.einsum("nxi,nx->ni", slopes, points - on(at))
        at = at + np.linalg.solve(normal, gradient[..., None])[..., 0]
    return np.asarray(np.linalg.norm(points - on(at), axis=1))
