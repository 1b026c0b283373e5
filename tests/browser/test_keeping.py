"""A session comes back whatever becomes of page, kernel and browser, on the same small server."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.browser.test_dashboard import choose, kernels

pytestmark = pytest.mark.slow

DONE = ".hg-side .hg-step-input .hg-done"
SHOWN = ".hg-step-view .hg-done:has-text('shows {} ·')"


@pytest.fixture(scope="module")
def visitor(browser):
    """A browser of one visitor, whose windows share what it remembers."""
    context = browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    context.set_default_timeout(300_000)
    yield context
    context.close()


@pytest.fixture(scope="module")
def linked(visitor, address):
    """A page opened by a link that carries a sample and options, and has its mesh made."""
    page = visitor.new_page()
    page.goto(f"{address}?sample=ideal&optimize=no&quality=1.5&run=1")
    shown(page, 1)
    return page


def shown(page, number):
    page.wait_for_selector(SHOWN.format(number), state="attached")


def runs(page, number):
    """Wait until so many runs are listed, each with what came of it, and no more."""
    page.wait_for_selector(f".hg-run-label .hg-done >> nth={number - 1}")
    expect(page.locator(".hg-run")).to_have_count(number)


def test_a_link_leads_to_a_mesh(linked):
    assert "ideal" in linked.locator(".hg-run-label").first.inner_text()


def test_other_levels_come_in_the_background_and_the_slider_shows_them(linked):
    linked.wait_for_selector(".hg-run-label:has-text('also at level 2, 3, 4, 5')")
    linked.get_by_role("slider").first.focus()
    linked.keyboard.press("ArrowRight")
    linked.wait_for_selector(".hg-step-view .hg-done:has-text('LoD 2')", state="attached")


def test_a_reload_finds_everything_and_a_run_goes_on(linked):
    choose(linked, "Sample", "Left ventricle · lifelike")
    linked.wait_for_selector(f"{DONE}:has-text('lifelike')")
    linked.get_by_role("button", name="All levels", exact=True).click()
    linked.wait_for_selector(".hg-run >> nth=1")
    asked = []
    linked.once("dialog", lambda dialog: (asked.append(dialog.type), dialog.accept()))
    linked.reload()
    shown(linked, 2)
    assert asked == ["beforeunload"]
    runs(linked, 2)
    linked.locator(".hg-run").last.get_by_role("button", name="Show").click()
    shown(linked, 1)


def test_a_visitor_who_stays_goes_on(linked):
    choose(linked, "Sample", "Left ventricle · lifelike")
    linked.wait_for_selector(f"{DONE}:has-text('lifelike')")
    linked.get_by_role("button", name="Run", exact=True).click()
    linked.wait_for_selector(".hg-run >> nth=2")
    with linked.expect_event("dialog") as asked:
        linked.once("dialog", lambda dialog: dialog.dismiss())
        linked.evaluate("() => setTimeout(() => location.reload(), 0)")
    assert asked.value.type == "beforeunload"
    shown(linked, 3)  # the page still has its kernel


def test_a_kernel_that_is_killed_costs_nothing(linked, server):
    for kernel in kernels(server[0]):
        kernel.kill()
    linked.wait_for_selector(".hg-gone:visible")
    linked.get_by_role("button", name="Bring it back").click()
    shown(linked, 3)
    runs(linked, 3)


def test_a_window_beside_begins_its_own_and_after_closing_the_session_is_there(
    linked, visitor, address
):
    beside = visitor.new_page()
    beside.goto(address)
    beside.wait_for_selector(DONE)
    expect(beside.locator(".hg-run")).to_have_count(0)
    beside.close()
    linked.close()
    again = visitor.new_page()
    again.goto(address)
    shown(again, 3)
    runs(again, 3)
