"""What EX files of any version say, before it is made into a mesh."""

from __future__ import annotations

from dataclasses import dataclass, field

Term = tuple[str | int, int, tuple[int, ...]]
"""Part of a parameter: its label, or its place among those of the node; version; scale factors."""


@dataclass(frozen=True)
class NodeComponent:
    """Where the parameters of a component of a field stand among its numbers at a node.

    Attributes
    ----------
    places : dict of (str, int) to int
        By label and version, counted from 0.
    size : int
        How many numbers it has at the node.
    """

    places: dict[tuple[str, int], int]
    size: int

    def labels(self) -> list[tuple[str, int]]:
        """Label and version of each number."""
        return sorted(self.places, key=self.places.__getitem__)


@dataclass(frozen=True)
class ElementComponent:
    """How an element makes a component of a field.

    Attributes
    ----------
    basis : str
        As the file names it.
    parameters : list of (list of int, list of Term) or None
        For each parameter the nodes in the element's list that its terms are taken of, and the
        terms that add up to it. None if the component is constant.
    """

    basis: str
    parameters: list[tuple[list[int], list[Term]]] | None


@dataclass
class Head:
    """What holds for the nodes or elements that follow.

    Attributes
    ----------
    dimension : int
        Of the elements; 0 for nodes.
    fields : dict of str to list
        Components of each field; an empty list if it is of a kind that is not read.
    kinds : dict of str to str
        Kind of each field: what it is, and its coordinate system.
    scale_factors : dict of str to int
        Number in each set.
    n_nodes : int
        Nodes of each element.
    """

    dimension: int = 0
    fields: dict[str, list[NodeComponent] | list[ElementComponent]] = field(default_factory=dict)
    kinds: dict[str, str] = field(default_factory=dict)
    scale_factors: dict[str, int] = field(default_factory=dict)
    n_nodes: int = 0


@dataclass
class Node:
    """Numbers of each component of each field at a node, and what they are.

    Attributes
    ----------
    values : dict of str to list of list of float
        By field and component.
    fields : dict of str to list of NodeComponent
        Components by field.
    """

    values: dict[str, list[list[float]]] = field(default_factory=dict)
    fields: dict[str, list[NodeComponent]] = field(default_factory=dict)


@dataclass
class Element:
    """What a file says of a three-dimensional element.

    Attributes
    ----------
    faces : list of int
        Numbers of its faces.
    parts : list of (Head, dict of str to list of str)
        Once for each time that the element is named: what holds, and its nodes, values and scale
        factors.
    """

    faces: list[int] = field(default_factory=list)
    parts: list[tuple[Head, dict[str, list[str]]]] = field(default_factory=list)


@dataclass
class ExContent:
    """All that is said.

    Attributes
    ----------
    nodes : dict of int to Node
        By number.
    elements : dict of int to Element
        Three-dimensional ones, by number.
    groups : dict of str to dict of int to list of int
        Members of each group by dimension.
    comments : list of str
        In the order of the file.
    """

    nodes: dict[int, Node] = field(default_factory=dict)
    elements: dict[int, Element] = field(default_factory=dict)
    groups: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    comments: list[str] = field(default_factory=list)
