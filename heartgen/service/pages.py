"""Pages: the form, a job and its result, the library, in the looks of the dashboard."""

from __future__ import annotations

import json
import re
import time
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, get_args
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, HTTPException, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.exception_handlers import http_exception_handler
from fastapi.responses import RedirectResponse
from fastapi.security import HTTPAuthorizationCredentials
from fastapi.templating import Jinja2Templates
from pydantic import ValidationError
from starlette.datastructures import FormData
from starlette.exceptions import HTTPException as StarletteHTTPException

from heartgen.errors import HeartgenError, sentence
from heartgen.formats import FORMATS
from heartgen.images.file_kinds import ENDINGS
from heartgen.options import OPTIONS
from heartgen.service.api_jobs import own
from heartgen.service.api_library import version_of
from heartgen.service.mail import facts_of
from heartgen.service.metadata import (
    FACETS,
    LICENSES,
    AgeBand,
    Metadata,
    Sex,
    json_ld,
    model_out,
)
from heartgen.service.schemas import MODEL, Identifier, JobId, Line, Offset, Version
from heartgen.service.security import COOKIE, FORM_KEY, Parts, caller_of, check_form, form_key
from heartgen.service.service import Service
from heartgen.service.submission import MOST_FIELDS, submitted
from heartgen.service.tables import State
from heartgen.service.tokens import Caller

HERE = Path(__file__).parent
STATIC = HERE / "static"

SWAGGER = Path(str(files("fastapi_offline"))) / "static"
"""Scripts and style of the page that describes the API: ours to serve, so that it works offline."""

RECENT = 20
"""Jobs that the first page lists."""

SHOWN = 24
"""Models on a page of the library."""

MONTH = 30 * 24 * 3600
"""Seconds that a browser keeps a token."""

BASIC = [option for option in OPTIONS.values() if option.about.level == "basic"]
OTHERS = [option for option in OPTIONS.values() if option.about.level != "basic"]

templates = Jinja2Templates(HERE / "templates")
templates.env.globals |= {"FORM_KEY": FORM_KEY, "FORMATS": FORMATS, "facets": FACETS}
templates.env.filters["day"] = lambda t: time.strftime("%Y-%m-%d %H:%M", time.gmtime(t)) + " UTC"
templates.env.filters["words"] = lambda text: text.replace("_", " ")

router = APIRouter(include_in_schema=False)


async def visitor(request: Request, service: Parts) -> Caller:
    """Who looks at a page; whoever needs a token for that is asked for it.

    Parameters
    ----------
    request : Request
        For the page.
    service : Service
        The parts of the service.
    """
    try:
        return await caller_of(request, service, None)
    except HTTPException as refused:
        if refused.status_code != 401:
            raise
        raise HTTPException(303, "a token is needed", {"Location": "/login"}) from None


Visitor = Annotated[Caller, Depends(visitor)]


@router.get("/")
def _home(request: Request, service: Parts, caller: Visitor) -> Response:
    """The form, and the visitor's last jobs."""
    return _first(request, service, caller)


@router.get("/api")
def _api(request: Request) -> Response:
    """What scripts can ask for."""
    paths: dict[str, dict[str, Any]] = request.app.openapi()["paths"]
    told = [
        {"method": method.upper(), "path": path, "about": each["description"].partition("\n")[0]}
        for path, methods in paths.items()
        for method, each in methods.items()
    ]
    return _page(request, "api.html", requests=told)


@router.post("/submit")
async def _submit(request: Request, service: Parts, caller: Visitor) -> Response:
    """A mask from the form."""
    form = await request.form(max_files=1, max_fields=MOST_FIELDS)
    check_form(request, form.get(FORM_KEY))
    _allow(caller, "jobs")
    try:
        job, _ = await submitted(request, service, caller, form)
    except HeartgenError as error:
        return await run_in_threadpool(_first, request, service, caller, sentence(error))
    return RedirectResponse(f"/jobs/{job.id}", 303)


