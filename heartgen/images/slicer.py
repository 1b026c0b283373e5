"""Segmentations by 3D Slicer (.seg.nrrd): segments, in layers where they overlap."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.images.file_kinds import refuse
from heartgen.images.structures import Structures
from heartgen.images.volume import Coded, Volume

KEY = re.compile(r"Segment(\d{1,6})_(LabelValue|Layer|Name|ID)$", re.ASCII)
"""Metadata of segments, which are numbered from 0."""

ENTRIES = ("ID", "LabelValue", "Layer", "Name", "Tags")
"""What is known of a segment."""

TERMS = 2
"""Of a terminology entry, where its category ends; type, modifier and regions follow."""


@dataclass(frozen=True)
class Segment:
    """A segment as the header declares it: its value in one of the layers.

    Attributes
    ----------
    name : str
        As the user called it.
    value : int
        Its value in the layer.
    layer : int
        Number of the layer, from 0.
    coded : Coded
        Its codes.
    """

    name: str
    value: int
    layer: int
    coded: Coded


def segments_of(metadata: Mapping[str, str]) -> list[Segment]:
    """Segments that the header of a .seg.nrrd file declares, in their order.

    Parameters
    ----------
    metadata : mapping of str to str
        Fields of the header by their keys.
    """
    found = {}
    for number in sorted({int(match[1]) for key in metadata if (match := KEY.match(key))}):
        entries = {name: metadata.get(f"Segment{number}_{name}") for name in ENTRIES}
        # Before Slicer 4.11 every segment had a layer of its own.
        value = _whole(entries["LabelValue"] or "1")
        layer = _whole(entries["Layer"] or ("0" if entries["LabelValue"] else str(number)))
        if value is not None and layer is not None:
            coded = _coded(entries["Tags"] or "")
            found[number] = Segment(entries["Name"] or entries["ID"] or "", value, layer, coded)
    return list(found.values())


def layered(
    segments: Sequence[Segment], layers: NDArray[np.generic], affine: NDArray[np.float64], file: str
) -> Structures:
    """Segments of several layers as structures.

    Parameters
    ----------
    segments : sequence of Segment
        As the header declares them.
    layers : (nx, ny, nz, n) of a real type
        Label maps.
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.
    file : str
        Name of the file.

    Returns
    -------
    Structures
        Numbered from 1.

    Raises
    ------
    InputError
        If no segment lies in one of the layers.
    """
    numbered = {
        number: segment
        for number, segment in enumerate(segments, start=1)
        if segment.layer < layers.shape[3]
    }

    def load(numbers: Sequence[int], _: int) -> Volume:
        asked = [numbered[number] for number in numbers]
        inside = [layers[..., segment.layer] == segment.value for segment in asked]
        return Volume(np.stack(inside, axis=-1), affine)

    if not numbered:
        refuse(
            file,
            f"None of its segments lies in one of the {layers.shape[3]} layers that the file has: "
            "export the segmentation again.",
        )
    names = {number: segment.name for number, segment in numbered.items()}
    codes = {number: segment.coded for number, segment in numbered.items()}
    return Structures(file, names, load, codes)


def _whole(text: str) -> int | None:
    """A whole number that is not negative, if the text is one."""
    return int(text) if re.fullmatch(r"\s*\d{1,9}\s*", text, re.ASCII) else None


def _coded(tags: str) -> Coded:
    """Codes of a segment's terminology entry: context~category~type~modifier~context~region~..."""
    entry = re.search(r"TerminologyEntry:([^|]*)", tags)
    terms = entry[1].split("~")[TERMS:] if entry else []
    triples = [term.split("^") for term in terms]
    coded = [triple for triple in triples if len(triple) == 3 and triple[1]]
    return Coded(tuple(c[1] for c in coded), tuple(c[2] for c in coded))
