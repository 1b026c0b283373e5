"""What lives on a mesh: coordinates, segments, fibers, the wall's shape; and clinical indices."""

from heartgen.fields.axes import HeartAxes, heart_axes
from heartgen.fields.catalog import FIELDS, make_fields
from heartgen.fields.fibers import FiberRule, fiber_frames, rule_from_text
from heartgen.fields.indices import Indices, clinical_indices
from heartgen.fields.segments import SEGMENTS, aha_segment
from heartgen.fields.strains import Strains, global_strains, segment_strains
from heartgen.renamed import keep_former_names

__all__ = [
    "FIELDS",
    "SEGMENTS",
    "FiberRule",
    "HeartAxes",
    "Indices",
    "Strains",
    "aha_segment",
    "clinical_indices",
    "fiber_frames",
    "global_strains",
    "heart_axes",
    "make_fields",
    "rule_from_text",
    "segment_strains",
]

keep_former_names(__name__)
