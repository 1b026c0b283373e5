"""Do nodes slide or drift: how far the optimization moves the material points of the anatomy.

usage: python -m benchmarks.correspondence FOLDER_OR_MASK... [--lod 3] [--elements 2x12x8]
                                           [--jobs N] [--output FILE.jsonl]

A material point is a place in an element (its xi), the same in every mesh of a topology. Landmarks
are material points: the poles of endo- and epicardium, the insertion line of the right ventricle,
the rims of the base, and the borders of the AHA segments, put at thirds of the longitudinal and
sixths (apical third: quarters) of the circumferential coordinate on endo- and epicardium of the
left ventricle (over the right one the epicardium has none). For each,
x is its place in the mesh before the optimization (warped and enhanced), y that in the optimized
one:

- move = |y - x|, mm: all of it, also the part that is the fit itself, since the surface was beside
  the patient's and is on it now.
- drift = |y - c|, mm, where c is the point closest to x of the optimized mesh's own surface (the
  same named one): where the landmark would lie if it had only been taken to the new surface, the
  shortest way. This is movement along the surface, the loss of correspondence. Landmarks on rims
  and on the insertion line bound their surfaces, and their drift includes that of the bound.

The limit is checked for the move, the stricter of the two readings, and drift is counted beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import heartgen
from benchmarks.rows import Row, case_of, elements_of, jobs_of_masks, resume, table
from heartgen.errors import HeartgenError
from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import tabulate
from heartgen.mesh.closest import closest_points

LIMIT = 3.0
"""mm; largest move of an anatomical point that keeps the correspondence."""

PER_ELEMENT = 8
"""Points per element along a line."""

THIRDS = (1 / 3, 2 / 3)
"""Longitudinal coordinates between apical, mid and basal segments."""

BORDERS = {"apical": 4, "mid": 6, "basal": 6}
"""Segments around each level (AHA; Cerqueira et al. 2002, doi:10.1161/hc0402.102975)."""

SIDES = {"endo": ("lv_endo", 0.0), "epi": ("epi", 1.0)}
"""Surfaces of the wall of the left ventricle, and xi3 there."""


Place = tuple[NDArray[np.intp], NDArray[np.float64]]
"""Elements (n,) and local coordinates (n, 3) of material points."""


def main() -> None:
    """Fit, tabulate, check."""
    jobs, a = jobs_of_masks(__doc__, "correspondence")
    print(report(resume(a.output, jobs, measure, a.jobs)))


def measure(job: Row) -> list[Row]:
    """Moves and drifts of the landmarks of one mask: a row per landmark."""
    path = Path(job["mask"])
    try:
        result = heartgen.personalize(
            heartgen.read_mask(path), lod=job["lod"], elements=elements_of(job["elements"])
        )
    except HeartgenError as error:
        return [{"case": case_of(path), "failure": str(error)}]
    rows = []
    for name, (surface, place) in landmarks(result.mesh).items():
        move, drift = moved(result.enhanced, result.mesh, surface, place)
        row: Row = {"case": case_of(path), "landmark": name, "points": len(move)}
        for what, values in (("move", move), ("drift", drift)):
            row |= {what: values.round(4).tolist()}
        rows.append(row)
    return rows


def moved(
    before: HexMesh, after: HexMesh, surface: str, place: Place
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Move and drift (n,) of material points of a surface, mm."""
    x, y = evaluate(before, place), evaluate(after, place)
    topology = after.topology
    faces = {**topology.surfaces, **topology.patches}[surface]
    closest = closest_points(after, faces, x).points
    return np.linalg.norm(y - x, axis=1), np.linalg.norm(y - closest, axis=1)


def evaluate(mesh: HexMesh, place: Place) -> NDArray[np.float64]:
    """World positions (n, 3), mm, LPS, of material points."""
    elements, xi = place
    return np.asarray(np.einsum("na,nax->nx", tabulate(xi), mesh.control[elements]))


def landmarks(mesh: HexMesh) -> dict[str, tuple[str, Place]]:
    """Landmarks by name: the surface they lie on, and the material points."""
    _, around, along = mesh.topology.shape
    out: dict[str, tuple[str, Place]] = {}
    circle = np.arange(around * PER_ELEMENT) / (around * PER_ELEMENT)
    for side, (surface, depth) in SIDES.items():
        pole = np.zeros((1, 2))
        out[f"apex, {side}"] = (surface, locate(mesh, depth, pole))
        rings = [np.c_[circle, np.full_like(circle, level)] for level in THIRDS]
        lines = list(_meridians(along))
        borders = locate(mesh, depth, np.concatenate(rings + lines))
        out[f"AHA borders, {side}"] = (surface, _of_left(mesh, borders))
        rim = np.c_[circle, np.ones_like(circle)]
        out[f"rim of the base, {side}"] = (surface, _of_left(mesh, locate(mesh, depth, rim)))
    if "rv_septum" in mesh.topology.patches:
        out["insertion line"] = ("rv_septum", insertion_line(mesh))
    return out


