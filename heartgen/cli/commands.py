"""The commands for a mask, and for the dashboard: read the options, run, show, write.

What takes long to import is imported inside the commands, so that ``heartgen --help`` is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from heartgen import __version__
from heartgen.cli.choices import (
    Debug,
    Frame,
    Label,
    Labels,
    Level,
    MaskPath,
    NoBrowser,
    Overwrite,
    RvWall,
    Septum,
    Shifts,
    Truncate,
    Ventricles,
    Views,
)
from heartgen.cli.earlier import check_results
from heartgen.cli.outcome import appearing_together, check_folder, check_picture, errors, told
from heartgen.errors import MeshError

if TYPE_CHECKING:
    from heartgen.images import Mask
    from heartgen.options import Options
    from heartgen.pipeline import Personalization

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="From a binary mask of the myocardium to a personalized cubic Hermite mesh.",
)

DPI = 150
"""Of the picture of `inspect`, dots per inch: 1800 pixels across."""


@app.command()
def fit(
    mask: MaskPath,
    out: Annotated[
        Path,
        typer.Option(
            "-o",
            "--out",
            metavar="OUT",
            show_default=False,
            help="Folder for mesh.exf, mesh.vtu and report.json.",
        ),
    ],
    lod: Level = 1,
    elements: Annotated[
        str | None,
        typer.Option(
            metavar="RxCxL",
            show_default=False,
            help="Elements, radial x circumferential x longitudinal; 1x12x6 for a left ventricle "
            "and 2x12x8 for both if not given.",
        ),
    ] = None,
    ventricles: Ventricles = "auto",
    truncate: Truncate = "auto",
    base: Annotated[
        str,
        typer.Option(
            metavar="rim|plane",
            help="Where valves rise, the mesh ends on a sheet that follows the rim, or on a plane "
            "below it.",
        ),
    ] = "rim",
    view: Views = None,
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    depth: Annotated[
        str,
        typer.Option(
            metavar="graded|linear",
            help="Parametrization across the wall: for even elements, or proportional.",
        ),
    ] = "graded",
    apex: Annotated[
        str,
        typer.Option(
            metavar="collapsed|hole|patch",
            help="Elements that collapse in a pole, an apical hole, or a square patch of elements.",
        ),
    ] = "collapsed",
    hole_radius: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            show_default=False,
            help="Radius of the apical hole on the endocardium; a quarter of the cavity's if not "
            "given.",
        ),
    ] = None,
    insertion: Annotated[
        str,
        typer.Option(
            metavar="rounded|squared",
            help="The line on which the right ventricle meets the left one follows the anatomy "
            "around the right apex, or stays square.",
        ),
    ] = "rounded",
    interior: Annotated[
        str,
        typer.Option(
            metavar="straight|relaxed",
            help="Lines across the wall: straight, or bent for better elements; surfaces stay.",
        ),
    ] = "straight",
    basis: Annotated[
        str,
        typer.Option(
            metavar="hermite|lagrange",
            help="Cubic basis of the mesh: smooth between elements, or values on a lattice.",
        ),
    ] = "hermite",
    fields: Annotated[
        str,
        typer.Option(
            metavar="all|none|NAMES",
            help="Fields written with the mesh: coordinates, aha, fibers, angles, thickness, "
            "curvature.",
        ),
    ] = "all",
    fiber_angles: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLES",
            show_default=False,
            help="Degrees at endo- and epicardium, helix=60/-60,right=90/-25,transverse=0/0,"
            "sheet=0/0 if not given.",
        ),
    ] = None,
    septum: Septum = None,
    shifts: Shifts = "auto",
    quality: Annotated[
        float,
        typer.Option(
            metavar="FACTOR",
            help="Weight of element quality against accuracy, relative to the level's own.",
        ),
    ] = 1.0,
    least_quality: Annotated[
        float,
        typer.Option(
            metavar="RATIO",
            help="Quality that the poorest element should reach too; the report says if it does "
            "not.",
        ),
    ] = 0.0,
    no_enhance: Annotated[
        bool, typer.Option("--no-enhance", help="Leave out the step that straightens elements.")
    ] = False,
    no_optimize: Annotated[
        bool,
        typer.Option("--no-optimize", help="Stop after the four steps of Lamata et al. (2014)."),
    ] = False,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Fit a mesh to a mask and write it with its report.

    Ends with 0 only if the mesh is valid; if it is not, nothing is written.
    """
    with told(debug):
        from heartgen.fields import rule_from_text
        from heartgen.images.selecting import Selection
        from heartgen.options import Options, direction_from_text, elements_from_text

        check_folder(out)
        options = Options(
            lod=lod,
            elements=None if elements is None else elements_from_text(elements),
            ventricles=cast("Any", ventricles),  # Options refuses words it does not know
            truncate=_truncation(truncate),
            base=cast("Any", base),
            enhance=not no_enhance,
            optimize=not no_optimize,
            quality=quality,
            least_quality=least_quality,
            depth=cast("Any", depth),
            apex=cast("Any", apex),
            hole_radius=hole_radius,
            insertion=cast("Any", insertion),
            interior=cast("Any", interior),
            basis=cast("Any", basis),
            shifts=cast("Any", shifts),
            septum=None if septum is None else direction_from_text(septum),
        )
        chosen = _fields(fields)
        rule = None if fiber_angles is None else rule_from_text(fiber_angles)
        selection = Selection(tuple(label or ()), labels, rv_wall, frame)
        heart = selection.read(mask, ventricles)
        check_results(out, heart, overwrite)
        views = [selection.read(path, ventricles, view=True) for path in view or ()]
        result = _personalized([heart, *views], options)
        with appearing_together(out) as folder:
            result.write(folder, fields=chosen, rule=rule)


