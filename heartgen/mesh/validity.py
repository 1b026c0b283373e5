"""Certificate that a mesh is valid: no element folds, and no two walls cross.

det J is proven positive in each element (exactly, up to a stated bound of the rounding errors), and
the sampled external surface has no self-crossing deeper than 0.01 mm (`heartgen.mesh.overlap`).

det J of a tricubic element is a polynomial of degree 8 per direction. If its 9^3 Bernstein
coefficients are positive, so is det J; where the bound is not decisive the element is subdivided
(Johnen, Remacle & Geuzaine 2013, doi:10.1016/j.jcp.2012.08.051). At the collapsed apex det J
vanishes on the pole by construction; there the factor ``xi`` that causes it is divided out, and
what remains is certified.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from math import comb

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import DEGREE, ORDER
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.overlap import overlapping

DET_DEGREE = 3 * DEGREE - 1
MAX_DEPTH = 6
"""Subdivisions of an element before it counts as undecided: pieces of 1/64 of its edge."""

UNIT = np.finfo(float).eps / 2
"""Relative error of one operation in float64."""

ROUNDINGS = 110
"""Operations in a row, at most, behind a coefficient of det J: 9 for three differences with their
factors, 38 for a product of two, of 36 terms, 51 for one of three, of 48 terms, and 12 for what
scales it, and for this bound itself."""

HALVING_ROUNDINGS = 3 * DET_DEGREE * MAX_DEPTH
"""Means in a row, at most, behind a coefficient on a piece of an element."""

PERMANENT = 6 / 27**0.5
"""Bound of the sum of the six products of a determinant, all taken positive, by the lengths of its
columns (Carlen, Lieb & Loss 2006, doi:10.4310/MAA.2006.v13.n1.a1)."""


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proven about a mesh.

    Attributes
    ----------
    positive : (e,) bool
        det J is proven positive in the whole element (away from the pole itself).
    lower_bound : (e,) float64
        Proven lower bound of det J (of det J / xi2 in elements that collapse), mm^3.
    overlapping : (e,) bool
        A face of the element crosses another one, see `heartgen.mesh.overlap.overlapping`. False
        everywhere from `certify_jacobian`, which does not look.
    """

    positive: NDArray[np.bool_]
    lower_bound: NDArray[np.float64]
    overlapping: NDArray[np.bool_]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Elements (e,) in which det J is proven positive and whose faces cross no other."""
        return self.positive & ~self.overlapping

    @property
    def all_valid(self) -> bool:
        """True if every element is proven valid."""
        return bool(self.valid.all())


def certify(mesh: HexMesh) -> Certificate:
    """Prove that no element of the mesh folds and no two of its walls cross.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    Certificate
    """
    found = certify_jacobian(mesh)
    return replace(found, overlapping=overlapping(mesh, folded=~found.positive))


def certify_jacobian(mesh: HexMesh) -> Certificate:
    """Prove, element by element, that the mesh does not fold; whether walls cross is not asked.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    Certificate
    """
    # Without what rounding may have added, the coefficients are those of a polynomial below det J.
    det = list(determinant_coefficients(mesh.control) - rounding_bound(mesh.control))
    for element, face in mesh.topology.collapsed:
        axis, end = divmod(int(face), 2)
        det[element] = _without_factor(det[element], axis, end)
    margin = _gamma(HALVING_ROUNDINGS) * np.array([np.abs(d).max() for d in det])
    bound = np.array([_lower_bound(d, m) for d, m in zip(det, margin, strict=True)]) - margin
    return Certificate(bound > 0, bound, overlapping=np.zeros(len(bound), dtype=np.bool_))


def determinant_coefficients(control: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bernstein coefficients of det J.

    Parameters
    ----------
    control : (e, 64, 3) float64
        Bernstein coefficients of the elements.

    Returns
    -------
    (e, 9, 9, 9) float64
        Axes (xi3, xi2, xi1), degree 8 each.
    """
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = _derivatives(control)
    cross = (
        _multiply(by, cz) - _multiply(bz, cy),
        _multiply(bz, cx) - _multiply(bx, cz),
        _multiply(bx, cy) - _multiply(by, cx),
    )
    det = sum(_multiply(a, b) for a, b in zip((ax, ay, az), cross, strict=True))
    return _from_monic(np.asarray(det))


