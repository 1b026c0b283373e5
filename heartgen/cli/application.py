"""The command line itself, and what several of its commands do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from heartgen import __version__
from heartgen.cli.parameters import EPILOG, TakesFormerFlags
from heartgen.errors import MeshError

if TYPE_CHECKING:
    from heartgen.images import Mask
    from heartgen.options import Options
    from heartgen.result import Personalization

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    cls=TakesFormerFlags,
    help="From a binary mask of the myocardium to a personalized cubic Hermite mesh.",
    epilog=EPILOG,
)


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, help="Show the version and end.")
    ] = False,
) -> None:
    """Answer ``--version``."""
    if version:
        typer.echo(f"heartgen {__version__}")
        raise typer.Exit


def personalized(images: list[Mask], options: Options) -> Personalization:
    """Run the pipeline under progress bars, show the report, refuse a mesh that is not valid.

    Parameters
    ----------
    images : list of Mask
        The heart, and further views of it.
    options : Options
        Of the fit.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    """
    from heartgen.cli.tables import show_report, step_bars
    from heartgen.pipeline import personalize

    with step_bars() as progress:
        result = personalize(images, options, progress=progress)
    show_report(result.report)
    if not result.report.quality.valid:
        raise MeshError(
            f"{images[0].name}: the mesh is not valid ({result.report.quality.faults}), so nothing "
            "was written: try a lower level of detail or other numbers of elements, and look at "
            "the mask with heartgen inspect"
        )
    return result
