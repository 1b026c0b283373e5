"""The Laplacian that keeps a deformation smooth, and the solver it makes fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft
from numpy.typing import NDArray

Vectors = NDArray[np.float64]
"""One vector per node, (n, 3) float64."""


@dataclass(frozen=True)
class Smoothing:
    """Squared Laplacian L'L of node values, with free (Neumann) borders.

    Attributes
    ----------
    shape : (int, int, int)
        Nodes along each axis.
    """

    shape: tuple[int, int, int]

    @cached_property
    def spectrum(self) -> NDArray[np.float64]:
        """Eigenvalues of L'L for the cosine modes, (nx, ny, nz)."""
        modes = [2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in self.shape]
        return np.asarray(
            (modes[0][:, None, None] + modes[1][:, None] + modes[2]) ** 2, dtype=float
        )

    @property
    def trace(self) -> float:
        """Trace of L'L for one component of the displacement."""
        return float(self.spectrum.sum())

    def apply(self, values: Vectors) -> Vectors:
        """L'L times node values (n, 3).

        Parameters
        ----------
        values : (n, 3) float64
            At the nodes, mm.
        """
        return self._laplacian(self._laplacian(values))

    def _laplacian(self, values: Vectors) -> Vectors:
        """Seven-point Laplacian of node values (n, 3)."""
        v = values.reshape(*self.shape, 3)
        out = np.zeros_like(v)
        for axis in range(3):
            step = np.diff(v, axis=axis)
            low: list[slice] = [slice(None)] * 4
            high = list(low)
            low[axis], high[axis] = slice(None, -1), slice(1, None)
            out[tuple(low)] -= step
            out[tuple(high)] += step
        return out.reshape(-1, 3)

    def solve(self, values: Vectors, smooth: float, shift: float) -> Vectors:
        """Solve (smooth L'L + shift I) x = values roughly, by cosine transforms.

        Parameters
        ----------
        values : (n, 3) float64
            Right side, at the nodes.
        smooth : float
            Factor of L'L.
        shift : float
            Factor of the identity.
        """
        # Single precision is enough: this only preconditions.
        v = values.reshape(*self.shape, 3).astype(np.float32)
        modes = scipy.fft.dctn(v, axes=(0, 1, 2), norm="ortho", overwrite_x=True)
        modes /= (smooth * self.spectrum + shift).astype(np.float32)[..., None]
        x = scipy.fft.idctn(modes, axes=(0, 1, 2), norm="ortho", overwrite_x=True)
        return np.asarray(x.reshape(-1, 3), dtype=float)


def conjugate_gradients(
    operator: Callable[[Vectors], Vectors],
    right: Vectors,
    precondition: Callable[[Vectors], Vectors],
    steps: int,
) -> Vectors:
    """Preconditioned conjugate gradients from zero, for a symmetric positive definite operator.

    Parameters
    ----------
    operator : callable
        Maps (n, 3) to (n, 3).
    right : (n, 3) float64
        Right-hand side.
    precondition : callable
        Maps (n, 3) to (n, 3), about as the inverse of the operator does.
    steps : int
        Number of steps; fewer only if the residual vanishes.

    Returns
    -------
    (n, 3) float64
    """
    x = np.zeros_like(right)
    r = right.copy()
    z = precondition(r)
    p = z.copy()
    rho = float(np.vdot(r, z))
    vanished = np.finfo(float).eps ** 2 * rho
    for _ in range(steps):
        if rho <= vanished:
            break
        q = operator(p)
        alpha = rho / float(np.vdot(p, q))
        x += alpha * p
        r -= alpha * q
        z = precondition(r)
        rho, old = float(np.vdot(r, z)), rho
        p = z + rho / old * p
    return x
