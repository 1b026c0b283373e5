"""The options: each is declared here, and nowhere else, with all that there is to say of it.

The flags of the command line, the controls of the page, the columns of a batch's table, the JSON
schema and docs/options.md are made from this.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from heartgen.errors import InputError
from heartgen.options.declaring import About, Needs, Word
from heartgen.options.defaults import OPTIMIZED_PASSES, OPTIMIZED_PASSES_OF_ONE, STEPS
from heartgen.options.option import Option, attributes, listed
from heartgen.options.refusing import refuses_in_sentences
from heartgen.options.values import (
    NUMBER,
    OUT_OF_BALANCE,
    QUALITY_LIMITS,
    ROW,
    SWITCH,
    TOO_MANY,
    WHOLE,
    Apex,
    Count,
    Direction,
    Insertion,
)
from heartgen.renamed import takes_former_options


@takes_former_options
@refuses_in_sentences
@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class Options:
    """What the user may choose.

    Attributes
    ----------
    :

    Examples
    --------
    >>> import heartgen
    >>> options = heartgen.Options(lod=3, ventricles="lv")
    >>> options.lod, options.optimize
    (3, True)
    >>> heartgen.Options(lod=7)
    Traceback (most recent call last):
    heartgen.errors.InputError: level of detail 7 does not exist: choose a whole number from 1 to 5
    """

    lod: Annotated[
        int,
        Field(ge=1, le=5),
        WHOLE,
        About(
            "Level of detail",
            "How closely the mesh follows the mask: 1 is coarse and most stable, 5 most accurate.",
            step="registration",
            level="basic",
            wrong="does not exist",
            remedy="choose a whole number from 1 to 5",
        ),
    ] = 1
    elements: Annotated[
        tuple[Count, Count, Count] | None,
        ROW,
        About(
            "Elements",
            "Numbers of elements: radial, circumferential, longitudinal.",
            step="template",
            level="basic",
            wrong=TOO_MANY,
            remedy="give radial, circumferential and longitudinal, for example 1x12x6",
            unset="1x12x6 for a left ventricle, 2x12x8 for both",
            example=(1, 12, 6),
            parts=("Radial", "Around", "Along"),
        ),
    ] = None
    ventricles: Annotated[
        Literal["auto", "lv", "biv"],
        About(
            "Ventricles",
            "What the mask shows.",
            step="shape analysis",
            level="basic",
            wrong="are not known",
            words={
                "auto": Word("Automatic", "found out"),
                "lv": Word("Left ventricle", "the left ventricle alone"),
                "biv": Word("Both ventricles", "both ventricles"),
            },
        ),
    ] = "auto"
    optimize: Annotated[
        bool,
        SWITCH,
        About(
            "Optimization",
            "Optimize the mesh after the four steps of the paper (Lamata et al. 2014).",
            step="optimization",
            words={
                "yes": Word("On", "accuracy, element quality and fairness are weighed"),
                "no": Word("Off", "stop after the paper's four steps"),
            },
        ),
    ] = True
    quality: Annotated[
        float,
        Field(ge=QUALITY_LIMITS[0], le=QUALITY_LIMITS[1]),
        NUMBER,
        About(
            "Quality weight",
            "Weight of element quality against accuracy in the optimization, over the default of "
            "the level of detail.",
            step="optimization",
            level="basic",
            wrong=OUT_OF_BALANCE,
            remedy="choose one, where 1 is the default",
            when="with the optimization",
            needs=Needs("optimize", True),
        ),
    ] = 1.0
    min_jacobian_ratio: Annotated[
        float,
        Field(ge=0, lt=1),
        NUMBER,
        About(
            "Minimum Jacobian ratio",
            "Jacobian ratio that every element should reach: those below it weigh more and more "
            "in the optimization, as long as that helps; the report says where it does not.",
            step="optimization",
            wrong="cannot be asked of every element",
            remedy="choose 0, for none, or a number below 1, for example 0.3",
            when="with the optimization",
            needs=Needs(
                "optimize",
                True,
                "a minimum Jacobian ratio is reached by the optimization of the mesh: allow the "
                "optimization, or ask for no minimum",
            ),
        ),
    ] = 0.0
    truncate: Annotated[
        Annotated[float, Field(ge=0, allow_inf_nan=False), NUMBER] | Literal["auto", "off"],
        About(
            "Truncation",
            "Cut the base below the rim, as the valves there are no part of the mesh; the paper "
            "cuts off 5 mm.",
            step="shape analysis",
            unit="mm",
            remedy="give a distance in mm, auto or off",
            example=5.0,
            words={
                "auto": Word("At valves", "where valve anatomy is present"),
                "off": Word("Never", "never"),
            },
        ),
    ] = "auto"
    base: Annotated[
        Literal["rim", "plane"],
        About(
            "Basal surface",
            "Where the mesh ends.",
            step="shape analysis",
            when="where valve anatomy is present",
            words={
                "rim": Word("Along the rim", "a smooth surface that follows the rim"),
                "plane": Word("Plane", "a plane, for which more is cut off"),
            },
        ),
    ] = "rim"
    enhance: Annotated[
        bool,
        SWITCH,
        About(
            "Enhancement",
            "Make transmural lines straight after warping, the paper's fourth step: better "
            "elements, surfaces unmoved.",
            step="enhancement",
            words={
                "yes": Word("On", "as in the paper"),
                "no": Word("Off", "leave out the step that straightens elements"),
            },
        ),
    ] = True
    transmural_grading: Annotated[
        bool,
        SWITCH,
        About(
            "Transmural grading",
            "Grade the transmural coordinate for even elements.",
            step="template",
            flag="--no-grading",
            words={
                "yes": Word("On", "graded"),
                "no": Word("Off", "depth in the wall proportional to the transmural coordinate"),
            },
        ),
    ] = True
    transmural_lines: Annotated[
        Literal["straight", "curved"],
        About(
            "Transmural lines",
            "Lines of the mesh across the wall, once it is optimized.",
            step="optimization",
            wrong="are not known",
            when="with the optimization",
            needs=Needs(
                "optimize",
                True,
                "transmural lines are only curved by the optimization of the mesh: allow the "
                "optimization, or keep them straight",
            ),
            words={
                "straight": Word("Straight", "as in the paper"),
                "curved": Word("Curved", "for better elements; the surfaces stay"),
            },
        ),
    ] = "straight"
    basis: Annotated[
        Literal["hermite", "lagrange"],
        About(
            "Basis",
            "Cubic basis of the mesh; its geometry is the same.",
            step="assessment",
            words={
                "hermite": Word(
                    "Cubic Hermite", "values and derivatives at nodes, smooth between elements"
                ),
                "lagrange": Word("Cubic Lagrange", "values at the Lagrange nodes of each element"),
            },
        ),
    ] = "hermite"
    septal_direction: Annotated[
        Direction | None,
        ROW,
        About(
            "Septal direction",
            "Direction from the left ventricle to the septum in the world (LPS), from which AHA "
            "segments are counted.",
            step="assessment",
            wrong="is not a direction of three numbers",
            remedy="give x, y and z that point from the left ventricle to the right, in the world "
            "(LPS), for example -1,-1,0",
            unset="that of the right ventricle, or -1,-1,0 where there is none",
            example=(-1.0, -1.0, 0.0),
            parts=("x", "y", "z"),
        ),
    ] = None
    apex: Annotated[
        Apex,
        About(
            "Apex",
            "How the lowest row of elements ends.",
            step="template",
            words={
                "collapsed": Word("Collapsed", "it collapses in a pole"),
                "hole": Word("Apical hole", "it ends at a hole"),
                "patch": Word(
                    "Square patch",
                    "a square patch of elements is in its place, for which a multiple of 4 must "
                    "lie around",
                ),
            },
        ),
    ] = "collapsed"
    hole_radius: Annotated[
        Annotated[float, Field(gt=0, allow_inf_nan=False), NUMBER] | None,
        About(
            "Hole radius",
            "Radius of the apical hole on the endocardium.",
            step="template",
            unit="mm",
            wrong="is not a positive number",
            remedy="give one, in mm",
            when="with an apical hole",
            needs=Needs(
                "apex",
                "hole",
                "an apex that is {apex} has no hole of {hole_radius} mm radius: choose the apex "
                "with a hole, or no radius",
            ),
            unset="a quarter of the cavity's",
            example=5.0,
        ),
    ] = None
    slice_alignment: Annotated[
        Literal["auto", "off"],
        About(
            "Slice alignment",
            "Move slices of a stack back that are shifted against each other.",
            step="shape analysis",
            when="for stacks of slices",
            words={
                "auto": Word("Where shifted", "those that clearly are"),
                "off": Word("Never", "never"),
            },
        ),
    ] = "auto"
    insertion: Annotated[
        Insertion,
        About(
            "RV insertion",
            "Line on which the right ventricle meets the left one.",
            step="optimization",
            when="for both ventricles, with the optimization",
            needs=Needs("optimize", True),
            words={
                "rounded": Word("Rounded", "it follows the anatomy around the right apex"),
                "squared": Word("Squared", "it stays as square there as in the template"),
            },
        ),
    ] = "rounded"

    def __post_init__(self) -> None:
        for each in OPTIONS.values():
            each.check_beside(self)
        if self.apex == "patch" and self.elements is not None and self.elements[1] % 4:
            raise InputError(
                f"{self.elements[1]} elements around cannot end in a square patch, of which a "
                "quarter of them lie along each side: use a multiple of 4"
            )

    def passes(self, lod: int, whole_lv: bool) -> int:
        """Registration passes at a level.

        Parameters
        ----------
        lod : int
            Level of detail, 1 to 5.
        whole_lv : bool
            Whether the heart is a left ventricle that is seen whole.
        """
        most = OPTIMIZED_PASSES_OF_ONE if whole_lv else OPTIMIZED_PASSES
        return min(lod, most) if self.optimize else lod


OPTIONS: Mapping[str, Option] = listed(Options)
"""All options by name, in order."""

ANALYZED = tuple(name for name, each in OPTIONS.items() if each.about.step == STEPS[0])
"""Options that change what is seen in a mask."""

Options.__doc__ = (Options.__doc__ or "").replace("    :\n", attributes(OPTIONS.values()))
