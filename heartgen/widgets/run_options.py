"""What the user chooses before a run, as traits that know no widget."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

from traitlets import Bool, CFloat, Enum, HasTraits, Int, Unicode

from heartgen.options import Options


@dataclass(frozen=True)
class Alternative:
    """One of several kinds to choose from: of topology, or of basis.

    Attributes
    ----------
    key : str
        As `Options` takes it.
    title, explanation : str
        Its name for users, and a sentence about it.
    """

    key: str
    title: str
    explanation: str


TOPOLOGIES = (
    Alternative("collapsed", "Collapsed apex", "The elements of the lowest row end in the pole."),
    Alternative("hole", "Apical hole", "The mesh ends at a hole, a quarter as wide as the cavity."),
    Alternative(
        "patch",
        "Square patch",
        "A square of elements closes the apex; a multiple of 4 elements must lie around.",
    ),
)

BASES = (
    Alternative(
        "hermite", "Cubic Hermite", "smooth across elements; positions and derivatives at nodes."
    ),
    Alternative(
        "lagrange",
        "Cubic Lagrange",
        "positions at Lagrange nodes; the same shape.",
    ),
)

INSERTIONS = (
    Alternative("rounded", "Rounded", "Follows the anatomy around the right apex."),
    Alternative("squared", "Squared", "Stays square, as in the paper."),
)

TRANSMURAL_LINES = (
    Alternative("straight", "Straight", "Straight across the wall, as in the paper."),
    Alternative("curved", "Curved", "Curved for better elements; the surfaces stay."),
)

VENTRICLES = {
    "auto": "Automatic",
    "lv": "Left ventricle",
    "biv": "Both ventricles",
}

TRUNCATIONS = {"auto": "Where valves rise", "off": "Never", "distance": "By a distance"}

LEVELS = {
    1: "most stable",
    2: "",
    3: "a good balance",
    4: "",
    5: "most accurate",
}

MOST_ELEMENTS = (6, 48, 36)
"""Elements (radial, circumferential, longitudinal) that the page offers at most: three times the
usual ones, which is minutes of work."""


class RunOptions(HasTraits):
    """Options of the next run; `options` turns them into those of heartgen.

    Attributes
    ----------
    lod : int
        Level of detail, 1 to 5.
    ventricles : {"auto", "lv", "biv"}
    default_elements : bool
        Leave the numbers of elements to heartgen.
    radial, circumferential, longitudinal : int
        Elements, if not.
    truncation : {"auto", "off", "distance"}
    distance : float
        Below the basal plane, mm, if truncation is by a distance.
    quality : float
        Weight of quality against accuracy.
    enhance, optimize : bool
    topology, insertion, transmural_lines, basis : str
    """

    lod = Int(1, min=1, max=5)
    ventricles = Enum(list(VENTRICLES), "auto")
    default_elements = Bool(True)
    radial = Int(1, min=1, max=MOST_ELEMENTS[0])
    circumferential = Int(12, min=3, max=MOST_ELEMENTS[1])
    longitudinal = Int(6, min=1, max=MOST_ELEMENTS[2])
    truncation = Enum(list(TRUNCATIONS), "auto")
    distance = CFloat(5.0, min=0.0, max=40.0)
    quality = CFloat(1.0, min=0.1, max=10.0)
    enhance = Bool(True)
    optimize = Bool(True)
    topology = Unicode(TOPOLOGIES[0].key)
    insertion = Unicode(INSERTIONS[0].key)
    transmural_lines = Unicode(TRANSMURAL_LINES[0].key)
    basis = Unicode(BASES[0].key)

    def options(self) -> Options:
        """Options for heartgen; raises InputError where they contradict each other."""
        elements = (int(self.radial), int(self.circumferential), int(self.longitudinal))
        truncate = self.distance if self.truncation == "distance" else self.truncation
        return Options(
            lod=int(self.lod),
            elements=None if self.default_elements else elements,
            ventricles=cast("Any", self.ventricles),
            optimize=bool(self.optimize),
            quality=float(self.quality),
            truncate=cast("Any", truncate),
            enhance=bool(self.enhance),
            apex=cast("Any", self.topology),
            insertion=cast("Any", self.insertion),
            transmural_lines=cast(
                "Any", self.transmural_lines if self.optimize else TRANSMURAL_LINES[0].key
            ),
            basis=cast("Any", self.basis),
        )


def changed_options(options: Options) -> dict[str, Any]:
    """Those options that are not heartgen's defaults, the level of detail always among them.

    Parameters
    ----------
    options : Options
        Of a run.
    """
    defaults = Options()
    names = [name for name in vars(options) if getattr(options, name) != getattr(defaults, name)]
    return {
        name: getattr(options, name) for name in vars(options) if name == "lod" or name in names
    }
