"""What heartgen takes where nothing is asked for, and the steps that it does."""

from __future__ import annotations

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

HOLE_SHARE = 0.25
"""Radius of an apical hole over that of the cavity, if it is not given."""

OPTIMIZED_PASSES, OPTIMIZED_PASSES_OF_ONE = 2, 3
"""Registration passes before an optimization, which leaves nothing for finer ones to find; and of a
left ventricle alone, whose registration is so close that an optimization could lose against it."""


def usual_elements(both: bool) -> tuple[int, int, int]:
    """Elements (radial, circumferential, longitudinal) of a left ventricle, or of both.

    Parameters
    ----------
    both : bool
        Both ventricles.
    """
    return BIV_ELEMENTS if both else LV_ELEMENTS
