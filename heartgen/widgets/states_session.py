"""The states of one heart that a visitor compares; nothing here knows a widget."""

from __future__ import annotations

import csv
import io
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from traitlets import Any as AnyTrait
from traitlets import Int, List

from heartgen.widgets.input_case import BINARY, load_file, name_unlike
from heartgen.widgets.work_state import WorkState

if TYPE_CHECKING:
    from heartgen.comparison import Comparison
    from heartgen.mesh import HexMesh
    from heartgen.viewing.bullseye import Bullseye

LOD = 2
"""Level of detail at which masks are fitted, unless another is chosen."""

PHASES = ("ED", "ES")
"""Frames of a cine that are its states."""


@dataclass(frozen=True, eq=False)
class HeartState:
    """A heart at one moment.

    Attributes
    ----------
    name : str
        What it is called; unlike that of any other.
    mesh : HexMesh
        mm, world (LPS).
    origin : str
        Where the mesh is from, for the user.
    """

    name: str
    mesh: HexMesh
    origin: str


@dataclass(frozen=True, eq=False)
class Compared:
    """What the states of a moment have in common.

    Attributes
    ----------
    states : tuple of HeartState
        That were compared.
    comparison : Comparison
        Ejection, strains, indices.
    bullseyes : tuple of Bullseye
        Values by segment.
    """

    states: tuple[HeartState, ...]
    comparison: Comparison
    bullseyes: tuple[Bullseye, ...]


class StatesSession(WorkState):
    """One visitor's comparison.

    Attributes
    ----------
    post : callable, optional
        Has a change made where the state lives; at once if omitted.
    states : list of HeartState
        In the order in which they came.
    compared : Compared or None
        None as long as there are less than two.
    lod : int
        Level of detail at which masks are fitted.
    """

    states: List[HeartState] = List()
    compared = AnyTrait(None, allow_none=True)
    lod = Int(LOD, min=1, max=5)

    def load_beat(self, name: str) -> Future[None]:
        """Take a heart of the samples at the end of diastole and of systole.

        Parameters
        ----------
        name : str
            In `heartgen.samples.beats.BEATS`.
        """
        self.clear()
        lod = self.lod

        def make() -> list[HeartState]:
            from heartgen.samples.beats import beat

            masks = [sample.mask for sample in beat(name).values()]
            return [_fitted(mask.name, mask, lod) for mask in masks]

        return self._worker.do("making and meshing a sample heart", make, self._add)

    def add_file(self, path: Path, scheme: str = BINARY, cine: bool = False) -> Future[None]:
        """Add a mesh, or the mesh of a mask, of a label map, or of two frames of a cine.

        Parameters
        ----------
        path : Path
            The file.
        scheme : str
            As of `heartgen.widgets.input_case.load_file`.
        cine : bool
            Take the frames with the largest and the smallest cavity.
        """
        kept, lod = self._worker.keep(path), self.lod

        def make() -> list[HeartState]:
            from heartgen.formats import READERS, read_mesh

            if kept.suffix.lower() in READERS:
                return [HeartState(kept.stem, read_mesh(kept), f"from {kept.name}")]
            cases = [load_file(kept, scheme, frame) for frame in (PHASES if cine else ("",))]
            names = [f"{case.name} {frame}" for case, frame in zip(cases, PHASES, strict=False)]
            return [
                _fitted(name if cine else case.name, case.mask, lod)
                for name, case in zip(names, cases, strict=True)
            ]

        return self._worker.do(f"reading {kept.name}", make, self._add)

    def remove(self, state: HeartState) -> None:
        """Compare without a state.

        Parameters
        ----------
        state : HeartState
            One of the states.
        """
        self.states = [each for each in self.states if each is not state]
        self._compare()

    def clear(self) -> None:
        """Begin anew."""
        with self.hold_trait_notifications():
            self.states = []
            self.compared = None

    def table(self) -> str:
        """Everything that was measured as CSV: a column for each state, and for each change."""
        found: Compared = self.compared
        return csv_text(found)

    def _add(self, states: list[HeartState]) -> None:
        """Take in states, under names of their own."""
        all_states = list(self.states)
        for state in states:
            name = name_unlike(state.name, {each.name for each in all_states})
            all_states.append(HeartState(name, state.mesh, state.origin))
        self.states = all_states
        self._compare()

    def _compare(self) -> None:
        """Have the states compared that there are now."""
        states = tuple(self.states)
        self.compared = None
        if len(states) > 1:
            self._worker.do("comparing", lambda: _compared(states), self._take)

    def _take(self, found: Compared) -> None:
        """Take in a comparison, unless there are other states by now."""
        if found.states == tuple(self.states):
            self.compared = found


def csv_text(found: Compared) -> str:
    """A comparison as CSV.

    Parameters
    ----------
    found : Compared
        States that were compared.
    """
    from heartgen.fields import SEGMENTS
    from heartgen.viewing.states import changes, states

    made = io.StringIO()
    writer = csv.writer(made, lineterminator="\n")
    table = states(found.comparison)
    writer.writerow(["measure", *table.names])
    writer.writerows([name, *values] for name, values in table.rows)
    writer.writerow([])
    for section in changes(found.comparison):
        writer.writerows(section.rows)
    writer.writerow([])
    writer.writerow(["segment", "name", *(shown.title for shown in found.bullseyes)])
    for number, name in SEGMENTS.items():
        values = [shown.values.get(number) for shown in found.bullseyes]
        writer.writerow(
            [
                number,
                name,
                *(
                    "" if v is None else f"{(100 if s.percent else 1) * v:.3g}"
                    for s, v in zip(found.bullseyes, values, strict=True)
                ),
            ]
        )
    return made.getvalue()


def _fitted(name: str, mask: Any, lod: int) -> HeartState:
    """The mesh of a mask."""
    from heartgen.errors import HeartgenError
    from heartgen.pipeline import personalize

    result = personalize(mask, lod=lod)
    if not result.report.quality.valid:
        raise HeartgenError(f"{name}: the mesh is not valid: choose a lower level of detail")
    return HeartState(name, result.mesh, f"fitted at level {lod}")


def _compared(states: tuple[HeartState, ...]) -> Compared:
    """Compare states."""
    from heartgen.comparison import compare
    from heartgen.viewing.bullseye import bullseyes

    meshes = [state.mesh for state in states]
    comparison = compare(meshes, [state.name for state in states])
    return Compared(states, comparison, bullseyes(comparison, meshes))
