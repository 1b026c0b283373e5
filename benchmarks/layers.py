"""The layers of the package as a picture, made from the code: docs/layers.svg.

usage: python -m benchmarks.layers [FILE.svg]

A row for each layer that pyproject.toml declares, and that import-linter checks; a box for each
package or module in it, with what its docstring says of it and the number of its lines.
"""

from __future__ import annotations

import ast
import sys
import textwrap
import tomllib
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "layers.svg"

PACKAGE = "heartgen"

INK, PAPER = "#26303b", "#eaf2f8"
WIDE, ROW, GAP = 10.0, 0.66, 0.04  # of the picture, a row, and around a box, inches
LETTERS = 17  # of the smaller text, in an inch


def layers() -> list[list[str]]:
    """The layers, uppermost first, each with the names in it."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    declared = next(c for c in contracts["contracts"] if c["type"] == "layers")["layers"]
    return [[name.strip(" ()") for name in layer.split("|")] for layer in declared]


def size(name: str) -> str:
    """Number of modules and lines of a package or module, in words."""
    path = ROOT / PACKAGE / name
    files = sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]
    lines = sum(len(file.read_text().splitlines()) for file in files)
    return f"{len(files)} modules, {lines:,} lines" if len(files) > 1 else f"{lines:,} lines"


def purpose(name: str) -> str:
    """What the docstring of a package or module says first."""
    path = ROOT / PACKAGE / name
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    first = (ast.get_docstring(ast.parse(file.read_text())) or "").split("\n\n")[0]
    return " ".join(first.split()).removesuffix(".").replace("`", "")


def draw(file: Path) -> None:
    """Write the picture."""
    found = layers()
    mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": PACKAGE})
    figure = Figure(figsize=(WIDE, len(found) * ROW), facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, WIDE), ylim=(len(found) * ROW, 0))
    axes.set_axis_off()
    for k, names in enumerate(found):
        wide = WIDE / len(names)
        for n, name in enumerate(names):
            box = FancyBboxPatch(
                (n * wide + GAP, k * ROW + GAP),
                wide - 2 * GAP,
                ROW - 2 * GAP,
                boxstyle="round,pad=0,rounding_size=0.06",
                facecolor=PAPER,
                edgecolor=INK,
                linewidth=0.8,
            )
            axes.add_patch(box)
            texts = [(name, 10), (size(name), 6.5)]
            lines = textwrap.wrap(purpose(name), int(wide * LETTERS), max_lines=2, placeholder=" …")
            texts[1:1] = [(line, 7) for line in lines]
            step = (ROW - 2 * GAP) / (len(texts) + 1)
            for j, (text, points) in enumerate(texts, start=1):
                axes.text(
                    (n + 0.5) * wide,
                    k * ROW + GAP + j * step,
                    text,
                    ha="center",
                    va="center",
                    color=INK,
                    size=points,
                )
    figure.savefig(file, metadata={"Date": None})


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else PICTURE)
