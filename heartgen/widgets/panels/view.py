"""Step 4: the heart in 3-D, through the stages of the pipeline, colored and cut as one likes."""

from __future__ import annotations

from typing import Any

import ipywidgets as widgets

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
)
LINES = (("Element edges", "edges"), ("Fibers", "fibers"), ("None", "off"))
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
        self.place = ViewPlace(self._draw, session.post)
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
        self.position = row(
            "At",
            widgets.FloatSlider(
                0.5, min=0.02, max=0.98, step=0.02, continuous_update=False, readout=False
            ),
            "Place of the cut",
        )
        self.lines = choose(LINES, "edges", "Lines", "Edges of the elements, or rule-based fibers")
        self.key = text("", "hg-scale")
        controls = [self.color, self.limit, self.mask, self.lines, self.cut, self.position]
        for control in (self.stage, *controls):
            control.observe(self._draw, "value")
        session.observe(self._draw, ["anatomy", "shown"])
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
        self.limit.disabled = not there or self.color.value != "error"
        self.position.disabled = not there or self.cut.value == "off"

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
        }

    def _failed(self, sentence: str) -> None:
        self.key.value = sentence

    def _show(self, scene: Any) -> None:
        """Hand a scene to the view."""
        session = self.session
        case = session.case
        self.place.view.show(scene, reset=case is not self._case)
        self._case = case
        slices = session.anatomy.slices
        moved = slices is not None and bool(slices.shifts.any()) and self.mask.value == "slices"
        self.key.value = key_html(scene.painted, self.mask.value != "off", moved)


def _scene(shown: Any, anatomy: Any, wanted: dict[str, Any]) -> Any:
    """The scene that is asked for: of a mesh, or of the mask alone."""
    from heartgen.widgets.mesh_scene import SceneView, mask_scene, mesh_scene

    return mask_scene(anatomy) if shown is None else mesh_scene(shown, SceneView(**wanted))


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
