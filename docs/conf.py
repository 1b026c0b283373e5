"""How the documentation is built: `make docs`, offline, every warning an error."""

from __future__ import annotations

import inspect
import shutil
from importlib import import_module
from pathlib import Path

import heartgen

HERE = Path(__file__).parent
NOTEBOOKS = HERE.parent / "notebooks"

project = "heartgen"
author = "The heartgen developers"
copyright = author
version = release = heartgen.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
exclude_patterns = ["_build"]
default_role = "literal"
suppress_warnings = ["ref.python"]  # types in docstrings are words, of which several have the name

html_theme = "pydata_sphinx_theme"
html_title = "heartgen"
html_theme_options = {
    "navigation_with_keys": False,
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
}
html_sidebars = {"*": []}  # only the course, the solvers and the reference have pages of their own
html_show_sourcelink = False

myst_enable_extensions = ["amsmath", "colon_fence", "dollarmath", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True

napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"

PACKAGES = {
    "heartgen": "from a mask to a mesh",
    "heartgen.images": "masks in the world",
    "heartgen.anatomy": "what a mask tells",
    "heartgen.templates": "ideal hearts",
    "heartgen.registration": "from template to patient",
    "heartgen.warping": "meshes carried along",
    "heartgen.enhancement": "straight across the wall",
    "heartgen.optimization": "accuracy, quality, fairness",
    "heartgen.assessment": "how good is it",
    "heartgen.fairness": "how lines run",
    "heartgen.mesh": "numerics of cubic hexahedra",
    "heartgen.mesh.jacobian": "determinants and quality",
    "heartgen.mesh.validity": "the certificate",
    "heartgen.fields": "what lives on a mesh",
    "heartgen.formats": "files",
    "heartgen.comparison": "two states of a heart",
    "heartgen.cohort": "many hearts",
    "heartgen.samples": "phantoms",
    "heartgen.viewing": "pictures",
    "heartgen.widgets": "in a notebook",
    "heartgen.errors": "what goes wrong",
}
"""Modules of the reference, and what each is about."""

WITHOUT_MEMBERS = {"Session"}
"""Classes whose traits document themselves."""


def public_names(module_name: str) -> list[str]:
    """What a module offers: its ``__all__``, or what is defined in it."""
    module = import_module(module_name)
    if hasattr(module, "__all__"):
        return [name for name in module.__all__ if not name.startswith("_")]
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (inspect.isfunction(value) or inspect.isclass(value))
        and value.__module__ == module_name
    ]


def entry(module_name: str, name: str) -> list[str]:
    """What the page of a module says of one of its names, as lines of reStructuredText."""
    value, whole = getattr(import_module(module_name), name), f"{module_name}.{name}"
    if inspect.ismodule(value):
        return []
    home = getattr(value, "__module__", None)
    if module_name == "heartgen" and isinstance(home, str):
        page = max((each for each in PACKAGES if home.startswith(each)), key=len)
        if page != "heartgen":
            return ["", f"* `heartgen.{name}`: see :doc:`{page}`"]
    if isinstance(value, type):
        return ["", f".. autoclass:: {whole}", *["   :members:"][: name not in WITHOUT_MEMBERS]]
    if callable(value):
        return ["", f".. autofunction:: {whole}"]
    return ["", f".. py:data:: {whole}", "", f"   A {type(value).__name__} of {len(value)}."]


def write_reference(folder: Path) -> None:
    """Write a page for each module: its words, and all that it offers."""
    folder.mkdir(exist_ok=True)
    for name, about in PACKAGES.items():
        head = [
            f"# {name}: {about}",
            "",
            "```{eval-rst}",
            f".. automodule:: {name}",
            "   :no-members:",
        ]
        entries = [line for each in public_names(name) for line in entry(name, each)]
        text = "\n".join([*head, "", *entries, "```", ""])
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def copy_lessons(folder: Path) -> None:
    """Copy the notebooks that changed, so that the others need not be run again."""
    folder.mkdir(exist_ok=True)
    for source in NOTEBOOKS.glob("[0-9]*.ipynb"):
        target = folder / source.name
        if not target.exists() or target.read_bytes() != source.read_bytes():
            shutil.copyfile(source, target)


write_reference(HERE / "api")
copy_lessons(HERE / "course")
