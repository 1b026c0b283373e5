"""FieldML 0.5, written by zinc from our EX text, then read again and compared.

Zinc leaves out of FieldML what it cannot say there, scale factors and sums, without a word. Our EX
files have neither, but only what is read back from the file tells that all of it is there: a file
that says something else is not written. mm, world (LPS).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import HeartgenError, MeshError, needing
from heartgen.files import replacing
from heartgen.formats.exf import exf_text
from heartgen.formats.exmodel import COORDINATES, ex_model
from heartgen.formats.written import Written
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh

CLOSE = 1e-9
"""How far what is read may lie from what was to be written, mm; of fields, of the largest value."""

POINTS = 8
"""Places in each element at which they are compared."""

OWN_NAMES = ("elements", "mesh3d", "node_derivatives", "node_versions", "nodes")
"""What zinc calls parts of the file, which it makes more names of with dots."""


def write_fieldml(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as a FieldML 0.5 file.

    Parameters
    ----------
    mesh : HexMesh
        Its basis is that of the coordinates in the file.
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Those that are constant in each element are written on nodes of the elements' own.

    Returns
    -------
    Written
        With a note that FieldML has no groups.

    Raises
    ------
    HeartgenError
        If zinc is not installed, or the file cannot be written.
    MeshError
        If a field does not fit the mesh, or what zinc reads in the file is not the mesh.
    """
    fields = tuple(_on_lattice(field) for field in fitting(fields, mesh.n_elements))
    for field in fields:
        if field.name in OWN_NAMES or "." in field.name:
            raise MeshError(
                f"field {field.name!r}: FieldML has this name for something else, or could: give "
                f"it one without dots that is not {' or '.join(OWN_NAMES)}"
            )
    model = ex_model(mesh, fields)
    with replacing(path) as temporary:
        _written_by_zinc(exf_text(model), temporary)
        wrong = _differing(mesh, fields, temporary)
        if wrong:
            raise MeshError(
                f"{Path(path).name}: FieldML cannot hold {' and '.join(wrong)} of this mesh: "
                "choose another format, such as .exf"
            )
    note = f"{Path(path).name} does not hold the {len(model.groups)} named groups of the mesh"
    return Written((Path(path),), (note,))


def _on_lattice(field: MeshField) -> MeshField:
    """The same field on the lattice: zinc writes none that are constant in each element."""
    if not field.per_element:
        return field
    return replace(field, values=field.evaluate(lattice()))


def _written_by_zinc(text: str, path: Path) -> None:
    """Let zinc read the text of an EX file and write it as FieldML."""
    context = _zinc()
    region = context.getDefaultRegion()
    source = region.createStreaminformationRegion()
    source.createStreamresourceMemoryBuffer(text.encode())
    if region.read(source) != _ok() or region.writeFile(str(path)) != _ok():
        raise HeartgenError(
            f"zinc did not write the mesh as FieldML: {_messages(context)}; choose another format"
        )


def _differing(mesh: HexMesh, fields: tuple[MeshField, ...], path: Path) -> list[str]:
    """What zinc reads in a file that is not that of the mesh, or not at all."""
    context = _zinc()
    region = context.getDefaultRegion()
    if region.readFile(str(path)) != _ok():
        return ["anything"]
    xi = np.random.default_rng(0).random((POINTS, 3))
    expected = {COORDINATES: (mesh.evaluate(xi), CLOSE)}
    for field in fields:
        expected[field.name] = (field.evaluate(xi), CLOSE * max(1.0, np.abs(field.values).max()))
    wrong = []
    for name, (values, close) in expected.items():
        found = _values(region, name, xi, values.shape[2])
        # NaN, where nothing could be read, is not close.
        if found.shape != values.shape or not np.all(np.abs(found - values) <= close):
            wrong.append("the coordinates" if name == COORDINATES else f"the field {name!r}")
    return wrong


def _values(region: Any, name: str, xi: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """A field at local coordinates (q, 3) of all elements, (e, q, k); NaN where it is not."""
    module = region.getFieldmodule()
    mesh, field = module.findMeshByDimension(3), module.findFieldByName(name)
    out = np.full((mesh.getSize(), len(xi), size), np.nan)
    if not field.isValid() or field.getNumberOfComponents() != size:
        return out
    cache = module.createFieldcache()
    for element, of_element in enumerate(out, 1):
        for place, value in zip(xi.tolist(), of_element, strict=True):
            cache.setMeshLocation(mesh.findElementByIdentifier(element), place)
            answer, found = field.evaluateReal(cache, size)
            if answer == _ok():
                value[:] = found
    return out


def _zinc() -> Any:
    """A context of zinc, which has to live as long as its regions."""
    with needing("FieldML needs", "fieldml"):
        from cmlibs.zinc.context import Context
    return Context("heartgen")


def _ok() -> int:
    from cmlibs.zinc.result import RESULT_OK

    return int(RESULT_OK)


def _messages(context: Any) -> str:
    """What zinc has logged."""
    log = context.getLogger()
    said = [log.getMessageTextAtIndex(i + 1) for i in range(log.getNumberOfMessages())]
    return "; ".join(" ".join(text.split()) for text in said) or "it did not say why"
