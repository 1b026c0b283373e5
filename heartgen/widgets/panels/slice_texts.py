"""What is said of a mask and its slices: sizes, checks, and what the colors mean."""

from __future__ import annotations

import html

from heartgen.widgets.session import Session

ML = 1000.0
"""mm^3 in a milliliter."""


def key_html(session: Session, mesh: bool = False, image: bool = False) -> str:
    """What the colors of the slices mean.

    Parameters
    ----------
    session : Session
        The visitor's work.
    mesh : bool
        Whether a mesh is drawn.
    image : bool
        Whether an image is drawn in place of the mask.
    """
    from heartgen.viewing.fit_lines import FACES, FACES_ON_GRAY, OUTLINE, OUTLINE_ON_GRAY
    from heartgen.viewing.slice_views import BLOOD, MYOCARDIUM, line_colors

    names: list[tuple[str, str]] = [] if image else [(MYOCARDIUM, "mask")]
    if not image and session.case is not None and session.case.mask.blood is not None:
        names += zip(BLOOD, ("left pool", "right pool"), strict=True)
    if mesh:
        outer, inner = (OUTLINE_ON_GRAY, FACES_ON_GRAY) if image else (OUTLINE, FACES)
        names += [(outer, "surface of the mesh"), (inner, "its elements")]
    elif session.anatomy is not None:
        names += [(color, name) for name, color in line_colors(session.anatomy).items()]
    return "".join(f'<span><i style="background:{c}"></i>{name}</span>' for c, name in names)


def findings_html(session: Session) -> str:
    """What is in the mask: its sizes, and what the checks found.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """
    case, anatomy = session.case, session.anatomy
    if session.complaint:
        sentence = "<br>".join(html.escape(line) for line in session.complaint.splitlines())
        return f'<p class="hg-complaint" role="alert">{sentence}</p>'
    if case is None:
        return '<p class="hg-empty">Choose a sample, or upload a mask of the myocardium.</p>'
    from heartgen.viewing.card import number

    mask = case.mask
    facts = [
        ("voxels", " × ".join(map(str, mask.voxels.shape))),
        ("voxel size", " × ".join(f"{s:.3g}" for s in mask.spacing) + " mm"),
        ("myocardium", f"{number(mask.volume / ML)} ml"),
    ]
    notes = [*mask.findings]
    if anatomy is not None:
        cut = anatomy.base.truncation
        facts += [
            ("heart", "left ventricle" if anatomy.rv is None else "both ventricles"),
            ("cavity", f"{number(anatomy.length)} mm long, {number(anatomy.radius)} mm radius"),
            ("wall", f"{number(anatomy.wall_thickness)} mm"),
            ("base", "not cut" if cut is None else f"cut by {number(cut)} mm"),
        ]
        notes += anatomy.findings
    rows = "".join(
        f"<div><dt>{name}</dt><dd>{html.escape(value)}</dd></div>" for name, value in facts
    )
    if notes:
        told = "".join(f"<li>{html.escape(note.message)}</li>" for note in notes)
        checks = f"<h3>What the checks found</h3><ul>{told}</ul>"
    else:
        checks = '<p class="hg-fine">The checks found nothing to mend.</p>'
    return f'<dl class="hg-facts">{rows}</dl>{checks}'


def blank() -> bytes:
    """An empty picture of the size of a slice."""
    return (
        b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00\x00\x00\x01\x00\x00\x00\x01\x08\x06\x00\x00\x00"
        b"\x1f\x15\xc4\x89\x00\x00\x00\rIDATx\x9cc\xf8\xff\xff?\x03\x00\x08\xfc\x02\xfe\xa7\x9a"
        b"\xa0\xa0\x00\x00\x00\x00IEND\xaeB`\x82"
    )
