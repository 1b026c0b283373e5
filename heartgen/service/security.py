"""Who asks, how often and how much; and the headers of every answer."""

from __future__ import annotations

import hmac
from collections.abc import Callable
from typing import Annotated
from urllib.parse import urlsplit

from fastapi import Depends, HTTPException, Request, Security
from fastapi.concurrency import run_in_threadpool
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer
from limits import RateLimitItemPerMinute
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter
from starlette.datastructures import MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from heartgen.service.service import Service
from heartgen.service.settings import MB
from heartgen.service.tokens import NOBODY, Caller

COOKIE = "heartgen_token"
"""Of the pages, for a token that was typed in once."""

FORM_KEY = "form_key"
"""Field of every form: what only our own pages can bring back."""

SAFE = ("GET", "HEAD", "OPTIONS")
"""Methods that change nothing."""

BODY_LIMIT = MB
"""Bytes of a request that brings no upload."""

WRONG_TRIES = 30
"""Wrong tokens in a minute from one address, after which they are not even told to be wrong."""

POLICY = (
    "default-src 'self'; img-src 'self' data:; style-src 'self'; script-src 'self'; "
    "object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'"
)

VIEW_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; connect-src data: blob:; worker-src blob:; "
    "sandbox allow-scripts"
)
"""Of 3-D views, which have all that they need in them, and get nothing of ours."""

HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
    "Cache-Control": "no-store",
}

bearer = HTTPBearer(auto_error=False, description="A token of `heartgen token create`.")
_limiter = MovingWindowRateLimiter(MemoryStorage())


def service_of(request: Request) -> Service:
    """The parts of the service.

    Parameters
    ----------
    request : Request
        That is answered.
    """
    service: Service = request.app.state.service
    return service


Parts = Annotated[Service, Depends(service_of)]


async def caller_of(
    request: Request,
    service: Parts,
    given: Annotated[HTTPAuthorizationCredentials | None, Security(bearer)] = None,
) -> Caller:
    """Who asks; raises an answer of 401 or 429.

    Parameters
    ----------
    request : Request
        That is answered.
    service : Service
        The parts of the service.
    given : HTTPAuthorizationCredentials or None
        What the request says in its header.
    """
    address = request.client.host if request.client else ""
    token = given.credentials if given else None
    if token is None and "authorization" not in request.headers:
        token = request.cookies.get(COOKIE)  # of pages, which are asked by the same browser alone
        if token is not None and not is_own(request):
            token = None
    caller: Caller | None = None
    if token is not None:
        caller = await run_in_threadpool(service.tokens.caller, token)
        wrong = RateLimitItemPerMinute(WRONG_TRIES)
        if caller is None and not _limiter.hit(wrong, "wrong", address):
            raise HTTPException(429, "too many wrong tokens: wait a minute")
    elif service.settings.takes_anonymous and "authorization" not in request.headers:
        if not is_own(request):
            raise HTTPException(403, "another site's page may not ask this: use the service itself")
        caller = NOBODY
    if caller is None:
        raise HTTPException(
            401,
            "this needs a token that is valid: ask who operates the service for one",
            {"WWW-Authenticate": "Bearer"},
        )
    limit = RateLimitItemPerMinute(service.settings.rate_limit)
    if not _limiter.hit(limit, "token", caller.owner):
        raise HTTPException(429, "too many requests: wait a minute", {"Retry-After": "60"})
    return caller


def needs(scope: str) -> Callable[..., Caller]:
    """A dependency: whoever asks must have a token for this.

    Parameters
    ----------
    scope : str
        Of `heartgen.service.tokens.SCOPES`.
    """

    def check(caller: Annotated[Caller, Depends(caller_of)]) -> Caller:
        if scope not in caller.scopes:
            raise HTTPException(403, f"this token is not for that: one with scope {scope} is")
        return caller

    return check


def is_own(request: Request) -> bool:
    """Whether no other site's page makes a browser ask.

    Parameters
    ----------
    request : Request
        That is answered.
    """
    site = request.headers.get("sec-fetch-site")
    if site is not None:
        navigates = request.headers.get("sec-fetch-mode") == "navigate"
        return site in ("same-origin", "none") or (navigates and request.method in SAFE)
    origin = request.headers.get("origin")
    return origin is None or urlsplit(origin).netloc == request.headers.get("host")


def form_key(request: Request) -> str:
    """What a form brings back: it belongs to the token of the page.

    Parameters
    ----------
    request : Request
        For the page.
    """
    token = request.cookies.get(COOKIE, "")
    return hmac.new(service_of(request).secret, token.encode(), "sha256").hexdigest()


def check_form(request: Request, brought: object) -> None:
    """Refuse a form that is not of our own page.

    Parameters
    ----------
    request : Request
        With the form.
    brought : object
        Value of its field `FORM_KEY`.
    """
    if not is_own(request) or not hmac.compare_digest(
        str(brought).encode(), form_key(request).encode()
    ):
        raise HTTPException(403, "this form is too old, or of another site: load the page again")


class Guard:
    """Ends requests that bring too much, and gives every answer its headers.

    Parameters
    ----------
    app : callable
        ASGI application.
    upload_limit : int
        MB.
    takes_uploads : tuple of str
        Paths to which uploads go.
    """

    def __init__(self, app: ASGIApp, upload_limit: int, takes_uploads: tuple[str, ...]) -> None:
        self.app, self.upload_limit, self.takes_uploads = app, upload_limit, takes_uploads

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, as ASGI asks for it."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        limit = BODY_LIMIT
        if scope["path"].rstrip("/") in self.takes_uploads:
            limit += self.upload_limit * MB
        taken, begun = 0, False

        async def counted() -> Message:
            nonlocal taken
            message = await receive()
            taken += len(message.get("body", b""))
            if taken > limit:
                raise _TooLargeError
            return message

        async def headed(message: Message) -> None:
            nonlocal begun
            if message["type"] == "http.response.start":
                begun = True
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        said = dict(scope["headers"]).get(b"content-length", b"0")
        try:
            if not said.isdigit() or int(said) > limit:
                raise _TooLargeError
            await self.app(scope, counted, headed)
        except _TooLargeError:
            if begun:
                raise
            text = (
                f"this is more than the {limit // MB} MB that are taken here: crop the image to "
                "the heart, or save it compressed (.nii.gz)"
            )
            answer = JSONResponse({"detail": text}, 413, {"Connection": "close"})
            await answer(scope, receive, headed)


class _TooLargeError(Exception):
    """A request brings too much."""
