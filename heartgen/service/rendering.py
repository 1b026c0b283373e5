"""Makes one rendition of a result and ends; `heartgen.service.renditions` starts it.

usage: python -m heartgen.service.rendering RESULT NAME FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

from heartgen.errors import HeartgenError
from heartgen.report import REPORT
from heartgen.result import Personalization

DPI = 120
"""Of a picture of slices, dots per inch."""


def main(result: Path, name: str, folder: Path) -> None:
    """Make the file, or files.

    Parameters
    ----------
    result : Path
        Folder of a result.
    name : str
        Of the rendition.
    folder : Path
        Where it is written.
    """
    loaded = Personalization.load(result)
    if name == "preview":
        _draw(loaded, folder / "preview.png")
    elif name == "view":
        from heartgen.viewing import view_html

        view_html(loaded, folder / "view.html")
    else:
        loaded.write(folder, name)
        (folder / REPORT).unlink()


def _draw(result: Personalization, path: Path) -> None:
    """The mesh in 3-D, or slices of the mask where nothing can draw that."""
    from heartgen.viewing import draw_slices, plot

    try:
        plot(result, screenshot=path).close()
    except HeartgenError:
        draw_slices(result.mask, result.anatomy).savefig(path, dpi=DPI)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
