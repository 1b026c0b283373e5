"""Pictures of lessons for the page that leads to them, from figures of the lessons themselves.

usage: python -m benchmarks.lesson_pictures [LESSON ...]

Each lesson of `FIGURES` is run until it has drawn the figure, which is kept, large and sharp, as
``heartgen/widgets/pictures/LESSON.jpg``. (Those of other lessons are scenes, taken by hand.)
"""

from __future__ import annotations

import io
import sys
from base64 import b64decode
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image

HOME = Path(__file__).parents[1]

FIGURES = {
    "06_warping": 0,
    "07_quality": 2,
    "08_tradeoff": 1,
    "09_sparse_data": 1,
    "10_cohort": 0,
    "12_your_own_data": 0,
}
"""Which figure of a lesson, counted from 0 among those that are no scenes."""

SIZE, MARGIN = (640, 400), 16
"""Of a picture, pixels."""

SHARP = "%config InlineBackend.print_figure_kwargs = {'dpi': 200, 'bbox_inches': 'tight'}"


def main() -> None:
    """Make the pictures."""
    for name in sys.argv[1:] or FIGURES:
        framed(figure(name, FIGURES[name])).save(
            HOME / "heartgen" / "widgets" / "pictures" / f"{name}.jpg", quality=88
        )
        print(name, flush=True)


def figure(name: str, which: int) -> Image.Image:
    """Run a lesson until it has drawn that figure."""
    lesson = nbformat.read(HOME / "notebooks" / f"{name}.ipynb", 4)
    lesson.cells.insert(0, nbformat.v4.new_code_cell(SHARP))
    client = NotebookClient(lesson, timeout=600)
    with client.setup_kernel():
        for index, cell in enumerate(lesson.cells):
            for output in client.execute_cell(cell, index).get("outputs", []):
                drawn = output.get("data", {}).get("image/png")
                if drawn is None:
                    continue
                if which == 0:
                    return Image.open(io.BytesIO(b64decode(drawn))).convert("RGB")
                which -= 1
    sys.exit(f"{name} has too few figures: correct FIGURES")


def framed(drawn: Image.Image) -> Image.Image:
    """The figure in the middle of a white picture."""
    drawn.thumbnail((SIZE[0] - 2 * MARGIN, SIZE[1] - 2 * MARGIN), Image.Resampling.LANCZOS)
    picture = Image.new("RGB", SIZE, "white")
    picture.paste(drawn, ((SIZE[0] - drawn.width) // 2, (SIZE[1] - drawn.height) // 2))
    return picture


if __name__ == "__main__":
    main()
