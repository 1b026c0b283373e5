"""What the user may choose, and what is done with it: the steps."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from math import isfinite
from typing import Any, Literal, get_args

from heartgen.errors import InputError
from heartgen.option_kinds import kind_of
from heartgen.renamed import new_options, takes_former_options

STEPS = (
    "shape analysis",
    "template",
    "registration",
    "warping",
    "enhancement",
    "optimization",
    "assessment",
)
"""Steps of the pipeline, in order."""

LV_ELEMENTS = (1, 12, 6)
BIV_ELEMENTS = (2, 12, 8)
"""Default elements (radial, circumferential, longitudinal)."""

Apex = Literal["collapsed", "hole", "patch"]
"""Kinds of apex: elements that collapse in a pole, a hole, or a square patch of elements."""

Insertion = Literal["rounded", "squared"]
"""Courses of the insertion line around the apex of the right ventricle."""

QUALITY_LIMITS = (0.01, 100.0)
"""Range of the quality dial."""

HOLE_SHARE = 0.25
"""Radius of an apical hole over that of the cavity, if it is not given."""

OPTIMIZED_PASSES, OPTIMIZED_PASSES_OF_ONE = 2, 3
"""Registration passes before an optimization, which leaves nothing for finer ones to find; and of a
left ventricle alone, whose registration is so close that an optimization could lose against it."""


@takes_former_options
@dataclass(frozen=True)
class Options:
    """What the user may choose.

    Attributes
    ----------
    lod : int
        Level of detail: 1, coarse and most stable, to 5, most accurate.
    elements : (int, int, int) or None
        Elements (radial, circumferential, longitudinal); None for 1x12x6 for a left ventricle and
        2x12x8 for both.
    ventricles : {"auto", "lv", "biv"}
        What the mask shows: found out, a left ventricle alone, or both.
    optimize : bool
        Optimize the mesh after the paper's four steps.
    quality : float
        Weight of element quality against accuracy in the optimization, over the default of the
        level of detail.
    min_jacobian_ratio : float
        Jacobian ratio that every element should reach: those below it weigh more and more in the
        optimization, as long as that helps; the report says where it does not.
    truncate : float or {"auto", "off"}
        Truncation below the rim, mm; ``"auto"`` where valve anatomy is present.
    base : {"rim", "plane"}
        Where valve anatomy is present, the basal surface of the mesh is a smooth one that follows
        the rim, or a plane, for which more is cut off.
    enhance : bool
        Straighten the mesh across the wall after warping.
    transmural_grading : bool
        Whether the transmural coordinate is graded for even elements, or proportional to the depth
        in the wall.
    transmural_lines : {"straight", "curved"}
        The lines of the mesh across the wall, once it is optimized: straight, as in the paper, or
        curved for better elements; the surfaces stay.
    basis : {"hermite", "lagrange"}
        Cubic basis of the result: values and derivatives at the nodes, smooth between elements, or
        values at the Lagrange nodes of each element. The geometry is the same.
    septal_direction : (float, float, float) or None
        Direction from the left ventricle to the septum, world (LPS), from which AHA segments are
        counted; None for that of the right ventricle, or, where there is none, to the patient's
        right and front.
    apex : {"collapsed", "hole", "patch"}
        The lowest row of elements collapses in a pole, or ends at an apical hole, or there is a
        square patch of elements in its place, for which a multiple of 4 must lie around.
    hole_radius : float or None
        Radius of the apical hole on the endocardium, mm; None for a quarter of the cavity's.
    slice_alignment : {"auto", "off"}
        Slices of a stack that are clearly shifted against each other are moved back, or never.
    insertion : {"rounded", "squared"}
        The line on which the right ventricle meets the left one follows the anatomy around the
        right apex, or stays as square there as in the template.

    Examples
    --------
    >>> import heartgen
    >>> options = heartgen.Options(lod=3, ventricles="lv")
    >>> options.lod, options.optimize
    (3, True)
    """

    lod: int = 1
    elements: tuple[int, int, int] | None = None
    ventricles: Literal["auto", "lv", "biv"] = "auto"
    optimize: bool = True
    quality: float = 1.0
    min_jacobian_ratio: float = 0.0
    truncate: float | Literal["auto", "off"] = "auto"
    base: Literal["rim", "plane"] = "rim"
    enhance: bool = True
    transmural_grading: bool = True
    transmural_lines: Literal["straight", "curved"] = "straight"
    basis: Literal["hermite", "lagrange"] = "hermite"
    septal_direction: tuple[float, float, float] | None = None
    apex: Apex = "collapsed"
    hole_radius: float | None = None
    slice_alignment: Literal["auto", "off"] = "auto"
    insertion: Insertion = "rounded"

    def __post_init__(self) -> None:
        self._check_types()
        if self.lod not in range(1, 6):
            raise InputError(f"level of detail {self.lod} does not exist: choose 1 to 5")
        if self.elements is not None and (
            len(self.elements) != 3 or any(int(n) != n or n < 1 for n in self.elements)
        ):
            raise InputError(
                f"elements {self.elements} are not three positive numbers: give radial, "
                "circumferential and longitudinal, for example 1x12x6"
            )
        if self.ventricles not in ("auto", "lv", "biv"):
            raise InputError(
                f"ventricles {self.ventricles!r} are not known: choose auto, lv or biv"
            )
        if not QUALITY_LIMITS[0] <= self.quality <= QUALITY_LIMITS[1]:
            raise InputError(
                f"quality {self.quality} is out of range: choose {QUALITY_LIMITS[0]:g} to "
                f"{QUALITY_LIMITS[1]:g}, where 1 is the default"
            )
        if not 0 <= self.min_jacobian_ratio < 1:
            raise InputError(
                f"a Jacobian ratio of {self.min_jacobian_ratio} cannot be asked of every element: "
                "choose 0, for none, or a number below 1, for example 0.3"
            )
        if self.min_jacobian_ratio and not self.optimize:
            raise InputError(
                "a least Jacobian ratio is reached by the optimization of the mesh: allow the "
                "optimization, or ask for no least ratio"
            )
        if isinstance(self.truncate, str) and self.truncate not in ("auto", "off"):
            raise InputError(
                f"truncation {self.truncate!r} is not known: give a distance in mm, auto or off"
            )
        if self.base not in ("rim", "plane"):
            raise InputError(f"base {self.base!r} is not known: choose rim or plane")
        if self.slice_alignment not in ("auto", "off"):
            raise InputError(
                f"slice alignment {self.slice_alignment!r} is not known: choose auto or off"
            )
        if self.transmural_lines not in ("straight", "curved"):
            raise InputError(
                f"transmural lines {self.transmural_lines!r} are not known: choose straight or "
                "curved"
            )
        if self.transmural_lines == "curved" and not self.optimize:
            raise InputError(
                "transmural lines are only curved by the optimization of the mesh: allow the "
                "optimization, or keep them straight"
            )
        if self.basis not in ("hermite", "lagrange"):
            raise InputError(f"basis {self.basis!r} is not known: choose hermite or lagrange")
        if self.insertion not in get_args(Insertion):
            raise InputError(
                f"insertion {self.insertion!r} is not known: choose rounded or squared"
            )
        if self.septal_direction is not None and not (
            len(self.septal_direction) == 3
            and all(map(isfinite, self.septal_direction))
            and any(self.septal_direction)
        ):
            raise InputError(
                f"septal direction {self.septal_direction} is not a direction: give three numbers "
                "that point from the left ventricle to the right, in the world (LPS), for example "
                "(-1, -1, 0)"
            )
        self._check_apex()

    def _check_types(self) -> None:
        """Refuse what is not of the kind that an option has."""
        for each in fields(self):
            value, (fits, kind) = getattr(self, each.name), kind_of(each.name)
            if not fits(value):
                raise InputError(f"{each.name} {value!r} is not {kind}: give {kind}")

    def _check_apex(self) -> None:
        """Refuse an apex that cannot be made."""
        if self.apex not in get_args(Apex):
            raise InputError(
                f"apex {self.apex!r} is not known: choose {', '.join(get_args(Apex)[:-1])} or "
                f"{get_args(Apex)[-1]}"
            )
        if self.hole_radius is not None and self.apex != "hole":
            raise InputError(
                f"an apex that is {self.apex} has no hole of {self.hole_radius} mm radius: choose "
                "the apex with a hole, or no radius"
            )
        if self.hole_radius is not None and not 0 < self.hole_radius < float("inf"):
            raise InputError(
                f"an apical hole of {self.hole_radius} mm radius cannot be made: give a positive "
                "number"
            )
        if self.apex == "patch" and self.elements is not None and self.elements[1] % 4:
            raise InputError(
                f"{self.elements[1]} elements around cannot end in a square patch, of which a "
                "quarter of them lie along each side: use a multiple of 4"
            )

    def passes(self, lod: int, whole_lv: bool) -> int:
        """Registration passes at a level; `whole_lv`: of a left ventricle that is seen whole.

        Parameters
        ----------
        lod : int
            Level of detail, 1 to 5.
        whole_lv : bool
            Whether the heart is a left ventricle that is seen whole.
        """
        return (
            min(lod, OPTIMIZED_PASSES_OF_ONE if whole_lv else OPTIMIZED_PASSES)
            if self.optimize
            else lod
        )


def chosen(options: Options | None, choices: Mapping[str, Any]) -> Options:
    """Options with single ones replaced.

    Parameters
    ----------
    options : Options or None
        None for the defaults.
    choices : mapping of str to value
        By name.

    Returns
    -------
    Options

    Raises
    ------
    InputError
        If there is no such option, or a value is not one.

    Examples
    --------
    >>> chosen(None, {"lod": 3}).lod
    3
    >>> chosen(None, {"optimizer": False})
    Traceback (most recent call last):
    heartgen.errors.InputError: there is no option 'optimizer': did you mean 'optimize'?
    """
    if options is not None and not isinstance(options, Options):
        raise InputError(
            f"options of type {type(options).__name__} are none: give heartgen.Options(...), or "
            "single options by name, such as lod=3"
        )
    wanted, known = new_options(choices), [each.name for each in fields(Options)]
    for name in wanted:
        if name not in known:
            close = get_close_matches(name, known, 1)
            told = f"did you mean {close[0]!r}?" if close else f"choose among {', '.join(known)}"
            raise InputError(f"there is no option {name!r}: {told}")
    return replace(options or Options(), **wanted)


def usual_elements(both: bool) -> tuple[int, int, int]:
    """Elements (radial, circumferential, longitudinal) of a left ventricle, or of both.

    Parameters
    ----------
    both : bool
        Both ventricles.
    """
    return BIV_ELEMENTS if both else LV_ELEMENTS


def elements_from_text(text: str) -> tuple[int, int, int]:
    """Numbers of elements from a text such as ``1x12x6``; raises InputError for any other.

    Parameters
    ----------
    text : str
        What the user wrote.
    """
    found = re.fullmatch(r"(\d{1,4})[x×](\d{1,4})[x×](\d{1,4})", text.strip().lower())
    if found is None:
        raise InputError(
            f"elements {text!r} are not three numbers: give radial, circumferential and "
            "longitudinal, for example 1x12x6"
        )
    radial, circumferential, longitudinal = map(int, found.groups())
    return radial, circumferential, longitudinal


def direction_from_text(text: str) -> tuple[float, float, float]:
    """A direction from a text such as ``-1,-1,0`` or ``-1/-1/0``; raises InputError otherwise.

    Parameters
    ----------
    text : str
        What the user wrote.
    """
    try:
        x, y, z = map(float, re.split("[,/]", text))
    except ValueError:
        raise InputError(
            f"direction {text!r} is not three numbers: give x, y and z in the world (LPS), for "
            "example -1,-1,0"
        ) from None
    return x, y, z
