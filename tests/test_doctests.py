"""The examples in the docstrings of what the package offers are there, and do what they show."""

from __future__ import annotations

import doctest
import inspect
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import pytest

import heartgen

pytestmark = pytest.mark.slow

MODULES = ["heartgen", "heartgen.mesh", "heartgen.formats", "heartgen.fields", "heartgen.samples"]


def offered() -> Iterator[tuple[str, Any]]:
    """The functions and classes of the modules' ``__all__``, each once, by name."""
    seen = set()
    for module in map(import_module, MODULES):
        for name in module.__all__:
            value = getattr(module, name)
            if (inspect.isfunction(value) or inspect.isclass(value)) and value not in seen:
                seen.add(value)
                yield f"{module.__name__}.{name}", value


@pytest.fixture(autouse=True)
def fitted_once(monkeypatch: pytest.MonkeyPatch, fits: dict[Any, Any]) -> None:
    """Let examples that fit the same mask under the same options share the result."""
    personalize = heartgen.personalize

    def recalled(mask: Any, **choices: Any) -> heartgen.Personalization:
        if not isinstance(mask, heartgen.Mask):
            return personalize(mask, **choices)
        key = (mask.voxels.tobytes(), mask.affine.tobytes(), *sorted(choices.items()))
        if key not in fits:
            fits[key] = personalize(mask, **choices)
        return fits[key]

    monkeypatch.setattr(heartgen, "personalize", recalled)


@pytest.fixture(scope="module")
def fits() -> dict[Any, Any]:
    """Results so far; they cannot be changed."""
    return {}


@pytest.mark.parametrize(("name", "value"), [pytest.param(*each, id=each[0]) for each in offered()])
def test_has_examples_that_run(name: str, value: Any) -> None:
    assert "Examples\n--------\n>>> " in (inspect.getdoc(value) or ""), f"{name} has no Examples"
    told: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.FAIL_FAST)
    for each in doctest.DocTestFinder(exclude_empty=True).find(value, name, globs={}):
        runner.run(each, out=told.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(told)
