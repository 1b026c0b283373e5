"""Fields on a mesh: numbers that vary within the elements, or one set of them per element."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.bernstein import ORDER, cube, lagrange_to_bernstein, tabulate

COEFFICIENTS = ORDER**3


@dataclass(frozen=True, eq=False)
class MeshField:
    """A named field on the elements of a mesh.

    Attributes
    ----------
    name : str
        Printable, without spaces at either end.
    values : (e, 64, k) or (e, k) float64
        k components: at the 4 x 4 x 4 Lagrange nodes of each element, xi1 fastest, as
        `HexMesh.lagrange_points` has positions, between which they are cubic; or one value per
        element, for which (e,) may be given as well. The field may jump between elements.

    Examples
    --------
    >>> import numpy as np
    >>> from heartgen.mesh import MeshField
    >>> stiffness = MeshField("stiffness", np.full(72, 10.0))  # kPa, one value an element
    >>> stiffness.per_element, stiffness.components
    (True, 1)
    >>> MeshField("pressure", np.zeros((72, 64, 1))).evaluate(np.full((5, 3), 0.5)).shape
    (72, 5, 1)
    """

    name: str
    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        if not self.name or self.name != self.name.strip() or not self.name.isprintable():
            raise MeshError(
                f"field {self.name!r}: a file cannot hold this name: use printable characters "
                "without spaces at either end"
            )
        values = np.asarray(self.values)
        if values.ndim == 1:
            values = values[:, None]
        on_lattice = values.ndim == 3 and values.shape[1] == COEFFICIENTS
        if values.dtype.kind not in "biuf" or not (values.ndim == 2 or on_lattice):
            raise MeshError(
                f"field {self.name!r}: {values.dtype} of shape {values.shape} is no field: give "
                f"numbers of shape (e, {COEFFICIENTS}, k), at the Lagrange nodes of each "
                "element, or (e, k), one row an element"
            )
        if not np.all(np.isfinite(values)):
            raise MeshError(
                f"field {self.name!r} is not finite everywhere: give a number where it is unknown"
            )
        object.__setattr__(self, "values", values.astype(np.float64))

    @property
    def per_element(self) -> bool:
        """True if the field is constant within each element."""
        return self.values.ndim == 2

    @property
    def components(self) -> int:
        """Number of components."""
        return int(self.values.shape[-1])

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """Bernstein coefficients, (e, 64, k)."""
        if self.per_element:
            return np.repeat(self.values[:, None], COEFFICIENTS, axis=1)
        return np.asarray(np.matmul(cube(lagrange_to_bernstein()), self.values))

    @overload
    def evaluate(self, xi: NDArray[np.float64], /) -> NDArray[np.float64]: ...

    @overload
    def evaluate(
        self, elements: NDArray[np.intp], xi: NDArray[np.float64], /
    ) -> NDArray[np.float64]: ...

    def evaluate(self, *where: Any) -> NDArray[np.float64]:
        """Values at the same local coordinates of every element, or at points.

        Parameters
        ----------
        *where : arrays
            ``evaluate(xi)``, (q, 3) float64, gives (e, q, k) float64; ``evaluate(elements, xi)``,
            (n,) int and (n, 3) float64, gives (n, k), as `HexMesh.evaluate` does.
        """
        if len(where) == 1:
            (xi,) = where
            if self.per_element:
                return np.repeat(self.values[:, None], len(xi), axis=1)
            return np.asarray(np.matmul(tabulate(xi), self.coefficients))
        from heartgen.mesh.location import at

        elements, xi = where
        return at(self.coefficients, elements, xi)


def fitting(fields: Iterable[MeshField], n_elements: int) -> tuple[MeshField, ...]:
    """Refuse fields of another mesh, or of the same name.

    Parameters
    ----------
    fields : iterable of MeshField
        Those to look at.
    n_elements : int
        Of the mesh.

    Returns
    -------
    tuple of MeshField
        The same fields.

    Raises
    ------
    MeshError
        That names the field.
    """
    fields = tuple(fields)
    names = [field.name for field in fields]
    for field in fields:
        if len(field.values) != n_elements:
            raise MeshError(
                f"field {field.name!r} is given on {len(field.values)} elements, but the mesh has "
                f"{n_elements}: give the field of this mesh"
            )
        if names.count(field.name) > 1:
            raise MeshError(f"two fields are named {field.name!r}: give each a name of its own")
    return fields
