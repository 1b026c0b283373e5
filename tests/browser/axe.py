"""What axe-core, the field's own checker of accessibility, finds on a page: nothing is exempt."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import pytest


def violations(page: Any) -> list[str]:
    """Rules that a page breaks, with the elements that break them; frames are looked into."""
    pytest.importorskip("axe_playwright_python")
    script = (files("axe_playwright_python") / "axe.min.js").read_text(encoding="utf-8")
    for frame in page.frames:
        frame.evaluate(script)
        # A frame in a sandbox is of another origin, and is checked as well.
        frame.evaluate("() => axe.configure({ allowedOrigins: ['<unsafe_all_origins>'] })")
    found = page.evaluate("() => axe.run()")
    assert found["passes"], "nothing was checked"
    return [
        f"{rule['id']}: {node['target']} {node['html'][:120]}"
        for rule in found["violations"]
        for node in rule["nodes"]
    ]


def violations_by_theme(page: Any) -> list[str]:
    """The same in light and in dark colors."""
    found = []
    for scheme in ("dark", "light"):
        page.emulate_media(color_scheme=scheme)
        found += [f"{scheme}: {each}" for each in violations(page)]
    return found
