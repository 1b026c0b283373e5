"""Step 1, in the middle: three slices to move through, and what the checks found."""

from __future__ import annotations

import html
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import ipywidgets as widgets
import numpy as np

from heartgen.errors import InputError, sentence
from heartgen.widgets.hints import explained
from heartgen.widgets.panels.slice_texts import blank, findings_html, key_html
from heartgen.widgets.parts import button, choose, classed, picture, text
from heartgen.widgets.session import MAX_UPLOAD, Session
from heartgen.widgets.slice_picture import SlicePicture, packed
from heartgen.widgets.transfer import Upload

DPI = 100
"""Of a slice: 360 pixels across."""

STEPS = 60
"""Places a slider stops at."""

BROKEN = ("first", "second", "third")
"""Names of an image's axes, where no heart is known."""

OFF, LAST = "", "optimized"

MESHES = (
    ("Its optimized stage", "optimized"),
    ("Enhanced", "enhanced"),
    ("Warped", "warped"),
    ("Registered", "registered"),
    ("Template", "template"),
    ("Hidden", OFF),
)
"""Stages as in `heartgen.viewing.stages`, which waits for VTK; a test compares."""


class SlicesPanel:
    """Slices along the axes of the heart, or of the image as long as no heart is known.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._view: Any = None
        self._fit: Any = None
        self._behind: Any = None
        self._wanted: tuple[Any, str] | None = None
        self._drawn: list[Any] = [None, None, None]
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen-slices")
        self.images = [SlicePicture(picture=blank()) for _ in range(3)]
        self.titles = [text("", "hg-slice-title") for _ in range(3)]
        self.sliders = [
            explained(
                widgets.FloatSlider(
                    description="At (mm)",
                    continuous_update=False,
                    readout_format=".0f",
                    disabled=True,
                ),
                "Move the slice through the heart, mm",
            )
            for i in range(3)
        ]
        for i, (image, slider) in enumerate(zip(self.images, self.sliders, strict=True)):
            slider.observe(self._moved, "value")
            image.observe(partial(self._clicked, i), "pointed")
        columns = [
            classed(widgets.VBox([title, image, slider]), "hg-slice")
            for title, image, slider in zip(self.titles, self.images, self.sliders, strict=True)
        ]
        self.mesh = choose(MESHES, "optimized", "Mesh", "Draw the walls of the mesh in the slices")
        self.upload = Upload(
            lambda: session.folder / "behind",
            MAX_UPLOAD,
            self._take_image,
            self._refused,
            title="Image behind the mesh",
            name="Upload an image to lie behind the mesh",
            zone="hg-zone",
        )
        self.clear = button(
            "Remove the image", "Show the mask again", self._drop_image, "hg-small-wide"
        )
        self.clear.layout.display = "none"
        self.said = text("", "hg-note")
        more = [self.mesh, classed(self.upload, "hg-behind"), self.clear, self.said]
        self.title = text("", "hg-title")
        self.key = text("", "hg-key")
        self.findings = text("", "hg-findings")
        self.widget = classed(
            widgets.VBox(
                [
                    self.title,
                    classed(widgets.HBox(columns), "hg-slices"),
                    self.key,
                    classed(widgets.HBox(more), "hg-controls"),
                    self.findings,
                ]
            ),
            "hg-panel",
        )
        session.observe(self._draw, ["case", "anatomy", "complaint"])
        session.observe(self._fit_anew, ["shown"])
        session.observe(self._follow, ["cursor"])
        self.mesh.observe(self._fit_anew, "value")
        self._draw()

    def _draw(self, _: Any = None) -> None:
        """Show another mask, or what is now known of it."""
        case = self.session.case
        self.findings.value = findings_html(self.session)
        name = "The mask" if case is None else html.escape(case.name)
        self.title.value = f"<h2>{name} in three slices</h2>"
        self._view = None  # the sliders say nothing while they are set
        if case is None:
            for image in self.images:
                image.picture = blank()
            return
        from heartgen.viewing.slice_views import SLICES, extent_of, slice_view

        view = slice_view(case.mask, self.session.anatomy)
        for i, slice_ in enumerate(SLICES):
            across = 3 - slice_.across - slice_.up
            low, high = float(view.low[across]), float(view.high[across])
            slider = self.sliders[i]
            slider.min, slider.max = min(low, slider.min), max(high, slider.max)
            slider.value = float(view.center[across])
            slider.min, slider.max = low, high
            slider.step = (high - low) / STEPS
            slider.disabled = False
            self.images[i].extent = list(extent_of(view, slice_))
        self._view = view
        self._show()
        self._fit_anew()

    def _fit_anew(self, _: Any = None) -> None:
        """Have the mesh prepared to be cut, in the thread."""
        shown, stage = self.session.shown, self.mesh.value
        self.mesh.disabled = shown is None
        if shown is not None and stage != OFF and not shown.result.has_stages:
            stage = LAST
        self._fit, self._wanted = None, None
        if shown is None or stage == OFF or self.session.anatomy is None:
            self._show(anew=True)
            return
        self._wanted = shown, stage
        self._pool.submit(self._make_fit, shown, stage)

    def _make_fit(self, shown: Any, stage: str) -> None:
        """In the thread."""
        from heartgen.viewing.slice_fit import SliceFit

        fit = SliceFit(shown.result, stage)
        self.session.post(lambda: self._take_fit(fit, shown, stage))

    def _take_fit(self, fit: Any, shown: Any, stage: str) -> None:
        if self._wanted == (shown, stage):
            self._fit = fit
            self._show(anew=True)

    def _take_image(self, path: Path) -> None:
        """Read an image that is to lie behind the mesh, in the thread."""
        self.said.value = f"reading {html.escape(path.name)} …"
        self._pool.submit(self._read_image, path)

    def _read_image(self, path: Path) -> None:
        try:
            image, said = gray_image(path), ""
        except Exception as error:
            image, said = None, sentence(error)
        self.session.post(lambda: self._put_image(image, said))

    def _put_image(self, image: Any, said: str) -> None:
        self._refused(said)
        if image is not None:
            self._behind = image
        self.clear.layout.display = "none" if self._behind is None else ""
        self._show(anew=True)

    def _drop_image(self) -> None:
        self._behind = None
        self._put_image(None, "")

    def _refused(self, said: str) -> None:
        self.said.value = html.escape(said)

    def _clicked(self, i: int, change: Any) -> None:
        """Move the other slices to where one was clicked."""
        if self._view is None or not change["new"]:
            return
        from heartgen.viewing.slice_views import SLICES

        place = self._place()
        place[[SLICES[i].across, SLICES[i].up]] = change["new"]
        self._point(place)

    def _moved(self, _: Any) -> None:
        """A slider was moved: all that is linked follows."""
        if self._view is not None:
            self._point(self._place())

    def _place(self) -> Any:
        """Where the slices cross, (3,) mm, frame of the view."""
        from heartgen.viewing.slice_views import SLICES

        place = self._view.center.copy()
        for slice_, slider in zip(SLICES, self.sliders, strict=True):
            place[3 - slice_.across - slice_.up] = slider.value
        return place

    def _point(self, place: Any) -> None:
        frame = self._view.frame
        self.session.cursor = tuple((frame[:3, :3] @ place + frame[:3, 3]).tolist())

    def _follow(self, _: Any) -> None:
        """Have the slices cross where a point was clicked, here or in the 3-D view."""
        view, cursor = self._view, self.session.cursor
        if view is None or cursor is None:
            return
        from heartgen.viewing.slice_views import SLICES

        place = (np.array(cursor) - view.frame[:3, 3]) @ view.frame[:3, :3]
        self._view = None
        for slice_, slider in zip(SLICES, self.sliders, strict=True):
            slider.value = float(place[3 - slice_.across - slice_.up])
        self._view = view
        self._show()

    def _show(self, anew: bool = False) -> None:
        """Draw the slices that have moved, or all, and where they cross."""
        if self._view is None:
            return
        from heartgen.viewing.slice_views import SLICES

        place = self._place()
        for i, slice_ in enumerate(SLICES):
            position = float(place[3 - slice_.across - slice_.up])
            drawn = (self._view, position)
            if anew or self._drawn[i] != drawn:
                self._drawn[i] = drawn
                self._draw_slice(i, position)
            self.images[i].cross = [float(place[slice_.across]), float(place[slice_.up])]
        self.key.value = key_html(self.session, self._fit is not None, self._behind is not None)

    def _draw_slice(self, i: int, position: float) -> None:
        """Draw a slice anew."""
        from heartgen.viewing.slice_views import SLICES, draw_slice

        slice_, image = SLICES[i], self.images[i]
        fit = None if self._fit is None else self._fit.section(self._view, slice_, position)
        across = 3 - slice_.across - slice_.up
        name = (
            slice_.title.replace(", at the thin line", "").capitalize()
            if self.session.anatomy is not None
            else f"Across the {BROKEN[across]} axis of the image"
        )
        self.titles[i].value = f"{name} · {'xyz'[across]} = {round(position)} mm"
        figure = draw_slice(self._view, slice_, position, fit, self._behind)
        with image.hold_sync():
            image.picture = picture(figure, DPI)
            image.about = f"{name} at {round(position)} mm"
            image.triangles = b"" if fit is None else packed(fit.triangles)
            image.element = b"" if fit is None else packed(fit.element, np.uint32)
            image.outline = b"" if fit is None else packed(fit.outline)
            image.error = b"" if fit is None else packed(fit.error)


def gray_image(path: Path) -> Any:
    """Read an image to be shown behind a mesh.

    Parameters
    ----------
    path : Path
        Of one frame.

    Returns
    -------
    Volume

    Raises
    ------
    InputError
        If it is none.
    """
    from heartgen.images.opening import open_image
    from heartgen.images.volume import Volume

    held = open_image(path)
    values = np.squeeze(held.values) if isinstance(held, Volume) else np.empty(0)
    if not isinstance(held, Volume) or values.ndim != 3:
        raise InputError(f"{path.name}: This is no image of one frame: give a gray image in 3-D.")
    return Volume(values, held.affine)
