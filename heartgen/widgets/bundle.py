"""All that a visitor takes away: meshes, report, pictures, manifest and script, in one zip."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from heartgen.errors import HeartgenError
from heartgen.options import usual_elements
from heartgen.widgets.run_options import changed_options
from heartgen.widgets.runs import Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 200
"""Of the pictures, dots per inch."""

MANIFEST = "manifest.json"


def make_bundle(
    outcome: Outcome,
    formats: Iterable[str],
    *,
    report: bool = True,
    figures: bool = True,
    levels: Iterable[Outcome] = (),
    cells: str | None = None,
) -> tuple[str, bytes]:
    """Put a result into a zip archive.

    Parameters
    ----------
    outcome : Outcome
        The mesh to hand out.
    formats : iterable of str
        Names of mesh formats.
    report : bool
        Add the page with the 3-D view.
    figures : bool
        Add pictures.
    levels : iterable of Outcome
        Other levels of detail of the case, for the picture that compares them.
    cells : {"hex8", "hex20", "hex27", "tet4", "tet10"}, optional
        Cells for the formats of linear or quadratic cells; the usual ones of each if omitted.

    Returns
    -------
    name : str
        Of the archive.
    content : bytes

    Raises
    ------
    HeartgenError
        If the mesh is not valid, or a file cannot be made.
    """
    result = outcome.result
    if not result.report.quality.valid:
        raise HeartgenError("the mesh is not valid, so it is not handed out")
    stem = f"heartgen-{_plain(outcome.case.name)}-lod{outcome.lod}"
    with TemporaryDirectory(prefix="heartgen-") as place:
        folder = Path(place)
        result.write(folder, tuple(formats), cells=cells)
        (folder / "reproduce.py").write_text(reproduce(outcome) + "\n", encoding="utf-8")
        if report:
            from heartgen.viewing import view_html

            view_html(result, folder / "report.html")
        if figures:
            _draw(outcome, list(levels), folder / "figures")
        files = sorted(file for file in folder.rglob("*") if file.is_file())
        names = {file.relative_to(folder).as_posix(): file for file in files}
        about = manifest(outcome, {name: _sha256(file) for name, file in names.items()})
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, file in names.items():
                archive.write(file, f"{stem}/{name}")
            archive.writestr(f"{stem}/{MANIFEST}", json.dumps(about, indent=1) + "\n")
    return f"{stem}.zip", buffer.getvalue()


def reproduce(outcome: Outcome) -> str:
    """The lines of Python that make the same result.

    Parameters
    ----------
    outcome : Outcome
        A mesh that came out of a run.
    """
    options = changed_options(outcome.result.options)
    if outcome.result.options.elements == usual_elements(outcome.result.anatomy.rv is not None):
        options.pop("elements", None)
    chosen = "".join(f", {name}={value!r}" for name, value in options.items())
    return (
        "import heartgen\n\n"
        f"mask = {outcome.case.code}\n"
        f"result = heartgen.personalize(mask{chosen})\n"
        'result.write("out")'
    )


def manifest(outcome: Outcome, files: dict[str, str]) -> dict[str, Any]:
    """What was made of what: options, versions, and the hash of everything.

    Parameters
    ----------
    outcome : Outcome
        The mesh that is handed out.
    files : dict of str to str
        SHA-256 of each file, by its name.
    """
    report = outcome.result.report
    return {
        "input": {"name": outcome.case.name, "sha256": outcome.case.sha256},
        "views": [view.name for view in outcome.case.views],
        "options": asdict(outcome.result.options),
        "versions": report.versions,
        "success": report.success,
        "status": report.status,
        "error_mean_mm": report.accuracy.mean,
        "quality_mean": report.quality.mean,
        "wriggle_median_degrees": {
            "circumferential": report.fairness.circumferential_median,
            "longitudinal": report.fairness.longitudinal_median,
        },
        "files": files,
        "note": "Research use, not for diagnosis.",
    }


def _draw(outcome: Outcome, levels: list[Outcome], folder: Path) -> None:
    """Pictures of mask, quality and levels, and of the mesh where it can be drawn."""
    from heartgen.viewing import draw_slices, plot
    from heartgen.viewing.figures import draw_histograms, draw_tradeoff

    folder.mkdir()
    result = outcome.result
    drawn: dict[str, Figure] = {
        "slices": draw_slices(result.mask, result.anatomy),
        "histograms": draw_histograms(result),
    }
    if len(levels) > 1:
        drawn["levels"] = draw_tradeoff([o.result for o in levels])
    for name, figure in drawn.items():
        figure.savefig(folder / f"{name}.png", dpi=DPI)
    try:
        plot(result, screenshot=folder / "mesh.png").close()
    except HeartgenError:  # no graphics library: the page shows the mesh
        return


def _plain(name: str) -> str:
    """A name for a file: without the image's endings, letters and digits only."""
    for ending in (".gz", ".nii", ".nrrd", ".nhdr", ".mha", ".mhd", ".dcm"):
        name = name.removesuffix(ending)
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in name) or "heart"


def _sha256(file: Path) -> str:
    """Hash of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
