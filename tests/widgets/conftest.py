"""Sessions without a browser, on a small heart."""

from __future__ import annotations

import pytest

pytest.importorskip("ipywidgets")
pytest.importorskip("anywidget")

from heartgen import samples
from heartgen.widgets.input_case import InputCase
from heartgen.widgets.session import Session


@pytest.fixture(autouse=True, scope="module")
def small():
    """Make every sample a coarse heart: what is tested is the page, not the pipeline."""
    mask = samples.lifelike_lv(3.0).mask

    def load(name: str) -> InputCase:
        code = f"heartgen.samples.load({name!r}).mask"
        return InputCase(mask, code, "0" * 64, "Small.", {"sample": name})

    with pytest.MonkeyPatch.context() as patch:
        for name in ("session_input", "tradeoff_study"):
            patch.setattr(f"heartgen.widgets.{name}.load_sample", load)
        yield


@pytest.fixture
def session():
    made = Session()
    yield made
    made.close()


@pytest.fixture(scope="module")
def finished(small):
    """A session with one mesh; nothing may change it."""
    made = Session()
    made.load_sample("lifelike").result()
    made.start().result()
    assert made.shown is not None, made.runs[-1].error
    yield made
    made.close()
