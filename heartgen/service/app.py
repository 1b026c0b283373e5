"""The web application: routes, errors as sentences, and what runs beside requests."""

from __future__ import annotations

import errno
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.routing import APIRoute
from fastapi.staticfiles import StaticFiles
from prometheus_client import CollectorRegistry
from sqlalchemy.exc import SQLAlchemyError
from starlette.exceptions import HTTPException
from starlette.middleware.trustedhost import TrustedHostMiddleware

from heartgen import __version__
from heartgen.errors import FileError, HeartgenError, InputError, sentence
from heartgen.service import api_jobs, api_library, operating, pages
from heartgen.service.dispatcher import Dispatcher
from heartgen.service.mail import Mailer
from heartgen.service.operating import JobNumbers, Timing
from heartgen.service.retention import Retention
from heartgen.service.security import Guard
from heartgen.service.service import Service
from heartgen.service.settings import LOCAL, Settings

logger = logging.getLogger("heartgen.service")

UPLOADS = ("/v1/jobs", "/v1/personalize", "/v1/models/archive", "/submit")
"""Paths to which uploads go."""

FULL = (errno.ENOSPC, errno.EDQUOT)
"""Errors of a disk without room."""

ABOUT = """
From a segmentation of the heart to a personalized cubic Hermite mesh, and a library of meshes.
Research use, not for diagnosis.
"""


def make_app(settings: Settings) -> FastAPI:
    """Make the application.

    Parameters
    ----------
    settings : Settings
        Of the operator.

    Returns
    -------
    FastAPI
        Its parts are in ``state``: ``service``, ``dispatcher``, ``mailer``.
    """
    service = Service(settings)
    dispatcher = Dispatcher(service.jobs, service.artifacts, settings)
    beside = (dispatcher, Mailer(service), Retention(service))

    @asynccontextmanager
    async def running(_: FastAPI) -> AsyncIterator[None]:
        for each in beside:
            each.start()
        yield
        for each in beside:
            await run_in_threadpool(each.stop)
        service.database.close()

    app = FastAPI(
        title="heartgen",
        version=__version__,
        description=ABOUT,
        lifespan=running,
        docs_url=None,
        redoc_url=None,
        generate_unique_id_function=_operation,
    )
    registry = CollectorRegistry()
    registry.register(JobNumbers(service))
    app.state.service, app.state.dispatcher = service, dispatcher
    app.state.registry, app.state.mailer = registry, beside[1]
    for each in (api_jobs, api_library, operating, pages):
        app.include_router(each.router)
    app.mount("/static/api", StaticFiles(directory=pages.SWAGGER), name="api")
    app.mount("/static", StaticFiles(directory=pages.STATIC), name="static")
    app.add_middleware(Guard, upload_limit=settings.upload_limit, takes_uploads=UPLOADS)
    app.add_middleware(Timing, registry=registry)
    if settings.takes_anonymous and settings.is_local:
        # A name that leads here from elsewhere must not make a browser's pages ours.
        app.add_middleware(TrustedHostMiddleware, allowed_hosts=[*LOCAL])
    app.add_exception_handler(HTTPException, pages.lost)
    app.add_exception_handler(HeartgenError, _refused)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(SQLAlchemyError, _no_database)
    app.add_exception_handler(OSError, _no_room)
    return app


def _operation(route: APIRoute) -> str:
    """Name of an operation in the OpenAPI description."""
    return f"{route.tags[0] if route.tags else 'page'}-{route.name.strip('_')}"


async def _refused(_: Request, error: Exception) -> JSONResponse:
    """An error that has a sentence."""
    full = isinstance(error, FileError) and not isinstance(error, InputError)
    return JSONResponse({"detail": sentence(error)}, 503 if full else 422)


async def _invalid(_: Request, error: Exception) -> JSONResponse:
    """What does not fit the description, in a sentence; nothing of what was given is repeated."""
    assert isinstance(error, RequestValidationError)
    told = [f"{'.'.join(map(str, each['loc'][1:]))}: {each['msg']}" for each in error.errors()]
    return JSONResponse({"detail": "; ".join(told)[:1000]}, 422)


async def _no_room(_: Request, error: Exception) -> JSONResponse:
    """A disk that is full, as it is while an upload arrives."""
    if not isinstance(error, OSError) or error.errno not in FULL:
        raise error
    logger.warning("the disk is full")
    text = "the disk of the service is full: try again later, or tell who operates it"
    return JSONResponse({"detail": text}, 503, {"Retry-After": "60"})


async def _no_database(_: Request, error: Exception) -> JSONResponse:
    """A database that is gone for now."""
    logger.warning("the database does not answer: %s", type(error).__name__)
    text = "the database does not answer: try again in a minute; nothing is lost"
    return JSONResponse({"detail": text}, 503, {"Retry-After": "30"})
