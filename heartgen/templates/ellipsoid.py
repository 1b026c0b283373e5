"""The truncated ellipsoid that stands for a left ventricle, and its fit to an anatomy."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.polynomial.polynomial import polyfit, polyval
from numpy.typing import NDArray
from scipy.optimize import least_squares

from heartgen.anatomy import Anatomy

START_CUT = 0.5
"""Equator below the base over the semi-axis at the start of the fit: a cut at 120 degrees."""

CUT_LIMITS = (-0.3, 0.9)
"""Bounds of the same: from a shallow bowl to an ellipsoid that is nearly closed."""

TAPER_LIMIT = 0.6
"""Bound of the taper: the radius stays positive and has one bulge."""

SECTION_LIMITS = np.log([3.0, 2.0, 2.0])
"""Bounds of a section's size over that of the pool, and of its elongation, as logarithms: semi-axes
up to 4 to 1 along the heart's axes."""

THIN = 0.15
"""Least thickness of wall and apex over the measured wall thickness."""

PRIOR = 0.05
"""Weight of the start in the fit; it decides between shapes that fit alike."""

PARAMETERS = (
    *(
        "place",
        "place",
        "lean",
        "lean",
        "section",
        "section",
        "section",
        "length",
        "height of base",
    ),
    *("wall", "apical wall", "pointedness", "pointedness", "bend", "bend"),
)
"""What the parameters of the fit are about, in words."""

AT_BOUND = 1e-3
"""Distance from a bound, over that between both, from which a parameter is at its bound."""

MAX_EVALUATIONS = 40

AROUND, ALONG = 24, 12
"""Samples of each surface in the fit."""

SWAYS = 4
"""Degree of the polynomial by which a pool leaves the long axis: it may turn back twice."""

STRAIGHT = np.zeros((SWAYS + 1, 2))
"""No such polynomial."""

OFF_AXIS = 0.5
"""Distance of a pool's section from the long axis, over its radius, from which the template follows
the pool: farther off, its apical part lies on one side of the pool and is matched to that alone."""

SECTIONS = 12
"""Sections of the pool that are compared, from apex to base; the tip's is not asked."""

ROBUST = 0.1
"""Distance over the radius of the pool from which a sample counts as an outlier."""


