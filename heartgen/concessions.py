"""What the user should know of a mesh that is not quite as was asked for."""

from __future__ import annotations

from heartgen.images import Finding


def fallen_back(wanted: int, level: int) -> tuple[Finding, ...]:
    """Tell when a level of detail could not be had.

    Parameters
    ----------
    wanted, level : int
        Level asked for, and that of the mesh.

    Returns
    -------
    tuple of Finding
        Empty if they are the same.
    """
    if level == wanted:
        return ()
    message = f"level of detail {wanted} folds an element: the mesh is that of level {level}"
    return (Finding("level of detail", message),)


def fitted_less(elements: int) -> tuple[Finding, ...]:
    """Tell when accuracy had to be given up for validity.

    Parameters
    ----------
    elements : int
        How many were fitted less closely than the others.

    Returns
    -------
    tuple of Finding
        Empty if none was.
    """
    if elements == 0:
        return ()
    fitted = "1 element was" if elements == 1 else f"{elements} elements were"
    message = f"{fitted} fitted less closely to keep all of them valid"
    return (Finding("optimization", message),)


def poorer(quality: float, least: float) -> tuple[Finding, ...]:
    """Tell when the poorest element stays below what was asked for.

    Parameters
    ----------
    quality, least : float
        Its Jacobian ratio, and the least that every element should reach.

    Returns
    -------
    tuple of Finding
        Empty if it reaches that, or nothing was asked for.
    """
    if not least or quality >= least:
        return ()
    message = (
        f"the poorest element has a quality of {quality:.3f}, not {least:g} as asked for: let "
        "quality weigh more, relax the interior, or choose a lower level of detail"
    )
    return (Finding("optimization", message),)
