"""EX files of version 1 to 3 into meshes: tricubic Hermite or Lagrange elements, and fields.

Versions, sums and scale factors all become weights of the extraction matrix. Coordinates are taken
to be mm, world (LPS).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import HeartgenError, InputError
from heartgen.formats.assembled import MeshFile, NamedSets, assembled, named_faces, our_name
from heartgen.formats.ex1 import ELEMENTS, NODES
from heartgen.formats.excontent import ExContent
from heartgen.formats.exf import STRUCTURE
from heartgen.formats.exmodel import COORDINATES, LABELS, RESERVED
from heartgen.formats.exterms import ExTerms, constant_values, terms_of
from heartgen.formats.extext import BROKEN, COMMENT, parse_ex
from heartgen.formats.written import read_text
from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import COEFFICIENTS
from heartgen.mesh.topology import ROUNDING


def read_ex(path: str | Path) -> MeshFile:
    """Read a mesh from an EX file, or from a pair of an ``.exnode`` and an ``.exelem``.

    Parameters
    ----------
    path : path
        Of either file of a pair.

    Returns
    -------
    MeshFile

    Raises
    ------
    InputError
        If a file cannot be read, or does not hold tricubic hexahedra.
    """
    path = Path(path)
    try:
        return _read(path)
    except HeartgenError:
        raise
    except BROKEN as error:
        raise InputError(f"{path}: The file is damaged ({error}): give the whole of it.") from error


def _read(path: Path) -> MeshFile:
    """Read the file, or the pair that it is one of."""
    paired = path.suffix.lower() in (NODES, ELEMENTS)
    paths = [path.with_suffix(ending) for ending in (NODES, ELEMENTS)] if paired else [path]
    content = parse_ex([(str(each), read_text(each)) for each in paths])
    numbers = sorted(number for number, element in content.elements.items() if element.parts)
    if not numbers:
        raise InputError(f"{path}: The file holds no elements: give one of a volume mesh.")
    name = _geometry(path, content, numbers)
    try:
        terms = terms_of(content, numbers, name)
    except HeartgenError:
        raise
    except ValueError as error:
        raise InputError(
            f"{path}: The field {name!r} cannot be read ({error}): give tricubic Hermite or "
            "Lagrange hexahedra, all of one basis."
        ) from error
    named, unread = _named(content, numbers)
    fields, more_unread = _fields(content, numbers, name)
    blocks = sp.kron(sp.eye_array(len(numbers)), sp.csr_array(terms.to_bernstein))
    mesh = assembled(
        dofs=terms.values,
        extraction=sp.csr_array(blocks @ terms.weights),
        nodes=np.unique(terms.corners, return_inverse=True)[1].reshape(-1, 8),
        constant=np.array([float(label == LABELS[0]) for _, label, _ in terms.keys]),
        basis=terms.basis,
        index=_structure(content.comments, len(numbers)),
        named=named,
    )
    return MeshFile(mesh, fields, (*unread, *more_unread))


def _geometry(path: Path, content: ExContent, numbers: list[int]) -> str:
    """Name of the field of coordinates."""
    kinds = {
        name: kind
        for head, _ in content.elements[numbers[0]].parts
        for name, kind in head.kinds.items()
    }
    candidates = sorted(name for name, kind in kinds.items() if kind.startswith("coordinate"))
    name = COORDINATES if COORDINATES in candidates else next(iter(candidates), None)
    if name is None:
        raise InputError(f"{path}: The elements have no coordinates: give the file that has them.")
    if "rectangular cartesian" not in kinds[name]:
        raise InputError(
            f"{path}: The field {name!r} is in other than rectangular Cartesian coordinates "
            f"({kinds[name]}): convert it with cmGui or zinc before."
        )
    return name


def _structure(comments: list[str], n_elements: int) -> NDArray[np.intp] | None:
    """Places of the elements (e, 3), if the file tells."""
    title = STRUCTURE.removeprefix(COMMENT)
    if title not in comments:
        return None
    following = comments[comments.index(title) + 1 :]
    rows: list[list[int]] = []
    for line in following:
        if not re.fullmatch(r"[\d\s;]+", line):
            break
        rows += [[int(number) for number in place.split()] for place in line.split(";")]
    whole = len(rows) == n_elements and all(len(row) == 3 for row in rows)
    return np.array(rows, dtype=np.intp) if whole else None


def _named(content: ExContent, numbers: list[int]) -> tuple[NamedSets, list[str]]:
    """What the groups name, and what was not read."""
    row = {number: place for place, number in enumerate(numbers)}
    faces: dict[int, list[tuple[int, int]]] = {}
    for number in numbers:
        for face, of in enumerate(content.elements[number].faces):
            faces.setdefault(of, []).append((row[number], face))
    parts: dict[str, NDArray[np.intp]] = {}
    of_faces: dict[str, NDArray[np.intp]] = {}
    unread = []
    for name, members in content.groups.items():
        elements = sorted({row[number] for number in members.get(3, []) if number in row})
        if len(elements) == len(numbers):
            continue  # the whole mesh: what it is called is known from its surfaces
        known = [faces[number][0] for number in members.get(2, []) if number in faces]
        if elements:
            parts[our_name(name)] = np.array(elements, dtype=np.intp)
        elif known:
            of_faces[our_name(name)] = np.array(known, dtype=np.intp)
        elif members.get(2):
            unread.append(f"the group {name!r} was not read: its faces belong to no element")
    outside = {places[0] for places in faces.values() if len(places) == 1}
    surfaces, patches = named_faces(of_faces, outside)
    return NamedSets(surfaces, parts, patches), unread


def _fields(
    content: ExContent, numbers: list[int], geometry: str
) -> tuple[tuple[MeshField, ...], list[str]]:
    """Fields on all elements, and a note on each of the others."""
    names = dict.fromkeys(
        name
        for number in numbers
        for head, _ in content.elements[number].parts
        for name in head.fields
    )
    read, unread = [], []
    for name in names:
        if name in (geometry, *RESERVED):
            continue
        try:
            values = constant_values(content, numbers, name)
            if values is None:
                values = _on_lattice(terms_of(content, numbers, name), len(numbers))
            read.append(MeshField(name, values))
        except HeartgenError:
            raise
        except ValueError as error:
            unread.append(f"the field {name!r} was not read: {error}")
    return tuple(read), unread


def _on_lattice(terms: ExTerms, n_elements: int) -> NDArray[np.float64]:
    """Values (e, 64, k) on the lattices of the elements."""
    one = tabulate(lattice()) @ terms.to_bernstein
    one = np.where(np.abs(one - np.rint(one)) < ROUNDING, np.rint(one), one)
    parameters = np.asarray(terms.weights @ terms.values).reshape(n_elements, one.shape[1], -1)
    return np.asarray(np.matmul(one, parameters)).reshape(n_elements, COEFFICIENTS, -1)