@dataclass(frozen=True, eq=False)
class TruncatedEllipsoid:
    """Endo- and epicardium of a left ventricle as two truncated ellipsoids.

    Coordinates are those of the heart's frame: z from apex to base, base at z = 0. A surface point
    is ``(center + lean z + bend z^2 + section (cos t, sin t) w(p), -axis (cut + cos p))``, where
    ``p`` runs from 0 at the apex to the angle at which z = 0, and ``w = sin p (1 + taper cos p)``:
    an exact ellipsoid for taper 0, a more pointed apex below it. The endocardium of a pool that
    leaves this axis sways about it, too.

    Attributes
    ----------
    center : (2,) float64
        Middle of the base, mm.
    lean : (2,) float64
        Sideways shift of the sections per mm of height.
    section : (2, 2) float64
        Endocardial cross-section at the equator, symmetric, mm.
    axis : float
        Endocardial semi-axis along z, mm.
    cut : float
        Height of the base above the equator over `axis`.
    wall, apex : float
        Thickness of the wall at the equator and at the apex, mm.
    taper : (float, float)
        Deviation of endo- and epicardium from an ellipsoid.
    bend : (2,) float64
        Curvature of the long axis, 1/mm.
    sway : (5, 2) float64
        How far the endocardium's sections lie from the long axis: coefficients of z^0 to z^4, in mm
        and powers of it.
    limited : tuple of str
        What of it a fit would have changed further, had it been allowed to.
    """

    center: NDArray[np.float64]
    lean: NDArray[np.float64]
    section: NDArray[np.float64]
    axis: float
    cut: float
    wall: float
    apex: float
    taper: tuple[float, float] = (0.0, 0.0)
    bend: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    sway: NDArray[np.float64] = field(default_factory=lambda: STRAIGHT)
    limited: tuple[str, ...] = ()

    def semi_axes(self, depth: float) -> tuple[NDArray[np.float64], float, float]:
        """Section (2, 2), semi-axis and base angle at a depth: 0 endocardium, 1 epicardium.

        Parameters
        ----------
        depth : float
            0 endocardium, 1 epicardium.
        """
        axis = self.axis + depth * self.apex
        section = self.section + depth * self.wall * np.eye(2)
        return section, axis, float(np.arccos(-self.cut * self.axis / axis))

    def profile(
        self, polar: NDArray[np.float64], depth: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Relative radius (n,) at polar angles (n,), and its derivative.

        Parameters
        ----------
        polar : (n,) float64
            Angle from the apex, rad.
        depth : float
            0 endocardium, 1 epicardium.
        """
        taper = (1 - depth) * self.taper[0] + depth * self.taper[1]
        value = np.sin(polar) * (1 + taper * np.cos(polar))
        return value, np.cos(polar) + taper * np.cos(2 * polar)

    def middle(self, depth: float) -> NDArray[np.float64]:
        """Middle of the sections at a depth: coefficients (5, 2) of the powers of the height.

        Parameters
        ----------
        depth : float
            0 endocardium, 1 epicardium.
        """
        out = (1 - depth) * self.sway
        out[:3] += [self.center, self.lean, self.bend]
        return np.asarray(out)

    def points(
        self, angle: NDArray[np.float64], polar: NDArray[np.float64], depth: float
    ) -> NDArray[np.float64]:
        """Surface points (n, 3) at angles around (n,) and polar angles (n,), heart frame, mm.

        Parameters
        ----------
        angle : (n,) float64
            Around the axis, rad.
        polar : (n,) float64
            Angle from the apex, rad.
        depth : float
            0 endocardium, 1 epicardium.
        """
        section, axis, _ = self.semi_axes(depth)
        z = -self.cut * self.axis - axis * np.cos(polar)
        ring = np.stack([np.cos(angle), np.sin(angle)], -1) @ section.T
        middle = polyval(z, self.middle(depth)).T
        xy = middle + ring * self.profile(polar, depth)[0][:, None]
        return np.concatenate([xy, z[:, None]], axis=1)


def fit_ellipsoid(anatomy: Anatomy) -> TruncatedEllipsoid:
    """Fit endo- and epicardium together to the level sets of an anatomy by robust least squares.

    With a right ventricle, the epicardium on the other side alone.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.

    Returns
    -------
    TruncatedEllipsoid
    """
    around, along = np.meshgrid(
        2 * np.pi * np.arange(AROUND) / AROUND, (np.arange(ALONG) + 0.5) / ALONG, indexing="ij"
    )
    angle, fraction = around.ravel(), along.ravel()
    least = THIN * anatomy.wall_thickness
    # On the side of a right ventricle (x > 0) the epicardium is not that of the left one.
    own = np.ones_like(angle) if anatomy.rv is None else (np.cos(angle) < 0).astype(float)
    weight = {"lv_endo": np.ones_like(angle), "epi": own}
    r, length = anatomy.radius, anatomy.length

    def shape(p: NDArray[np.float64]) -> TruncatedEllipsoid:
        return TruncatedEllipsoid(
            center=r * p[0:2],
            lean=p[2:4],
            section=r * _positive(p[4:7]),
            axis=length * p[7],
            cut=float(p[8]),
            wall=anatomy.wall_thickness * p[9],
            apex=anatomy.wall_thickness * p[10],
            taper=(float(p[11]), float(p[12])),
            bend=p[13:15] / length,
        )

    def misfit(p: NDArray[np.float64]) -> NDArray[np.float64]:
        candidate = shape(p)
        out = []
        for depth, name in enumerate(weight):
            polar = fraction * candidate.semi_axes(depth)[2]
            points = anatomy.to_world(candidate.points(angle, polar, depth))
            # Rows of samples shrink towards the apex: weight by circumference.
            out.append(
                anatomy.surfaces[name].sample(points)[0]
                * np.sqrt(weight[name] * np.abs(candidate.profile(polar, depth)[0]))
            )
        return np.concatenate([*(part / r for part in out), PRIOR * (p - start)])

    axis = 1 / (1 + START_CUT)
    apex = max(anatomy.apex_thickness, least) / anatomy.wall_thickness
    start = np.array([0, 0, 0, 0, 0, 0, 0, axis, START_CUT, 1, apex, 0, 0, 0, 0])
    bound = (TAPER_LIMIT, TAPER_LIMIT)
    low = np.array(
        [
            -1,
            -1,
            -1,
            -1,
            *np.negative(SECTION_LIMITS),
            axis / 3,
            CUT_LIMITS[0],
            THIN,
            THIN,
            *np.negative(bound),
            -1,
            -1,
        ]
    )
    high = np.array([1, 1, 1, 1, *SECTION_LIMITS, axis * 3, CUT_LIMITS[1], 4, 4, *bound, 1, 1])
    start = np.clip(start, low + 1e-6, high - 1e-6)
    fit = least_squares(
        misfit, start, bounds=(low, high), loss="soft_l1", f_scale=ROBUST, max_nfev=MAX_EVALUATIONS
    )
    found = shape(fit.x)
    close = np.minimum(fit.x - low, high - fit.x) < AT_BOUND * (high - low)
    limited = tuple(dict.fromkeys(np.array(PARAMETERS)[close].tolist()))
    return replace(found, sway=pool_sway(found, anatomy), limited=limited)


def pool_sway(shape: TruncatedEllipsoid, anatomy: Anatomy) -> NDArray[np.float64]:
    """How the pool sways about the axis of an ellipsoid, (5, 2); zero if it hardly does.

    Parameters
    ----------
    shape : TruncatedEllipsoid
        Fitted to the heart.
    anatomy : Anatomy
        The patient's heart, measured.
    """
    pool = anatomy.surfaces["lv_endo"]
    edges = np.linspace(-anatomy.length, 0, SECTIONS + 1)
    index = np.argwhere(pool.values < 0).astype(float)
    points = anatomy.to_heart(index @ pool.affine[:3, :3].T + pool.affine[:3, 3])
    section = np.digitize(points[:, 2], edges) - 1
    found = [points[section == n] for n in range(SECTIONS)]
    volume = abs(np.linalg.det(pool.affine[:3, :3]))
    middles = np.array([part.mean(axis=0) for part in found if len(part)])
    areas = np.array([len(part) for part in found if len(part)]) * volume / np.diff(edges)[0]
    z = middles[:, 2]
    off = middles[:, :2] - polyval(z, shape.middle(0)).T
    share = np.hypot(*off.T) / np.sqrt(areas / np.pi)
    if len(share) <= SWAYS or max(share[1:]) < OFF_AXIS:
        return STRAIGHT
    return np.asarray(polyfit(z, off, SWAYS))


def _positive(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix exponential (2, 2) of ``[[p0 + p1, p2], [p2, p0 - p1]]``: every section of one kind.

    Its semi-axes are ``exp(p0 +- h)`` with ``h = |(p1, p2)|``; no p makes it indefinite.
    """
    size, slant = np.exp(p[0]), np.array([[p[1], p[2]], [p[2], -p[1]]])
    h = float(np.hypot(p[1], p[2]))
    steepness = np.sinh(h) / h if h > 0 else 1.0
    return np.asarray(size * (np.cosh(h) * np.eye(2) + steepness * slant))
