"""What a mesh can be colored by. A new quantity is one more entry of `COLORINGS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import matplotlib
import numpy as np
from matplotlib.colors import to_hex, to_rgb
from numpy.typing import NDArray

from heartgen.fields import make_fields
from heartgen.fields.catalog import AHA
from heartgen.fields.segments import NO_SEGMENT
from heartgen.mesh import HexMesh, MeshField
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.viewing.card import SURFACE_NAMES
from heartgen.viewing.differences import difference_scale, signed_distances
from heartgen.viewing.fields import FIELD_STYLES, segment_color
from heartgen.viewing.polydata import on_surface, to_mask
from heartgen.viewing.scene import MESH, REGION_COLORS, Scale, color_scale, nice_limit

if TYPE_CHECKING:
    from heartgen.result import Personalization

Array = NDArray[np.float64]
Colors = NDArray[np.uint8]

STOPS = 12
"""Colors of a key between which a browser interpolates; the maps are smooth."""

FIELD_RANGE = (1.0, 99.0)
"""Percentiles of a field at the ends of its color scale, where it has no ends of its own."""


@dataclass(frozen=True, eq=False)
class PaintedFaces:
    """A surface to be colored.

    Attributes
    ----------
    result : Personalization
        Of which the surface is a stage.
    mesh : HexMesh
        At the stage that is shown.
    points : (n, 3) float64
        Of all external faces, equally many on each, mm, world (LPS).
    other : HexMesh or None
        With which the mesh is compared.
    """

    result: Personalization
    mesh: HexMesh
    points: Array
    other: HexMesh | None = None

    def of_faces(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the external faces, (f,), at their points, (n,).

        Parameters
        ----------
        values : (f,) array
            One for each external face.
        """
        return np.repeat(values, len(self.points) // len(values))

    @cached_property
    def error(self) -> Array:
        """Distance to the mask, (n,) mm."""
        return to_mask(self.points, self.result.anatomy.myocardium)

    @cached_property
    def quality(self) -> Array:
        """Jacobian ratio of every element, (e,)."""
        return np.asarray(jacobian_ratio(self.mesh))

    def field(self, group: str, name: str) -> MeshField:
        """A field of the mesh, one of `heartgen.fields.FIELDS` by its group and name.

        Parameters
        ----------
        group : str
            One of `heartgen.fields.FIELDS`.
        name : str
            Of a field in it.
        """
        made = make_fields(
            self.mesh, [group], septal_direction=self.result.options.septal_direction
        )
        return next(field for field in made if field.name == name)

    def of_field(self, field: MeshField) -> Array:
        """Values of a field with one component at the points, (n,).

        Parameters
        ----------
        field : MeshField
            Of one component, on the mesh.
        """
        return on_surface(field, self.mesh.topology).ravel()

    @cached_property
    def region(self) -> NDArray[np.intp]:
        """Place of the surface of every external face in the topology's, (f,)."""
        sizes = [len(part) for part in self.mesh.topology.surfaces.values()]
        return np.repeat(np.arange(len(sizes)), sizes)


@dataclass(frozen=True, eq=False)
class Painted:
    """Colors of a surface, and their key.

    Attributes
    ----------
    rgb : (n, 3) uint8
        Of the points.
    inside : callable
        Colors (m, 3) of the wall where it is cut open: of elements (m,) or, with a `field`,
        of its values (m,).
    title : str
        Of the key.
    field : MeshField or None
        That colors the wall where it is cut open, if colors vary within the elements.
    scale : Scale or None
        Of a quantity.
    stops : tuple of str
        Colors of the scale from its low to its high end.
    more : bool
        Values beyond the end of the scale have its last color.
    names : tuple of (str, str)
        Color and name of each class, where there are classes.
    """

    rgb: Colors
    inside: Callable[[NDArray[Any]], Colors]
    title: str
    field: MeshField | None = None
    scale: Scale | None = None
    stops: tuple[str, ...] = ()
    more: bool = False
    names: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Coloring:
    """A quantity to color by.

    Attributes
    ----------
    title, explanation : str
        Its name for users, and a sentence about it.
    paint : callable
        Colors of a patch; the second argument is the end of the error's scale, if one was chosen.
    """

    title: str
    explanation: str
    paint: Callable[[PaintedFaces, float | None], Painted]


def _by_error(patch: PaintedFaces, limit: float | None) -> Painted:
    limit = limit or nice_limit(patch.result.report.accuracy.p95)
    scale = color_scale("error", limit)
    return replace(scaled(patch.error, scale), more=True)


def _by_quality(patch: PaintedFaces, limit: float | None) -> Painted:
    scale = color_scale("quality")
    faces = patch.mesh.topology.external
    return scaled(
        patch.of_faces(patch.quality[faces[:, 0]]),
        scale,
        lambda elements: _mapped(patch.quality[elements], scale),
    )


def _by_region(patch: PaintedFaces, limit: float | None) -> Painted:
    surfaces = list(patch.mesh.topology.surfaces)
    colors = np.array([_rgb(REGION_COLORS[name]) for name in surfaces], dtype=np.uint8)
    return Painted(
        rgb=colors[patch.of_faces(patch.region)],
        inside=_plain,
        title="surface",
        names=tuple((REGION_COLORS[name], SURFACE_NAMES[name]) for name in surfaces),
    )


def _by_segment(patch: PaintedFaces, _: float | None) -> Painted:
    segment = patch.field("aha", AHA).values[:, 0].astype(int)
    there = {number: segment_color(int(number)) for number in np.unique(segment)}
    colors = np.zeros((max(there) + 1, 3), dtype=np.uint8)
    for number, color in there.items():
        colors[number] = _rgb(color)
    return Painted(
        rgb=colors[patch.of_faces(segment[patch.mesh.topology.external[:, 0]])],
        inside=lambda elements: colors[segment[elements]],
        title="AHA segment",
        names=tuple((c, "none" if n == NO_SEGMENT else str(n)) for n, c in there.items()),
    )


def _by_field(key: str) -> Callable[[PaintedFaces, float | None], Painted]:
    """Color by one of the fields that `heartgen.viewing.plot_field` knows."""

    def paint(patch: PaintedFaces, _: float | None) -> Painted:
        look = FIELD_STYLES[key]
        field = patch.field(look.of, look.field)
        low, high = look.limits or np.round(np.percentile(field.values, FIELD_RANGE))
        scale = Scale(look.title, cast("Any", look.colors), (float(low), float(high)))
        values = patch.of_field(field)
        return replace(scaled(values, scale, lambda v: _mapped(v, scale)), field=field)

    return paint


def _by_difference(patch: PaintedFaces, _: float | None) -> Painted:
    if patch.other is None:
        return replace(_by_region(patch, None), title="choose in Assess what to compare with")
    distances = signed_distances(patch.mesh, patch.other)
    return scaled(distances, difference_scale(distances))


COLORINGS = {
    "error": Coloring("Error", "Distance from the mesh to the mask, mm", _by_error),
    "quality": Coloring("Quality Q", "Jacobian ratio of each element, 1 is best", _by_quality),
    "region": Coloring("Surface", "Endocardium, epicardium, base", _by_region),
    "segment": Coloring("AHA segment", "The 17 segments of the left ventricle", _by_segment),
    "transmural": Coloring("Transmural", "Depth in the wall: cut it open", _by_field("transmural")),
    "longitudinal": Coloring("Longitudinal", "From apex to base", _by_field("longitudinal")),
    "thickness": Coloring("Wall thickness", "Across the wall, mm", _by_field("thickness")),
    "difference": Coloring("Difference", "To the mesh chosen in Assess, mm", _by_difference),
}


def scaled(
    values: Array, scale: Scale, inside: Callable[[NDArray[Any]], Colors] | None = None
) -> Painted:
    """Colors of values on a scale.

    Parameters
    ----------
    values : (n,) float64
        At the points.
    scale : Scale
        Its ends and colors.
    inside : callable, optional
        As of `Painted`; one color if omitted.
    """
    colors = matplotlib.colormaps[scale.colors]
    stops = tuple(to_hex(colors(i / (STOPS - 1))) for i in range(STOPS))
    return Painted(_mapped(values, scale), inside or _plain, scale.title, scale=scale, stops=stops)


def _mapped(values: Array, scale: Scale) -> Colors:
    """Colors (n, 3) of values (n,) on a scale."""
    low, high = scale.limits
    share = np.clip((values - low) / (high - low), 0, 1)
    rgba = matplotlib.colormaps[scale.colors](share, bytes=True)
    return np.asarray(rgba[:, :3], dtype=np.uint8)


def _plain(elements: NDArray[np.intp]) -> Colors:
    """The color of the mesh for every element."""
    return np.tile(_rgb(MESH), (len(elements), 1))


def _rgb(color: str) -> Colors:
    """A color as bytes (3,)."""
    return np.round(255 * np.array(to_rgb(color))).astype(np.uint8)
