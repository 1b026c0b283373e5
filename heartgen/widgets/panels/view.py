"""Step 4: the heart in 3-D, through the stages of the pipeline, colored and cut as one likes."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import ipywidgets as widgets
import numpy as np

from heartgen.widgets.parts import choose, classed, head, row, text
from heartgen.widgets.session import Session
from heartgen.widgets.view_place import ViewPlace

LIMITS = (("automatic", 0.0), ("0.5 mm", 0.5), ("1 mm", 1.0), ("2 mm", 2.0), ("5 mm", 5.0))

STAGES = (
    ("Template", "template"),
    ("Registered", "registered"),
    ("Warped", "warped"),
    ("Enhanced", "enhanced"),
    ("Optimized", "optimized"),
)
"""As in `heartgen.widgets.mesh_scene`, which waits for VTK; a test compares. So are the next."""

NO_STAGES = "This mesh was made elsewhere, and what it was on its way did not come with it"
"""Why the stages of a result that was loaded cannot be shown."""

COLORS = (
    ("Error", "error"),
    ("Quality Q", "quality"),
    ("Surface", "region"),
    ("AHA segment", "segment"),
    ("Transmural", "transmural"),
    ("Longitudinal", "longitudinal"),
    ("Wall thickness", "thickness"),
    ("Difference", "difference"),
)
LINES = (
    ("Element edges", "edges"),
    ("Fibers", "fibers"),
    ("Fibers at a depth", "depth"),
    ("None", "off"),
)
MASKS = (
    ("Where it differs", "misfit"),
    ("All of it", "whole"),
    ("Its slices", "slices"),
    ("Hidden", "off"),
)
CUTS = (
    ("No cut", "off"),
    ("Long axis, 1", "x"),
    ("Long axis, 2", "y"),
    ("Short axis", "z"),
    ("Free plane", "free"),
)


class ViewPanel:
    """Controls of the 3-D view, and its key.

    Parameters
    ----------
    session : Session
        The visitor's work.
    titled : bool
        Whether the panel has a head.
    """

    def __init__(self, session: Session, titled: bool = True) -> None:
        self.session = session
        self.place = ViewPlace(self._draw, session.post, self._told, self._pointed)
        self._case: Any = None
        self.stage = row(
            "Stage",
            widgets.ToggleButtons(options=STAGES, value="optimized"),
            "The mesh on its way: template, registered, warped, enhanced, optimized",
        )
        self.color = choose(COLORS, "error", "Color by", "What the colors of the mesh show")
        self.limit = choose(
            LIMITS, 0.0, "Scale ends at", "Distance at the end of the error's color scale"
        )
        self.mask = choose(
            _masks(False),
            "misfit",
            "Mask",
            "The mask's surface, translucent, or of a stack the contours in its slices",
        )
        self.cut = choose(CUTS, "off", "Cut", "Cut the heart open along one of its axes")
        self.position = _slider("Cut at", 0.5, (0.02, 0.98), 0.02, "Place of the cut")
        self.turn = _slider("Turn", 0, (-180, 180), 5, "Turn the free plane around the long axis")
        self.tilt = _slider("Tilt", 0, (-90, 90), 5, "Tilt the free plane towards the base")
        self.lines = choose(LINES, "edges", "Lines", "Edges of the elements, or rule-based fibers")
        self.depth = _slider("Depth", 0.5, (0, 1), 0.05, "From the endocardium to the epicardium")
        self.key = text("", "hg-scale")
        controls = [self.color, self.limit, self.mask, self.lines, self.depth]
        controls += [self.cut, self.position, self.turn, self.tilt]
        for control in (self.stage, *controls):
            control.observe(self._draw, "value")
        session.observe(self._draw, ["anatomy", "shown", "against"])
        session.observe(self._prepare, ["outcomes"])
        session.observe(self._mark, ["cursor"])
        self.widget = classed(
            widgets.VBox(
                [
                    *([head(session, "view")] if titled else []),
                    classed(self.stage, "hg-stages"),
                    self.place.widget,
                    self.key,
                    classed(widgets.HBox(controls), "hg-controls"),
                ]
            ),
            "hg-panel hg-look",
        )
        self._controls = [self.stage, *controls]
        self._enable()

    def open(self) -> None:
        """Have the 3-D view started."""
        self.place.open()

    def _enable(self) -> None:
        """Only what is of use can be changed."""
        there = self.session.shown is not None
        for control in self._controls:
            control.disabled = not there
        way = there and self.session.shown.result.has_stages
        self.stage.disabled = not way
        self.stage.tooltips = [
            NO_STAGES if there and not way else f"Show the mesh: {title.lower()}"
            for title, _ in STAGES
        ]
        self.color.disabled = not there or self.lines.value == "depth"
        self.limit.disabled = self.color.disabled or self.color.value != "error"
        for control, of_use in (
            (self.position, self.cut.value != "off"),
            (self.turn, self.cut.value == "free"),
            (self.tilt, self.cut.value == "free"),
            (self.depth, self.lines.value == "depth"),
        ):
            control.layout.display = "" if of_use else "none"

    def _draw(self, _: Any = None) -> None:
        """Have the scene made in the thread, then show it."""
        self._enable()
        session = self.session
        if session.anatomy is not None:
            self._offer(_masks(session.anatomy.slices is not None))
        if self.place.view is None or session.anatomy is None:
            return
        shown, anatomy, wanted = session.shown, session.anatomy, self._wanted()
        self.place.make(lambda: _scene(shown, anatomy, wanted), self._show, self._failed)

    def _prepare(self, change: Any) -> None:
        """Have ready what the scenes of further levels need: they are shown as they are chosen."""
        if self.place.view is None:
            return
        for outcome in change["new"]:
            if outcome not in change["old"] and outcome is not self.session.shown:
                self.place.prepare(partial(_ready, outcome))

    def _offer(self, masks: tuple[tuple[str, str], ...]) -> None:
        """Ways to show the mask that suit the case; of a stack, its contours at first."""
        if tuple(self.mask.options) == masks:
            return
        keys = [key for _, key in masks]
        chosen = self.mask.value if self.mask.value in keys else "misfit"
        self.mask.options = masks
        self.mask.value = "slices" if "slices" in keys else chosen

    def _wanted(self) -> dict[str, Any]:
        """What the controls ask for."""
        return {
            "stage": "optimized" if self.stage.disabled else self.stage.value,
            "color": self.color.value,
            "mask": self.mask.value,
            "lines": self.lines.value,
            "cut": self.cut.value,
            "position": self.position.value,
            "limit": self.limit.value or None,
            "normal": _normal(self.turn.value, self.tilt.value),
            "depth": self.depth.value,
            "against": self.session.against,
        }

    def _told(self, message: dict[str, Any]) -> None:
        """A button of the view was pressed."""
        session, shown = self.session, self.session.shown
        if shown is None:
            return
        if message["kind"] == "play":
            self.place.make(lambda: _moving(shown), self.place.view.move, self._failed)
        elif message["kind"] == "facing":
            self._cut_facing(message["direction"])
        session.post(self._enable)

    def _cut_facing(self, direction: list[float]) -> None:
        """Cut across a direction, (3,), heart frame."""
        x, y, z = direction
        for control in (self.turn, self.tilt, self.cut):
            control.unobserve(self._draw, "value")
        self.turn.value = math.degrees(math.atan2(y, x))
        self.tilt.value = math.degrees(math.asin(max(-1.0, min(1.0, z))))
        self.cut.value = "free"
        for control in (self.turn, self.tilt, self.cut):
            control.observe(self._draw, "value")
        self._draw()

    def _pointed(self, point: Any) -> None:
        self.session.cursor = tuple(point.tolist())

    def _mark(self, _: Any = None) -> None:
        """Mark the point that was clicked in a slice."""
        if self.place.view is not None:
            cursor = self.session.cursor
            self.place.view.mark(None if cursor is None else np.array(cursor))

    def _failed(self, sentence: str) -> None:
        self.key.value = sentence

    def _show(self, scene: Any) -> None:
        """Hand a scene to the view, unless another heart is being measured by now."""
        session = self.session
        if session.anatomy is None:
            return
        case = session.case
        meshed, shown = scene.probe is not None, session.shown
        whole = self.cut.value == "off" and shown is not None and shown.result.has_stages
        self.place.view.show(
            scene,
            reset=case is not self._case,
            can_play=meshed and whole,
            can_cut=meshed,
        )
        self._mark()
        self._case = case
        slices = session.anatomy.slices
        moved = slices is not None and bool(slices.shifts.any()) and self.mask.value == "slices"
        self.key.value = key_html(scene.painted, self.mask.value != "off", moved)
        if self.color.value == "segment":
            from heartgen.viewing.bullseye_svg import segment_key

            self.key.value = segment_key() + self.key.value


def _scene(shown: Any, anatomy: Any, wanted: dict[str, Any]) -> Any:
    """The scene that is asked for: of a mesh, or of the mask alone."""
    from heartgen.widgets.mesh_scene import SceneView, mask_scene, mesh_scene

    return mask_scene(anatomy) if shown is None else mesh_scene(shown, SceneView(**wanted))


def _ready(outcome: Any) -> None:
    """Have ready what takes long of a scene."""
    from heartgen.widgets.mesh_scene import prepare

    prepare(outcome)


def _moving(shown: Any) -> Any:
    """The mesh in each of its stages."""
    from heartgen.widgets.mesh_scene import stages_moving

    return stages_moving(shown)


def _normal(turn: float, tilt: float) -> tuple[float, float, float]:
    """Unit vector by its angles around the long axis and towards the base, degrees."""
    around, above = math.radians(turn), math.radians(tilt)
    level = math.cos(above)
    return level * math.cos(around), level * math.sin(around), math.sin(above)


def _slider(label: str, value: float, ends: tuple[float, float], step: float, tooltip: str) -> Any:
    """A slider that is heard when it is let go."""
    low, high = ends
    made = widgets.FloatSlider(
        value, min=low, max=high, step=step, continuous_update=False, readout=False
    )
    return row(label, made, tooltip)


def _masks(stack: bool) -> tuple[tuple[str, str], ...]:
    """Ways to show the mask: contours are those of a stack."""
    return tuple((title, key) for title, key in MASKS if stack or key != "slices")


def key_html(painted: Any, mask: bool, moved: bool = False) -> str:
    """The key of the colors.

    Parameters
    ----------
    painted : Painted
        Colors of the surface.
    mask : bool
        Whether the mask is shown.
    moved : bool
        Whether slices are shown that were aligned, so that they were given elsewhere.
    """
    marks = '<span class="hg-class"><i class="hg-mask-mark"></i>mask</span>' if mask else ""
    if moved:
        marks += '<span class="hg-class"><i class="hg-given-mark"></i>slices as given</span>'
    if painted is None:
        return marks
    if painted.scale is not None:
        low, high = painted.scale.limits
        more = " or more" if painted.more else ""
        key = (
            f'<div class="hg-bar"><span>{painted.title}</span>'
            f'<i style="background:linear-gradient(to right,{",".join(painted.stops)})"></i>'
            f"<span><b>{low:g}</b><b>{(low + high) / 2:g}</b><b>{high:g}{more}</b></span></div>"
        )
    else:
        key = f"<span>{painted.title}</span>" + "".join(
            f'<span class="hg-class"><i style="background:{color}"></i>{name}</span>'
            for color, name in painted.names
        )
    return key + marks
