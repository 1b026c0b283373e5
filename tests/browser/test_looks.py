"""The dashboard for everybody: read aloud, by keyboard, in narrow windows, in the dark."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.browser.axe import violations, violations_by_theme
from tests.browser.conftest import SIZE
from tests.browser.test_dashboard import coarse, run, upload  # noqa: F401

pytestmark = pytest.mark.slow

TABS = ("input", "view", "assess", "export")

NAME = f"{'a_name_that_is_much_too_long_for_its_place_' * 2}ED.nii.gz"

WINDOWS = {
    "phone": (390, 844),
    "tablet": (768, 1024),
    "laptop": (1024, 768),
    "magnified": (720, 450),  # 1440 x 900 at 200 %
}

CUT_OFF = """() => [...document.querySelectorAll(
     '.hg-app :is(button, select, input, img, .hg-card, .hg-main, .hg-key, .hg-scale, .hg-frame)')]
   .filter(e => e.getClientRects().length && !e.closest('.hg-scroll'))
   .filter(e => { const r = e.getBoundingClientRect();
                  return r.left < -1 || r.right > innerWidth + 1; })
   .map(e => e.outerHTML.slice(0, 120))"""
"""What reaches over the edge of the window."""


def to_tab(page, key):
    page.locator(f".hg-tab-{key}").click()
    page.locator(f".hg-tab-{key}[aria-selected=true]").wait_for()
    page.locator(f"#hg-panel-{key}").wait_for()


@pytest.fixture(scope="module")
def ran(page, coarse, tmp_path_factory):  # noqa: F811
    """The page with a mesh of a file that has a long name."""
    path = tmp_path_factory.mktemp("long") / NAME
    shutil.copy(coarse, path)
    upload(page, path)
    page.wait_for_selector(f".hg-side .hg-step-input .hg-done:has-text('{NAME}')")
    run(page, 1)
    return page


@pytest.mark.parametrize("key", TABS)
def test_checker_finds_nothing(ran, key):
    to_tab(ran, key)
    assert violations_by_theme(ran) == []


@pytest.mark.parametrize("window", WINDOWS)
def test_nothing_is_cut_off_in_small_windows(ran, window):
    width, height = WINDOWS[window]
    ran.set_viewport_size({"width": width, "height": height})
    for key in TABS:
        to_tab(ran, key)
        assert ran.evaluate(CUT_OFF) == []
        assert ran.evaluate("() => document.documentElement.scrollWidth") <= width
        for tab in ran.get_by_role("tab").all():
            assert tab.bounding_box()["width"] > 50
    assert violations(ran) == []
    ran.set_viewport_size(SIZE)


def test_tabs_are_tabs(ran):
    to_tab(ran, "assess")
    expect(ran.get_by_role("tab", selected=True)).to_have_text("5 Assess")
    expect(ran.get_by_role("tabpanel")).to_have_count(1)
    ran.keyboard.press("ArrowRight")
    ran.get_by_role("tab", name="6 Export", selected=True).wait_for()
    ran.keyboard.press("ArrowRight")
    ran.get_by_role("tab", name="1 Slices", selected=True).wait_for()


def test_pressed_stage_is_seen_while_the_mouse_is_over_it(ran):
    to_tab(ran, "view")
    pressed = ran.get_by_role("button", name="Optimized", pressed=True)
    pressed.hover()
    ran.wait_for_timeout(300)  # milliseconds; colors change slowly
    ink, back = (
        pressed.evaluate(
            f"e => getComputedStyle(e).{name}.match(/[0-9.]+/g).slice(0, 3).map(Number)"
        )
        for name in ("color", "backgroundColor")
    )
    assert np.abs(np.subtract(ink, back)).min() > 100


def test_long_names_leave_the_level_and_the_table_whole(ran):
    card = ran.locator(".hg-run").first
    level = card.locator(".hg-name span").last
    expect(level).to_have_text("· LoD 1")
    right = level.bounding_box()["x"] + level.bounding_box()["width"]
    assert right <= card.locator("button").first.bounding_box()["x"]
    to_tab(ran, "assess")
    last = ran.locator(".hg-compare td").last.bounding_box()
    assert last["x"] + last["width"] <= SIZE["width"]


def test_export_says_which_run_it_hands_out(ran):
    to_tab(ran, "export")
    begins = re.compile(rf"^\s*{re.escape(f'Run 1: {NAME}, level of detail 1')}")
    expect(ran.locator(".hg-which")).to_have_text(begins)


def test_help_leads_through_the_page_and_finds_words(ran):
    ran.locator("body").click(position={"x": 5, "y": 5})
    ran.keyboard.press("?")
    ran.get_by_role("dialog", name="Help").wait_for()
    assert violations_by_theme(ran) == []
    for link in ran.locator(".hg-dialog a").all():
        ink = link.evaluate("e => getComputedStyle(e).color")
        assert ink != ran.locator(".hg-dialog").evaluate("e => getComputedStyle(e).backgroundColor")
    ran.get_by_role("searchbox", name="Find a word").fill("wriggle")
    assert ran.locator(".hg-words > div:visible").count() in range(1, 5)
    ran.get_by_role("button", name="Tour in 7 steps").click()
    seen = []
    for _ in range(7):
        box = ran.get_by_role("dialog")
        seen.append(box.get_by_role("heading").inner_text())
        assert violations(ran) == []
        box.get_by_role("button", name="Next").or_(box.get_by_role("button", name="Done")).click()
    assert seen[0] == "Input"
    assert seen[-1] == "Export"
    expect(ran.locator(".hg-tour")).to_have_count(0)


def test_keys_do_what_clicks_do_unless_something_is_written(ran):
    ran.locator("body").click(position={"x": 5, "y": 5})
    ran.keyboard.press("5")
    ran.get_by_role("tab", name="5 Assess", selected=True).wait_for()
    ran.get_by_role("button", name="Help").click()
    ran.get_by_role("searchbox", name="Find a word").press("1")
    ran.keyboard.press("Escape")
    expect(ran.get_by_role("tab", selected=True)).to_have_text("5 Assess")