@router.get("/jobs/{identifier}")
def _job(request: Request, identifier: JobId, service: Parts, caller: Visitor) -> Response:
    """A job: how far it is, or what came out."""
    return _shown(request, service, caller, identifier)


@router.post("/jobs/{identifier}/cancel")
async def _cancel(request: Request, identifier: JobId, service: Parts, caller: Visitor) -> Response:
    """Cancel a job."""
    async with request.form(max_files=0, max_fields=4) as form:
        check_form(request, form.get(FORM_KEY))
    _allow(caller, "jobs")
    await run_in_threadpool(own, service, identifier, caller)
    await run_in_threadpool(service.jobs.cancel, identifier)
    return RedirectResponse(f"/jobs/{identifier}", 303)


@router.post("/jobs/{identifier}/publish")
async def _publish(
    request: Request, identifier: JobId, service: Parts, caller: Visitor
) -> Response:
    """Publish a result."""
    async with request.form(max_files=0, max_fields=MOST_FIELDS) as form:
        check_form(request, form.get(FORM_KEY))
        _allow(caller, "publish")
        return await run_in_threadpool(_published, request, identifier, service, caller, form)


@router.get("/library")
def _library(
    request: Request, service: Parts, caller: Visitor, q: Line = "", offset: Offset = 0
) -> Response:
    """Browse the library."""
    _allow(caller, "library")
    chosen = {name: value for name in FACETS if (value := request.query_params.get(name, ""))[:200]}
    found = service.library.search(q.replace("\x00", ""), _plain(chosen), SHOWN, offset)

    def link(**changes: str | int) -> str:
        told = {"q": q, **chosen, **changes}
        return "/library?" + urlencode({name: v for name, v in told.items() if v})

    return _page(
        request,
        "library.html",
        found=found,
        q=q,
        chosen=chosen,
        link=link,
        offset=offset,
        shown=SHOWN,
    )


@router.get("/library/{identifier}")
def _latest(request: Request, identifier: Identifier, service: Parts, caller: Visitor) -> Response:
    """The latest version of a model."""
    return _model_page(request, service, caller, identifier, None)


@router.get("/library/{identifier}/v{version}")
def _version(
    request: Request, identifier: Identifier, version: Version, service: Parts, caller: Visitor
) -> Response:
    """A version of a model."""
    return _model_page(request, service, caller, identifier, version)


@router.get("/docs")
def _docs(request: Request) -> Response:
    """All requests of the API, to be tried."""
    return templates.TemplateResponse(request, "docs.html")


@router.get("/login")
def _login(request: Request) -> Response:
    """Ask for a token."""
    return _page(request, "login.html")


@router.post("/login")
async def _enter(request: Request, service: Parts) -> Response:
    """Keep a token in the browser."""
    async with request.form(max_files=0, max_fields=4) as form:
        check_form(request, form.get(FORM_KEY))
        token = str(form.get("token", "")).strip()
    try:
        given = HTTPAuthorizationCredentials(scheme="Bearer", credentials=token)
        await caller_of(request, service, given)
    except HTTPException as refused:
        return _page(request, "login.html", refused.status_code, error=refused.detail)
    answer = RedirectResponse("/", 303)
    secure = service.settings.url.startswith("https:")
    answer.set_cookie(COOKIE, token, max_age=MONTH, httponly=True, secure=secure, samesite="strict")
    return answer


@router.post("/logout")
async def _leave(request: Request) -> Response:
    """Forget the token."""
    async with request.form(max_files=0, max_fields=4) as form:
        check_form(request, form.get(FORM_KEY))
    answer = RedirectResponse("/login", 303)
    answer.delete_cookie(COOKIE)
    return answer


