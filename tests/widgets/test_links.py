"""Links that carry choices."""

from __future__ import annotations

import pytest

from heartgen.errors import HeartgenError
from heartgen.options import Options
from heartgen.widgets.links import Link, query_of


def test_links_carry_what_is_chosen():
    options = Options(lod=3, elements=(1, 8, 4), truncate=5.0, optimize=False)
    link = Link.read(query_of("biv", options, True))
    assert (link.sample, link.run) == ("biv", True)
    assert link.choices == {"lod": 3, "elements": (1, 8, 4), "truncate": 5.0, "optimize": False}
    assert Link.read("token=abc&theme=light").empty
    with pytest.raises(HeartgenError, match="nonsense"):
        Link.read("sample=nonsense")
