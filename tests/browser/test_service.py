"""What a visitor of the service does: submit, follow, look, publish, find, take away."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

pytest.importorskip("fastapi")

from heartgen import samples
from heartgen.images.writing import write_mask
from tests.browser.axe import violations_by_theme
from tests.service.running import Running

pytestmark = pytest.mark.slow

PATIENCE = 240_000
"""Milliseconds."""


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A service with real fits."""
    with Running(tmp_path_factory.mktemp("service")) as service:
        yield service


def test_mask_becomes_a_model_of_the_library(browser, running: Running, tmp_path: Path) -> None:
    write_mask(samples.ideal_cup(4.0).mask, tmp_path / "heart.nii.gz")
    page = browser.new_page(accept_downloads=True)
    page.set_default_timeout(PATIENCE)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(running.url)
    page.set_input_files("input[name=mask]", tmp_path / "heart.nii.gz")
    page.fill("input[name=title]", "From the browser")
    page.click("summary")
    found = violations_by_theme(page)
    page.select_option("select[name='option.optimize']", "no")
    page.click("main button:text('Submit')")
    page.wait_for_selector("#state.done")
    page.frame_locator("iframe").frame_locator("iframe").locator("canvas").first.wait_for()
    found += violations_by_theme(page)
    assert errors == []
    page.fill("form[action$=publish] input[name=title]", "A cup")
    page.fill("input[name=condition]", "healthy")
    page.check("input[name=no_names]")
    page.click("main button:text('Publish')")
    page.wait_for_url("**/library/HG-*/v1")
    found += violations_by_theme(page)
    page.click("nav >> text=Library")
    found += violations_by_theme(page)
    page.click("aside >> text=healthy")
    expect(page.locator("a.model")).to_have_count(1)
    page.click("a.model")
    with page.expect_download() as download:
        page.click(".formats >> text=/^exf$/")
    download.value.save_as(tmp_path / "mesh.exf")
    for path in ("login", "api", "nothing"):
        page.goto(f"{running.url}/{path}")
        found += violations_by_theme(page)
    assert found == []
    page.on("console", lambda said: errors.append(said.text))  # what the policy refuses is told
    page.click("nav >> text=API")
    page.click("main >> text=the same to try out")
    page.click("text=/Cancel$/")
    page.locator("#swagger-ui button:text('Try it out')").wait_for()
    assert errors == []
    page.close()
    context = pytest.importorskip("cmlibs.zinc.context").Context("service")
    region = context.getDefaultRegion()
    assert region.readFile(str(tmp_path / "mesh.exf")) == 1  # zinc's RESULT_OK
    assert region.getFieldmodule().findMeshByDimension(3).getSize() == 72
