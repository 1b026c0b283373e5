"""HexMesh: tricubic hexahedra whose Bernstein coefficients are `extraction @ dofs`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, overload

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bases import to_hermite, to_lagrange
from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.lagrange_nodes import shared_points
from heartgen.mesh.lattice_order import VTK_ORDER, places
from heartgen.mesh.refinement import refine
from heartgen.mesh.topology import COEFFICIENTS, Topology
from heartgen.shown import as_html, counted, in_lines

if TYPE_CHECKING:
    import meshio
    import pyvista

    from heartgen.mesh.field import MeshField

Array = NDArray[np.float64]

__all__ = ["COEFFICIENTS", "Grid", "HexMesh", "Topology"]


class Grid(Protocol):
    """Voxels and where they are."""

    @property
    def voxels(self) -> NDArray[Any]:
        """(nx, ny, nz)."""

    @property
    def affine(self) -> NDArray[np.float64]:
        """Voxel index to world coordinates, (4, 4), mm, LPS."""


@dataclass(frozen=True, eq=False, repr=False)
class HexMesh:
    """A mesh of tricubic hexahedra. Meshes compare by identity: compare `dofs`.

    Attributes
    ----------
    dofs : (n, 3) float64
        Degrees of freedom, mm, world (LPS).
    topology : Topology
        Shared by all meshes that differ only in shape.

    Examples
    --------
    >>> import heartgen
    >>> import numpy as np
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> mesh  # doctest: +ELLIPSIS
    HexMesh: 72 elements (1 radial x 12 circumferential x 6 longitudinal), cubic hermite
      1164 degrees of freedom a direction, extent ... mm
      surfaces lv_endo, epi, base
    >>> middle = mesh.evaluate(np.full((1, 3), 0.5))  # of each element
    >>> elements, xi = mesh.locate(middle[5])
    >>> elements.tolist(), xi.round(6).tolist()
    ([5], [[0.5, 0.5, 0.5]])
    >>> np.allclose(mesh.evaluate(elements, xi), middle[5])
    True
    >>> mesh.refined(radial=2).n_elements
    144
    """

    dofs: NDArray[np.float64]
    topology: Topology

    @cached_property
    def control(self) -> NDArray[np.float64]:
        """Bernstein coefficients, (e, 64, 3) float64, mm, world (LPS)."""
        return np.asarray(self.topology.extraction @ self.dofs).reshape(-1, COEFFICIENTS, 3)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.topology.n_elements

    @property
    def surfaces(self) -> Mapping[str, NDArray[np.intp]]:
        """Named surfaces: their faces, (f, 2) int, as (element, face)."""
        return self.topology.surfaces

    @property
    def points(self) -> Array:
        """The points of all `cells`, shared where elements meet, (m, 3), mm, world (LPS)."""
        return self.lagrange_points().reshape(-1, 3)[self._numbered[1]]

    @property
    def cells(self) -> NDArray[np.intp]:
        """Points of each element as a cubic Lagrange hexahedron of VTK, in its order, (e, 64)."""
        return self._numbered[0][:, places(VTK_ORDER)]

    @cached_property
    def _numbered(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        return shared_points(self.topology)

    @overload
    def evaluate(self, xi: Array, /) -> Array: ...

    @overload
    def evaluate(self, elements: NDArray[np.intp], xi: Array, /) -> Array: ...

    def evaluate(self, *where: Any) -> Array:
        """Positions: ``evaluate(xi)`` in every element, ``evaluate(elements, xi)`` of points.

        Parameters
        ----------
        *where : arrays
            ``xi``, (q, 3) float64: local coordinates in [0, 1], the same for every element. Or
            ``elements``, (n,) int, of each point, such as `locate` gives, -1 for none; and ``xi``,
            (n, 3) float64, of each point.

        Returns
        -------
        (e, q, 3), or (n, 3) float64, mm, world (LPS)
            NaN where there is no element.
        """
        if len(where) == 1:
            return np.asarray(np.matmul(tabulate(np.asarray(where[0])), self.control))
        from heartgen.mesh.location import at

        elements, xi = where
        return at(self.control, elements, xi)

    def locate(self, points: Array) -> tuple[NDArray[np.intp], Array]:
        """Find the elements that points lie in, and where in them: the inverse of `evaluate`.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).

        Returns
        -------
        elements : (n,) int
            The first one, of a point where elements meet; -1 outside the mesh.
        xi : (n, 3) float64
            Local coordinates in [0, 1]; NaN outside the mesh.
        """
        from heartgen.mesh.location import locate

        return locate(self.control, points)

    def gradient(self, xi: NDArray[np.float64]) -> NDArray[np.float64]:
        """Jacobian matrices dx/dxi at the same local coordinates of every element.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates.

        Returns
        -------
        (e, q, 3, 3) float64
            Last axis is the xi direction; mm.
        """
        directions = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
        return np.stack([np.matmul(tabulate(xi, d), self.control) for d in directions], -1)

    def write(
        self,
        path: str | Path,
        fields: Iterable[MeshField] = (),
        format: str | None = None,
    ) -> list[Path]:
        """Write the mesh; `heartgen.write_mesh` also says what a format does not hold.

        Parameters
        ----------
        path : path
            Its ending tells the format unless that is given.
        fields : iterable of MeshField
            Fields on the mesh.
        format : str, optional
            One of `heartgen.formats.FORMATS`.

        Returns
        -------
        list of Path
            The files.
        """
        from heartgen.formats import write_mesh

        return list(write_mesh(self, path, fields, format).files)

    def plot(self, color: str | None = "region", **options: Any) -> pyvista.Plotter:
        """Show the mesh; arguments go to `heartgen.viewing.plot_mesh`.

        Parameters
        ----------
        color : {"region", "quality"} or None
            Surface, Jacobian ratio of each element, or one color for all.
        **options : object
            As of `heartgen.viewing.plot_mesh`.
        """
        from heartgen.viewing import plot_mesh

        return plot_mesh(self, color, **options)

    def to_pyvista(self, fields: Iterable[MeshField] = ()) -> pyvista.UnstructuredGrid:
        """The mesh, exactly, as a grid of cubic Lagrange hexahedra, with its parts and fields.

        Parameters
        ----------
        fields : iterable of MeshField
            Fields on the mesh.
        """
        from heartgen.viewing import to_pyvista

        return to_pyvista(self, fields)

    def to_meshio(self, fields: Iterable[MeshField] = ()) -> meshio.Mesh:
        """The mesh, exactly, as a `meshio.Mesh` of VTK's cubic Lagrange hexahedra.

        Parameters
        ----------
        fields : iterable of MeshField
            Fields on the mesh.
        """
        from heartgen.formats import to_meshio

        return to_meshio(self, fields)

    def __repr__(self) -> str:
        radial, around, along = self.topology.shape
        lines = [
            f"HexMesh: {counted(self.n_elements, 'element')} ({radial} radial x {around} "
            f"circumferential x {along} longitudinal), cubic {self.topology.basis}",
            f"  {counted(len(self.dofs), 'degree')} of freedom a direction, extent "
            f"{' x '.join(f'{side:.3g}' for side in np.ptp(self.control, axis=(0, 1)))} mm",
            f"  surfaces {', '.join(self.surfaces) or 'none'}",
        ]
        return in_lines(lines)

    def _repr_html_(self) -> str:
        return as_html(repr(self))

    def with_dofs(self, dofs: NDArray[np.float64]) -> HexMesh:
        """Return the mesh of the same topology with other degrees of freedom (n, 3), mm, LPS.

        Parameters
        ----------
        dofs : (n, 3) float64
            mm, world (LPS).
        """
        return HexMesh(np.asarray(dofs, dtype=float), self.topology)

    def transformed(self, affine: NDArray[np.float64]) -> HexMesh:
        """Return the mesh under an affine map.

        Parameters
        ----------
        affine : (4, 4) float64
            mm, world (LPS) to world.

        Returns
        -------
        HexMesh
            Exact: the space of a mesh contains all its affine images.
        """
        shift = np.outer(self.topology.constant, affine[:3, 3])
        return self.with_dofs(self.dofs @ affine[:3, :3].T + shift)

    def lagrange_points(self) -> NDArray[np.float64]:
        """Positions at the 4x4x4 Lagrange nodes of each element, (e, 64, 3), xi1 fastest, mm, LPS.

        They are the cubic Lagrange coefficients of the very same geometry.
        """
        values = self.topology.functionals(tabulate(lattice())) @ self.dofs
        return np.asarray(values).reshape(-1, COEFFICIENTS, 3)

    def rasterize(self, like: Grid, partial: bool = False) -> NDArray[np.float32]:
        """Return the image of the mesh on the voxels of another image.

        Parameters
        ----------
        like : Mask, or anything with its `voxels` and `affine`
            The image whose voxels are taken; mm, world (LPS).
        partial : bool
            Give the share of each voxel that is in the mesh, not whether its center is.

        Returns
        -------
        (nx, ny, nz) float32
            0 to 1, see `heartgen.mesh.rasterization.rasterize`.
        """
        from heartgen.mesh.rasterization import rasterize

        return rasterize(self, like.voxels.shape, like.affine, partial)

    def refined(self, radial: int = 1, circumferential: int = 1, longitudinal: int = 1) -> HexMesh:
        """Split every element; the geometry and the degrees of freedom stay the same.

        Parameters
        ----------
        radial, circumferential, longitudinal : int
            Pieces per element in each direction.

        Returns
        -------
        HexMesh
        """
        pieces = circumferential, longitudinal, radial
        return replace(self, topology=refine(self.topology, pieces))

    def to_lagrange(self, order: int = 3) -> HexMesh:
        """Return the mesh in the Lagrange basis: values on a lattice in each element, C0.

        Parameters
        ----------
        order : {1, 2, 3}
            3 leaves the geometry as it is. Lower orders resample it: the elements then pass
            through lattices of 2 or 3 points per direction; `heartgen.mesh.bases.deviation` tells
            how far that moves them.

        Returns
        -------
        HexMesh
            Still of tricubic elements, which contain those of lower order.
        """
        return to_lagrange(self, order)

    def to_hermite(self) -> HexMesh:
        """Return the mesh in the cubic Hermite basis; the geometry stays as it is.

        Returns
        -------
        HexMesh
            In the topology that the mesh had before `to_lagrange` if its geometry lies in that;
            otherwise nodes have versions of the derivatives in which their elements differ.
        """
        return to_hermite(self)
