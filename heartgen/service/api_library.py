"""Requests about the library: publish, search, take away, withdraw, export, import."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Depends, HTTPException, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse
from pydantic import BaseModel, Field
from starlette.background import BackgroundTask
from starlette.datastructures import UploadFile

from heartgen.service.api_jobs import file_answer, own
from heartgen.service.archive import Taken, export, take_in
from heartgen.service.metadata import Found, Metadata, ModelOut, json_ld, model_out
from heartgen.service.renditions import NAMES
from heartgen.service.schemas import (
    REFUSALS,
    Identifier,
    JobId,
    Limit,
    Line,
    Offset,
    Version,
    found,
)
from heartgen.service.security import Parts, needs
from heartgen.service.service import Service
from heartgen.service.tables import Model
from heartgen.service.tokens import Caller

Reader = Annotated[Caller, Depends(needs("library"))]
Publisher = Annotated[Caller, Depends(needs("publish"))]
Admin = Annotated[Caller, Depends(needs("admin"))]

ARCHIVE = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["archive"],
                    "properties": {"archive": {"type": "string", "format": "binary"}},
                }
            }
        },
    }
}

router = APIRouter(prefix="/v1", tags=["library"], responses=REFUSALS)


class Publication(BaseModel):
    """A result that is to be published."""

    job: JobId
    metadata: Metadata
    new_version_of: Identifier | None = None


@router.post("/models", status_code=201)
def _publish(wanted: Publication, service: Parts, caller: Publisher) -> ModelOut:
    """Publish the result of a job, as a new model or as a new version of one of yours."""
    job = own(service, wanted.job, caller)
    model = service.library.publish(job, wanted.metadata, caller, wanted.new_version_of)
    return model_out(model, service.settings.url)


class Wanted(BaseModel):
    """Words and facets that are looked for, and which of what is found."""

    q: Line = Field("", description="Words.")
    species: Line = ""
    condition: Line = ""
    modality: Line = ""
    phase: Line = ""
    sex: Line = ""
    age_band: Line = ""
    study: Line = ""
    license: Line = ""
    limit: Limit = 20
    offset: Offset = 0


@router.get("/models")
def _search(service: Parts, caller: Reader, wanted: Annotated[Wanted, Query()]) -> Found:
    """Search the latest versions by words and facets; and how many there are under each facet."""
    facets = wanted.model_dump(exclude={"q", "limit", "offset"})
    return service.library.search(wanted.q, facets, wanted.limit, wanted.offset)


@router.get("/models/archive", response_class=FileResponse)
def _export(service: Parts, caller: Admin) -> Response:
    """Take away the whole library: a table (Parquet) and all files, in one archive."""
    folder = Path(tempfile.mkdtemp(dir=service.artifacts.home / "incoming"))
    path = folder / "library.zip"
    export(service.library, path)
    clean = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    return FileResponse(path, filename=path.name, background=clean)


@router.post("/models/archive", openapi_extra=ARCHIVE)
async def _import(request: Request, service: Parts, caller: Admin) -> Taken:
    """Add the models of an archive that are not here."""
    async with request.form(max_files=1, max_fields=4) as form:
        archive = form.get("archive")
        if not isinstance(archive, UploadFile):
            raise HTTPException(422, "there is no archive: attach it in the field archive")
        return await run_in_threadpool(_take_in, service, archive, caller)


@router.get("/models/{identifier}")
def _latest(identifier: Identifier, service: Parts, caller: Reader) -> ModelOut:
    """The latest version of a model."""
    return model_out(version_of(service, identifier, None), service.settings.url)


@router.get("/models/{identifier}/versions")
def _versions(identifier: Identifier, service: Parts, caller: Reader) -> list[ModelOut]:
    """All versions of a model, latest first."""
    found(service.library.get(identifier), "model")
    return [model_out(each, service.settings.url) for each in service.library.versions(identifier)]


@router.get("/models/{identifier}/versions/{version}")
def _version(identifier: Identifier, version: Version, service: Parts, caller: Reader) -> ModelOut:
    """A version of a model."""
    return model_out(version_of(service, identifier, version), service.settings.url)


@router.get("/models/{identifier}/versions/{version}/jsonld")
def _jsonld(
    identifier: Identifier, version: Version, service: Parts, caller: Reader
) -> dict[str, Any]:
    """A version of a model as a Dataset of schema.org (JSON-LD)."""
    return json_ld(version_of(service, identifier, version), service.settings.url)


@router.get("/models/{identifier}/versions/{version}/files/{format}", response_class=FileResponse)
def _file(
    identifier: Identifier, version: Version, format: str, service: Parts, caller: Reader
) -> Response:
    """A file of a model: a mesh format, report, preview, view, or all (results)."""
    model = version_of(service, identifier, version)
    if format not in NAMES:
        raise HTTPException(
            422, f"format {format!r} is not known: choose one of {', '.join(NAMES)}"
        )
    return file_answer(service.library.file(model, format), format)


@router.delete("/models/{identifier}/versions/{version}", status_code=204)
def _withdraw(identifier: Identifier, version: Version, service: Parts, caller: Publisher) -> None:
    """Withdraw a version of a model of yours."""
    service.library.withdraw(version_of(service, identifier, version), caller)


def version_of(service: Service, identifier: str, version: int | None) -> Model:
    """A model, or an answer of 404.

    Parameters
    ----------
    service : Service
        The parts of the service.
    identifier : str
        Of the model.
    version : int or None
        None for the latest.
    """
    model: Model = found(service.library.get(identifier, version), "model")
    return model


def _take_in(service: Service, archive: UploadFile, caller: Caller) -> Taken:
    """Keep an archive as a file while it is read."""
    with tempfile.NamedTemporaryFile(
        dir=service.artifacts.home / "incoming", suffix=".zip"
    ) as file:
        shutil.copyfileobj(archive.file, file)
        file.flush()
        return take_in(service.library, Path(file.name), caller)
