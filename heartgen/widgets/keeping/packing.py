"""Results as files without code: arrays, plain values, and the package's own data classes.

A pickle would run what it says, and sessions are files that users exchange. Here a file names the
data classes of a short list and nothing else. What several objects share is written once, and what
a reader has already (mask and anatomy of a result) is not written at all.
"""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.lib.format import read_array, write_array

from heartgen.errors import InputError
from heartgen.files import replacing

CLASSES = {
    "heartgen.anatomy.analysis": ("Anatomy",),
    "heartgen.anatomy.base": ("Base",),
    "heartgen.anatomy.heart_shape": ("Slices",),
    "heartgen.anatomy.plane": ("Plane",),
    "heartgen.anatomy.right_ventricle": ("RvAnatomy",),
    "heartgen.assessment": ("Accuracy", "Quality"),
    "heartgen.coverage": ("Coverage",),
    "heartgen.fairness": ("Fairness",),
    "heartgen.fields.indices": ("Indices",),
    "heartgen.images.isosurface": ("Isosurface",),
    "heartgen.images.levelset": ("LevelSet",),
    "heartgen.images.mask": ("Finding", "Mask"),
    "heartgen.mesh.hexmesh": ("HexMesh",),
    "heartgen.mesh.topology": ("Topology",),
    "heartgen.options": ("Options",),
    "heartgen.registration.deformation": ("Deformation", "GridMap", "NodeGrid"),
    "heartgen.report": ("Measurements", "Report", "RightMeasurements", "SliceReport"),
    "heartgen.result": ("Personalization",),
}
"""All that may be in a file, by module."""

PARTIAL = "Personalization"
"""The class of which parts may be missing: it says so when they are asked for."""

GRAPH = "graph.json"
"""Member of a packed file that says how its arrays belong together."""

LEVEL = 1
"""Of the compression: the fastest halves most arrays, and the best takes ten times as long."""

MOST = 4_000_000_000
"""Bytes of the arrays that are read from one file: a stop for files that are made to do harm."""

DAMAGES = (
    *(zipfile.BadZipFile, zlib.error, EOFError),
    *(OSError, ValueError, LookupError, TypeError, AttributeError),
)
"""What a file that is damaged, or was made to do harm, ends in."""

PLAIN = (str, int, float, bool, type(None))


def pack(value: Any, path: Path, known: Any = ()) -> None:
    """Write values into a file, which appears whole or not at all.

    Parameters
    ----------
    value : object
        Arrays, sparse arrays, numbers, texts, tuples, lists, dictionaries with texts for keys, and
        data classes of `CLASSES`.
    path : Path
        The file.
    known : object
        What whoever reads it has: parts of it are referred to, not written.
    """
    writer = _Writer(known)
    graph = writer.told(value)
    with (
        replacing(path) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive,
    ):
        for number, array in enumerate(writer.arrays):
            with archive.open(f"{number}.npy", "w", force_zip64=True) as member:
                write_array(member, array, allow_pickle=False)
        archive.writestr(GRAPH, json.dumps(graph))


