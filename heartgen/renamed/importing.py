"""Modules, and names in them, that are imported from where they were."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

from heartgen.renamed.tables import MODULES, MOVED, NAMES, REPLACED
from heartgen.renamed.telling import warn_of


def keep_former_names(module: str) -> None:
    """Let names be imported from a module under former names, as `NAMES` and `MOVED` have them.

    Parameters
    ----------
    module : str
        Its name.
    """
    home = sys.modules[module]
    known = getattr(home, "__getattr__", None)

    def former(name: str) -> Any:
        new = NAMES.get(module, {}).get(name)
        if new is not None:
            warn_of(f"{module}.{name}", new)
            return getattr(home, new)
        if name in MOVED.get(module, {}):
            return _moved(module, name)
        if known is not None:
            return known(name)
        raise AttributeError(f"module {module!r} has no attribute {name!r}")

    setattr(home, "__getattr__", former)  # noqa: B010  # unseen by mypy, which checks new names


def _moved(module: str, name: str) -> Any:
    """What has left a module, or stands for it; warns of where it is, or what is used instead."""
    place = MOVED[module][name]
    warn_of(f"{module}.{name}", REPLACED.get(name, f"{place}.{name}"))
    return getattr(import_module(place), name)


def new_module(name: str) -> str | None:
    """Where a module is now; None if it was never elsewhere.

    Parameters
    ----------
    name : str
        New or former, with all packages.
    """
    found = name
    while True:
        old = max((m for m in MODULES if f"{found}.".startswith(f"{m}.")), key=len, default=None)
        if old is None:
            return None if found == name else found
        found = MODULES[old] + found.removeprefix(old)


class FormerModules(MetaPathFinder, Loader):
    """Finds modules under their former names: what is in them comes from where they are now."""

    def find_spec(
        self, fullname: str, path: object = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Say that there is such a module.

        Parameters
        ----------
        fullname : str
            Of the module that is imported.
        path : object
            Not used.
        target : module or None
            Not used.
        """
        if not fullname.startswith("heartgen.") or new_module(fullname) is None:
            return None
        return ModuleSpec(fullname, self, is_package=True)

    def exec_module(self, module: ModuleType) -> None:
        """Have everything looked up where it is now.

        Parameters
        ----------
        module : ModuleType
            Empty, to be filled.
        """
        new = new_module(module.__name__)
        assert new is not None
        warn_of(module.__name__, new)
        home = import_module(new)

        def there(name: str) -> Any:
            if name in MOVED.get(home.__name__, {}):
                return _moved(home.__name__, name)
            return getattr(home, NAMES.get(home.__name__, {}).get(name, name))

        setattr(module, "__getattr__", there)  # noqa: B010
