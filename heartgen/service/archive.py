"""The library as one archive: a table of all models (Parquet) and their files, out and in again."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import TypeAdapter, ValidationError
from sqlalchemy import select

from heartgen.errors import InputError
from heartgen.files import replacing
from heartgen.service.library import Library, add
from heartgen.service.metadata import FACETS, Metadata, words_of
from heartgen.service.schemas import Identifier, Version
from heartgen.service.tables import Audit, Model, new_id
from heartgen.service.tokens import Caller

TABLE = "models.parquet"
"""The table in an archive."""

FILES = ("mesh.exf", "mesh.vtu", "report.json", "preview/preview.png", "view/view.html")
"""Of a model."""

NEEDED = FILES[:3]

MOST_MODELS = 100_000
"""In an archive that is taken in."""

LARGEST_TABLE, LARGEST_FILE = 512 * 1024**2, 256 * 1024**2
"""Bytes, unpacked."""

BLOCK = 1024 * 1024
"""Bytes that are copied at a time."""

TOLD = ("title", *FACETS, "citation", "description")
"""Columns of text."""


@dataclass(frozen=True)
class Taken:
    """What came of an archive.

    Attributes
    ----------
    added : int
        Models that are new here.
    known : int
        Those that were here before.
    """

    added: int
    known: int


def export(library: Library, target: Path) -> int:
    """Write all models, all versions, into one archive.

    Parameters
    ----------
    library : Library
        From which.
    target : Path
        A .zip file, which appears whole or not at all.

    Returns
    -------
    int
        How many.
    """
    rows: list[dict[str, Any]] = []
    with (
        replacing(target) as path,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        library.database.reading() as session,
    ):
        for model in session.scalars(select(Model).order_by(Model.identifier, Model.version)):
            hashes: dict[str, str] = {}
            for name, file in _files(library, model):
                hashes[name] = hashlib.sha256(file.read_bytes()).hexdigest()
                archive.write(file, _place(model.identifier, model.version, name))
            rows.append(
                {
                    "identifier": model.identifier,
                    "version": model.version,
                    "published": model.published,
                    **{name: getattr(model, name) for name in TOLD},
                    "keywords": list(model.keywords),
                    "provenance": json.dumps(model.provenance),
                    "sha256": json.dumps(hashes),
                }
            )
        table = BytesIO()
        pq.write_table(pa.Table.from_pylist(rows, schema=_schema()), table)
        archive.writestr(TABLE, table.getvalue())
    return len(rows)


def take_in(library: Library, source: Path, caller: Caller) -> Taken:
    """Add the models of an archive that are not here; what it holds besides is not looked at.

    Parameters
    ----------
    library : Library
        To which.
    source : Path
        As `export` writes it.
    caller : Caller
        Who asks; owns what is added.

    Raises
    ------
    InputError
        If it is no such archive, or a file in it is not what its table says. Models before that
        one stay.
    """
    added = known = 0
    try:
        with zipfile.ZipFile(source) as archive:
            for row in _rows(archive):
                if library.get(row["identifier"], row["version"]) is not None:
                    known += 1
                    continue
                _add(library, archive, row, caller)
                added += 1
    except (zipfile.BadZipFile, pa.ArrowException, NotImplementedError, RuntimeError) as error:
        raise InputError(
            f"{source.name}: This is no archive of a library ({error}): give one that heartgen "
            "library export wrote."
        ) from error
    return Taken(added, known)


def _add(library: Library, archive: zipfile.ZipFile, row: dict[str, Any], caller: Caller) -> None:
    """Add one model."""
    try:
        told = {name: row[name] for name in (*TOLD, "keywords")}
        metadata = Metadata(**told, no_names=True)
        hashes = json.loads(row["sha256"])
        provenance = json.loads(row["provenance"])
        if not set(NEEDED) <= set(hashes) <= set(FILES) or not isinstance(provenance, dict):
            raise ValueError("files are missing")
    except (ValidationError, ValueError, TypeError, KeyError) as error:
        raise InputError(
            f"{row['identifier']}: What the table says of this model is not as it has to be "
            f"({' '.join(str(error).split())[:200]}): export it again."
        ) from error
    model = Model(
        id=new_id(),
        identifier=row["identifier"],
        version=row["version"],
        published=float(row["published"]),
        owner=caller.owner,
        **metadata.model_dump(exclude={"no_names"}),
        words=words_of(metadata, row["identifier"]),
        provenance=provenance,
    )

    def unpack(stage: Path) -> None:
        for name, digest in hashes.items():
            (stage / name).parent.mkdir(exist_ok=True)
            _unpack(archive, _place(model.identifier, model.version, name), stage / name, digest)

    library.artifacts.make(f"library/{model.id}", unpack)
    with library.database.writing() as session:
        add(session, model)
        session.add(
            Audit(
                actor=caller.owner,
                action="import",
                subject=model.identifier,
                detail={"version": model.version, "title": model.title},
            )
        )


def _rows(archive: zipfile.ZipFile) -> Iterator[dict[str, Any]]:
    """Rows of the table, each with an identifier and a version."""
    try:
        entry = archive.getinfo(TABLE)
    except KeyError:
        raise InputError(
            f"there is no {TABLE} in this archive: give one that heartgen library export wrote"
        ) from None
    if entry.file_size > LARGEST_TABLE:
        raise InputError(f"{TABLE} is larger than any library: export it again")
    with archive.open(entry) as file:
        table = pq.read_table(BytesIO(file.read(LARGEST_TABLE)), schema=_schema())
    if table.num_rows > MOST_MODELS:
        raise InputError(f"{table.num_rows} models are more than the {MOST_MODELS} that are taken")
    identifier: TypeAdapter[str] = TypeAdapter(Identifier)
    version: TypeAdapter[int] = TypeAdapter(Version)
    for row in table.to_pylist():
        try:
            identifier.validate_python(row["identifier"])
            version.validate_python(row["version"])
        except ValidationError:
            raise InputError(
                f"{row['identifier']!r}, version {row['version']!r}, is no model of a library: "
                "export it again"
            ) from None
        yield row


def _unpack(archive: zipfile.ZipFile, name: str, target: Path, digest: str) -> None:
    """Unpack a file that is what the table says; no name from the archive becomes a path."""
    found, size = hashlib.sha256(), 0
    try:
        source = archive.open(name)
    except KeyError:
        raise InputError(f"{name} is not in this archive: export it again") from None
    with source, target.open("xb") as out:
        while block := source.read(BLOCK):
            size += len(block)
            found.update(block)
            if size > LARGEST_FILE:
                raise InputError(f"{name} is larger than any mesh: export it again")
            out.write(block)
    if found.hexdigest() != digest:
        raise InputError(f"{name} is not what the table says: export it again")


def _files(library: Library, model: Model) -> Iterator[tuple[str, Path]]:
    """Names in the archive, and files, of a model."""
    home = library.artifacts.home / "library" / model.id
    for name in FILES:
        if (home / name).is_file():
            yield name, home / name


def _place(identifier: str, version: int, name: str) -> str:
    return f"files/{identifier}/v{version}/{name}"


def _schema() -> pa.Schema:
    """Columns of the table."""
    text = pa.string()
    return pa.schema(
        [
            ("identifier", text),
            ("version", pa.int64()),
            ("published", pa.float64()),
            *((name, text) for name in TOLD),
            ("keywords", pa.list_(text)),
            ("provenance", text),
            ("sha256", text),
        ]
    )