def unpack(path: Path, known: Any = ()) -> Any:
    """Read what `pack` wrote.

    Parameters
    ----------
    path : Path
        The file.
    known : object
        What was given to `pack`, or its equal.

    Raises
    ------
    InputError
        If the file holds anything else.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(each.file_size for each in archive.infolist()) > MOST:
                raise InputError(f"{path.name}: This file is too large to be read.")
            return _Reader(archive, known, path.parent).made(json.loads(archive.read(GRAPH)))
    except InputError:
        raise
    except DAMAGES as e:
        raise InputError(
            f"{path.name}: This is no file of a heartgen session, or it is damaged ({e})."
        ) from e


@cache
def _classes() -> dict[str, type]:
    """The data classes that may be in a file, by name."""
    return {
        name: getattr(import_module(module), name)
        for module, names in CLASSES.items()
        for name in names
    }


def _parts(value: Any) -> Iterator[Any]:
    """All shared things in a value, always in the same order."""
    if isinstance(value, np.ndarray) or sp.issparse(value):
        yield value
    elif is_dataclass(value):
        yield value
        for each in fields(value):
            yield from _parts(getattr(value, each.name))
    elif isinstance(value, Mapping):
        for part in value.values():
            yield from _parts(part)
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _parts(part)


def _shared(known: Any) -> list[Any]:
    """What is in the hands of the reader, each once."""
    return list({id(part): part for part in _parts(known)}.values())


class _Writer:
    """Tells values in JSON, and collects their arrays."""

    def __init__(self, known: Any) -> None:
        self.arrays: list[np.ndarray[Any, Any]] = []
        self._kept = _shared(known)  # so that no other object has the number of one of them
        self._known = {id(part): {"known": n} for n, part in enumerate(self._kept)}
        self._seen: dict[int, int] = {}

    def told(self, value: Any) -> Any:
        """A value in JSON."""
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, PLAIN):
            return value
        if isinstance(value, list):
            return [self.told(part) for part in value]
        if isinstance(value, tuple):
            return {"tuple": [self.told(part) for part in value]}
        if isinstance(value, Mapping):
            return {"dict": [[self.told(k), self.told(v)] for k, v in value.items()]}
        if id(value) in self._known:
            return self._known[id(value)]
        if id(value) in self._seen:
            return {"again": self._seen[id(value)]}
        told = self._told_anew(value)
        self._seen[id(value)] = len(self._seen)
        self._kept.append(value)
        return told

    def _told_anew(self, value: Any) -> Any:
        kind = type(value)
        if isinstance(value, np.ndarray):
            self.arrays.append(value)
            return {"array": len(self.arrays) - 1}
        if sp.issparse(value):
            matrix: Any = value
            rows = matrix.tocsr()
            self.arrays += [rows.data, rows.indices, rows.indptr]
            return {"sparse": len(self.arrays) - 3, "shape": list(rows.shape)}
        name = kind.__name__
        if _classes().get(name) is not kind:
            raise TypeError(f"{kind.__qualname__} cannot be packed")
        names = [each.name for each in fields(kind)]
        if name == PARTIAL:  # one that was loaded lacks what is not written
            names = [each for each in names if each in vars(value)]
        parts = {each: self.told(getattr(value, each)) for each in names}
        return {"class": name, "fields": parts}


class _Reader:
    """Makes values of what a writer told."""

    def __init__(self, archive: zipfile.ZipFile, known: Any, folder: Path) -> None:
        self._archive, self._folder = archive, folder
        self._known = _shared(known)
        self._seen: list[Any] = []

    def made(self, told: Any) -> Any:
        """The value that was told."""
        if isinstance(told, PLAIN):
            return told
        if isinstance(told, list):
            return [self.made(part) for part in told]
        if "tuple" in told:
            return tuple(self.made(part) for part in told["tuple"])
        if "dict" in told:
            return {self.made(k): self.made(v) for k, v in told["dict"]}
        if "known" in told:
            return self._known[told["known"]]
        if "again" in told:
            return self._seen[told["again"]]
        made = self._made_anew(told)
        self._seen.append(made)
        return made

    def _made_anew(self, told: dict[str, Any]) -> Any:
        if "array" in told:
            return self._array(told["array"])
        if "sparse" in told:
            first, shape = told["sparse"], tuple(told["shape"])
            data, indices, indptr = (self._array(first + n) for n in range(3))
            made = sp.csr_array((data, indices, indptr), shape=shape)
            made.check_format()
            return made
        kind: Any = _classes()[told["class"]]
        parts = {name: self.made(part) for name, part in told["fields"].items()}
        names = {each.name for each in fields(kind)}
        if told["class"] == PARTIAL and set(parts) < names:
            parts["folder"] = self._folder
        elif set(parts) != names:
            raise InputError(
                "This session was made by another version of heartgen: fit the heart again."
            )
        made = object.__new__(kind)  # a result is as it was, whatever its class would derive
        vars(made).update(parts)
        return made

    def _array(self, number: int) -> Any:
        with self._archive.open(f"{number}.npy") as member:
            array = read_array(member, allow_pickle=False)
        return array
