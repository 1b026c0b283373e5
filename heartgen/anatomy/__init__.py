"""Shape analysis: what there is in the mask, where it points, how large it is."""

from heartgen.anatomy.analysis import Anatomy, analyze, analyze_under, raw_indicator
from heartgen.anatomy.base import Base
from heartgen.anatomy.hole import Cone, cone_through, with_hole
from heartgen.anatomy.plane import Plane
from heartgen.anatomy.right import RightVentricle
from heartgen.anatomy.shape import Slices
from heartgen.anatomy.sheet import Sheet
from heartgen.anatomy.views import with_views

__all__ = [
    "Anatomy",
    "Base",
    "Cone",
    "Plane",
    "RightVentricle",
    "Sheet",
    "Slices",
    "analyze",
    "analyze_under",
    "cone_through",
    "raw_indicator",
    "with_hole",
    "with_views",
]
