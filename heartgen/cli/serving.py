"""The commands that serve pages: `dashboard` alone, or all `apps`."""

from __future__ import annotations

from typing import Annotated

import typer

from heartgen.cli.commands import app
from heartgen.cli.outcome import errors_reported
from heartgen.cli.parameters import Command, Debug, NoBrowser

__all__ = ["app"]

Host = Annotated[str, typer.Option(metavar="HOST", help="Address to serve on; 0.0.0.0 for all.")]
Port = Annotated[
    int | None,
    typer.Option(
        metavar="PORT", min=1, max=65535, show_default=False, help="8888 or the next free one."
    ),
]
Token = Annotated[
    str | None,
    typer.Option(
        metavar="WORD",
        show_default=False,
        help="Word that visitors have to know; made up if others can reach the page.",
    ),
]
BaseUrl = Annotated[
    str, typer.Option(metavar="PATH", help="Where the page is, behind a proxy: /x/.")
]


@app.command(cls=Command)
def dashboard(
    host: Host = "localhost",
    port: Port = None,
    token: Token = None,
    base_url: BaseUrl = "/",
    no_browser: NoBrowser = False,
    debug: Debug = False,
) -> None:
    """Serve the dashboard: mask in, mesh out, in a browser."""
    with errors_reported(debug):
        from heartgen.serving.server import Address, serve

        serve(Address(host, port, token, _slashed(base_url), browser=not no_browser))


@app.command(cls=Command)
def apps(
    host: Host = "localhost",
    port: Port = None,
    token: Token = None,
    base_url: BaseUrl = "/",
    no_browser: NoBrowser = False,
    debug: Debug = False,
) -> None:
    """Serve all apps: the dashboard, accuracy against quality, states of a heart."""
    with errors_reported(debug):
        from heartgen.serving.server import INDEX, Address, serve

        serve(Address(host, port, token, _slashed(base_url), browser=not no_browser, page=INDEX))


def _slashed(base_url: str) -> str:
    """The path with a slash at each end."""
    return f"/{base_url.strip('/')}/".replace("//", "/")
