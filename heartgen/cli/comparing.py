"""The command for several states of one heart: `compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from heartgen.cli.earlier import MESHES
from heartgen.cli.meshes import app
from heartgen.cli.option_flags import flag_of
from heartgen.cli.outcome import errors, errors_reported
from heartgen.cli.parameters import Command, Debug
from heartgen.errors import InputError, needing
from heartgen.options import option_from_text

__all__ = ["app"]


@app.command(cls=Command)
def compare(
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT...",
            show_default=False,
            help="Meshes of one heart, or the folders of their results; at least two.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="OUT",
            show_default=False,
            help=".html for a page with both extremes in 3-D, .json for plain data.",
        ),
    ] = None,
    septal_direction: flag_of("septal_direction") = "auto",  # type: ignore[valid-type]
    debug: Debug = False,
) -> None:
    """Compare states of a heart, such as diastole and systole: ejection fraction, strains."""
    with errors_reported(debug):
        from heartgen.cli.tables import show_comparison
        from heartgen.comparison import compare as compared
        from heartgen.formats import read_mesh, write_text

        kind = None if out is None else out.suffix.lower()
        if kind not in (None, ".html", ".json"):
            raise InputError(
                f"{out}: A comparison is a page or plain data: end it in .html, .json."
            )
        direction = option_from_text("septal_direction", septal_direction)
        meshes = [read_mesh(_mesh_of(result)) for result in results]
        found = compared(meshes, _names(results), direction)
        show_comparison(found)
        if out is not None and kind == ".json":
            write_text(found.to_json() + "\n", out)
        elif out is not None:
            with needing("pages need", "plot"):
                from heartgen.viewing import compare_html
            with errors.status("making the page"):
                compare_html(found, meshes, out, ", ".join(found.names))
        if out is not None:
            typer.echo(out)


def _mesh_of(result: Path) -> Path:
    """The mesh that a path is, or the first that is in its folder."""
    if not result.is_dir():
        return result
    for name in MESHES:
        if (result / name).is_file():
            return result / name
    raise InputError(
        f"{result}: There is no {' or '.join(MESHES)} in this folder: give that of a result."
    )


def _names(results: list[Path]) -> list[str]:
    """What tells the results apart: the names of folders or files, or as much of the paths."""
    paths = [path.absolute() for path in results]
    paths = [path.parent if path.name in MESHES else path.with_suffix("") for path in paths]
    depth, most = 1, max(len(path.parts) for path in paths)
    while len({path.parts[-depth:] for path in paths}) < len(paths) and depth < most:
        depth += 1
    names = ["/".join(path.parts[-depth:]) for path in paths]
    if len(set(names)) < len(names):
        raise InputError("one mesh was given more than once: give meshes of several states")
    return names
