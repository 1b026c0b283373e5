"""What differs between a left ventricle alone and both: each kind of heart has its own of these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from heartgen.anatomy import Anatomy
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surface_chart import Apex
from heartgen.optimization.settings import BIV_WEIGHTS, LV_WEIGHTS, HeartWeights
from heartgen.options import BIV_ELEMENTS, LV_ELEMENTS
from heartgen.templates import TruncatedEllipsoid, biventricular_template, lv_template


class TemplateMaker(Protocol):
    """Makes a template, such as `heartgen.templates.lv_template`."""

    def __call__(
        self,
        anatomy: Anatomy,
        elements: tuple[int, int, int],
        graded: bool = True,
        apex: Apex = "collapsed",
        hole: float = 0.0,
        shape: TruncatedEllipsoid | None = None,
    ) -> HexMesh:
        """Tailor it to an anatomy."""


@dataclass(frozen=True)
class HeartKind:
    """A kind of heart, and what it is meshed with.

    Attributes
    ----------
    title : str
        What it is.
    elements : (int, int, int)
        Default elements (radial, circumferential, longitudinal).
    template : TemplateMaker
        Its template.
    weights : HeartWeights
        Of the optimization.
    """

    title: str
    elements: tuple[int, int, int]
    template: TemplateMaker
    weights: HeartWeights


LEFT_VENTRICLE = HeartKind("left ventricle", LV_ELEMENTS, lv_template, LV_WEIGHTS)
BOTH_VENTRICLES = HeartKind("both ventricles", BIV_ELEMENTS, biventricular_template, BIV_WEIGHTS)


def kind_of(anatomy: Anatomy) -> HeartKind:
    """The kind of a heart.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    """
    return LEFT_VENTRICLE if anatomy.rv is None else BOTH_VENTRICLES
