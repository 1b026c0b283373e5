"""The text of EX files, version 1 to 3, read into what it says."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from heartgen.errors import InputError
from heartgen.formats.excontent import (
    Element,
    ElementComponent,
    ExContent,
    Head,
    Node,
    NodeComponent,
    Term,
)
from heartgen.formats.exmodel import LABELS

NUMBERS = re.compile(r"[-+0-9.eE\s]+")
VERSIONED = re.compile(r"(?P<label>[^()]+?)\s*(?:\((?P<version>\d+)\))?")
FIELD_HEAD = re.compile(r"\d+\)\s*(?P<name>[^,]+),\s*(?P<kind>.*),\s*#Components\s*=\s*(?P<n>\d+)")
NODE_VALUES = re.compile(r"#Values\s*=\s*(?P<n>\d+)\s*(?:\((?P<labels>.*)\))?")
NODE_VERSIONS = re.compile(
    r"#Derivatives\s*=\s*(?P<n>\d+)\s*(?:\((?P<labels>[^)]*)\))?,?\s*"
    r"(?:#Versions\s*=\s*(?P<versions>\d+))?"
)

BASIS_NODE = re.compile(r"\d+(\+\d+)*\.\s*#Values")

BROKEN = (ValueError, IndexError, KeyError, AttributeError, TypeError, StopIteration)
"""What comes of text that breaks off or has words where numbers should be."""

COMMENT = "! "


def parse_ex(texts: Iterable[tuple[str, str]]) -> ExContent:
    """Read the text of EX files that make one region.

    Parameters
    ----------
    texts : iterable of (str, str)
        Name and content of each file, nodes before elements.

    Returns
    -------
    ExContent

    Raises
    ------
    InputError
        That names the file and the line.
    """
    content = ExContent()
    for name, text in texts:
        parser = _Parser(content, text)
        try:
            parser.run()
        except BROKEN as error:
            told = error if isinstance(error, _UnreadableError) else "it is not complete"
            raise InputError(
                f"{name}: Line {parser.at} cannot be read ({told}): give an EX file with fields on "
                "hexahedra, or convert it with other software."
            ) from error
    return content


class _UnreadableError(ValueError):
    """What a line says is beyond this reader."""


class _Parser:
    """Goes through the lines of one file."""

    def __init__(self, content: ExContent, text: str) -> None:
        self.content = content
        self.lines = text.splitlines()
        self.at = 0
        self.head = Head()
        self.templates: dict[tuple[str, str], Head] = {}
        self.group: dict[int, list[int]] | None = None
        self.nodeset = "nodes"

    def run(self) -> None:
        while self.at < len(self.lines):
            line = self._next()
            if not line:
                return
            act = next((act for start, act in ACTS.items() if line.startswith(start)), None)
            if act is None:
                raise _UnreadableError(f"{line[:40]!r} is not known")
            act(self, line)

    def _next(self) -> str:
        """The next line that is not empty."""
        line = ""
        while not line and self.at < len(self.lines):
            line = self.lines[self.at].strip()
            self.at += 1
        return line

    def _peek(self) -> str:
        place = self.at
        line = self._next()
        self.at = place
        return line

    def _numbers(self) -> list[str]:
        """All numbers up to the next word."""
        found: list[str] = []
        while (line := self._peek()) and NUMBERS.fullmatch(line):
            found += self._next().split()
        return found

    # --- what a line may begin with ---------------------------------------------------------------

    def comment(self, line: str) -> None:
        if line.startswith("!#nodeset"):
            self.nodeset = line.split()[1].rstrip(",")
            self.head = Head()
        elif line.startswith("!#mesh"):
            self.head = Head(int(line.split("dimension=")[1].split(",")[0]))
        elif line.startswith(COMMENT):
            self.content.comments.append(line.removeprefix(COMMENT))

    def start_group(self, line: str) -> None:
        name = line.split(":", 1)[1].strip()
        self.group = self.content.groups.setdefault(name, {})
        self.head, self.nodeset = Head(), "nodes"

    def start_region(self, line: str) -> None:
        self.group, self.head = None, Head()

    def nothing(self, line: str) -> None:
        """What changes nothing of what is read."""

    def define(self, line: str) -> None:
        kind, name = line.removeprefix("Define ").split(" template: ")
        kept, self.head = self.head, Head(self.head.dimension)
        while self._peek().startswith(("Shape", "#")):
            self.header_line(self._next())
        self.templates[kind, name.strip()], self.head = self.head, kept

    def use(self, line: str) -> None:
        kind, name = line.split(" template: ")
        self.head = self.templates[kind.lower(), name.strip()]

    def header_line(self, line: str) -> None:
        if line.startswith("Shape"):
            dimension = int(line.split("Dimension=")[1].split(",")[0])
            if dimension == 3 and line.split(",", 1)[1:] not in ([" line*line*line"], []):
                raise _UnreadableError("elements that are no hexahedra")
            self.head = Head(dimension)
        elif line.startswith("#Scale factor sets"):
            self.head = Head(self.head.dimension)
            for _ in range(_count(line)):
                name, size = self._next().split(", #Scale factors=")
                self.head.scale_factors[name.strip()] = int(size.split(",")[0])
        elif line.startswith("#Nodes"):
            self.head.n_nodes = _count(line)
        elif line.startswith("#Fields"):
            of_node = self.head.dimension == 0
            if of_node:
                self.head = Head()
            for _ in range(_count(line)):
                self._field(of_node)
        else:
            raise _UnreadableError(f"{line[:40]!r} is not known")

    def _field(self, of_node: bool) -> None:
        """Head of a field and all its components."""
        found = FIELD_HEAD.match(line := self._next())
        if found is None:
            raise _UnreadableError(f"{line[:40]!r} is no field")
        name, components = found["name"].strip(), int(found["n"])
        read = [self._node_component() if of_node else self._component() for _ in range(components)]
        self.head.kinds[name] = found["kind"]
        known = "real" in found["kind"] and "time sequence" not in line
        self.head.fields[name] = read if known else []  # type: ignore[assignment]

    def _node_component(self) -> NodeComponent:
        line = self._next().split(".", 1)[1]
        if (by_label := NODE_VALUES.search(line)) is not None:
            labels = [_versioned(label) for label in (by_label["labels"] or "value").split(",")]
            each = [(label, v) for label, n in labels for v in range(n)]
        elif (by_version := NODE_VERSIONS.search(line)) is not None:
            n = int(by_version["n"])
            named = by_version["labels"]
            names = [label.strip() for label in named.split(",")] if named else LABELS[1 : n + 1]
            versions = range(int(by_version["versions"] or 1))
            each = [(label, v) for v in versions for label in ("value", *names)]
        else:
            return NodeComponent({}, 0)
        return NodeComponent({key: place for place, key in enumerate(each)}, len(each))

    def _component(self) -> ElementComponent:
        line = self._next().split(".", 1)[1].strip()
        basis, manner = line.split(",", 1)
        if "element based" in manner:
            return ElementComponent(basis, None)
        if "standard node based" not in manner:
            return ElementComponent("grid", None)
        offset = 0
        wanted = manner.split("scale factor set=")[1].strip(" .") if "set=" in manner else basis
        for name, size in self.head.scale_factors.items():
            if name == wanted:
                break
            offset += size if wanted in self.head.scale_factors else 0
        self._next()  # how many nodes the element has, which is no news
        parameters: list[tuple[list[int], list[Term]]] = []
        while BASIS_NODE.match(self._peek()):
            parameters += self._basis_node(offset)
        return ElementComponent(basis, parameters)

    def _basis_node(self, offset: int) -> list[tuple[list[int], list[Term]]]:
        """Parameters that are taken of a node, or of several whose terms are added."""
        nodes = [int(n) - 1 for n in self._next().split(".", 1)[0].split("+")]
        kind, names = self._next().split(":", 1)
        words, scaled = names.split(), [""] * len(names.split())
        if self._peek().startswith("Scale factor indices"):
            scaled = self._next().split(":", 1)[1].split()
        by_label = kind.startswith("Value labels")
        return [
            (nodes, _terms(word, factors, by_label, offset))
            for word, factors in zip(words, scaled, strict=True)
        ]

    def node(self, line: str) -> None:
        number = int(line.split(":")[1])
        own = self.nodeset == "nodes"
        if self.group is not None and own:
            self.group.setdefault(0, []).append(number)
        if not own or not all(self.head.fields.values()):
            while self.at < len(self.lines) and not _is_word(self._peek()):
                self._next()
            return
        node, numbers = self.content.nodes.setdefault(number, Node()), iter(self._numbers())
        for name, components in self.head.fields.items():
            of_node = [part for part in components if isinstance(part, NodeComponent)]
            values = [[float(next(numbers)) for _ in range(part.size)] for part in of_node]
            node.values[name], node.fields[name] = values, of_node

    def element(self, line: str) -> None:
        dimension, number = self._identifier(line.split(":")[1].split())
        if self.group is not None:
            self.group.setdefault(dimension, []).append(number)
        said: dict[str, list[str]] = {}
        while (following := self._peek()).rstrip(" :") in SAID:
            self._next()
            said[following.rstrip(" :")] = self._numbers()
        if dimension == 3:
            element = self.content.elements.setdefault(number, Element())
            if "Faces" in said:
                faces = [int(face) for face in said["Faces"]]
                element.faces = faces[1::3] if self._triples(line) else faces
            element.parts.append((self.head, said))

    def _triples(self, line: str) -> bool:
        """Whether an element is numbered as in version 1."""
        return len(line.split(":")[1].split()) == 3

    def _identifier(self, words: list[str]) -> tuple[int, int]:
        """Dimension and number of an element."""
        if len(words) == 1:
            return self.head.dimension, int(words[0])
        for dimension, word in zip((3, 2, 1), words, strict=True):
            if int(word):
                return dimension, int(word)
        raise _UnreadableError("an element without a number")

    def members(self, line: str) -> None:
        dimension = 0 if line.startswith("Node") else self.head.dimension
        if self.group is None:
            raise _UnreadableError("members of no group")
        members: list[int] = []
        while (following := self._peek()) and not _is_word(following):
            for run in self._next().strip(",").split(","):
                first, _, last = run.strip().partition("..")
                members += range(int(first), int(last or first) + 1)
        if dimension or self.nodeset == "nodes":
            self.group.setdefault(dimension, []).extend(members)


ACTS: dict[str, Callable[[_Parser, str], None]] = {
    "!": _Parser.comment,
    "EX Version": _Parser.nothing,
    "Region": _Parser.start_region,
    "Group name": _Parser.start_group,
    "Define ": _Parser.define,
    "Node template": _Parser.use,
    "Element template": _Parser.use,
    "Shape": _Parser.header_line,
    "#": _Parser.header_line,
    "Node group": _Parser.members,
    "Element group": _Parser.members,
    "Node": _Parser.node,
    "Element": _Parser.element,
}
"""What is done with a line, by its beginning."""

SAID = ("Faces", "Nodes", "Values", "Scale factors")
"""What an element may be followed by."""


def _count(line: str) -> int:
    return int(line.split("=")[1])


def _is_word(line: str) -> bool:
    """Whether a line is more than numbers, ranges and text in quotes."""
    return bool(line) and not line.startswith('"') and not re.fullmatch(r"[-+0-9.eE,\s]+", line)


def _versioned(text: str) -> tuple[str, int]:
    """Label, and the number in brackets behind it or 1."""
    found = VERSIONED.fullmatch(text.strip())
    if found is None:
        raise _UnreadableError(f"{text!r} is no label")
    return found["label"], int(found["version"] or 1)


def _terms(word: str, factors: str, by_label: bool, offset: int) -> list[Term]:
    """Terms of a parameter, from label+label and the products of scale factors of each."""
    if not by_label:
        scaled = _factors(factors, offset)
        return [(int(word) - 1, 0, scaled)] if int(word) else []
    labels = [_versioned(label) for label in word.split("+")]
    each = factors.split("+") if factors else [""] * len(labels)
    return [
        (label, version - 1, _factors(product, offset))
        for (label, version), product in zip(labels, each, strict=True)
        if label != "zero"
    ]


def _factors(product: str, offset: int) -> tuple[int, ...]:
    """Scale factors of a product, counted from 0 among all of the element; 0 there means none."""
    numbers = (int(number) for number in product.split("*") if number)
    return tuple(number - 1 + offset for number in numbers if number)
