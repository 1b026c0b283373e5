"""What lives on a mesh: coordinates, segments, fibres, the wall's shape; and clinical indices."""

from heartgen.fields.axes import HeartAxes, heart_axes
from heartgen.fields.catalogue import FIELDS, make_fields
from heartgen.fields.fibres import FibreRule, fibre_frames
from heartgen.fields.segments import SEGMENTS, aha_segment

__all__ = [
    "FIELDS",
    "SEGMENTS",
    "FibreRule",
    "HeartAxes",
    "aha_segment",
    "fibre_frames",
    "heart_axes",
    "make_fields",
]