def _first(request: Request, service: Service, caller: Caller, error: str = "") -> Response:
    """The form, with what was wrong with it."""
    return _page(
        request,
        "submit.html",
        422 if error else 200,
        error=error,
        basic=BASIC,
        others=OTHERS,
        jobs=service.jobs.of_owner(caller.owner, None, RECENT, 0),
        limit=service.settings.upload_limit,
        mails=service.settings.smtp is not None,
        endings=",".join([*ENDINGS, ".gz"]),
    )


def _shown(
    request: Request, service: Service, caller: Caller, identifier: str, error: str = ""
) -> Response:
    """The page of a job, with what was wrong with its publication."""
    _allow(caller, "jobs")
    job = own(service, identifier, caller)
    return _page(
        request,
        "job.html",
        422 if error else 200,
        error=error,
        job=job,
        ended=State(job.state).ended,
        place=service.jobs.place(job),
        facts=facts_of(job),
        publishes="publish" in caller.scopes,
        sexes=get_args(Sex),
        ages=get_args(AgeBand),
        licenses=LICENSES,
    )


def _published(
    request: Request, identifier: str, service: Service, caller: Caller, form: FormData
) -> Response:
    """The page of a model that was published, or of the job that cannot be."""
    told: dict[str, Any] = {
        name: form.get(name) for name in Metadata.model_fields if form.get(name)
    }
    told["no_names"] = form.get("no_names") == "yes"
    told["keywords"] = [w for w in str(form.get("keywords", "")).split(",") if w.strip()]
    before = str(form.get("new_version_of", "")).strip() or None
    job = own(service, identifier, caller)
    if before is not None and not re.match(MODEL, before):
        text = "what it is a new version of is no identifier of a model: give it as HG-..."
        return _shown(request, service, caller, identifier, text)
    try:
        model = service.library.publish(job, Metadata(**told), caller, before)
    except ValidationError as wrong:
        text = "; ".join(f"{each['loc'][0]}: {each['msg']}" for each in wrong.errors())
        return _shown(request, service, caller, identifier, text)
    except HeartgenError as wrong:
        return _shown(request, service, caller, identifier, sentence(wrong))
    return RedirectResponse(f"/library/{model.identifier}/v{model.version}", 303)


def _model_page(
    request: Request, service: Service, caller: Caller, identifier: str, version: int | None
) -> Response:
    """The page of a model."""
    _allow(caller, "library")
    model = version_of(service, identifier, version)
    home = service.artifacts.home / "library" / model.id
    # As a block of data in the page, nothing in it may end the block.
    linked = json.dumps(json_ld(model, service.settings.url)).replace("<", "\\u003c")
    return _page(
        request,
        "model.html",
        model=model_out(model, service.settings.url),
        versions=service.library.versions(identifier),
        linked=linked,
        pictures={name: (home / name).is_dir() for name in ("preview", "view")},
    )


def _page(request: Request, name: str, code: int = 200, **told: Any) -> Response:
    """A page of a template."""
    told |= {"form_key": form_key(request), "has_token": COOKIE in request.cookies}
    return templates.TemplateResponse(request, name, told, code)


async def lost(request: Request, error: Exception) -> Response:
    """An error of a page as a page, and of the API as its clients read it.

    Parameters
    ----------
    request : Request
        That was refused.
    error : HTTPException
        With the reason.
    """
    assert isinstance(error, StarletteHTTPException)
    sought = "text/html" in request.headers.get("accept", "")
    if error.status_code == 404 and sought and not request.url.path.startswith("/v1/"):
        return _page(request, "lost.html", 404, detail=error.detail)
    return await http_exception_handler(request, error)


def _allow(caller: Caller, scope: str) -> None:
    """Refuse who has a token that is not for that."""
    if scope not in caller.scopes:
        raise HTTPException(403, f"this token is not for that: one with scope {scope} is")


def _plain(texts: dict[str, str]) -> dict[str, str]:
    """Texts without the letter that databases refuse."""
    return {name: value.replace("\x00", "")[:200] for name, value in texts.items()}
