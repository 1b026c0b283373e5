"""How long a run will take: from times of known runs, corrected by what this machine just did."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod

from heartgen.options import STEPS, Options, usual_elements

REGISTRATION = {"lv": (0.2, 0.8, 3.0, 7.0, 23.0), "biv": (0.3, 3.0, 6.0, 12.0, 33.0)}
"""Seconds of the registration up to each level of detail."""

OTHERS = {
    "lv": {"shape analysis": 2.8, "template": 0.7, "warping": 0.1, "enhancement": 0.0},
    "biv": {"shape analysis": 5.5, "template": 1.9, "warping": 1.5, "enhancement": 0.0},
}
"""Seconds of the steps that do not depend on the level. Both tables: samples "lifelike" and "biv",
of 1 mm voxels and usual numbers of elements, two cores of a small virtual machine."""

PER_ELEMENT = {
    "optimization": {"lv": 0.05, "biv": 0.028},
    "assessment": {"lv": 0.006, "biv": 0.003},
}
"""Seconds of an element in the steps that grow with their number."""


@dataclass
class Costs:
    """Expected seconds of every step; `learn` from each run.

    Attributes
    ----------
    slowness : float
        Time of this machine over that of the tables.
    """

    slowness: float = 1.0

    def expect(
        self, options: Options, both: bool, levels: tuple[int, ...], analyzed: bool
    ) -> dict[str, float]:
        """Seconds of every step.

        Parameters
        ----------
        options : Options
            Of the run.
        both : bool
            Both ventricles.
        levels : tuple of int
            Levels of detail that are fitted together.
        analyzed : bool
            The shape analysis is there already.

        Returns
        -------
        dict of str to float
            By step, in order.
        """
        kind = "biv" if both else "lv"
        n = n_elements(options, both)
        seconds = {
            **OTHERS[kind],
            "registration": REGISTRATION[kind][options.passes(max(levels), not both) - 1],
            **{step: cost[kind] * n for step, cost in PER_ELEMENT.items()},
        }
        if analyzed:
            seconds["shape analysis"] = 0.0
        if not options.optimize:
            seconds["optimization"] = 0.0
        each = {"warping", "enhancement", "optimization", "assessment"}
        return {
            step: self.slowness * seconds[step] * (len(levels) if step in each else 1)
            for step in STEPS
        }

    def learn(self, expected: Mapping[str, float], seconds: float) -> None:
        """Correct the slowness by a run that took so many seconds.

        Parameters
        ----------
        expected : mapping of str to float
            Seconds of each step that the run had.
        seconds : float
            What it took in all.
        """
        total = sum(expected.values())
        if total > 0 and seconds > 0:
            self.slowness *= (seconds / total) ** 0.5  # half way: one run may be an exception


def n_elements(options: Options, both: bool) -> int:
    """Elements a mesh will have.

    Parameters
    ----------
    options : Options
        Of the run.
    both : bool
        Both ventricles.
    """
    return prod(options.elements or usual_elements(both))