@app.command()
def inspect(
    mask: MaskPath,
    picture: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="PICTURE", help="Picture of three slices."),
    ] = Path("inspect.png"),
    ventricles: Ventricles = "auto",
    truncate: Truncate = "auto",
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    debug: Debug = False,
) -> None:
    """Show what is in a mask: what the checks found, what the shape analysis sees."""
    with told(debug):
        from heartgen.anatomy import analyze_under
        from heartgen.cli.tables import console, show_anatomy, show_image
        from heartgen.files import replacing
        from heartgen.images.selecting import Selection
        from heartgen.options import Options
        from heartgen.viewing import draw_slices

        check_picture(picture)
        options = Options(truncate=_truncation(truncate), ventricles=cast("Any", ventricles))
        image = Selection(tuple(label or ()), labels, rv_wall, frame).read(mask, ventricles)
        show_image(image)
        anatomy = analyze_under(image, options)
        show_anatomy(anatomy)
        with replacing(picture) as temporary:
            draw_slices(image, anatomy).savefig(temporary, dpi=DPI)
        console.print(f"Picture: {picture}", markup=False, highlight=False, soft_wrap=True)


@app.command()
def demo(
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="OUT", help="Folder for all that is made.")
    ] = Path("out/demo"),
    sample: Annotated[str, typer.Option(metavar="NAME", help="Which sample heart.")] = "lifelike",
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Mesh a sample heart, and make a page that shows the result."""
    with told(debug):
        from heartgen import samples
        from heartgen.images.writing import write_mask
        from heartgen.options import Options
        from heartgen.viewing import view_html

        check_folder(out)
        heart = samples.load(sample)
        check_results(out, heart.mask, overwrite)
        errors.print(heart.description, style="dim", markup=False, soft_wrap=True)
        result = _personalized([heart.mask], Options())
        with appearing_together(out) as folder:
            write_mask(heart.mask, folder / "mask.nii.gz")
            result.write(folder)
            with errors.status("making the page"):
                view_html(result, folder / "index.html")
        typer.echo(f"Open {out / 'index.html'} in a browser.")


@app.command()
def dashboard(
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Address to serve on; 0.0.0.0 for all.")
    ] = "localhost",
    port: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", min=1, max=65535, show_default=False, help="8888 or the next free one."
        ),
    ] = None,
    token: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            show_default=False,
            help="Word that visitors have to know; made up if others can reach the page.",
        ),
    ] = None,
    base_url: Annotated[
        str, typer.Option(metavar="PATH", help="Where the page is, behind a proxy: /x/.")
    ] = "/",
    no_browser: NoBrowser = False,
    debug: Debug = False,
) -> None:
    """Serve the dashboard: mask in, mesh out, in a browser."""
    with told(debug):
        from heartgen.apps.server import Place, serve

        base = f"/{base_url.strip('/')}/".replace("//", "/")
        serve(Place(host, port, token, base, browser=not no_browser))


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


def _personalized(images: list[Mask], options: Options) -> Personalization:
    """Run the pipeline under progress bars, show the report, refuse a mesh that is not valid."""
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


def _fields(text: str) -> tuple[str, ...]:
    """Names of fields; all or none of them by one word."""
    from heartgen.fields import FIELDS
    from heartgen.fields.catalog import check_names

    words = {"all": tuple(FIELDS), "none": ()}
    return words[text] if text in words else check_names(text.split(","))


def _truncation(text: str) -> Any:
    """A distance in mm, or a word: `Options` refuses those it does not know."""
    try:
        return float(text)
    except ValueError:
        return text
