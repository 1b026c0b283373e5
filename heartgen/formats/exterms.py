"""How elements of EX files are made of nodal parameters, as matrices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.formats.excontent import ElementComponent, ExContent, Node
from heartgen.formats.exmodel import LABELS
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, ORDER, lagrange_to_bernstein
from heartgen.mesh.hexmesh import COEFFICIENTS

LINES = {
    "c.Hermite": HERMITE_TO_BERNSTEIN.reshape(ORDER, 2, 2),
    "l.Lagrange": lagrange_to_bernstein(1)[..., None],
    "q.Lagrange": lagrange_to_bernstein(2)[..., None],
    "c.Lagrange": lagrange_to_bernstein(3)[..., None],
}
"""Bernstein coefficients along a line, (4, nodes, derivatives), of each basis."""

Key = tuple[int, str, int]
"""Node, label and version of a parameter."""


@dataclass(frozen=True, eq=False)
class ExTerms:
    """A field as nodal parameters.

    Attributes
    ----------
    keys : list of (int, str, int)
        Node, label and version of each of the n parameters in use, in this order.
    values : (n, k) float64
        Of k components.
    weights : (m e, n) sparse
        The m parameters of each element.
    to_bernstein : (64, m) float64
        Bernstein coefficients of an element from these.
    corners : (e, 8) int
        Nodes at the corners, xi1 fastest.
    basis : {"hermite", "lagrange"}
        What the parameters are.
    """

    keys: list[Key]
    values: NDArray[np.float64]
    weights: sp.csr_array
    to_bernstein: NDArray[np.float64]
    corners: NDArray[np.intp]
    basis: Literal["hermite", "lagrange"]


def terms_of(content: ExContent, numbers: list[int], name: str) -> ExTerms:
    """Terms of a field on elements.

    Parameters
    ----------
    content : ExContent
        All that the file says.
    numbers : list of int
        The elements.
    name : str
        The field.

    Returns
    -------
    ExTerms

    Raises
    ------
    ValueError
        That says why the field is beyond this reader.
    """
    found = [_component(content, number, name) for number in numbers]
    bases = {component.basis for component, _ in found}
    if len(bases) != 1:
        raise ValueError(f"its elements are of the bases {', '.join(sorted(bases))}")
    to_bernstein, corners = _basis(bases.pop())
    n_nodes, n_labels = to_bernstein.shape[1:]
    rows: list[tuple[int, Key, float]] = []
    nodes = np.empty((len(numbers), n_nodes), dtype=np.intp)
    for e, (component, said) in enumerate(found):
        own = [int(node) for node in said["Nodes"]]
        factors = [float(factor) for factor in said.get("Scale factors", [])]
        parameters = component.parameters or []
        if len(parameters) != n_nodes * n_labels:
            raise ValueError("its elements do not have the parameters of their basis")
        nodes[e] = [own[of_nodes[0]] for of_nodes, _ in parameters[::n_labels]]
        for p, (of_nodes, terms) in enumerate(parameters):
            taken = of_nodes if len(of_nodes) == len(terms) else of_nodes[:1] * len(terms)
            for node, (label, version, scaled) in zip(taken, terms, strict=True):
                weight = float(np.prod([factors[factor] for factor in scaled]))
                key = _key(content.nodes, name, own[node], label, version)
                rows.append((e * len(parameters) + p, key, weight))
    keys = sorted({key for _, key, _ in rows}, key=lambda k: (k[0], LABELS.index(k[1]), k[2]))
    rank = {key: place for place, key in enumerate(keys)}
    entries = (
        [weight for _, _, weight in rows],
        (
            [row for row, _, _ in rows],
            [rank[key] for _, key, _ in rows],
        ),
    )
    shape = (len(numbers) * n_nodes * n_labels, len(keys))
    return ExTerms(
        keys=keys,
        values=np.array([_values(content.nodes[key[0]], name, key) for key in keys]),
        weights=sp.csr_array(sp.coo_array(entries, shape=shape)),
        to_bernstein=to_bernstein.reshape(COEFFICIENTS, -1),
        corners=nodes[:, corners],
        basis="hermite" if n_labels > 1 else "lagrange",
    )


def constant_values(
    content: ExContent, numbers: list[int], name: str
) -> NDArray[np.float64] | None:
    """Values (e, k) of a field that is constant in each element; None if it is not.

    Parameters
    ----------
    content : ExContent
        All that the file says.
    numbers : list of int
        The elements.
    name : str
        The field.
    """
    rows = []
    for number in numbers:
        for head, said in content.elements[number].parts:
            place = 0
            for field, components in head.fields.items():
                n = sum(
                    isinstance(c, ElementComponent) and c.parameters is None for c in components
                )
                if field == name and n and n == len(components):
                    rows.append([float(v) for v in said["Values"][place : place + n]])
                place += n
    if not rows:
        return None
    if len(rows) != len(numbers) or len({len(row) for row in rows}) != 1:
        raise ValueError("not every element has it")
    return np.array(rows)


def _component(
    content: ExContent, number: int, name: str
) -> tuple[ElementComponent, dict[str, list[str]]]:
    """The one way in which an element makes all components of a field."""
    for head, said in content.elements[number].parts:
        components = head.fields.get(name)
        if not components:
            continue
        first = components[0]
        if any(component != first for component in components):
            raise ValueError("its components are not made alike")
        if not isinstance(first, ElementComponent) or first.parameters is None:
            raise ValueError("it is not of nodal parameters")
        return first, said
    raise ValueError("not every element has it")


def _basis(text: str) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Bernstein coefficients from parameters, (64, nodes, derivatives), and the corner nodes."""
    names = text.replace(" ", "").split("*")
    if len(names) != 3 or any(name not in LINES for name in names):
        raise ValueError(f"the basis {text} is not known")
    lines = [LINES[name] for name in reversed(names)]  # xi3, xi2, xi1
    matrix = reduce(np.kron, lines)
    counts = [line.shape[1] for line in lines]
    place = np.arange(matrix.shape[1]).reshape(counts)
    return matrix, place[np.ix_(*([0, n - 1] for n in counts))].ravel()


def _key(nodes: dict[int, Node], name: str, node: int, label: str | int, version: int) -> Key:
    """A parameter by its label, which is asked for or stands at a place."""
    if node not in nodes or name not in nodes[node].fields:
        raise ValueError(f"node {node} has no parameters of it")
    places = nodes[node].fields[name][0].places
    if isinstance(label, int):
        ordered = nodes[node].fields[name][0].labels()
        if label >= len(ordered):
            raise ValueError(f"node {node} has no parameter {label + 1}")
        label, version = ordered[label]
    if (label, version) not in places or label not in LABELS:
        raise ValueError(f"node {node} has no {label}({version + 1})")
    return node, label, version


def _values(node: Node, name: str, key: Key) -> list[float]:
    """Parameter of all components."""
    each = zip(node.fields[name], node.values[name], strict=True)
    return [values[component.places[key[1:]]] for component, values in each]
