"""What requests bring and answers say."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import HTTPException
from pydantic import AfterValidator, BaseModel, Field, StringConstraints

from heartgen.service.jobs import Jobs
from heartgen.service.tables import Job, State

CONTROL = {*map(chr, range(32)), "\x7f"} - {"\n", "\t", "\r"}
"""Letters that no text has: databases refuse the first of them."""


def _printable(text: str) -> str:
    """Refuse what databases and headers refuse."""
    if any(letter in CONTROL or "\ud800" <= letter <= "\udfff" for letter in text):
        raise ValueError("there are control characters in this text: leave them out")
    return text


Line = Annotated[str, StringConstraints(max_length=200), AfterValidator(_printable)]
"""A short text."""

Passage = Annotated[str, StringConstraints(max_length=5000), AfterValidator(_printable)]
"""A long text."""

JobId = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{32}$")]
MODEL = r"^HG-[0-9A-HJKMNP-TV-Z]{10}$"
"""Of identifiers of models: base 32 of Crockford, without letters that are mistaken for others."""

Identifier = Annotated[str, StringConstraints(pattern=MODEL)]

Version = Annotated[int, Field(ge=1, le=100_000)]
Offset = Annotated[int, Field(ge=0, le=10_000_000)]

PAGE = 50
"""Entries of a page, if not asked otherwise."""

Limit = Annotated[int, Field(ge=1, le=500)]


class JobOut(BaseModel):
    """A job, as its owner sees it."""

    id: str
    title: str
    state: State
    step: str | None = Field(None, description="That runs.")
    progress: float = Field(description="Share of the step that is done; 1 once all is done.")
    place: int | None = Field(None, description="In the queue, from 1.")
    reason: str | None = Field(None, description="Why there is no result.")
    summary: dict[str, Any] | None = Field(None, description="Figures of the result.")
    options: dict[str, Any]
    created: float = Field(description="Seconds since 1970.")
    started: float | None = None
    finished: float | None = None


class Refusal(BaseModel):
    """Why a request was not followed."""

    detail: str = Field(description="A sentence.")


def job_out(jobs: Jobs, job: Job) -> JobOut:
    """A job, as its owner sees it.

    Parameters
    ----------
    jobs : Jobs
        With the queue.
    job : Job
        Of the database.
    """
    return JobOut(
        id=job.id,
        title=job.title,
        state=State(job.state),
        step=job.step,
        progress=job.progress,
        place=jobs.place(job),
        reason=job.reason,
        summary=job.summary,
        options=job.options,
        created=job.created,
        started=job.started,
        finished=job.finished,
    )


def found(thing: Any, what: str) -> Any:
    """What was asked for, or an answer of 404.

    Parameters
    ----------
    thing : object
        None if it is not there.
    what : str
        That was asked for.
    """
    if thing is None:
        raise HTTPException(404, f"there is no such {what}, or it is not yours")
    return thing


REFUSALS: dict[int | str, dict[str, Any]] = {
    code: {"model": Refusal, "description": why}
    for code, why in {
        400: "The request cannot be read",
        401: "No valid token",
        403: "The token is not for that",
        404: "There is none",
        409: "Not now",
        413: "Too large",
        422: "What was given is not as it has to be",
        429: "Too many requests",
        503: "Not now: disk or database",
    }.items()
}
"""Answers that any request may have."""
