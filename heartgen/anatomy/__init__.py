"""Shape analysis: what there is in the mask, where it points, how large it is."""

from heartgen.anatomy.analysis import Anatomy, analyze, analyze_under, raw_indicator
from heartgen.anatomy.basal_surface import BasalSurface
from heartgen.anatomy.base import Base
from heartgen.anatomy.heart_shape import Slices
from heartgen.anatomy.hole import Cone, cone_through, rim_cone, with_hole
from heartgen.anatomy.plane import Plane
from heartgen.anatomy.right_ventricle import RvAnatomy
from heartgen.anatomy.views import with_views
from heartgen.renamed import keep_former_names

__all__ = [
    "Anatomy",
    "BasalSurface",
    "Base",
    "Cone",
    "Plane",
    "RvAnatomy",
    "Slices",
    "analyze",
    "analyze_under",
    "cone_through",
    "raw_indicator",
    "rim_cone",
    "with_hole",
    "with_views",
]

keep_former_names(__name__)