def _of_left(mesh: HexMesh, place: Place) -> Place:
    """The material points that do not belong to the right ventricle."""
    kept = ~np.isin(place[0], mesh.topology.parts.get("right ventricle", []))
    return place[0][kept], place[1][kept]


def _meridians(along: int) -> Iterator[NDArray[np.float64]]:
    """Borders (n, 2) between the segments of each level, circumferential and longitudinal."""
    ends = (0.0, *THIRDS, 1.0)
    count = along * PER_ELEMENT // len(BORDERS) + 1
    for low, high, segments in zip(ends[:-1], ends[1:], BORDERS.values(), strict=True):
        # The pole itself is a landmark of its own.
        t = np.linspace(low, high, count + 1)[1:]
        for n in range(segments):
            yield np.c_[np.full_like(t, n / segments), t]


def locate(mesh: HexMesh, depth: float, place: NDArray[np.float64]) -> Place:
    """Material points at relative circumferential and longitudinal coordinates (n, 2) of the wall.

    Depth 0 is the inner face of the innermost layer, 1 the outer one of the outermost.
    """
    radial, around, along = mesh.topology.shape
    c, s = place[:, 0] % 1 * around, place[:, 1] * along
    column = np.minimum(c.astype(int), around - 1)
    row = np.minimum(s.astype(int), along - 1)
    layer = 0 if depth == 0 else radial - 1
    where = {tuple(index): e for e, index in enumerate(mesh.topology.index.tolist())}
    elements = np.array([where[layer, i, j] for i, j in zip(column, row, strict=True)])
    return elements, np.c_[c - column, s - row, np.full_like(c, depth)]


def insertion_line(mesh: HexMesh) -> Place:
    """Material points where the free wall of the right ventricle meets the septum."""
    faces = mesh.topology.patches["rv_septum"][:, 0]
    index = mesh.topology.index
    open_ones = {tuple(i) for i in index[faces, 1:].tolist()}
    t = (np.arange(PER_ELEMENT) + 0.5) / PER_ELEMENT
    zero, one = np.zeros_like(t), np.ones_like(t)
    elements, places = [], []
    for e in faces:
        _, c, s = index[e].tolist()
        sides = {(c - 1, s): (zero, t), (c + 1, s): (one, t), (c, s - 1): (t, zero)}
        for neighbor, (u, v) in sides.items():
            if neighbor not in open_ones:
                elements.append(np.full(len(t), e))
                places.append(np.c_[u, v, one])
    return np.concatenate(elements), np.concatenate(places)


def report(rows: Sequence[Row]) -> str:
    """Figures of all points of all masks by landmark, and the cases beyond the limit."""
    done = [r for r in rows if "move" in r]
    heads = ["landmark", "hearts", "points", "move median", "95 %", "max"]
    heads += ["drift median", "95 %", "max", "hearts beyond 3 mm (move, drift)"]
    lines, beyond = [], []
    for name in dict.fromkeys(r["landmark"] for r in done):
        group = [r for r in done if r["landmark"] == name]
        line: list[object] = [name, len(group), sum(r["points"] for r in group)]
        for what in ("move", "drift"):
            values = np.concatenate([r[what] for r in group])
            line += [float(np.median(values)), float(np.percentile(values, 95)), float(max(values))]
        far = [sum(max(r[what]) > LIMIT for r in group) for what in ("move", "drift")]
        lines.append([*line, f"{far[0]}, {far[1]}"])
        beyond += [(max(r["move"]), max(r["drift"]), name, r["case"]) for r in group]
    named = [
        f"- {case}, {name}: move {move:.2f} mm, drift {drift:.2f} mm"
        for move, drift, name, case in sorted(beyond, reverse=True)
        if move > LIMIT
    ]
    failed = [f"- {r['case']}: {r['failure']}" for r in rows if "failure" in r]
    return "\n".join(
        [table(heads, lines), "", f"beyond {LIMIT:g} mm:", *(named or ["- none"]), *failed]
    )


if __name__ == "__main__":
    main()
