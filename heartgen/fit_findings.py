"""Findings of the fit: where the mesh is not quite what was asked for."""

from __future__ import annotations

from heartgen.images import Finding


def template_limited(limited: tuple[str, ...]) -> tuple[Finding, ...]:
    """Tell that the template could not follow the heart as far as it would have.

    Parameters
    ----------
    limited : tuple of str
        What of the ellipsoid is at a bound.

    Returns
    -------
    tuple of Finding
        Empty if nothing is.
    """
    if not limited:
        return ()
    message = (
        f"the template's ellipsoid reached the bound of its {' and '.join(limited)}: this heart is "
        "farther from an ellipsoid than most, and registration has more to do"
    )
    return (Finding("template", message),)


def lod_reduced(wanted: int, level: int) -> tuple[Finding, ...]:
    """Tell that the mesh is of a lower level of detail.

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


def elements_regularized(elements: int) -> tuple[Finding, ...]:
    """Tell that accuracy was given up for validity.

    Parameters
    ----------
    elements : int
        How many weighed more against the data than the others.

    Returns
    -------
    tuple of Finding
        Empty if none did.
    """
    if elements == 0:
        return ()
    regularized = "1 element was" if elements == 1 else f"{elements} elements were"
    return (Finding("optimization", f"{regularized} regularized to keep det J > 0"),)


def min_jacobian_ratio_missed(reached: float, wanted: float) -> tuple[Finding, ...]:
    """Tell that an element stays below the Jacobian ratio asked for.

    Parameters
    ----------
    reached, wanted : float
        Least Jacobian ratio of the elements, and the one that all should reach.

    Returns
    -------
    tuple of Finding
        Empty if all reach it, or none was asked for.
    """
    if not wanted or reached >= wanted:
        return ()
    message = (
        f"the least Jacobian ratio is {reached:.3f}, not {wanted:g} as asked for: raise the "
        "quality weight, let the transmural lines be curved, or choose a lower level of detail"
    )
    return (Finding("optimization", message),)
