"""`Personalization`: a mesh fitted to a patient, written, loaded and shown."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.anatomy import Anatomy
from heartgen.fields import FIELDS, FiberRule, make_fields
from heartgen.fields.catalog import DIRECTIONS, check_names
from heartgen.formats import cells_of, fields_held, file_name, write_mesh, write_text
from heartgen.images import Mask
from heartgen.images.accepting import MaskLike
from heartgen.images.sources import seen_from
from heartgen.mesh import HexMesh, MeshField
from heartgen.options import Options
from heartgen.registration import Deformation
from heartgen.report import REPORT, Report
from heartgen.saved_result import find_part, keep_mask, load_parts
from heartgen.shown import as_html, in_lines

if TYPE_CHECKING:
    import pyvista


@dataclass(frozen=True, eq=False, repr=False)
class Personalization:
    """A mesh fitted to a patient, and everything on the way to it.

    Attributes
    ----------
    mask : Mask
        What the mesh is fitted to.
    options : Options
        Of the run.
    anatomy : Anatomy
        What the shape analysis measured.
    template : HexMesh
        The tailored template, placed on the patient.
    deformations : tuple of Deformation
        The map after each registration pass.
    warped : HexMesh
        The mesh before enhancement.
    enhanced : HexMesh
        The mesh before optimization.
    mesh : HexMesh
        The result; mm, world (LPS).
    report : Report
        How good the mesh is.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> result = heartgen.personalize(mask, optimize=False)
    >>> with TemporaryDirectory() as folder:
    ...     names = [path.name for path in result.write(folder, mask=True)]
    ...     again = heartgen.Personalization.load(folder)
    >>> names
    ['mesh.exf', 'mesh.vtu', 'report.json', 'mask.nii.gz']
    >>> again.report == result.report
    True
    >>> [field.name for field in again.fields(["aha", "thickness"])]
    ['aha segment', 'wall thickness']
    """

    mask: Mask
    options: Options
    anatomy: Anatomy
    template: HexMesh
    deformations: tuple[Deformation, ...]
    warped: HexMesh
    enhanced: HexMesh
    mesh: HexMesh
    report: Report

    @classmethod
    def load(cls, folder: str | Path, mask: MaskLike | None = None) -> Personalization:
        """Load a result that was written.

        Parameters
        ----------
        folder : path
            With ``report.json`` and a mesh in a format that is read: ``mesh.exf``, ``mesh.exelem``
            or ``mesh.vtu``.
        mask : Mask, path or image, optional
            The mask of the fit. If omitted it is looked for when it is needed: in the folder, then
            where it was read for the fit.

        Returns
        -------
        Personalization
            With mesh, report and options. Its mask is looked for, and its anatomy measured again
            (without further views of the heart), when they are asked for. Template, deformations
            and the meshes before the last are not written: to ask for them is a
            `heartgen.errors.NotKeptError`.

        Raises
        ------
        InputError
            If there is no result in the folder, or the mask is another one.
        """
        result = object.__new__(cls)
        vars(result).update(load_parts(Path(folder), mask))
        return result

    def __getattr__(self, name: str) -> Any:
        """Find what a loaded result has not got yet."""
        if name not in {each.name for each in fields(self)} or "folder" not in vars(self):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        vars(self)[name] = find_part(self, vars(self)["folder"], name)
        return vars(self)[name]

    def __repr__(self) -> str:
        report = str(self.report).splitlines()
        lines = [f"Personalization of {report[0]}", *repr(self.mesh).splitlines()]
        lines[1:] = [f"  {line}" for line in lines[1:]]
        return in_lines([*lines, *report[1:]], " in print(result.report)")

    def _repr_html_(self) -> str:
        return as_html(repr(self))

    @property
    def has_stages(self) -> bool:
        """Whether the meshes on the way are there: of a result that was loaded, they are not."""
        return "template" in vars(self)

    def write(
        self,
        folder: str | Path,
        formats: str | tuple[str, ...] = ("exf", "vtu"),
        fields: Iterable[str | MeshField] = tuple(FIELDS),
        rule: FiberRule | None = None,
        cells: str | None = None,
        mask: bool = False,
    ) -> list[Path]:
        """Write the mesh and its report; each file appears whole or not at all.

        Parameters
        ----------
        folder : path
            Created if absent; gets ``mesh.exf``, ``mesh.vtu`` and ``report.json``.
        formats : str or tuple of str
            Name or names of the mesh formats, of `heartgen.formats.FORMATS`.
        fields : iterable of str or MeshField
            Fields on the mesh that go into the files that have a place for them: names of
            `heartgen.fields.FIELDS`, of which all are written if omitted, or fields of your own.
        rule : FiberRule, optional
            Angles of the fibers.
        cells : {"hex8", "hex20", "hex27", "tet4", "tet10"}, optional
            Cells for the formats of linear or quadratic cells; the usual ones of each if omitted.
        mask : bool
            Write the mask as well, ``mask.nii.gz``: 1 in the myocardium, 2 and 3 in blood pools,
            the labels of the scheme ``"heartgen"``.

        Returns
        -------
        list of Path
            The files written.
        """
        folder, fields = Path(folder), tuple(fields)
        formats = (formats,) if isinstance(formats, str) else formats
        named = check_names(name for name in fields if isinstance(name, str))
        made = self.fields(_needed(named, formats), rule)
        own = tuple(field for field in fields if isinstance(field, MeshField))
        paths: list[Path] = []
        for name in formats:
            path = folder / file_name("mesh", name)
            wanted = cells_of(name, cells)
            paths += write_mesh(self.mesh, path, (*made, *own), name, wanted).files
        write_text(_portable(self.report, folder).to_json() + "\n", folder / REPORT)
        paths.append(folder / REPORT)
        if mask:
            paths.append(keep_mask(self.mask, folder))
        return paths

    def fields(
        self, names: Iterable[str] | None = None, rule: FiberRule | None = None
    ) -> tuple[MeshField, ...]:
        """Make fields on the mesh.

        Parameters
        ----------
        names : iterable of str, optional
            Of `heartgen.fields.FIELDS`: material coordinates, AHA segments, fibers and their
            angles, and thickness and curvature of the wall; all if omitted.
        rule : FiberRule, optional
            Angles of the fibers.

        Returns
        -------
        tuple of MeshField
        """
        return make_fields(
            self.mesh, names, rule=rule, septal_direction=self.options.septal_direction
        )

    def plot(self, **options: Any) -> pyvista.Plotter:
        """Show the mesh over the mask's surface; options go to `heartgen.viewing.plot`.

        Parameters
        ----------
        **options : object
            As of `heartgen.viewing.plot`.
        """
        from heartgen.viewing import plot

        return plot(self, **options)


def _needed(fields: Iterable[str], formats: Iterable[str]) -> list[str]:
    """Names of the fields for which one of these formats has a place."""
    held = {fields_held(name) for name in formats}
    if "all" in held:
        return list(fields)
    return [name for name in fields if name == DIRECTIONS] if "directions" in held else []


def _portable(report: Report, folder: Path) -> Report:
    """The report as it is written: its mask's place is told from the folder."""
    if report.mask_source is None:
        return report
    return replace(report, mask_source=seen_from(report.mask_source, folder))
