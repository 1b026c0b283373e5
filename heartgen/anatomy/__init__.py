"""Shape analysis: what there is in the mask, where it points, how large it is."""

from heartgen.anatomy.analysis import Anatomy, analyse
from heartgen.anatomy.base import Base, Plane
from heartgen.anatomy.hole import Cone, cone_through, with_hole
from heartgen.anatomy.right import RightVentricle
from heartgen.anatomy.shape import Slices

__all__ = [
    "Anatomy",
    "Base",
    "Cone",
    "Plane",
    "RightVentricle",
    "Slices",
    "analyse",
    "cone_through",
    "with_hole",
]
