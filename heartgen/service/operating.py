"""What an operator looks at: health, metrics for Prometheus, and logs with the ids of jobs."""

from __future__ import annotations

import logging
import logging.config
import sys
import time
from collections.abc import Iterator
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Request, Response
from fastapi.responses import JSONResponse
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Histogram, generate_latest
from prometheus_client.metrics_core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from heartgen.errors import HeartgenError
from heartgen.service.security import Parts, needs
from heartgen.service.service import Service
from heartgen.service.settings import MB
from heartgen.service.tokens import Caller

router = APIRouter(tags=["operate"])

METHODS = ("GET", "HEAD", "POST", "DELETE")
"""That are counted each by itself."""

SLOW = (0.01, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 6.4)
"""Seconds by which answers are counted."""


@router.get("/healthz", responses={503: {"description": "Something is missing"}})
def _health(request: Request, service: Parts) -> Response:
    """Whether the database answers, there is room on the disk, and workers can be reached."""
    found = {"database": True, "disk": True, "workers": request.app.state.dispatcher.ready}
    try:
        service.jobs.counts()
    except SQLAlchemyError:
        found["database"] = False
    try:
        service.artifacts.check_space(MB)
    except (HeartgenError, OSError):
        found["disk"] = False
    return JSONResponse(found, 200 if all(found.values()) else 503)


@router.get("/metrics", responses={401: {"description": "No token"}, 403: {"description": "No"}})
def _metrics(
    request: Request, service: Parts, caller: Annotated[Caller, Depends(needs("admin"))]
) -> Response:
    """Numbers of jobs in each state, and times of answers, for Prometheus."""
    try:
        text = generate_latest(request.app.state.registry)
    except SQLAlchemyError:
        raise HTTPException(503, "the database does not answer") from None
    return Response(text, media_type=CONTENT_TYPE_LATEST)


class JobNumbers(Collector):
    """Numbers of jobs in each state, counted when they are asked for.

    Parameters
    ----------
    service : Service
        The parts of the service.
    """

    def __init__(self, service: Service) -> None:
        self.service = service

    def collect(self) -> Iterator[Metric]:
        """Count."""
        jobs = GaugeMetricFamily("heartgen_jobs", "Jobs in each state", labels=["state"])
        for state, number in self.service.jobs.counts().items():
            jobs.add_metric([state], number)
        yield jobs

    def describe(self) -> Iterator[Metric]:
        """Name what is counted, without asking the database."""
        yield GaugeMetricFamily("heartgen_jobs", "Jobs in each state", labels=["state"])


class Timing:
    """Times answers, by route and code.

    Parameters
    ----------
    app : callable
        ASGI application.
    registry : CollectorRegistry
        Where times are counted.
    """

    def __init__(self, app: ASGIApp, registry: CollectorRegistry) -> None:
        self.app = app
        self.times = Histogram(
            "heartgen_answer_seconds",
            "Time to the beginning of an answer",
            ["method", "route", "code"],
            buckets=SLOW,
            registry=registry,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, as ASGI asks for it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        start = time.perf_counter()

        async def timed(message: Message) -> None:
            if message["type"] == "http.response.start":
                route = getattr(scope.get("route"), "path", "other")
                method = scope["method"] if scope["method"] in METHODS else "other"
                labels = self.times.labels(method, route, str(message["status"]))
                labels.observe(time.perf_counter() - start)
            await send(message)

        await self.app(scope, receive, timed)


def log_as_json() -> None:
    """Write logs to standard error, a line of JSON each, with the ids of jobs; no addresses asked.

    Requests are not logged: what they bring in headers and addresses is nobody's business.
    """
    logging.config.dictConfig(
        {
            "version": 1,
            "disable_existing_loggers": False,
            "formatters": {
                "json": {
                    "()": "pythonjsonlogger.json.JsonFormatter",
                    "fmt": "%(asctime)s %(levelname)s %(name)s %(message)s",
                }
            },
            "handlers": {
                "stderr": {
                    "class": "logging.StreamHandler",
                    "formatter": "json",
                    "stream": sys.stderr,
                }
            },
            "loggers": {"heartgen.service": {"level": "INFO", "handlers": ["stderr"]}},
        }
    )
