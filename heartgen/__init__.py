"""From a binary myocardium mask to a personalized cubic Hermite mesh of the ventricles."""

from __future__ import annotations

import logging
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from heartgen.renamed import FormerModules

if TYPE_CHECKING:
    from heartgen import errors, samples
    from heartgen.client import Client
    from heartgen.comparison import compare
    from heartgen.formats import read_mesh, write_mesh
    from heartgen.images import Mask, mask_from_array, read_labels, read_mask
    from heartgen.mesh import HexMesh
    from heartgen.options import Options
    from heartgen.pipeline import personalize, personalize_levels
    from heartgen.result import Personalization

__version__ = "0.1.0"

GLOSSARY = "https://github.com/heartgen/heartgen/blob/HEAD/docs/glossary.md"
"""Page of the words that users meet, with their units."""

# First, because what Python left of a module in its old place, a cache, would pass for a package.
sys.meta_path.insert(0, FormerModules())

# Steps and findings are logged; whoever wants to see them sets a level and a handler.
logging.getLogger("heartgen").addHandler(logging.NullHandler())

__all__ = [
    "Client",
    "HexMesh",
    "Mask",
    "Options",
    "Personalization",
    "__version__",
    "compare",
    "errors",
    "mask_from_array",
    "personalize",
    "personalize_levels",
    "read_labels",
    "read_mask",
    "read_mesh",
    "samples",
    "write_mesh",
]

_HOMES = {
    "Client": "heartgen.client",
    "HexMesh": "heartgen.mesh",
    "Mask": "heartgen.images",
    "Options": "heartgen.options",
    "Personalization": "heartgen.result",
    "compare": "heartgen.comparison",
    "mask_from_array": "heartgen.images",
    "personalize": "heartgen.pipeline",
    "personalize_levels": "heartgen.pipeline",
    "read_labels": "heartgen.images",
    "read_mask": "heartgen.images",
    "read_mesh": "heartgen.formats",
    "write_mesh": "heartgen.formats",
}


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used, so that ``import heartgen`` is instant."""
    if name in ("errors", "samples"):
        return import_module(f"heartgen.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module 'heartgen' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
