"""Requests about jobs: submit, follow, cancel, take away."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Depends, HTTPException, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, JSONResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent

from heartgen.service.renditions import ALL, NAMES, media_type
from heartgen.service.schemas import (
    PAGE,
    REFUSALS,
    JobId,
    JobOut,
    Limit,
    Offset,
    found,
    job_out,
)
from heartgen.service.security import VIEW_POLICY, Parts, needs
from heartgen.service.service import Service
from heartgen.service.submission import KEY_HEADER, form_schema, submitted
from heartgen.service.tables import Job, State
from heartgen.service.tokens import Caller

LOOK = 0.25
"""Seconds between two looks at a job that is waited for."""

KEY = {
    "name": KEY_HEADER,
    "in": "header",
    "schema": {"type": "string", "maxLength": 200},
    "description": "The same key and content give the same job, however often it is submitted.",
}

FORM = form_schema() | {"parameters": [KEY]}

Mine = Annotated[Caller, Depends(needs("jobs"))]

router = APIRouter(prefix="/v1", tags=["jobs"], responses=REFUSALS)


@router.post("/jobs", status_code=202, response_model=JobOut, openapi_extra=FORM)
async def _submit(request: Request, response: Response, service: Parts, caller: Mine) -> JobOut:
    """Submit a mask or label map with its options; what was done before is answered at once."""
    job, _ = await submitted(request, service, caller)
    response.headers["Location"] = f"/v1/jobs/{job.id}"
    return await run_in_threadpool(job_out, service.jobs, job)


@router.post(
    "/personalize",
    openapi_extra=FORM,
    response_class=FileResponse,
    responses={202: {"model": JobOut, "description": "It takes longer: see the job"}},
)
async def _personalize(
    request: Request,
    service: Parts,
    caller: Mine,
    format: Annotated[str, Query(description=f"One of {', '.join(NAMES)}.")] = ALL,
) -> Response:
    """Submit a mask, wait, and get the result."""
    _known(format)
    job, _ = await submitted(request, service, caller)
    end = time.monotonic() + service.settings.wait_limit
    while not State(job.state).ended and time.monotonic() < end:
        if await request.is_disconnected():
            break
        await asyncio.sleep(LOOK)
        job = found(await run_in_threadpool(service.jobs.get, job.id), "job")
    headers = {"Location": f"/v1/jobs/{job.id}"}
    if not State(job.state).ended:
        shown = await run_in_threadpool(job_out, service.jobs, job)
        return JSONResponse(shown.model_dump(mode="json"), 202, headers)
    if job.state != State.DONE:
        raise HTTPException(422, job.reason, headers)
    answer = await run_in_threadpool(rendition, service, job, format)
    answer.headers.update(headers)
    return answer


@router.get("/jobs")
def _list(
    service: Parts,
    caller: Mine,
    state: State | None = None,
    limit: Limit = PAGE,
    offset: Offset = 0,
) -> list[JobOut]:
    """Your jobs, newest first."""
    jobs = service.jobs.of_owner(caller.owner, state, limit, offset)
    return [job_out(service.jobs, job) for job in jobs]


@router.get("/jobs/{identifier}")
def _get(identifier: JobId, service: Parts, caller: Mine) -> JobOut:
    """State, step, progress and place in the queue of a job."""
    return job_out(service.jobs, own(service, identifier, caller))


@router.delete("/jobs/{identifier}")
def _cancel(identifier: JobId, service: Parts, caller: Mine) -> JobOut:
    """Cancel a job; one that has ended stays as it is."""
    own(service, identifier, caller)
    service.jobs.cancel(identifier)
    return job_out(service.jobs, own(service, identifier, caller))


@router.get(
    "/jobs/{identifier}/events",
    response_class=EventSourceResponse,
    responses={200: {"description": "An event for each change, until the job has ended"}},
)
async def _events(
    identifier: JobId, service: Parts, caller: Mine
) -> AsyncIterator[ServerSentEvent]:
    """Follow a job: server-sent events, each the job as it is then."""
    told: dict[str, Any] | None = None
    while True:
        job = await run_in_threadpool(own, service, identifier, caller)
        shown = await run_in_threadpool(job_out, service.jobs, job)
        now = shown.model_dump(mode="json")
        if now != told:
            yield ServerSentEvent(data=now, event="job")
            told = now
        if State(job.state).ended:
            return
        await asyncio.sleep(LOOK)


@router.get("/jobs/{identifier}/results", response_class=FileResponse)
def _results(identifier: JobId, service: Parts, caller: Mine) -> Response:
    """All files of a result in one archive; parts of it by Range."""
    return rendition(service, own(service, identifier, caller), ALL)


@router.get("/jobs/{identifier}/results/{format}", response_class=FileResponse)
def _result(identifier: JobId, format: str, service: Parts, caller: Mine) -> Response:
    """One file of a result: a mesh format, report, preview (PNG) or view (HTML, 3-D)."""
    _known(format)
    return rendition(service, own(service, identifier, caller), format)


def own(service: Service, identifier: str, caller: Caller) -> Job:
    """A job of whoever asks, or an answer of 404: also for those of others.

    Parameters
    ----------
    service : Service
        The parts of the service.
    identifier : str
        Of the job.
    caller : Caller
        Who asks.
    """
    job: Job = found(service.jobs.get(identifier, caller.owner), "job")
    return job


def rendition(service: Service, job: Job, name: str) -> FileResponse:
    """The answer with a file of a result.

    Parameters
    ----------
    service : Service
        The parts of the service.
    job : Job
        Any; one without a result is refused.
    name : str
        Of the file.
    """
    if job.state != State.DONE:
        raise HTTPException(
            409, job.reason or f"the job is {job.state}: there is no result yet; ask again later"
        )
    if not service.artifacts.is_done(job.fingerprint):
        raise HTTPException(404, "this result is no longer kept: submit the mask again")
    return file_answer(service.renditions.file(f"results/{job.fingerprint}", name), name)


def file_answer(path: Path, name: str) -> FileResponse:
    """The answer with a file; the view is shown, apart from everything of ours.

    Parameters
    ----------
    path : Path
        Of the file.
    name : str
        Of `NAMES`.
    """
    headers = {"Content-Security-Policy": VIEW_POLICY} if name == "view" else {}
    shown = name in ("view", "preview")
    return FileResponse(
        path,
        headers=headers,
        media_type=media_type(name, path),
        filename=None if shown else path.name,
    )


def _known(name: str) -> None:
    """Refuse a format that there is not."""
    if name not in NAMES:
        raise HTTPException(422, f"format {name!r} is not known: choose one of {', '.join(NAMES)}")
