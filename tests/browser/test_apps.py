"""The index leads to every app, and each shows a sample at once: in a table, a plot, and in 3-D."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.browser.axe import violations, violations_by_theme
from tests.browser.seeing import is_colored, is_mesh, wait_for_view

pytestmark = pytest.mark.slow

SEEN = {
    "dashboard": ".hg-side .hg-step-input .hg-done",
    "tradeoff": ".hg-point",
    "states": ".hg-bullseye svg",
}
"""What is on each app once its first sample is there."""

LESSONS = len(list((Path(__file__).parents[2] / "notebooks").glob("[0-9]*.ipynb")))


@pytest.mark.parametrize("name", SEEN)
def test_index_leads_to_an_app_that_shows_a_heart(browser, apps, name):
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.set_default_timeout(180_000)
    page.goto(f"{apps}index.ipynb", wait_until="commit")
    assert "Starting" in page.locator("#loading").inner_text()
    page.wait_for_selector(".hg-index nav a")
    expect(page.locator("#loading")).to_have_count(0)
    expect(page.locator(".hg-index img")).to_have_count(3 + LESSONS)
    page.locator(f'.hg-index a[href="{name}.ipynb"]').click()
    page.wait_for_selector(SEEN[name], state="attached")
    if name == "dashboard":  # nothing has been fitted yet: it shows the mask
        page.locator(".hg-tab-view").click()
    wait_for_view(page, is_colored if name == "dashboard" else is_mesh)
    assert violations_by_theme(page) == []
    page.get_by_role("link", name="All apps").click()
    page.wait_for_selector(".hg-index nav a")
    assert violations_by_theme(page) == []
    page.close()


def test_pages_fit_a_phone(browser, apps):
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.set_default_timeout(180_000)
    for name in ("index", "states"):
        page.goto(f"{apps}{name}.ipynb")
        page.wait_for_selector(".hg-footer")
        wide = page.evaluate(
            """() => [...document.querySelectorAll('.hg-card, .hg-index a, .hg-main')]
                 .map(e => e.getBoundingClientRect().right)"""
        )
        assert max(wide) <= 390
        assert violations(page) == []
    page.close()
