"""`heartgen view`: a mesh in a browser, with the mask it was made of, on a server of its own."""

from __future__ import annotations

import os
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from heartgen.anatomy import Anatomy, analyze_under
from heartgen.errors import InputError, MissingFileError, needing
from heartgen.formats import READERS, read_mesh_file, write_mesh
from heartgen.report import options_beside
from heartgen.viewing.camera import camera_around
from heartgen.viewing.contours import EDGE_RADIUS, TUBE_SIDES
from heartgen.viewing.polydata import MAX_TRIANGLES, mask_surface, to_mask
from heartgen.viewing.scene import AMBIENT, DARK, MASK, MESH, SPECULAR, SPECULAR_POWER

SUBDIVISION = 3
"""Halvings of a curved cell's edge for the picture: 8 flat pieces."""

MASK_OPACITY = 0.3

DISTANCE = "distance to the mask (mm)"

PLAIN = "one color"


def view_files(mesh: Path, mask: Path | None, port: int, browser: bool) -> None:
    """Show a mesh, and a mask over it, until interrupted.

    Parameters
    ----------
    mesh : Path
        As heartgen writes it (VTU, EXF, EX1), or another mesh that PyVista reads.
    mask : Path or None
        Shown over the mesh; None for none.
    port : int
        0 for any that is free.
    browser : bool
        Open the page.

    Raises
    ------
    HeartgenError
        If a file cannot be read, or the mask not be analyzed.
    """
    from heartgen.images import read_mask

    shown = read_mesh(mesh)
    anatomy = None if mask is None else analyze_under(read_mask(mask), options_beside(mesh))
    scene = make_scene(shown, anatomy)
    serve_scene(scene, mesh.name, port, browser)


def read_mesh(path: Path) -> pv.DataSet:
    """Read a mesh to look at.

    Parameters
    ----------
    path : Path
        File to read.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    if not path.is_file():
        raise MissingFileError(f"{path}: There is no such file: check the path.")
    if path.suffix.lower() in READERS and path.suffix.lower() != ".vtu":
        found = read_mesh_file(path)
        with tempfile.TemporaryDirectory(prefix="heartgen-") as folder:
            write_mesh(found.mesh, Path(folder) / "mesh.vtu", found.fields)
            return read_mesh(Path(folder) / "mesh.vtu")
    try:
        with pv.vtk_verbosity("off"), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # VTK's complaints become one sentence
            mesh = pv.read(path)
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(
            f"{path}: This is no mesh that can be shown ({error}): give mesh.vtu."
        ) from error
    if not isinstance(mesh, pv.DataSet) or mesh.n_cells == 0:
        raise InputError(f"{path}: There are no cells in this file: give mesh.vtu.")
    return mesh


def make_scene(mesh: pv.DataSet, anatomy: Anatomy | None) -> Any:
    """Make a plotter with actors ``mesh``, ``edges`` and, if its mask is known, ``mask``.

    Parameters
    ----------
    mesh : pyvista.DataSet
        mm, world (LPS).
    anatomy : Anatomy or None
        Of the mask; None if there is no mask.
    """
    surface: Any = mesh.extract_surface(
        nonlinear_subdivision=SUBDIVISION, algorithm="dataset_surface"
    )
    lines: Any = mesh.extract_all_edges()
    with pv.vtk_verbosity("off"):
        plotter: Any = pv.Plotter(off_screen=True, notebook=False)
    plotter.set_background("white")
    look: Any = {"ambient": AMBIENT, "specular": SPECULAR, "specular_power": SPECULAR_POWER}
    if anatomy is not None:
        shown = mask_surface(anatomy.myocardium, MAX_TRIANGLES)
        error = to_mask(surface.points, anatomy.myocardium)
        surface.point_data[DISTANCE] = error.astype(np.float32)
        plotter.add_mesh(shown, color=MASK, opacity=MASK_OPACITY, smooth_shading=True, name="mask")
    plotter.add_mesh(surface, color=MESH, name="mesh", show_scalar_bar=False, **look)
    radius = EDGE_RADIUS * float(np.ptp(lines.points, axis=0).max())
    plotter.add_mesh(lines.tube(radius=radius, n_sides=TUBE_SIDES), color=DARK, name="edges")
    eye, center = camera_around(np.asarray(surface.points, dtype=float))
    plotter.camera.focal_point, plotter.camera.position = center, eye
    plotter.camera.up = (0.0, 0.0, 1.0)
    return plotter


def colors_of(plotter: Any) -> list[str]:
    """Names of what the mesh can be colored by.

    Parameters
    ----------
    plotter : pyvista.Plotter
        As of `make_scene`.
    """
    surface = plotter.actors["mesh"].mapper.dataset
    hidden = ("vtkOriginal", "Normals", "surface ", "patch ", "part ")
    names = [
        name
        for name in surface.array_names
        if surface[name].ndim == 1 and not name.startswith(hidden)
    ]
    return [PLAIN, *names]


def color_by(plotter: Any, name: str) -> str:
    """Color the mesh, and say what the ends of the scale are.

    Parameters
    ----------
    plotter : pyvista.Plotter
        As of `make_scene`.
    name : str
        One of `colors_of`.
    """
    mapper = plotter.actors["mesh"].mapper
    if name == PLAIN:
        mapper.scalar_visibility = False
        return ""
    values = np.asarray(mapper.dataset[name])
    low, high = float(values.min()), float(values.max())
    mapper.set_scalars(values, name, cmap="viridis", clim=(low, high))
    mapper.scalar_visibility = True
    return f"{low:.3g} (dark) to {high:.3g} (bright)"


def serve_scene(plotter: Any, title: str, port: int, browser: bool) -> None:
    """Serve a scene on this machine until interrupted.

    Parameters
    ----------
    plotter : pyvista.Plotter
        As of `make_scene`.
    title : str
        Of the page.
    port : int
        0 for any that is free.
    browser : bool
        Open the page.
    """
    os.environ.setdefault("VTK_WASM_DIR_OVERRIDE", tempfile.gettempdir())  # else it is downloaded
    with needing("the view needs", "apps"):
        from trame.app import get_server
        from trame.ui.vuetify3 import SinglePageLayout
        from trame.widgets import vuetify3 as vuetify
        from trame_pyvista import widgets as views
    make_view: Any = views.PyVistaLocalView
    plotter.suppress_rendering = True
    server: Any = get_server("heartgen-view", client_type="vue3")
    state = server.state
    names = colors_of(plotter)
    state.color, state.mask, state.scale = PLAIN, True, ""
    with SinglePageLayout(server) as layout:
        layout.title.set_text(f"heartgen · {title}")
        with layout.toolbar:
            vuetify.VSpacer()
            vuetify.VLabel("{{ scale }}", classes="mr-4")
            vuetify.VSelect(
                label="Color by",
                v_model=("color",),
                items=("names", names),
                hide_details=True,
                density="compact",
                style="max-width: 260px",
            )
            if "mask" in plotter.actors:
                vuetify.VCheckbox(
                    label="Mask", v_model=("mask",), hide_details=True, classes="mr-6"
                )
        with layout.content:
            view = make_view(plotter)
        layout.footer.clear()
        layout.footer.add_child("Research use, not for diagnosis")

    @state.change("color", "mask")  # type: ignore[untyped-decorator]
    def _changed(color: str, mask: bool, **_: Any) -> None:
        state.scale = color_by(plotter, color)
        if "mask" in plotter.actors:
            plotter.actors["mask"].SetVisibility(mask)
        view.update()

    server.start(port=port, open_browser=browser, host="127.0.0.1", timeout=0)