def rounding_bound(control: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bound of the rounding errors of `determinant_coefficients`.

    A sum of products that takes n operations in a row is off by at most n u / (1 - n u) times the
    sum of the absolute products (Higham 2002, section 3.1, doi:10.1137/1.9780898718027): near 0 for
    nearly flat elements is the determinant, not this sum.

    Parameters
    ----------
    control : (e, 64, 3) float64
        Bernstein coefficients of the elements, taken as exact.

    Returns
    -------
    (e, 9, 9, 9) float64
    """
    a, b, c = (np.linalg.norm(d, axis=0) for d in _derivatives(control))
    factor = PERMANENT * _gamma(ROUNDINGS)
    return factor * _from_monic(_multiply(a, _multiply(b, c)))


def _gamma(n: int) -> float:
    """Relative error of n operations in a row."""
    return float(n * UNIT / (1 - n * UNIT))


def _derivatives(control: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Derivatives along xi1, xi2 and xi3 in scaled Bernstein form, (3, e, k, j, i) each."""
    x = np.moveaxis(control.reshape(-1, ORDER, ORDER, ORDER, 3), -1, 0)
    return [_monic(DEGREE * np.diff(x, axis=4 - d)) for d in range(3)]


def _binomials(n: int) -> NDArray[np.float64]:
    """Binomial coefficients of degree n, (n + 1,)."""
    return np.array([comb(n, i) for i in range(n + 1)], dtype=float)


def _binomial_weights(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Product of the binomials of the last three axes."""
    k, j, i = (_binomials(n - 1) for n in shape[-3:])
    return np.asarray(np.einsum("k,j,i->kji", k, j, i))


def _monic(c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scaled Bernstein form, in which polynomials multiply by convolution."""
    return np.asarray(c * _binomial_weights(c.shape))


def _from_monic(c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bernstein coefficients from the scaled form."""
    return np.asarray(c / _binomial_weights(c.shape))


def _multiply(f: NDArray[np.float64], g: NDArray[np.float64]) -> NDArray[np.float64]:
    """Product of polynomials in scaled Bernstein form, (e, k, j, i) each."""
    out = np.zeros((len(f), *(m + n - 1 for m, n in zip(f.shape[1:], g.shape[1:], strict=True))))
    n3, n2, n1 = g.shape[1:]
    for k, j, i in product(*(range(n) for n in f.shape[1:])):
        out[:, k : k + n3, j : j + n2, i : i + n1] += f[:, k, j, i, None, None, None] * g
    return out


def _without_factor(det: NDArray[np.float64], axis: int, end: int) -> NDArray[np.float64]:
    """Divide by xi (or 1 - xi) along an axis: B_{j+1}^n = xi * n / (j + 1) * B_j^{n-1}."""
    moved = np.moveaxis(det, 2 - axis, 0)
    n = len(moved) - 1
    rest = moved[1:] if end == 0 else moved[:-1][::-1]
    quotient = rest * (n / np.arange(1, n + 1))[:, None, None]
    if end:
        quotient = quotient[::-1]
    return np.moveaxis(quotient, 0, 2 - axis)


def _lower_bound(coefficients: NDArray[np.float64], enough: float) -> float:
    """Proven lower bound; subdivides until it exceeds `enough` or a corner value does not."""
    if not np.isfinite(coefficients).all():
        return -np.inf
    pieces = [coefficients]
    decided = np.inf
    for _ in range(MAX_DEPTH):
        least = np.array([piece.min() for piece in pieces])
        bound = min(decided, float(least.min()))
        if bound > enough or any(_corners(piece).min() <= enough for piece in pieces):
            return bound
        decided = min(decided, float(least[least > enough].min(initial=np.inf)))
        open_ones = [piece for piece, low in zip(pieces, least, strict=True) if low <= enough]
        pieces = [octant for piece in open_ones for octant in _octants(piece)]
    return min(decided, min(float(piece.min()) for piece in pieces))


def _corners(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values at the eight corners: the corner coefficients."""
    k, j, i = (n - 1 for n in coefficients.shape)
    return coefficients[::k, ::j, ::i]


def _octants(coefficients: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """De Casteljau subdivision at 1/2 in all three directions."""
    pieces = [coefficients]
    for axis in range(3):
        pieces = [half for piece in pieces for half in _halves(piece, axis)]
    return pieces


def _halves(c: NDArray[np.float64], axis: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coefficients on the lower and the upper half along an axis."""
    row = np.moveaxis(c, axis, 0)
    lower, upper = [row[0]], [row[-1]]
    while len(row) > 1:
        row = (row[:-1] + row[1:]) / 2
        lower.append(row[0])
        upper.append(row[-1])
    return (
        np.moveaxis(np.stack(lower), 0, axis),
        np.moveaxis(np.stack(upper[::-1]), 0, axis),
    )
