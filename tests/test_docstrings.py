"""Every parameter of what is public is documented: under its name, in order, and in words."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.core import TyperGroup
from typer.main import get_command

from heartgen.cli.cohort import app

ENTRY = re.compile(r"(?P<names>\*{0,2}\w+(?:, \*{0,2}\w+)*)(?: : (?P<type>.+))?$")
"""First line of what a docstring says of a parameter, or of several of one type."""

COMMANDS = {"command", "callback"}
"""Decorators of what is called from the command line, where its options have a help text each."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Called:
    """What somebody calls, and where its parameters are documented."""

    place: str
    parameters: list[str]
    docstring: str
    sections: tuple[str, ...] = ("Parameters",)


@dataclass(frozen=True)
class Entry:
    """What a docstring says of a parameter."""

    name: str
    type: str
    description: str


def entries(docstring: str, section: str) -> list[Entry]:
    """The entries of a section, in order."""
    found = re.search(rf"^{section}\n-+\n(.*?)(?=^\S[^\n]*\n---|\Z)", docstring, re.M | re.S)
    out: list[Entry] = []
    for block in re.split(r"\n(?=\S)", found[1].rstrip()) if found else []:
        head, _, description = block.partition("\n")
        if match := ENTRY.match(head):
            names = match["names"].replace("*", "").split(", ")
            out += [Entry(name, match["type"] or "", description.strip()) for name in names]
    return out


def parameters(arguments: ast.arguments, *, bound: bool = False) -> list[str]:
    """Names of the parameters that a caller sees."""
    plain = [*arguments.posonlyargs, *arguments.args][bound:]
    found = [*plain, arguments.vararg, *arguments.kwonlyargs, arguments.kwarg]
    return [each.arg for each in found if each is not None and not each.arg.startswith("_")]


def decorators(node: Function | ast.ClassDef) -> set[str]:
    """Last names of the decorators."""
    called = (each.func if isinstance(each, ast.Call) else each for each in node.decorator_list)
    return {ast.unparse(each).split(".")[-1] for each in called}


def fields(node: ast.ClassDef) -> list[str]:
    """Names of the public fields of a dataclass or a named tuple that are given to make one.

    What is said of an option is in its declaration, of which the docstring is made.
    """
    return [
        line.target.id
        for line in node.body
        if isinstance(line, ast.AnnAssign)
        and isinstance(line.target, ast.Name)
        and not line.target.id.startswith("_")
        and not re.search(r"ClassVar|init=False|About\(", ast.unparse(line))
    ]


def of_class(node: ast.ClassDef, place: str) -> Iterator[Called]:
    """The class itself and its public methods."""
    docstring = ast.get_docstring(node) or ""
    either = ("Parameters", "Attributes")
    if "dataclass" in decorators(node) or "NamedTuple" in map(ast.unparse, node.bases):
        yield Called(place, fields(node), docstring, either)
    for line in node.body:
        if not isinstance(line, Function):
            continue
        if line.name == "__init__":
            yield Called(place, parameters(line.args, bound=True), docstring, either)
        elif not line.name.startswith("_") and not decorators(line) & {"setter", "overload"}:
            names = parameters(line.args, bound="staticmethod" not in decorators(line))
            yield Called(f"{place}.{line.name}", names, ast.get_docstring(line) or "")


def of_source(source: str, module: str) -> Iterator[Called]:
    """What a module offers."""
    for node in ast.parse(source).body:
        if not isinstance(node, Function | ast.ClassDef) or node.name.startswith("_"):
            continue
        place = f"{module}.{node.name}"
        if isinstance(node, ast.ClassDef):
            yield from of_class(node, place)
        elif not decorators(node) & {"overload", *COMMANDS}:
            yield Called(place, parameters(node.args), ast.get_docstring(node) or "")


def public(package: Path) -> Iterator[Called]:
    """What the modules of a package offer, but for private ones."""
    for path in sorted(package.rglob("*.py")):
        module = path.relative_to(package.parent).with_suffix("").parts
        if not any(re.match(r"_(?!_init__$)", part) for part in module):
            yield from of_source(path.read_text(encoding="utf-8"), ".".join(module))


def faults(called: Called) -> list[str]:
    """What a docstring leaves out, or has otherwise than the signature."""
    documented = [e for section in called.sections for e in entries(called.docstring, section)]
    own = [e for e in documented if e.name in called.parameters]
    names = [e.name for e in own]
    found = [f"{name} is not documented" for name in called.parameters if name not in names]
    if not found and names != called.parameters:
        found.append("parameters are not in the order of the signature")
    if called.sections == ("Parameters",):
        found += [f"{e.name} is no parameter" for e in documented if e not in own]
    found += [f"{e.name} has no type" for e in own if not e.type]
    found += [f"{e.name} has no description" for e in own if not e.description]
    return [f"{called.place}: {fault}" for fault in found]


def test_every_parameter_is_described(repository: Path) -> None:
    called = list(public(repository / "heartgen"))
    assert sum(len(each.parameters) for each in called) > 1000
    found = [fault for each in called for fault in faults(each)]
    assert not found, "\n".join(found)


def test_every_option_of_the_command_line_has_a_help_text() -> None:
    group = get_command(app)
    assert isinstance(group, TyperGroup)
    options = [(name, option) for name, c in group.commands.items() for option in c.params]
    assert len(options) > 50
    assert not [(name, o.name) for name, o in options if not getattr(o, "help", None)]


WRITTEN = '''
def shift(points, by, *, scale=1.0):
    """Move points.

    Parameters
    ----------
    points : (n, 3) float64
        mm.
    by : (3,) float64
        mm.
    scale : float
        Factor.

    Returns
    -------
    (n, 3) float64
    """
'''


@pytest.mark.parametrize(
    ("left_out", "instead", "fault"),
    [
        ("", "", None),
        ("    by : (3,) float64\n        mm.\n", "", "by is not documented"),
        ("by : (3,) float64", "by", "by has no type"),
        ("    scale : float\n        Factor.", "    scale : float", "scale has no description"),
        ("    scale : float", "    factor : float", "factor is no parameter"),
        ("(points, by,", "(by, points,", "parameters are not in the order of the signature"),
    ],
)
def test_check_sees_what_is_missing(left_out: str, instead: str, fault: str | None) -> None:
    source = WRITTEN.replace(left_out, instead) if left_out else WRITTEN
    [called] = of_source(source, "module")
    found = faults(called)
    assert not found if fault is None else f"module.shift: {fault}" in found
