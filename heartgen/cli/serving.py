"""The commands that serve pages: `dashboard` alone, or all `apps`."""

from __future__ import annotations

from collections.abc import Callable
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


def _serving(page: str, told: str) -> Callable[..., None]:
    """A command that serves a page.

    Parameters
    ----------
    page : str
        As of `heartgen.serving.server.Address`.
    told : str
        What its help says.
    """

    def command(
        host: Host = "localhost",
        port: Port = None,
        token: Token = None,
        base_url: BaseUrl = "/",
        no_browser: NoBrowser = False,
        debug: Debug = False,
    ) -> None:
        with errors_reported(debug):
            from heartgen.serving.server import Address, serve

            path = f"/{base_url.strip('/')}/".replace("//", "/")
            serve(Address(host, port, token, path, browser=not no_browser, page=page))

    command.__doc__ = told
    return command


app.command("dashboard", cls=Command)(
    _serving("dashboard", "Serve the dashboard: mask in, mesh out, in a browser.")
)
app.command("apps", cls=Command)(
    _serving("index", "Serve all apps: the dashboard, accuracy against quality, states of a heart.")
)
