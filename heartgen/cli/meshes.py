"""The commands for meshes that are there: `convert`, `view`, `rasterize` and `render`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from heartgen.cli.outcome import errors, errors_reported
from heartgen.cli.parameters import Command, Debug, NoBrowser
from heartgen.cli.serving import app
from heartgen.errors import InputError, needing
from heartgen.options import option_from_text

__all__ = ["app"]

Mesh = Annotated[
    Path,
    typer.Argument(metavar="MESH", show_default=False, help="mesh.exf or mesh.vtu of a result."),
]
FittedMask = Annotated[
    Path | None,
    typer.Argument(metavar="MASK", show_default=False, help="The mask it was fitted to, if any."),
]


@app.command(cls=Command)
def convert(
    source: Annotated[
        Path,
        typer.Argument(metavar="IN", show_default=False, help="EXF, EX1 or VTU of cubic elements."),
    ],
    target: Annotated[
        Path,
        typer.Argument(metavar="OUT", show_default=False, help="Its ending says the format."),
    ],
    format: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", show_default=False, help="Format, where endings are shared: vtu-bezier."
        ),
    ] = None,
    basis: Annotated[
        str | None,
        typer.Option(metavar="hermite|lagrange", show_default=False, help="As in IN if not given."),
    ] = None,
    order: Annotated[
        int, typer.Option(min=1, max=3, help="Of Lagrange elements; below 3 they are resampled.")
    ] = 3,
    cells: Annotated[
        str | None,
        typer.Option(
            metavar="hex8|hex20|hex27|tet4|tet10",
            show_default=False,
            help="Cells to which the mesh is resampled, for formats of linear or quadratic cells.",
        ),
    ] = None,
    pieces: Annotated[
        str | None,
        typer.Option(
            metavar="RxCxL",
            show_default=False,
            help="Pieces of an element, radial x circumferential x longitudinal.",
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Write a mesh, with its fields, in another format, and say what is lost."""
    with errors_reported(debug):
        from heartgen.formats import convert as convert_file

        parts = None if pieces is None else option_from_text("elements", pieces)
        written = convert_file(source, target, format, basis, order, cells, parts)
        for note in written.notes:
            errors.print(note, style="yellow", markup=False, highlight=False, soft_wrap=True)
        for file in written.files:
            typer.echo(file)


@app.command(cls=Command)
def view(
    mesh: Mesh,
    mask: FittedMask = None,
    port: Annotated[int, typer.Option(metavar="PORT", min=0, max=65535, help="0: any.")] = 0,
    no_browser: NoBrowser = False,
    debug: Debug = False,
) -> None:
    """Show a mesh in the browser, with its mask."""
    with errors_reported(debug):
        with needing("the view needs", "apps"):
            from heartgen.serving.standalone import view_files
        view_files(mesh, mask, port, browser=not no_browser)


@app.command(cls=Command)
def rasterize(
    mesh: Mesh,
    like: Annotated[
        Path,
        typer.Argument(
            metavar="LIKE", show_default=False, help="Image whose voxels are to be filled."
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "-o", "--out", metavar="OUT", show_default=False, help=".nii.gz, .nii, .nrrd or .mha."
        ),
    ],
    partial: Annotated[
        bool, typer.Option("--partial", help="Share of each voxel in the mesh, not 0 or 1.")
    ] = False,
    debug: Debug = False,
) -> None:
    """Draw a mesh into an image like another one: binary, or with partial volumes."""
    with errors_reported(debug):
        import numpy as np

        from heartgen.formats import read_mesh
        from heartgen.images.reading import read_grid
        from heartgen.images.writing import check_image_name, write_image
        from heartgen.mesh.jacobian import volume
        from heartgen.mesh.rasterization import rasterize as drawn

        check_image_name(out)
        shape, affine = read_grid(like)
        found = read_mesh(mesh)
        image = drawn(found, shape, affine, partial)
        voxel = abs(float(np.linalg.det(affine[:3, :3])))
        share = float(image.sum(dtype=float)) * voxel / volume(found)
        write_image(image if partial else image.astype(np.uint8), affine, out)
        typer.echo(out)
        errors.print(f"{100 * share:.2f} % of the volume of the mesh are in the image")


@app.command(cls=Command)
def render(
    mesh: Mesh,
    mask: FittedMask = None,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="PICTURE", help="PNG.")] = Path(
        "mesh.png"
    ),
    color: Annotated[
        list[str] | None,
        typer.Option(
            "--color",
            metavar="NAME",
            show_default=False,
            help="A row of the picture: region, quality, error or overlay (with MASK), change "
            "(with --compare), transmural, longitudinal, circumferential, thickness, aha, "
            "fibers-endo, fibers-mid, fibers-epi, plain; may be repeated.",
        ),
    ] = None,
    view: Annotated[
        list[str] | None,
        typer.Option(
            "--view",
            metavar="NAME",
            show_default=False,
            help="A column: oblique, septal, anterior, lateral, inferior, basal, apical; may be "
            "repeated.",
        ),
    ] = None,
    compare: Annotated[
        Path | None,
        typer.Option(metavar="MESH", show_default=False, help="Another mesh, for change."),
    ] = None,
    limit: Annotated[
        float, typer.Option(metavar="MM", min=0.001, help="End of the scale of the error.")
    ] = 1.0,
    no_edges: Annotated[
        bool, typer.Option("--no-edges", help="Leave out the edges of the elements.")
    ] = False,
    debug: Debug = False,
) -> None:
    """Draw a mesh for print, a row for each coloring and a column for each view."""
    with errors_reported(debug):
        from heartgen.anatomy import analyze_under
        from heartgen.files import replacing
        from heartgen.formats import read_mesh
        from heartgen.images import read_mask
        from heartgen.report import options_beside

        with needing("pictures need", "plot"):
            from heartgen.viewing import render as draw
        if out.suffix.lower() != ".png":
            raise InputError(f"{out}: Pictures of meshes are PNG: end the name in .png.")
        rows = color or (["overlay", "error"] if mask else ["region"])
        with replacing(out) as temporary:
            plotter = draw(
                read_mesh(mesh),
                temporary,
                colors=rows,
                views=view or ["oblique"],
                mask=None if mask is None else analyze_under(read_mask(mask), options_beside(mesh)),
                other=None if compare is None else read_mesh(compare),
                edges=not no_edges,
                error_limit=limit,
            )
            plotter.close()
        typer.echo(out)
