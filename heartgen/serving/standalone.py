"""`heartgen view`: a mesh in a browser, with the mask it was made of, in the page's 3-D view."""

from __future__ import annotations

import tempfile
import warnings
import webbrowser
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy, analyze_under
from heartgen.errors import HeartgenError, InputError, MissingFileError
from heartgen.fields import heart_axes
from heartgen.fields.catalog import AHA
from heartgen.formats import READERS, read_mesh_file, write_mesh
from heartgen.report import options_beside
from heartgen.viewing.camera import frame_of
from heartgen.viewing.contours import EDGE_RADIUS, TUBE_SIDES
from heartgen.viewing.fields import segment_color
from heartgen.viewing.polydata import MAX_TRIANGLES, mask_surface, to_mask
from heartgen.viewing.scene import DARK, MASK, MESH, Scale, nice_limit
from heartgen.widgets.colors import Painted, scaled
from heartgen.widgets.mesh_scene import WHOLE_OPACITY, Scene
from heartgen.widgets.scene_file import scene_file
from heartgen.widgets.scene_parts import framed, rgba
from heartgen.widgets.scene_views import views_of

Array = NDArray[np.float64]

SUBDIVISION = 3
"""Halvings of a curved cell's edge for the picture: 8 flat pieces."""

DISTANCE = "distance to the mask (mm)"

PLAIN = "one color"

FAR = 95.0
"""Percentile of the distance by which the end of its scale is chosen."""

HIDDEN = ("vtkOriginal", "pyvistaOriginal", "Normals", "surface ", "patch ", "part ", "rgba")
"""Beginnings of arrays' names that are no quantities."""


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
    scene, colorings = make_scene(shown, anatomy, frame_beside(mesh, anatomy))
    serve_page(scene_file(scene, colorings, mesh.name), port, browser)


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


def frame_beside(path: Path, anatomy: Anatomy | None) -> tuple[Array, dict[str, Any]]:
    """Frame (4, 4) in which a heart stands upright, and its named sides.

    Parameters
    ----------
    path : Path
        Of the mesh; one that heartgen does not know stays as it lies.
    anatomy : Anatomy or None
        Of its mask.
    """
    try:
        axes = heart_axes(read_mesh_file(path).mesh)
    except HeartgenError:
        frame = np.eye(4) if anatomy is None else anatomy.frame
        return frame, views_of(frame)
    frame = frame_of(axes)
    return frame, views_of(frame, axes)


def make_scene(
    mesh: pv.DataSet, anatomy: Anatomy | None, place: tuple[Array, dict[str, Any]]
) -> tuple[Scene, dict[str, Painted]]:
    """The scene of a mesh, and what it can be colored by.

    Parameters
    ----------
    mesh : pyvista.DataSet
        mm, world (LPS).
    anatomy : Anatomy or None
        Of the mask; None if there is no mask.
    place : (array, dict)
        As of `frame_beside`.
    """
    frame, views = place
    surface: Any = mesh.extract_surface(
        nonlinear_subdivision=SUBDIVISION, algorithm="dataset_surface"
    ).triangulate()
    surface = _apart(surface.compute_normals(cell_normals=False, split_vertices=True))
    shown = pv.PolyData()
    if anatomy is not None:
        error = to_mask(surface.points, anatomy.myocardium)
        surface.point_data[DISTANCE] = error.astype(np.float32)
        shown = mask_surface(anatomy.myocardium, MAX_TRIANGLES)
        shown.point_data["rgba"] = rgba(MASK, np.full(shown.n_points, WHOLE_OPACITY))
    lines: Any = mesh.extract_all_edges()
    radius = EDGE_RADIUS * float(np.ptp(lines.points, axis=0).max())
    tubes = lines.tube(radius=radius, n_sides=TUBE_SIDES)
    tubes.point_data["rgba"] = rgba(DARK, np.ones(tubes.n_points))
    colorings = {name: _painted(surface, name) for name in colors_of(surface)}
    for data in (surface, tubes, shown):
        framed(data, frame)
    return Scene(surface, tubes, shown, None, frame, views), colorings


def colors_of(surface: pv.PolyData) -> list[str]:
    """Names of what the mesh can be colored by.

    Parameters
    ----------
    surface : PolyData
        Of the mesh.
    """
    names = [
        name
        for name in surface.point_data
        if surface.point_data[name].ndim == 1 and not name.startswith(HIDDEN)
    ]
    return [PLAIN, *names]


def serve_page(page: str, port: int, browser: bool) -> None:
    """Serve a page on this machine until interrupted.

    Parameters
    ----------
    page : str
        HTML.
    port : int
        0 for any that is free.
    browser : bool
        Open the page.

    Raises
    ------
    HeartgenError
        If the port is taken.
    """
    try:
        server = ThreadingHTTPServer(("127.0.0.1", port), partial(_Page, page.encode()))
    except OSError as error:
        raise HeartgenError(
            f"the view cannot be served on port {port} ({error.strerror}): choose another --port"
        ) from error
    address = f"http://127.0.0.1:{server.server_port}/"
    print(f"heartgen view: {address}   (Ctrl-C ends it)", flush=True)
    if browser:
        webbrowser.open(address)
    with server:
        server.serve_forever()


class _Page(BaseHTTPRequestHandler):
    """Answers every request with one page."""

    def __init__(self, page: bytes, *arguments: Any) -> None:
        self.page = page
        super().__init__(*arguments)

    def do_GET(self) -> None:
        """Hand over the page."""
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(self.page)))
        self.end_headers()
        self.wfile.write(self.page)

    def log_message(self, *_: Any) -> None:
        """Requests are no news."""


def _apart(surface: pv.PolyData) -> pv.PolyData:
    """Triangles without points in common, so that each may have its cell's color."""
    corners = surface.regular_faces.ravel()
    apart = pv.PolyData(
        surface.points[corners], faces=np.insert(np.arange(len(corners)).reshape(-1, 3), 0, 3, 1)
    )
    for name in surface.point_data:
        apart.point_data[name] = np.asarray(surface.point_data[name])[corners]
    for name in surface.cell_data:
        apart.point_data[name] = np.repeat(np.asarray(surface.cell_data[name]), 3, axis=0)
    apart.point_data.active_normals_name = "Normals"
    return apart


def _painted(surface: pv.PolyData, name: str) -> Painted:
    """The surface colored by an array."""
    if name == PLAIN:
        return _classes(np.zeros(surface.n_points, int), {0: (MESH, "mesh")}, "")
    values = np.asarray(surface.point_data[name], dtype=float)
    if name == AHA:
        numbers = values.astype(int)
        there = {
            int(n): (segment_color(int(n)), str(n) if n else "none") for n in np.unique(numbers)
        }
        return _classes(numbers, there, "AHA segment")
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if name == DISTANCE:
        low, high = 0.0, nice_limit(float(np.percentile(values, FAR)))
    return scaled(values, Scale(name, "viridis", (low, high if high > low else low + 1)))


def _classes(numbers: NDArray[np.intp], named: dict[int, tuple[str, str]], title: str) -> Painted:
    """Points colored by class, each of which has a color and a name."""
    colors = np.zeros((max(named) + 1, 3), np.uint8)
    for number, (color, _) in named.items():
        colors[number] = pv.Color(color).int_rgb
    return Painted(colors[numbers], colors.__getitem__, title, names=tuple(named.values()))
