"""Looks at the lines of meshes: surfaces before and after the optimization, and long-axis sections.

usage: python -m benchmarks.lines MASK... [--lod 3] [--elements 1x12x6] [--set NAME=VALUE,...]
                                  [-o OUT]

For each mask OUT/NAME.png: epicardium and endocardium with the mesh's lines, before and after the
optimization, and four sections along the long axis, of the optimized mesh and of the smoothed mask.
A notch, a shoulder at the apical row or waves at the rim of the base, which no figure may tell, are
seen there. ``ideal`` and ``lifelike`` stand for the phantoms at 2 mm, ``biv`` for that of both.
"""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv
from numpy.typing import NDArray

import heartgen
from heartgen import samples
from heartgen.images.isosurface import isosurface
from heartgen.mesh.surface_faces import face_control, tabulate_face
from heartgen.options import option_from_text, settings_from_text
from heartgen.result import Personalization

Array = NDArray[np.float64]

PHANTOMS = {
    "ideal": lambda: samples.ideal_cup(2.0).mask,
    "lifelike": lambda: samples.lifelike_lv(2.0).mask,
    "biv": lambda: samples.biv(2.0).mask,
}

PIECES = 16
"""Pieces of a face along each side, in the pictures."""

ANGLES = (0, 45, 90, 135)
"""Of the sections around the long axis, degrees from the septum."""

WALLS = ("epi", "lv_endo", "rv_endo")

FROM = np.array([0.7, -1.0, 0.25])
"""Direction from which one looks, in the heart's frame."""


def main() -> None:
    """Draw all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("masks", nargs="+")
    parser.add_argument("--lod", type=int, default=3)
    parser.add_argument("--elements", type=partial(option_from_text, "elements"))
    parser.add_argument("--set", default="")
    parser.add_argument("-o", "--out", type=Path, default=Path("benchmarks/results/lines"))
    a = parser.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    given = settings_from_text(filter(None, a.set.split(",")))
    choices: dict[str, Any] = {name: values[0] for name, values in given.items()}
    for name in a.masks:
        mask = PHANTOMS[name]() if name in PHANTOMS else heartgen.read_mask(name)
        result = heartgen.personalize(mask, lod=a.lod, elements=a.elements, **choices)
        path = a.out / f"{Path(name).name.split('.')[0]}.png"
        draw(result, path)
        print(path, result.report, sep="\n")


def draw(result: Personalization, path: Path) -> None:
    """Surfaces above, sections below."""
    figure, axes = plt.subplots(2, 4, figsize=(16, 10), dpi=90, layout="constrained")
    places = [(m, n) for n in ("epi", "endo") for m in ("before", "after")]
    for place, (when, wall) in zip(axes[0], places, strict=True):
        mesh = result.enhanced if when == "before" else result.mesh
        names = ("epi",) if wall == "epi" else ("lv_endo", "rv_endo")
        place.imshow(picture(result, mesh, names))
        place.set_title(f"{'epicardium' if wall == 'epi' else 'endocardium'}, {when}")
        place.axis("off")
    for place, angle in zip(axes[1], ANGLES, strict=True):
        section(result, place, angle)
    figure.savefig(path)
    plt.close(figure)


def picture(
    result: Personalization, mesh: heartgen.HexMesh, names: tuple[str, ...]
) -> NDArray[np.uint8]:
    """Surfaces with their lines, seen from `FROM`."""
    frame = result.anatomy.frame
    plotter = pv.Plotter(off_screen=True, window_size=(600, 650))
    surface = pieces(mesh, names)
    plotter.add_mesh(surface, color="#d9a79c", smooth_shading=True)
    t = np.linspace(0, 1, PIECES + 1)
    for name in names:
        if name in mesh.topology.surfaces:
            control = face_control(mesh, mesh.topology.surfaces[name])
            for end in (np.zeros_like(t), np.ones_like(t)):
                for uv in (np.c_[end, t], np.c_[t, end]):
                    for line in tabulate_face(uv) @ control:
                        plotter.add_mesh(pv.lines_from_points(line), color="black", line_width=2)
    middle, away = np.array(surface.center), frame[:3, :3] @ FROM
    plotter.camera_position = [middle + 300 * away, middle, frame[:3, 2]]
    plotter.reset_camera()
    plotter.camera.zoom(1.3)
    image = plotter.screenshot(return_img=True)
    plotter.close()
    return np.asarray(image)


def pieces(mesh: heartgen.HexMesh, names: tuple[str, ...]) -> pv.PolyData:
    """Surfaces as quadrilaterals."""
    t = np.linspace(0, 1, PIECES + 1)
    uv = np.stack(np.meshgrid(t, t), -1).reshape(-1, 2)
    grid = np.arange(len(uv)).reshape(PIECES + 1, -1)
    quads = [grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]]
    cells = np.c_[np.full(PIECES**2, 4), np.stack(quads, -1).reshape(-1, 4)]
    faces = np.concatenate([mesh.topology.surfaces.get(n, np.zeros((0, 2), int)) for n in names])
    points = tabulate_face(uv) @ face_control(mesh, faces)
    shift = np.repeat(np.arange(len(faces)) * len(uv), len(cells))[:, None]
    every = np.tile(cells, (len(faces), 1)) + shift * np.array([0, 1, 1, 1, 1])
    return pv.PolyData(points.reshape(-1, 3), every.ravel())


def section(result: Personalization, place: Any, angle: float) -> None:
    """The plane through the long axis at an angle around it: mask in gray, mesh in red."""
    anatomy = result.anatomy
    turn = np.radians(angle)
    across = anatomy.frame[:3, :3] @ np.array([np.cos(turn), np.sin(turn), 0])
    normal = np.cross(across, anatomy.frame[:3, 2])
    origin = anatomy.frame[:3, 3]
    target = isosurface(anatomy.myocardium)
    cells = np.c_[np.full(len(target.triangles), 3), target.triangles]
    shapes = (
        (pv.PolyData(target.points, cells.ravel()), "0.6", 3),
        (pieces(result.mesh, tuple(result.mesh.topology.surfaces)), "tab:red", 1.2),
    )
    for shape, color, width in shapes:
        cut = shape.slice(normal=normal, origin=origin)
        at = (np.asarray(cut.points) - origin) @ np.c_[across, anatomy.frame[:3, 2]]
        lines = (
            np.asarray(cut.lines).reshape(-1, 3)[:, 1:] if cut.n_lines else np.zeros((0, 2), int)
        )
        for ends in at[lines]:
            place.plot(*ends.T, color=color, linewidth=width)
    place.set_aspect("equal")
    place.set_title(f"{angle}° from the septum, mm")


if __name__ == "__main__":
    main()
