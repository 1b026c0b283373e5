"""EX version 3 (.exf): the mesh as OpenCMISS, zinc and scaffoldmaker tools read it, exactly.

Every element says which versions of which nodal parameters it takes, with unit scaling: there are
no scale factors, sums or implied zeros, so that the widest set of tools can read or convert the
file. The frame is that of heartgen: mm, world (LPS).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.files import write_text
from heartgen.formats.groups import Group, named_groups
from heartgen.formats.nodal import NodalParameters, nodal_parameters
from heartgen.formats.skeleton import COLLAPSED, Skeleton, skeleton
from heartgen.mesh.hexmesh import HexMesh

PARAMETERS = (
    "value d/ds1 d/ds2 d2/ds1ds2 d/ds3 d2/ds1ds3 d2/ds2ds3 d3/ds1ds2ds3".split()
)
"""Labels of the parameters of a node, in the order of `heartgen.formats.nodal`."""

FIELD = "1) coordinates, coordinate, rectangular cartesian, real, #Components=3"
BASIS = "c.Hermite*c.Hermite*c.Hermite, no modify, standard node based."

NODES = "!#nodeset nodes"
MESHES = (
    "!#mesh mesh1d, dimension=1, nodeset=nodes",
    "!#mesh mesh2d, dimension=2, face mesh=mesh1d, nodeset=nodes",
    "!#mesh mesh3d, dimension=3, face mesh=mesh2d, nodeset=nodes",
)
SHAPES = ("line", "line*line", "line*line*line")

NULL = -1
"""Number that stands for no face or no line; real ones count from 1."""


def write_exf(
    mesh: HexMesh, path: str | Path, groups: Mapping[str, NDArray[np.intp]] | None = None
) -> None:
    """Write a mesh as an EX version 3 file.

    Parameters
    ----------
    mesh : HexMesh
    path : path
        Its folder is created if absent.
    groups : mapping of str to (n,) or (n, 2) int, optional
        More named groups, of elements or of faces (element, face). The surfaces, the apex and the
        myocardium of a left ventricle are always there, under the names scaffoldmaker gives them.

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    MeshError
        If a group names what the mesh does not have.
    """
    parts = skeleton(mesh.topology)
    lines = [
        "EX Version: 3",
        "Region: /",
        "! heartgen: mm, world (LPS); derivatives with respect to element coordinates",
        *_nodes(nodal_parameters(mesh)),
    ]
    write_text("\n".join(lines) + "\n", path)
